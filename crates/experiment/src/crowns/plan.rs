//! Which methods are run with which parameters.

use serde::Serialize;
use std::fmt;
use timberline_crowns::surface::{
    Axes, AxisBounds, HighestPoint, HullCentroid, L1, L2, Method, StarSac,
};

/// Largest semiaxis of the paper (b_max of its equation 15), m.
pub const LARGEST_AXIS_M: f64 = 3.0;

/// A method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Centroid of the convex hull of the points.
    HullCentroid,
    /// The highest point.
    HighestPoint,
    /// Consensus crown models (StarSac); their peak is the highest cell.
    StarSac,
    /// Least squares, equal axes.
    L2Equal,
    /// Least squares, free axes.
    L2Free,
    /// Least absolute deviations.
    L1,
}

impl Family {
    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::HullCentroid => "hull centroid",
            Self::HighestPoint => "highest point",
            Self::StarSac => "StarSac",
            Self::L2Equal => "L2, equal axes",
            Self::L2Free => "L2, free axes",
            Self::L1 => "L1",
        }
    }
}

/// How the axes of an L1 surface are bounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bounds {
    /// Constraint C4 of the paper, whose mu grows with omega.
    Paper,
    /// Exact bounds on the axes, the same for every omega.
    Exact,
}

impl Bounds {
    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Exact => "exact",
        }
    }
}

/// A method with its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Setting {
    /// The method.
    pub family: Family,
    /// Largest imbalance of the axes; of L1 only.
    pub omega: Option<f64>,
    /// Bounds on the axes; of L1 only.
    pub bounds: Option<Bounds>,
    /// Half width of the prior's box around the highest point, m; none without a prior.
    pub delta_m: Option<f64>,
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.family.name())?;
        if let Some(omega) = self.omega {
            write!(f, ", ω = {omega}")?;
        }
        if let Some(bounds) = self.bounds {
            write!(f, ", {} bounds", bounds.name())?;
        }
        match self.delta_m {
            Some(delta) => write!(f, ", prior δ = {delta} m"),
            None => Ok(()),
        }
    }
}

impl Setting {
    /// A method without parameters.
    #[must_use]
    pub fn plain(family: Family) -> Self {
        Self { family, omega: None, bounds: None, delta_m: None }
    }

    /// L1 without a prior.
    #[must_use]
    pub fn l1(omega: f64, bounds: Bounds) -> Self {
        Self { omega: Some(omega), bounds: Some(bounds), ..Self::plain(Family::L1) }
    }

    /// The same with a prior at the highest point.
    #[must_use]
    pub fn with_prior(self, delta_m: f64) -> Self {
        Self { delta_m: Some(delta_m), ..self }
    }

    /// Whether the method sees all points instead of the highest one of every cell.
    #[must_use]
    pub fn sees_points(&self) -> bool {
        matches!(self.family, Family::HullCentroid | Family::HighestPoint)
    }

    /// The method, ready to be run.
    #[must_use]
    pub fn method(&self) -> Box<dyn Method> {
        match self.family {
            Family::HullCentroid => Box::new(HullCentroid),
            Family::HighestPoint => Box::new(HighestPoint),
            Family::StarSac => Box::new(StarSac::default()),
            Family::L2Equal => Box::new(L2 { axes: Axes::Equal }),
            Family::L2Free => Box::new(L2 { axes: Axes::Free }),
            Family::L1 => {
                let bounds = match self.bounds {
                    Some(Bounds::Paper) => AxisBounds::Paper { largest_m: LARGEST_AXIS_M },
                    _ => AxisBounds::default(),
                };
                Box::new(L1 { omega: self.omega.unwrap_or(0.0), bounds, ..L1::default() })
            }
        }
    }
}

/// Values of omega, 0 to 0.95.
#[must_use]
pub fn omegas() -> Vec<f64> {
    (0..20).map(|step| f64::from(step) / 20.0).collect()
}

/// Half widths of the prior's box, 0.1 to 1 m.
#[must_use]
pub fn deltas_m() -> Vec<f64> {
    (1..=10).map(|step| f64::from(step) / 10.0).collect()
}

/// The omega at which two free axes are combined with a prior.
pub const OMEGA_WITH_PRIOR: f64 = 0.2;

/// The paper's sweeps: baselines, omega without a prior under both kinds of bounds, delta with equal
/// axes and with [`OMEGA_WITH_PRIOR`].
#[must_use]
pub fn sweeps() -> Vec<Setting> {
    let mut all: Vec<Setting> = [
        Family::HullCentroid,
        Family::HighestPoint,
        Family::StarSac,
        Family::L2Equal,
        Family::L2Free,
    ]
    .map(Setting::plain)
    .to_vec();
    for bounds in [Bounds::Paper, Bounds::Exact] {
        all.extend(omegas().into_iter().map(|omega| Setting::l1(omega, bounds)));
    }
    let narrowed = |omega, bounds| {
        deltas_m().into_iter().map(move |delta| Setting::l1(omega, bounds).with_prior(delta))
    };
    all.extend(narrowed(0.0, Bounds::Paper));
    all.extend(narrowed(OMEGA_WITH_PRIOR, Bounds::Exact));
    all
}

/// A few methods for a side-by-side look: highest point, least squares, L1, L1 with a prior.
#[must_use]
pub fn side_by_side(delta_m: f64) -> Vec<Setting> {
    let l1 = Setting::l1(0.0, Bounds::Exact);
    vec![
        Setting::plain(Family::HullCentroid),
        Setting::plain(Family::HighestPoint),
        Setting::plain(Family::L2Equal),
        Setting::plain(Family::L2Free),
        l1,
        l1.with_prior(delta_m),
        Setting::l1(OMEGA_WITH_PRIOR, Bounds::Exact),
        Setting::l1(OMEGA_WITH_PRIOR, Bounds::Exact).with_prior(delta_m),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_say_what_they_are() {
        let setting = Setting::l1(0.2, Bounds::Exact).with_prior(0.3);
        assert_eq!(setting.to_string(), "L1, ω = 0.2, exact bounds, prior δ = 0.3 m");
        assert_eq!(Setting::plain(Family::L2Free).to_string(), "L2, free axes");
    }

    #[test]
    fn the_sweeps_hold_every_setting_once() {
        let all = sweeps();
        assert_eq!(all.len(), 5 + 2 * 20 + 2 * 10);
        for (index, setting) in all.iter().enumerate() {
            assert!(!all[..index].contains(setting), "{setting}");
        }
    }
}

//! Parameters of the stage `crown-fit`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What makes a tree's position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FitMethod {
    /// Centre of the elliptic paraboloid with the smallest sum of absolute residuals.
    L1,
    /// Centre of the elliptic paraboloid with the smallest sum of squared residuals; knows neither
    /// bounds nor prior.
    L2,
    /// Centroid of the convex hull of the crown's points.
    HullCentroid,
    /// The highest point.
    HighestPoint,
    /// Peak of a consensus crown model over the tree's points: the highest of them.
    #[serde(rename = "starsac")]
    StarSac,
}

/// What bounds the semiaxes of the method `l1`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BoundsRule {
    /// `smallest_axis_m` and `largest_axis_m`, exactly.
    Exact,
    /// Constraint C4 of Polewski et al., with `largest_axis_m` as b_max of their equation 15.
    Paper,
}

/// Where the position is expected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PriorRule {
    /// In a box around the highest point.
    HighestPoint,
    /// Anywhere.
    None,
}

/// Who solves the convex programs of the method `l1`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SolverChoice {
    /// The solvers of this program.
    Dedicated,
    /// The general cone solver Clarabel, as a reference.
    Clarabel,
}

/// Parameters of the stage `crown-fit`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CrownFitParams {
    /// Farthest a tree's points can be from its apex; `reach_m` of the stage `segmentation`.
    #[schemars(range(min = 1.0, max = 60.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub reach_m: f64,
    /// What makes a tree's position.
    #[schemars(extend("x-source" = "Polewski et al., section 6: l1 against the others; starsac: Tittmann et al. 2011"))]
    pub method: FitMethod,
    /// Edge of the cells to which a crown is thinned for `l1` and `l2`; the highest point of each is
    /// kept.
    #[schemars(range(min = 0.05, max = 5.0), extend("x-unit" = "m", "x-source" = "Polewski et al., section 4: 0.4 or 0.5 m"))]
    pub cell_m: f64,
    /// Largest imbalance of the paraboloid's axes: 0 makes them equal, 1 leaves them free. `l2` knows
    /// only these two.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "1", "x-source" = "Polewski et al., constraint C3"))]
    pub omega: f64,
    /// What bounds the semiaxes.
    #[schemars(extend("x-source" = "paper: Polewski et al., constraint C4 and eq 15; exact: this program"))]
    pub bounds: BoundsRule,
    /// Largest semiaxis of the paraboloid: its radius one metre below its apex.
    #[schemars(range(min = 0.1, max = 100.0), extend("x-unit" = "m", "x-source" = "Polewski et al., eq 15 (b_max = 3 m)"))]
    pub largest_axis_m: f64,
    /// Smallest semiaxis of the paraboloid, for `bounds = "exact"`.
    #[schemars(range(min = 0.001, max = 100.0), extend("x-unit" = "m", "x-source" = "this program: flags needles"))]
    pub smallest_axis_m: f64,
    /// Where the method `l1` expects the position.
    #[schemars(extend("x-source" = "Polewski et al., constraint C5"))]
    pub prior: PriorRule,
    /// Half width of the box around the highest point, for `prior = "highest-point"`.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "m", "x-source" = "Polewski et al., section 6 (delta from 0.1 m to none)"))]
    pub prior_half_width_m: f64,
    /// Who solves the programs of the method `l1`.
    #[schemars(extend("x-source" = "this program"))]
    pub solver: SolverChoice,
    /// Whether the method `l1` tells how sure the position is: the extent of the centres with nearly
    /// as good a fit, which takes several times as long as the fit, and the standard error.
    #[schemars(extend("x-source" = "extent: this program; standard error: Koenker and Bassett 1978, theorem 4.2"))]
    pub uncertainty: bool,
    /// The crown polygon holds the tree's points above this share of its height.
    #[schemars(range(min = 0.0, max = 0.99), extend("x-unit" = "1", "x-source" = "this program"))]
    pub polygon_above: f64,
    /// The crown's base is where the tree's points per metre of height fall below this share of the
    /// fullest metre's.
    #[schemars(range(min = 0.0, max = 0.99), extend("x-unit" = "1", "x-source" = "this program"))]
    pub base_density: f64,
}

impl Default for CrownFitParams {
    fn default() -> Self {
        Self {
            reach_m: 15.0,
            method: FitMethod::L1,
            cell_m: 0.5,
            omega: 0.0,
            bounds: BoundsRule::Exact,
            largest_axis_m: 3.0,
            smallest_axis_m: 0.1,
            prior: PriorRule::HighestPoint,
            prior_half_width_m: 0.5,
            solver: SolverChoice::Dedicated,
            uncertainty: true,
            polygon_above: 0.3,
            base_density: 0.25,
        }
    }
}

impl CrownFitParams {
    /// What ranges of single fields do not catch.
    #[must_use]
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let (smallest, largest, omega) = (self.smallest_axis_m, self.largest_axis_m, self.omega);
        if self.bounds == BoundsRule::Exact && smallest >= largest {
            faults.push(format!(
                "smallest_axis_m = {smallest} is not below largest_axis_m = {largest}"
            ));
        }
        if self.method == FitMethod::L1 && self.bounds == BoundsRule::Paper && omega >= 1.0 {
            faults.push(format!(
                "omega = {omega} makes mu infinite with bounds = \"paper\": take less than 1, or bounds = \"exact\""
            ));
        }
        if self.method == FitMethod::L2 && omega != 0.0 && omega != 1.0 {
            faults.push(format!(
                "method = \"l2\" knows equal axes (omega = 0) and free ones (omega = 1), not omega = {omega}"
            ));
        }
        faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::de::IntoDeserializer;
    use serde::de::value::{Error, StrDeserializer};

    #[test]
    fn defaults_are_sound() {
        assert_eq!(CrownFitParams::default().faults(), Vec::<String>::new());
    }

    #[test]
    fn fields_that_do_not_go_together_are_named() {
        let base = CrownFitParams::default();
        let crossed = CrownFitParams { smallest_axis_m: 4.0, ..base.clone() };
        assert!(
            crossed.faults()[0].contains("smallest_axis_m = 4 is not below largest_axis_m = 3")
        );
        let paper = CrownFitParams { bounds: BoundsRule::Paper, ..base.clone() };
        assert!(CrownFitParams { smallest_axis_m: 4.0, ..paper.clone() }.faults().is_empty());
        assert!(CrownFitParams { omega: 1.0, ..paper }.faults()[0].contains("mu infinite"));
        assert!(CrownFitParams { omega: 1.0, ..base.clone() }.faults().is_empty());
        let squares = CrownFitParams { method: FitMethod::L2, ..base };
        assert!(CrownFitParams { omega: 1.0, ..squares.clone() }.faults().is_empty());
        assert!(CrownFitParams { omega: 0.2, ..squares }.faults()[0].contains("not omega = 0.2"));
    }

    #[test]
    fn methods_have_the_names_of_the_tables() {
        let named = |name: &'static str| {
            let text: StrDeserializer<'_, Error> = name.into_deserializer();
            FitMethod::deserialize(text).unwrap()
        };
        let names = ["l1", "l2", "hull-centroid", "highest-point", "starsac"];
        let methods = [
            FitMethod::L1,
            FitMethod::L2,
            FitMethod::HullCentroid,
            FitMethod::HighestPoint,
            FitMethod::StarSac,
        ];
        assert_eq!(names.map(named), methods);
    }
}

//! Branches of a model against the branches that are really there.

use crate::Error;
use serde::{Deserialize, Serialize};
use timberline_solids::vector::{along, distance, sub};
use timberline_solids::{Cylinder, CylinderIndex, Ends};

/// A branch: cylinders one after the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Branch {
    /// 0 for the stem, 1 for branches on it, and so on.
    pub order: u16,
    /// Its cylinders.
    pub cylinders: Vec<Cylinder>,
}

impl Branch {
    /// Diameter where it begins, m: that of its thickest cylinder.
    #[must_use]
    pub fn diameter_m(&self) -> f64 {
        self.cylinders.iter().map(|c| 2.0 * c.radius_m).fold(0.0, f64::max)
    }

    /// Length, m, without cylinders that are not finite.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.cylinders.iter().map(Cylinder::length_m).filter(|length| length.is_finite()).sum()
    }
}

/// When a piece of an axis belongs to a branch of the other model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BranchParams {
    /// Largest distance between axes, m, whatever the radius.
    pub tolerance_m: f64,
    /// Further distance, in radii of the true branch: an axis inside the wood is on it.
    pub tolerance_radii: f64,
    /// Step along axes, m.
    pub step_m: f64,
    /// Share of its length that makes a branch found, or real.
    pub share: f64,
    /// Lower bounds of the diameter classes beyond the first, m, ascending.
    pub classes_m: Vec<f64>,
}

impl Default for BranchParams {
    /// 5 cm and one radius, steps of 2 cm, half the length; classes below 2 cm, 2 to 5, 5 to 10, and above.
    fn default() -> Self {
        Self {
            tolerance_m: 0.05,
            tolerance_radii: 1.0,
            step_m: 0.02,
            share: 0.5,
            classes_m: vec![0.02, 0.05, 0.10],
        }
    }
}

/// Branches of one group: of an order, or of a diameter class.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct BranchCounts {
    /// True branches.
    pub reference: u32,
    /// Of these, those the model has over the share of their length.
    pub found: u32,
    /// Branches of the model.
    pub model: u32,
    /// Of these, those that follow no true branch over the share of their length.
    pub false_branches: u32,
    /// Length of the true branches, m.
    pub reference_m: f64,
    /// Of this, what the model has, m.
    pub found_m: f64,
    /// Length of the model's branches, m.
    pub model_m: f64,
    /// Of this, what follows no true branch, m.
    pub false_m: f64,
}

impl BranchCounts {
    /// True branches that the model does not have.
    #[must_use]
    pub fn missing(&self) -> u32 {
        self.reference - self.found
    }

    fn add(&mut self, other: &Self) {
        self.reference += other.reference;
        self.found += other.found;
        self.model += other.model;
        self.false_branches += other.false_branches;
        self.reference_m += other.reference_m;
        self.found_m += other.found_m;
        self.model_m += other.model_m;
        self.false_m += other.false_m;
    }
}

/// How the branches of a model compare.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct BranchAccuracy {
    /// All branches, the stem included.
    pub all: BranchCounts,
    /// By order; of a true and of a modelled branch its own.
    pub by_order: Vec<BranchCounts>,
    /// By diameter class; of a true and of a modelled branch its own.
    pub by_class: Vec<BranchCounts>,
}

/// Compares branches by their axes. Which branch is whose partner does not matter, only whether there is
/// wood along the axis: a true branch that the model has in two pieces is found.
///
/// # Errors
/// [`Error::Parameter`] for values out of range.
pub fn assess_branches(
    reference: &[Branch],
    model: &[Branch],
    params: &BranchParams,
) -> Result<BranchAccuracy, Error> {
    check(params)?;
    let (truth, found) = (Axes::of(reference), Axes::of(model));
    let mut accuracy = BranchAccuracy {
        by_class: vec![BranchCounts::default(); params.classes_m.len() + 1],
        ..BranchAccuracy::default()
    };
    for branch in reference {
        // The radius that gives tolerance is the true one: here the branch's own.
        let met_m = length_where(branch, params, |at, own_m| {
            found.nearest(at).is_some_and(|(away_m, _)| away_m <= tolerance(params, own_m))
        });
        let length_m = branch.length_m();
        accuracy.each(branch, params, |counts| {
            counts.reference += 1;
            counts.reference_m += length_m;
            counts.found += u32::from(met_m >= params.share * length_m && length_m > 0.0);
            counts.found_m += met_m;
        });
    }
    for branch in model {
        let met_m = length_where(branch, params, |at, _| {
            truth.nearest(at).is_some_and(|(away_m, true_m)| away_m <= tolerance(params, true_m))
        });
        let length_m = branch.length_m();
        accuracy.each(branch, params, |counts| {
            counts.model += 1;
            counts.model_m += length_m;
            let is_real = length_m > 0.0 && met_m >= params.share * length_m;
            counts.false_branches += u32::from(!is_real);
            counts.false_m += (length_m - met_m).max(0.0);
        });
    }
    Ok(accuracy)
}

impl BranchAccuracy {
    /// Adds the branches of another tree, counted with the same parameters.
    pub fn add(&mut self, other: &Self) {
        self.all.add(&other.all);
        for (own, other) in
            [(&mut self.by_order, &other.by_order), (&mut self.by_class, &other.by_class)]
        {
            own.resize(own.len().max(other.len()), BranchCounts::default());
            own.iter_mut().zip(other).for_each(|(own, other)| own.add(other));
        }
    }

    /// Does something to all counts that a branch belongs to.
    fn each(
        &mut self,
        branch: &Branch,
        params: &BranchParams,
        mut change: impl FnMut(&mut BranchCounts),
    ) {
        let order = usize::from(branch.order);
        if self.by_order.len() <= order {
            self.by_order.resize(order + 1, BranchCounts::default());
        }
        let diameter_m = branch.diameter_m();
        let class = params.classes_m.iter().filter(|bound| diameter_m >= **bound).count();
        change(&mut self.all);
        change(&mut self.by_order[order]);
        change(&mut self.by_class[class]);
    }
}

fn tolerance(params: &BranchParams, radius_m: f64) -> f64 {
    params.tolerance_m + params.tolerance_radii * radius_m
}

/// The axes of all branches.
struct Axes {
    index: CylinderIndex,
    radii_m: Vec<f64>,
}

impl Axes {
    fn of(branches: &[Branch]) -> Self {
        let all = || branches.iter().flat_map(|branch| &branch.cylinders);
        let axes: Vec<Cylinder> = all().map(|c| Cylinder { radius_m: 0.0, ..*c }).collect();
        let index = CylinderIndex::with_ends(&axes, &vec![Ends::NONE; axes.len()]);
        Self { index, radii_m: all().map(|c| c.radius_m).collect() }
    }

    /// Distance to the nearest axis and the radius there.
    fn nearest(&self, at_m: [f64; 3]) -> Option<(f64, f64)> {
        let (place, away_m) = self.index.nearest(at_m)?;
        Some((away_m, self.radii_m[place as usize]))
    }
}

/// Length of the pieces of a branch whose middle fulfils a condition, which gets the radius, too.
fn length_where(
    branch: &Branch,
    params: &BranchParams,
    condition: impl Fn([f64; 3], f64) -> bool,
) -> f64 {
    let mut sum = 0.0;
    for cylinder in &branch.cylinders {
        let length_m = distance(cylinder.start_m, cylinder.end_m);
        if !length_m.is_finite() {
            continue;
        }
        let steps = (length_m / params.step_m).ceil().max(1.0) as usize;
        let way = sub(cylinder.end_m, cylinder.start_m);
        let met = |step: &usize| {
            let share = (*step as f64 + 0.5) / steps as f64;
            condition(along(cylinder.start_m, way, share), cylinder.radius_m)
        };
        sum += length_m * (0..steps).filter(met).count() as f64 / steps as f64;
    }
    sum
}

fn check(params: &BranchParams) -> Result<(), Error> {
    let allowed = "it must be 0 or more";
    for (name, value) in
        [("tolerance_m", params.tolerance_m), ("tolerance_radii", params.tolerance_radii)]
    {
        if value.is_nan() || value < 0.0 {
            return Err(Error::Parameter { name, value, allowed });
        }
    }
    if params.step_m.is_nan() || params.step_m <= 0.0 {
        let value = params.step_m;
        return Err(Error::Parameter { name: "step_m", value, allowed: "it must be above 0 m" });
    }
    if !(0.0..=1.0).contains(&params.share) {
        let value = params.share;
        return Err(Error::Parameter { name: "share", value, allowed: "it must be from 0 to 1" });
    }
    Ok(())
}

/// Volumes of the parts that foresters ask for, m3.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Volumes {
    /// The stem.
    pub stem_m3: f64,
    /// Branches of at least 5 cm of diameter.
    pub thick_m3: f64,
    /// Branches below.
    pub thin_m3: f64,
}

/// Diameter that parts thick from thin branches, m.
pub const THICK_M: f64 = 0.05;

impl Volumes {
    /// The volumes of branches; each cylinder counts by its own diameter, those of order 0 as stem.
    #[must_use]
    pub fn of(branches: &[Branch]) -> Self {
        let mut volumes = Self::default();
        for branch in branches {
            for cylinder in &branch.cylinders {
                let class = match (branch.order, 2.0 * cylinder.radius_m >= THICK_M) {
                    (0, _) => &mut volumes.stem_m3,
                    (_, true) => &mut volumes.thick_m3,
                    (_, false) => &mut volumes.thin_m3,
                };
                *class += cylinder.volume_m3();
            }
        }
        volumes
    }

    /// All.
    #[must_use]
    pub fn total_m3(&self) -> f64 {
        self.stem_m3 + self.thick_m3 + self.thin_m3
    }

    /// Error of these volumes as a share of the true ones: stem, thick, thin, total; NaN where there is no
    /// true volume.
    #[must_use]
    pub fn relative_errors(&self, truth: &Self) -> [f64; 4] {
        let error = |found: f64, truth: f64| {
            if truth > 0.0 { found / truth - 1.0 } else { f64::NAN }
        };
        [
            error(self.stem_m3, truth.stem_m3),
            error(self.thick_m3, truth.thick_m3),
            error(self.thin_m3, truth.thin_m3),
            error(self.total_m3(), truth.total_m3()),
        ]
    }
}

#[cfg(test)]
mod tests;

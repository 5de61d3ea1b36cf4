//! How large a tree is to be, and what is particular about it.

use super::species::TreeSpecies;
use crate::Error;
use crate::error::check;
use serde::{Deserialize, Serialize};

/// Size and particulars of a tree that is to be grown.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TreeSize {
    /// Diameter of the stem 1.3 m along it, m.
    pub dbh_m: f64,
    /// Length of the stem's axis, m; the height of a tree that stands upright.
    pub height_m: f64,
    /// Lowest living branch above the foot, m.
    pub crown_base_m: f64,
    /// Largest distance of the crown's envelope from the stem, m.
    pub crown_radius_m: f64,
    /// Angle of the stem from the vertical, degrees.
    pub lean_deg: f64,
    /// Direction of the lean, degrees from east towards north.
    pub lean_azimuth_deg: f64,
    /// Largest distance of a slightly bent stem from its chord, m.
    pub sweep_m: f64,
    /// Height at which the stem divides in two of nearly the same thickness, m.
    pub fork_m: Option<f64>,
    /// Whether it bears leaves or needles.
    pub leaves: bool,
}

impl TreeSize {
    /// The usual tree of a species and a diameter.
    #[must_use]
    pub fn of_dbh(species: TreeSpecies, dbh_m: f64) -> Self {
        let habit = species.habit();
        let dbh_cm = 100.0 * dbh_m;
        let [a, b] = habit.height_curve;
        let root = dbh_cm / (a + b * dbh_cm);
        let height_m = 1.3 + root * root;
        let [constant, slope] = habit.crown_radius;
        Self {
            dbh_m,
            height_m,
            crown_base_m: habit.crown_base_share * height_m,
            crown_radius_m: constant + slope * dbh_cm,
            lean_deg: 0.6,
            lean_azimuth_deg: 40.0,
            sweep_m: 0.004 * height_m,
            fork_m: None,
            leaves: true,
        }
    }

    /// The same without leaves.
    #[must_use]
    pub fn leafless(mut self) -> Self {
        self.leaves = false;
        self
    }

    /// The same with another lean, degrees from the vertical and from east towards north.
    #[must_use]
    pub fn leaning(mut self, lean_deg: f64, azimuth_deg: f64) -> Self {
        (self.lean_deg, self.lean_azimuth_deg) = (lean_deg, azimuth_deg);
        self
    }

    /// The same with a stem that divides at a height, m.
    #[must_use]
    pub fn forked_at(mut self, height_m: f64) -> Self {
        self.fork_m = Some(height_m);
        self
    }

    /// The same in the shade of others: lower, its crown shorter and narrower.
    #[must_use]
    pub fn suppressed(mut self) -> Self {
        self.height_m = 1.3 + 0.8 * (self.height_m - 1.3);
        self.crown_base_m = 0.5 * self.height_m;
        self.crown_radius_m *= 0.8;
        self
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        check("dbh_m", self.dbh_m, 0.02..=1.5, "0.02 to 1.5 m")?;
        check("height_m", self.height_m, 2.0..=60.0, "2 to 60 m")?;
        let highest = 0.95 * self.height_m;
        check("crown_base_m", self.crown_base_m, 0.1..=highest, "0.1 m to 0.95 of the height")?;
        check("crown_radius_m", self.crown_radius_m, 0.1..=15.0, "0.1 to 15 m")?;
        check("lean_deg", self.lean_deg, 0.0..=45.0, "0 to 45 degrees")?;
        check("lean_azimuth_deg", self.lean_azimuth_deg, -360.0..=360.0, "-360 to 360 degrees")?;
        check("sweep_m", self.sweep_m, 0.0..=2.0, "0 to 2 m")?;
        self.fork_m.map_or(Ok(()), |fork| {
            check("fork_m", fork, 0.2..=highest, "0.2 m to 0.95 of the height")
        })
    }
}

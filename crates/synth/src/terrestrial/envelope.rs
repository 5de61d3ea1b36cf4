//! How far a crown reaches: what limits the length of its branches.

use super::axis::Axis;
use super::size::TreeSize;
use super::species::TreeSpecies;
use super::vector::{Vec3, along};

/// Surface of revolution around a stem.
#[derive(Debug, Clone)]
pub(crate) struct Envelope {
    species: TreeSpecies,
    base_m: f64,
    top_m: f64,
    radius_m: f64,
    stem: Axis,
}

/// Step by which a branch feels its way to the envelope, m.
const STEP_M: f64 = 0.1;

impl Envelope {
    pub(crate) fn new(species: TreeSpecies, size: &TreeSize, stem: &Axis) -> Self {
        let top_m = stem.place(stem.length()).at[2];
        let base_m = size.crown_base_m.min(0.97 * top_m);
        Self { species, base_m, top_m, radius_m: size.crown_radius_m, stem: stem.clone() }
    }

    /// Depth in the crown: 0 at the top, 1 at its base.
    pub(crate) fn depth(&self, z: f64) -> f64 {
        (self.top_m - z) / (self.top_m - self.base_m)
    }

    /// Distance from the stem to the envelope, m, at a depth in the crown.
    pub(crate) fn radius_at(&self, depth: f64) -> f64 {
        let x = depth.max(0.0);
        let share = match self.species {
            // Nearly a cone whose lowest branches are a little shorter.
            TreeSpecies::NorwaySpruce if x < 0.8 => libm::pow(x / 0.8, 0.82),
            TreeSpecies::NorwaySpruce => 1.0 - 0.8 * (x - 0.8),
            // Rounded, widest in the middle.
            TreeSpecies::ScotsPine => rounded(x, 0.6, 0.45),
            TreeSpecies::EuropeanBeech => rounded(x, 0.68, 0.4),
            TreeSpecies::PedunculateOak => rounded(x, 0.55, 0.35),
        };
        self.radius_m * share.max(0.0)
    }

    /// Length of the straight way from a position to the envelope, m.
    pub(crate) fn room_m(&self, from: Vec3, direction: Vec3, limit_m: f64) -> f64 {
        let mut length = 0.0;
        while length < limit_m {
            let at = along(from, direction, length + STEP_M);
            let axis = self.stem.place(at[2].clamp(0.0, self.stem.length())).at;
            let off = libm::hypot(at[0] - axis[0], at[1] - axis[1]);
            if at[2] > self.top_m || off > self.radius_at(self.depth(at[2])) {
                break;
            }
            length += STEP_M;
        }
        length.min(limit_m)
    }
}

/// A quarter of an ellipse down to the widest place, then narrower by a share at the base and to
/// nothing below it.
fn rounded(x: f64, widest: f64, lost: f64) -> f64 {
    if x < widest {
        let away = 1.0 - x / widest;
        (1.0 - away * away).max(0.0).sqrt()
    } else {
        let below = (x - widest) / (1.0 - widest);
        1.0 - lost * below * below
    }
}

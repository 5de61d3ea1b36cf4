//! What is known about one tree: the truth.

use crate::{Crown, Species};
use serde::{Deserialize, Serialize};

/// Social position of a crown in the canopy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layer {
    /// Open to the sky and clearly above its neighbours.
    Dominant,
    /// At least half of the crown open to the sky.
    Codominant,
    /// A small part open to the sky.
    Intermediate,
    /// Below other crowns.
    Suppressed,
}

impl Layer {
    /// Name in tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Dominant => "dominant",
            Self::Codominant => "codominant",
            Self::Intermediate => "intermediate",
            Self::Suppressed => "suppressed",
        }
    }
}

/// A tree of a scene. Positions are in the scene's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Number in the scene, from 1, by descending height.
    pub id: u32,
    /// Index of its stand.
    pub stand: u16,
    /// Species.
    pub species: Species,
    /// Diameter at breast height, cm.
    pub dbh_cm: f64,
    /// Vertical distance from the stem's base to the top, m.
    pub height_m: f64,
    /// Where the stem meets the ground, m.
    pub base_m: [f64; 3],
    /// Envelope of the crown; its top is the top of the tree.
    pub crown: Crown,
    /// Ground elevation straight below the top, m.
    pub ground_below_top_m: f64,
    /// Share of the crown's upper surface (in plan) that lies open to the sky.
    pub exposed: f64,
    /// Whether nothing of another crown lies above the top.
    pub visible: bool,
    /// Social position.
    pub layer: Layer,
}

impl Tree {
    /// Height of the crown's base above the stem's base, m.
    #[must_use]
    pub fn crown_base_height_m(&self) -> f64 {
        self.crown.base_z_m() - self.base_m[2]
    }

    /// Height of the top above the ground straight below it, m: what a laser scan can show.
    #[must_use]
    pub fn top_above_ground_m(&self) -> f64 {
        self.crown.top_m[2] - self.ground_below_top_m
    }

    /// Basal area, m².
    #[must_use]
    pub fn basal_area_m2(&self) -> f64 {
        let radius_m = self.dbh_cm / 200.0;
        std::f64::consts::PI * radius_m * radius_m
    }
}

//! Species for terrestrial scenes: how they branch.
//!
//! The forms of the curves are published; the figures were chosen so that trees look like those of
//! temperate European stands, and stand for no particular one.

use serde::{Deserialize, Serialize};

/// Species that can be grown piece by piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TreeSpecies {
    /// *Picea abies*: whorls of drooping branches, needles on flat twigs.
    NorwaySpruce,
    /// *Pinus sylvestris*: fewer, thicker, rising branches, needles in tufts at the tips.
    ScotsPine,
    /// *Fagus sylvatica*: rising branches, twigs in flat layers.
    EuropeanBeech,
    /// *Quercus robur*: wide, crooked branches, twigs all around.
    PedunculateOak,
}

impl TreeSpecies {
    /// All of them.
    pub const ALL: [Self; 4] =
        [Self::NorwaySpruce, Self::ScotsPine, Self::EuropeanBeech, Self::PedunculateOak];

    /// Name in tables: the first letters of genus and species.
    #[must_use]
    pub const fn code(self) -> &'static str {
        match self {
            Self::NorwaySpruce => "PIAB",
            Self::ScotsPine => "PISY",
            Self::EuropeanBeech => "FASY",
            Self::PedunculateOak => "QURO",
        }
    }

    /// Whether it has a leader with whorls.
    #[must_use]
    pub const fn is_conifer(self) -> bool {
        matches!(self, Self::NorwaySpruce | Self::ScotsPine)
    }

    pub(crate) const fn habit(self) -> &'static BranchingHabit {
        match self {
            Self::NorwaySpruce => &SPRUCE,
            Self::ScotsPine => &PINE,
            Self::EuropeanBeech => &BEECH,
            Self::PedunculateOak => &OAK,
        }
    }
}

/// How a species grows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct BranchingHabit {
    /// `a` and `b` of Näslund's (1936) height curve `1.3 + D² / (a + b D)²`, cm and m.
    pub(crate) height_curve: [f64; 2],
    /// Crown radius: constant, m, and per cm of DBH, m.
    pub(crate) crown_radius: [f64; 2],
    /// Height of the crown's base, share of the tree's height.
    pub(crate) crown_base_share: f64,
    /// Exponent of Ormerod's (1973) stem taper.
    pub(crate) taper: f64,
    /// How much thicker the foot is than the taper alone would have it.
    pub(crate) flare: f64,
    /// Vertical distance of whorls or of branches along the stem, m.
    pub(crate) spacing_m: f64,
    /// Branches of a whorl, fewest and most.
    pub(crate) whorl: [u32; 2],
    /// Angle between the stem and a branch, degrees: at the top and at the crown's base.
    pub(crate) angle_deg: [f64; 2],
    /// How far a branch bends from its insertion to its tip, degrees: first half (positive is down)
    /// and second half.
    pub(crate) bend_deg: [f64; 2],
    /// Largest order of branches.
    pub(crate) orders: u8,
    /// Angle between a branch and those that it bears, degrees.
    pub(crate) fork_angle_deg: f64,
    /// Whether those lie in a plane, left and right in turn, rather than all around.
    pub(crate) flat: bool,
    /// Deviation of the change of direction per step, degrees.
    pub(crate) crooked_deg: f64,
    /// Share of the bare inner part of a branch of the lower crown.
    pub(crate) bare: f64,
    pub(crate) foliage: FoliageHabit,
}

/// Leaves, or sprays of needles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FoliageHabit {
    /// Half of the length and half of the width, m.
    pub(crate) half_m: [f64; 2],
    /// Distance along a twig, m.
    pub(crate) spacing_m: f64,
    /// Length of the leafy end of a twig, m.
    pub(crate) leafy_m: f64,
    /// Number at each place.
    pub(crate) bundle: u32,
    /// Radius above which wood bears none, m.
    pub(crate) thickest_m: f64,
    /// How much blades lie flat: 1 level, 0 any way.
    pub(crate) level: f64,
}

const SPRUCE: BranchingHabit = BranchingHabit {
    height_curve: [1.734, 0.1476],
    crown_radius: [0.7, 0.043],
    crown_base_share: 0.36,
    taper: 0.75,
    flare: 0.28,
    spacing_m: 0.42,
    whorl: [4, 6],
    angle_deg: [50.0, 98.0],
    bend_deg: [14.0, -26.0],
    orders: 3,
    fork_angle_deg: 52.0,
    flat: true,
    crooked_deg: 2.5,
    bare: 0.35,
    foliage: FoliageHabit {
        half_m: [0.020, 0.006],
        spacing_m: 0.028,
        leafy_m: 0.7,
        bundle: 2,
        thickest_m: 0.004,
        level: 0.5,
    },
};

const PINE: BranchingHabit = BranchingHabit {
    height_curve: [1.79, 0.16],
    crown_radius: [0.6, 0.048],
    crown_base_share: 0.55,
    taper: 0.65,
    flare: 0.18,
    spacing_m: 0.48,
    whorl: [3, 5],
    angle_deg: [40.0, 84.0],
    bend_deg: [4.0, -32.0],
    orders: 3,
    fork_angle_deg: 50.0,
    flat: false,
    crooked_deg: 6.0,
    bare: 0.45,
    foliage: FoliageHabit {
        half_m: [0.038, 0.007],
        spacing_m: 0.025,
        leafy_m: 0.22,
        bundle: 3,
        thickest_m: 0.005,
        level: 0.0,
    },
};

const BEECH: BranchingHabit = BranchingHabit {
    height_curve: [1.147, 0.1716],
    crown_radius: [1.1, 0.085],
    crown_base_share: 0.40,
    taper: 0.78,
    flare: 0.30,
    spacing_m: 0.62,
    whorl: [1, 1],
    angle_deg: [30.0, 62.0],
    bend_deg: [-6.0, 4.0],
    orders: 4,
    fork_angle_deg: 46.0,
    flat: true,
    crooked_deg: 4.5,
    bare: 0.22,
    foliage: FoliageHabit {
        half_m: [0.034, 0.021],
        spacing_m: 0.045,
        leafy_m: 0.35,
        bundle: 1,
        thickest_m: 0.0045,
        level: 0.75,
    },
};

const OAK: BranchingHabit = BranchingHabit {
    height_curve: [1.435, 0.1775],
    crown_radius: [1.0, 0.09],
    crown_base_share: 0.36,
    taper: 0.85,
    flare: 0.35,
    spacing_m: 0.7,
    whorl: [1, 2],
    angle_deg: [34.0, 76.0],
    bend_deg: [-10.0, -8.0],
    orders: 5,
    fork_angle_deg: 52.0,
    flat: false,
    crooked_deg: 11.0,
    bare: 0.25,
    foliage: FoliageHabit {
        half_m: [0.048, 0.026],
        spacing_m: 0.03,
        leafy_m: 0.16,
        bundle: 1,
        thickest_m: 0.0045,
        level: 0.3,
    },
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_differ() {
        let mut codes = TreeSpecies::ALL.map(TreeSpecies::code);
        codes.sort_unstable();
        assert!(codes.windows(2).all(|pair| pair[0] != pair[1]));
    }
}

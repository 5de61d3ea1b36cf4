//! How thick a branch may be, given what was seen of the stem before the tree was modelled.

use crate::{SkeletonNode, TreePoints};

/// Radii above breast height are at most this many times that of the seen stem: it tapers, and its
/// own diameter is known to a few centimetres.
const ABOVE: f64 = 1.3;
/// Radii below breast height are at most this many times that: butt swell and buttresses.
const BELOW: f64 = 2.0;

/// The largest radius by elevation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    breast_m: f64,
    radius_m: f64,
}

impl Bound {
    /// The bound of a tree whose diameter at breast height was seen; none where it was not.
    #[must_use]
    pub fn of(tree: &TreePoints<'_>, breast_height_m: f64) -> Option<Self> {
        let radius_m = 0.5 * tree.dbh_m.filter(|dbh_m| dbh_m.is_finite() && *dbh_m > 0.0)?;
        Some(Self { breast_m: tree.base_m[2] + breast_height_m, radius_m })
    }

    /// Largest radius at an elevation, m.
    #[must_use]
    pub fn at(&self, z_m: f64) -> f64 {
        self.radius_m * if z_m > self.breast_m { ABOVE } else { BELOW }
    }

    /// A skeleton whose radii keep to the bound.
    #[must_use]
    pub fn kept(&self, skeleton: &[SkeletonNode]) -> Vec<SkeletonNode> {
        let keep = |node: &SkeletonNode| SkeletonNode {
            radius_m: node.radius_m.min(self.at(node.position_m[2])),
            ..*node
        };
        skeleton.iter().map(keep).collect()
    }
}

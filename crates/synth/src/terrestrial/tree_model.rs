//! A tree whose every piece of wood is known.

use super::bvh::Bvh;
use super::cylinder::{Joint, Leaf, Solid, TrueCylinder};
use super::species::TreeSpecies;
use super::vector::{along, length, sub};
use serde::{Deserialize, Serialize};

/// Diameter from which a branch counts as thick, m.
pub const THICK_DIAMETER_M: f64 = 0.05;
/// Where the diameter of a stem is measured, m along the stem from its foot.
pub const BREAST_HEIGHT_M: f64 = 1.3;

/// Parts into which the volume of a tree is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VolumeClass {
    /// Pieces of order 0.
    Stem,
    /// Pieces of higher orders whose mean diameter is at least 5 cm.
    ThickBranches,
    /// Pieces of higher orders whose mean diameter is below 5 cm.
    ThinBranches,
}

/// A tree: pieces of wood and leaves, world positions in metres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TreeModel {
    /// Number of the tree in its plot, from 1.
    pub id: u32,
    /// Species; `None` for simple shapes.
    pub species: Option<TreeSpecies>,
    /// Foot of the stem's axis, world, m.
    pub base_m: [f64; 3],
    /// Lowest living branch above the foot, m; the height where there is none.
    pub crown_base_height_m: f64,
    /// Pieces of wood; every parent comes before its children.
    pub cylinders: Vec<TrueCylinder>,
    /// Leaves, or sprays of needles.
    pub leaves: Vec<Leaf>,
}

impl TreeModel {
    /// The tree with its foot at another place.
    #[must_use]
    pub fn at(mut self, base_m: [f64; 3]) -> Self {
        let shift = sub(base_m, self.base_m);
        self.base_m = base_m;
        self.cylinders.iter_mut().for_each(|piece| *piece = piece.moved(shift));
        self.leaves.iter_mut().for_each(|leaf| *leaf = leaf.moved(shift));
        self
    }

    /// The tree with another number.
    #[must_use]
    pub fn with_id(mut self, id: u32) -> Self {
        self.id = id;
        self
    }

    /// The tree without its leaves.
    #[must_use]
    pub fn leafless(mut self) -> Self {
        self.leaves.clear();
        self
    }

    /// Pieces of the stem (order 0), from its foot to its tip.
    pub fn stem(&self) -> impl Iterator<Item = &TrueCylinder> {
        self.cylinders.iter().filter(|piece| piece.order == 0)
    }

    /// Axis position and diameter of the stem at a distance from its foot along it, m; `None` above
    /// its tip.
    #[must_use]
    pub fn stem_at(&self, along_m: f64) -> Option<([f64; 3], f64)> {
        let mut below = 0.0;
        for piece in self.stem() {
            let length = piece.length_m();
            if along_m <= below + length && length > 0.0 {
                let share = ((along_m - below) / length).max(0.0);
                let radius =
                    piece.start_radius_m + share * (piece.end_radius_m - piece.start_radius_m);
                let way = sub(piece.end_m, piece.start_m);
                return Some((along(piece.start_m, way, share), 2.0 * radius));
            }
            below += length;
        }
        None
    }

    /// Diameter of the stem 1.3 m along it from its foot, m; 0 for a lower one.
    #[must_use]
    pub fn dbh_m(&self) -> f64 {
        self.stem_at(BREAST_HEIGHT_M).map_or(0.0, |(_, diameter)| diameter)
    }

    /// Highest end of any piece, world, m.
    #[must_use]
    pub fn top_m(&self) -> [f64; 3] {
        let ends = self.cylinders.iter().map(|piece| piece.end_m);
        ends.fold(self.base_m, |top, end| if end[2] > top[2] { end } else { top })
    }

    /// Height of the highest end of any piece above the foot, m.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        self.top_m()[2] - self.base_m[2]
    }

    /// Volume of a part, m³: the sum of its truncated cones.
    #[must_use]
    pub fn volume_m3(&self, class: VolumeClass) -> f64 {
        let of_class = |piece: &&TrueCylinder| {
            let thick = piece.mean_diameter_m() >= THICK_DIAMETER_M;
            class
                == match (piece.order, thick) {
                    (0, _) => VolumeClass::Stem,
                    (_, true) => VolumeClass::ThickBranches,
                    (_, false) => VolumeClass::ThinBranches,
                }
        };
        self.cylinders.iter().filter(of_class).map(TrueCylinder::volume_m3).sum()
    }

    /// Number of branches of each order; the first entry is the stem.
    #[must_use]
    pub fn branches_by_order(&self) -> Vec<u32> {
        let mut counts = Vec::new();
        let mut last = None;
        // The pieces of a branch follow each other.
        for piece in &self.cylinders {
            let order = usize::from(piece.order);
            if counts.len() <= order {
                counts.resize(order + 1, 0);
            }
            if last != Some(piece.branch) {
                counts[order] += 1;
            }
            last = Some(piece.branch);
        }
        counts
    }

    /// Area of the crown seen from above, m²: the convex hull of leaves and of wood above the crown's
    /// base.
    #[must_use]
    pub fn crown_area_m2(&self) -> f64 {
        let low = self.base_m[2] + self.crown_base_height_m;
        let wood = self.cylinders.iter().filter(|piece| piece.end_m[2] >= low);
        let ends =
            wood.map(|piece| piece.end_m).chain(self.leaves.iter().map(|leaf| leaf.centre_m));
        hull_area_m2(ends.map(|p| [p[0] - self.base_m[0], p[1] - self.base_m[1]]).collect())
    }

    /// Diameter of the circle of the crown's area, m.
    #[must_use]
    pub fn crown_diameter_m(&self) -> f64 {
        (4.0 / std::f64::consts::PI * self.crown_area_m2()).sqrt()
    }

    /// Distance of a world position from the true surface of the wood, m. [`Self::surface`] is much
    /// faster for many positions.
    #[must_use]
    pub fn distance_m(&self, point_m: [f64; 3]) -> f64 {
        let solids = self.solids();
        let signed = solids.iter().map(|solid| solid.signed_distance_m(point_m));
        signed.fold(f64::INFINITY, f64::min).abs()
    }

    /// Prepares distances of many positions.
    #[must_use]
    pub fn surface(&self) -> TreeSurface {
        let solids = self.solids();
        let bvh = Bvh::build(&solids.iter().map(Solid::bounds).collect::<Vec<_>>());
        TreeSurface { solids, bvh }
    }

    /// The pieces prepared for geometry.
    pub(crate) fn solids(&self) -> Vec<Solid> {
        let pieces = self.cylinders.iter().zip(joints(&self.cylinders));
        pieces.map(|(piece, ends)| Solid::new(piece, ends)).collect()
    }
}

/// How each piece is closed: open where it starts on wood, a ball where its branch goes on, flat
/// elsewhere.
fn joints(cylinders: &[TrueCylinder]) -> Vec<[Joint; 2]> {
    let start = |piece: &TrueCylinder| match piece.parent {
        None => Joint::Flat,
        Some(_) => Joint::Buried,
    };
    let mut joints: Vec<_> = cylinders.iter().map(|piece| [start(piece), Joint::Flat]).collect();
    for piece in cylinders {
        if let Some(parent) = piece.parent
            && let (Some(ends), Some(below)) =
                (joints.get_mut(parent as usize), cylinders.get(parent as usize))
            && length(sub(below.end_m, piece.start_m)) < 1e-9
        {
            ends[1] = Joint::Ball;
        }
    }
    joints
}

/// The surface of a tree's wood, ready for many questions.
#[derive(Debug, Clone)]
pub struct TreeSurface {
    solids: Vec<Solid>,
    bvh: Bvh,
}

impl TreeSurface {
    /// Signed distance of a world position from the surface, negative within the wood, m; infinite
    /// for a tree without wood.
    #[must_use]
    pub fn signed_distance_m(&self, point_m: [f64; 3]) -> f64 {
        self.nearest(point_m).map_or(f64::INFINITY, |(_, distance)| distance)
    }

    /// The piece nearest to a world position, and the signed distance from it, m.
    #[must_use]
    pub fn nearest(&self, point_m: [f64; 3]) -> Option<(u32, f64)> {
        self.bvh.nearest(point_m, |index| self.solids[index as usize].signed_distance_m(point_m))
    }
}

/// Area of the convex hull of positions in the plane (Andrew's monotone chain, 1979), m².
fn hull_area_m2(mut points: Vec<[f64; 2]>) -> f64 {
    points.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turn = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut hull: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while hull.len() > 1 && turn(hull[hull.len() - 2], hull[hull.len() - 1], point) <= 0.0 {
                hull.pop();
            }
            hull.push(point);
        }
        hull.pop();
        hull
    };
    let mut ring = chain(&mut points.iter().copied());
    ring.extend(chain(&mut points.iter().rev().copied()));
    let edges = ring.iter().zip(ring.iter().cycle().skip(1));
    0.5 * edges.map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_with_points_inside() {
        let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 1.0], [1.0, 0.0]];
        assert!((hull_area_m2(corners.to_vec()) - 4.0).abs() < 1e-12);
        assert_eq!(hull_area_m2(vec![[1.0, 1.0]; 3]), 0.0);
    }
}

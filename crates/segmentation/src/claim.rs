//! Which crown claims a point.

use crate::{Error, Membership, SegmentationParams};
use timberline_pointcloud::Grid2;

/// A crown: a surface around an apex, cut off at a radius. Positions are in the points' frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crown {
    /// Tree id; not 0.
    pub id: u64,
    /// Highest point, m.
    pub apex: [f64; 3],
    /// Depth of the surface below the apex at distance r is `b1 r + b2 r²`, m.
    pub coefficients: [f64; 2],
    /// Radius, m.
    pub radius_m: f64,
    /// A point nearer to the surface than this is on it, m.
    pub tolerance_m: f64,
    /// Whether that is measured at right angles to the surface (to first order: the vertical
    /// residual times the cosine of the slope) or vertically.
    pub oblique: bool,
}

/// A tree's claim on a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Claim {
    /// Tree id; 0 for none.
    pub id: u64,
    /// Strength: 0 for none; above 1/2 on the surface, 1/4 to 1/2 below it.
    pub score: f32,
}

impl Claim {
    /// The stronger claim; of equal ones that of the lower id.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let stronger = other.score > self.score;
        let equal_but_first = other.score == self.score && other.id < self.id;
        if stronger || equal_but_first { other } else { self }
    }
}

impl Crown {
    /// How strongly the crown claims a position, if it does.
    ///
    /// On the surface (residual below the tolerance) the score falls with the residual from 1 to
    /// 1/2. In the volume it falls with the distance from the axis, relative to the radius, from
    /// 1/2 to 1/4: a surface always outdoes a volume, so that a small tree under a large one keeps
    /// its own crown, and between two volumes the nearer axis wins, in proportion to the crowns.
    #[must_use]
    pub fn claim(&self, [x, y, z]: [f64; 3], params: &SegmentationParams) -> Option<Claim> {
        let (dx, dy) = (x - self.apex[0], y - self.apex[1]);
        let squared = dx * dx + dy * dy;
        if squared > self.radius_m * self.radius_m {
            return None;
        }
        let r = squared.sqrt();
        let [b1, b2] = self.coefficients;
        let below = self.apex[2] - z - r * (b1 + b2 * r);
        let slope = if self.oblique { b1 + 2.0 * b2 * r } else { 0.0 };
        let distance = below.abs() / (1.0 + slope * slope).sqrt();
        let score = if distance < self.tolerance_m {
            1.0 - 0.5 * distance / self.tolerance_m
        } else if params.membership == Membership::Volume && below > -params.above_m {
            0.5 / (1.0 + r / self.radius_m)
        } else {
            return None;
        };
        Some(Claim { id: self.id, score: score as f32 })
    }
}

/// The tree of every point: the strongest claim of all crowns.
///
/// Positions in metres, in the frame of the crowns; `height_m` above ground, NaN where unknown (no
/// tree then). Points in the sequence of the slices, crowns in any.
///
/// # Errors
/// [`Error::Length`], [`Error::Reach`].
pub fn label(
    [x, y, z]: [&[f64]; 3],
    height_m: &[f32],
    crowns: &[Crown],
    params: &SegmentationParams,
) -> Result<Vec<Claim>, Error> {
    let columns = [("y", y.len()), ("z", z.len()), ("height", height_m.len())];
    Error::check_lengths(x.len(), &columns)?;
    let reach_m = params.reach_m;
    if let Some(far) = crowns.iter().find(|crown| crown.radius_m > reach_m) {
        return Err(Error::Reach { tree: far.id, radius_m: far.radius_m, reach_m });
    }
    let grid = Grid2::new(x, y, GRID_CELL_M)?;
    let mut claims = vec![Claim::default(); x.len()];
    for crown in crowns {
        grid.candidates(crown.apex[0], crown.apex[1], crown.radius_m, |i| {
            if f64::from(height_m[i]) >= params.min_height_m
                && let Some(claim) = crown.claim([x[i], y[i], z[i]], params)
            {
                claims[i] = claims[i].or(claim);
            }
        });
    }
    Ok(claims)
}

/// Edge of the search grid's cells, m: about the radius of a crown.
const GRID_CELL_M: f64 = 2.0;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn crown(id: u64, x: f64, z: f64, radius_m: f64) -> Crown {
        Crown {
            id,
            apex: [x, 0.0, z],
            coefficients: [1.0, 0.0],
            radius_m,
            tolerance_m: 0.5,
            oblique: false,
        }
    }

    fn tree_at(crowns: &[Crown], at: [f64; 3]) -> Claim {
        let params = SegmentationParams::default();
        label([&[at[0]], &[at[1]], &[at[2]]], &[at[2] as f32], crowns, &params).unwrap()[0]
    }

    #[test]
    fn surface_volume_above_and_beyond() {
        let tree = [crown(7, 0.0, 10.0, 3.0)];
        assert_eq!(tree_at(&tree, [1.0, 0.0, 9.0]), Claim { id: 7, score: 1.0 });
        assert_eq!(tree_at(&tree, [3.0, 0.0, 4.0]), Claim { id: 7, score: 0.25 });
        assert_eq!(tree_at(&tree, [0.0, 0.0, 5.0]), Claim { id: 7, score: 0.5 });
        assert_eq!(tree_at(&tree, [2.0, 0.0, 9.0]).id, 7, "a branch above the surface");
        assert_eq!(tree_at(&tree, [2.0, 0.0, 9.6]).id, 0, "another tree's");
        assert_eq!(tree_at(&tree, [3.1, 0.0, 7.0]).id, 0, "beyond the radius");
        assert_eq!(tree_at(&tree, [0.0, 0.0, 0.9]).id, 0, "on the ground");
    }

    #[test]
    fn a_steep_flank_is_measured_across() {
        let params = SegmentationParams { membership: Membership::Surface, ..Default::default() };
        let upright = Crown { coefficients: [4.0, 0.0], ..crown(7, 0.0, 20.0, 3.0) };
        let oblique = Crown { oblique: true, ..upright };
        let beside = [2.0, 0.0, 11.0];
        assert_eq!(upright.claim(beside, &params), None, "1 m below");
        assert!(oblique.claim(beside, &params).is_some(), "0.24 m across");
    }

    #[test]
    fn surface_only_when_asked() {
        let params = SegmentationParams { membership: Membership::Surface, ..Default::default() };
        let tree = crown(7, 0.0, 10.0, 3.0);
        assert_eq!(tree.claim([0.0, 0.0, 5.0], &params), None);
        assert!(tree.claim([0.0, 0.0, 9.7], &params).is_some());
    }

    #[test]
    fn a_small_tree_under_a_large_one_keeps_its_crown() {
        let both = [crown(1, 0.0, 20.0, 5.0), crown(2, 3.0, 9.0, 1.5)];
        assert_eq!(tree_at(&both, [3.5, 0.0, 8.4]).id, 2);
        assert_eq!(tree_at(&both, [1.0, 0.0, 8.4]).id, 1);
        assert_eq!(tree_at(&both, [3.0, 0.0, 12.0]).id, 1, "above the small one's apex");
    }

    #[test]
    fn equal_claims_go_to_the_lower_id() {
        let pair = [crown(9, 2.0, 10.0, 3.0), crown(4, -2.0, 10.0, 3.0)];
        assert_eq!(tree_at(&pair, [0.0, 0.0, 5.0]).id, 4);
    }

    #[test]
    fn an_unknown_height_is_no_tree() {
        let params = SegmentationParams::default();
        let tree = [crown(7, 0.0, 10.0, 3.0)];
        let found = label([&[0.0], &[0.0], &[10.0]], &[f32::NAN], &tree, &params).unwrap();
        assert_eq!(found, [Claim::default()]);
    }

    #[test]
    fn a_crown_beyond_the_reach_is_an_error() {
        let params = SegmentationParams { reach_m: 2.0, ..Default::default() };
        let message = label([&[], &[], &[]], &[], &[crown(7, 0.0, 9.0, 2.5)], &params)
            .unwrap_err()
            .to_string();
        assert!(message.contains("tree 7") && message.contains("2.5 m"), "{message}");
        let short = label([&[1.0], &[1.0], &[1.0]], &[], &[], &params).unwrap_err();
        assert_eq!(short, Error::Length { column: "height", expected: 1, found: 0 });
    }

    proptest! {
        #[test]
        fn neither_frame_nor_sequence_nor_far_crowns_matter(
            points in prop::collection::vec((-60i32..60, -60i32..60, 0i32..80), 1..60),
            trees in prop::collection::vec((-60i32..60, -60i32..60, 20i32..80, 4i32..20), 1..8),
            shift in -500i32..500,
        ) {
            let solve = |origin: f64, reversed: bool| {
                let mut crowns: Vec<Crown> = trees.iter().enumerate().map(|(i, t)| Crown {
                    id: i as u64 + 1,
                    apex: [f64::from(t.0) * 0.25 + origin, f64::from(t.1) * 0.25 + origin, f64::from(t.2) * 0.25],
                    coefficients: [0.5, 0.25], radius_m: f64::from(t.3) * 0.25, tolerance_m: 0.5, oblique: t.3 % 2 == 0,
                }).collect();
                if reversed { crowns.reverse(); }
                let column = |f: &dyn Fn(&(i32, i32, i32)) -> f64| points.iter().map(f).collect::<Vec<f64>>();
                let (x, y, z) = (column(&|p| f64::from(p.0) * 0.25 + origin), column(&|p| f64::from(p.1) * 0.25 + origin), column(&|p| f64::from(p.2) * 0.25));
                let height: Vec<f32> = z.iter().map(|z| *z as f32).collect();
                label([&x, &y, &z], &height, &crowns, &SegmentationParams::default()).unwrap()
            };
            prop_assert_eq!(solve(0.0, false), solve(f64::from(shift), true));
        }
    }
}

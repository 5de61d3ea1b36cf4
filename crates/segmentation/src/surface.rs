//! Which points of a tree are on its surface, where only its points are known.

use timberline_pointcloud::Grid2;

/// How far around a point the surface of its tree is looked for, m: several times the distance of
/// neighbouring points from 2 points/m² on.
const RADIUS_M: f64 = 1.5;
/// Fall of the steepest surface, m/m: the flank of a narrow conifer, 8 m deep on 2 m of radius.
const STEEPEST: f64 = 4.0;
/// A point less than this below the surface is on it, m: twice the roughness of a crown
/// (`crown-models` takes 0.3 m for it).
const DEPTH_M: f64 = 0.6;

/// Scores for points whose trees are known: above 1/2 for those on the upper surface of their tree
/// ([`Labels::ON_SURFACE`](timberline_artefact::kinds::Labels::ON_SURFACE)), less for those inside,
/// 0 for those without a tree (id 0).
///
/// The surface is the lowest one above the tree's points that nowhere falls steeper than the flank
/// of a narrow crown; points within 1.5 m count. So a score depends on that surroundings alone.
/// Positions in metres in any frame, as long as `tree_id`.
#[must_use]
pub fn surface_scores([x, y, z]: [&[f64]; 3], tree_id: &[u64]) -> Vec<f32> {
    let Ok(grid) = Grid2::new(x, y, RADIUS_M) else { return vec![0.0; tree_id.len()] };
    let score = |i: usize| {
        let mut depth = 0.0_f64;
        grid.candidates(x[i], y[i], RADIUS_M, |j| {
            let (dx, dy) = (x[j] - x[i], y[j] - y[i]);
            let squared = dx * dx + dy * dy;
            if tree_id[j] == tree_id[i] && squared <= RADIUS_M * RADIUS_M {
                depth = depth.max(z[j] - z[i] - STEEPEST * squared.sqrt());
            }
        });
        depth_score(depth)
    };
    (0..tree_id.len()).map(|i| if tree_id[i] == 0 { 0.0 } else { score(i) }).collect()
}

/// From 1 on the surface to 1/2 at the depth where it ends, then towards 0.
fn depth_score(depth_m: f64) -> f32 {
    let score = if depth_m < DEPTH_M {
        1.0 - 0.5 * depth_m / DEPTH_M
    } else {
        0.5 / (1.0 + depth_m - DEPTH_M)
    };
    score as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_top_and_the_flank_are_surface_and_the_inside_is_not() {
        // A cone of slope 3 with a point every 0.25 m, a stem point, and a neighbour's point above.
        let (mut x, mut y, mut z) = (Vec::new(), Vec::new(), Vec::new());
        for i in -8..=8 {
            for j in -8..=8 {
                let (dx, dy) = (f64::from(i) * 0.25, f64::from(j) * 0.25);
                x.push(dx);
                y.push(dy);
                z.push(20.0 - 3.0 * (dx * dx + dy * dy).sqrt());
            }
        }
        let cone = x.len();
        x.extend([0.1, 0.1]);
        y.extend([0.1, 0.1]);
        z.extend([15.0, 25.0]);
        let mut tree = vec![7; cone + 1];
        tree.push(8);
        let scores = surface_scores([&x, &y, &z], &tree);
        assert!(scores[..cone].iter().all(|score| *score == 1.0));
        assert!(scores[cone] > 0.0 && scores[cone] < 0.2, "{}", scores[cone]);
        assert_eq!(scores[cone + 1], 1.0, "another tree");
        assert_eq!(surface_scores([&[0.0], &[0.0], &[9.0]], &[0]), [0.0]);
    }

    #[test]
    fn the_score_falls_with_depth() {
        let scores = [0.0, 0.3, 0.59, 0.6, 1.0, 9.0].map(depth_score);
        assert!(scores.windows(2).all(|pair| pair[0] > pair[1]), "{scores:?}");
        assert!(scores[2] > 0.5 && scores[3] <= 0.5 && scores[5] > 0.0);
    }

    proptest! {
        #[test]
        fn neither_frame_nor_sequence_matters(
            points in prop::collection::vec((0i32..40, 0i32..40, 0i32..80, 0u64..3), 1..60),
            shift in -500i32..500,
        ) {
            let solve = |origin: f64, points: &[(i32, i32, i32, u64)]| {
                let x: Vec<f64> = points.iter().map(|p| f64::from(p.0) * 0.25 + origin).collect();
                let y: Vec<f64> = points.iter().map(|p| f64::from(p.1) * 0.25 - origin).collect();
                let z: Vec<f64> = points.iter().map(|p| f64::from(p.2) * 0.25).collect();
                let tree: Vec<u64> = points.iter().map(|p| p.3).collect();
                surface_scores([&x, &y, &z], &tree)
            };
            let mut reversed = points.clone();
            reversed.reverse();
            let mut back = solve(f64::from(shift), &reversed);
            back.reverse();
            prop_assert_eq!(solve(0.0, &points), back);
        }
    }
}

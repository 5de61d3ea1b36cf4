//! Steps 1 and 2: thinning, and moving points to the middle of their branch.

use crate::kdtree::KdTree;
use crate::vector::{Vector, distance, mean, squared};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Points closer than this share of the box's diagonal are one.
const THIN_SHARE: f64 = 0.001;

/// Points within this share of the largest distance from the base are trunk and main branches.
const MAIN_SHARE: f64 = 0.5;

/// Largest mean difference of densities around a point that is moved.
const EVEN: f64 = 0.6;

/// Thins points, which come in canonical order: of those closer together than a thousandth of the
/// box's diagonal the first stays.
pub(super) fn thin(points: &[Vector]) -> Vec<Vector> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in points {
        low = std::array::from_fn(|axis| low[axis].min(p[axis]));
        high = std::array::from_fn(|axis| high[axis].max(p[axis]));
    }
    let gap = THIN_SHARE * distance(low, high);
    let mut cells: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    let mut kept: Vec<Vector> = Vec::new();
    for p in points {
        let cell = p.map(|value| (value / gap).floor() as i64);
        let near = (0..27i64).any(|i| {
            let next = [cell[0] + i / 9 - 1, cell[1] + i / 3 % 3 - 1, cell[2] + i % 3 - 1];
            let others = cells.get(&next).into_iter().flatten();
            others.copied().any(|other| squared(kept[other as usize], *p) < gap * gap)
        });
        if !near {
            cells.entry(cell).or_default().push(kept.len() as u32);
            kept.push(*p);
        }
    }
    kept
}

/// Moves points of trunk and main branches to the mean of their neighbours where density is even.
///
/// The search radius falls from the first radius at the base to nothing at the farthest point. The
/// density of a point is the number of points within its search radius; differences are relative to
/// the point's own.
pub(super) fn centre(points: &[Vector], root: u32, first_radius: f64) -> Vec<Vector> {
    let base = points[root as usize];
    let farthest = points.iter().map(|p| distance(*p, base)).fold(0.0, f64::max);
    let tree = KdTree::new(points);
    let around = |p: &Vector| {
        let away = distance(*p, base);
        let reach = first_radius * (1.0 - away / farthest);
        let mut found = Vec::new();
        if away < MAIN_SHARE * farthest {
            tree.within(p, reach, &mut found);
        }
        found
    };
    let density: Vec<f64> = points.par_iter().map(|p| around(p).len() as f64).collect();
    let moved = |(p, own): (&Vector, &f64)| {
        let found = around(p);
        if found.is_empty() {
            return *p;
        }
        let off = |&other: &u32| (density[other as usize] - own).abs();
        let difference = found.iter().map(off).sum::<f64>() / (own * found.len() as f64);
        if difference < EVEN {
            mean(found.iter().map(|&other| points[other as usize]))
        } else {
            *p
        }
    };
    points.par_iter().zip(&density).map(moved).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_first_of_close_points() {
        let points = [[0.0; 3], [0.0005, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]];
        assert_eq!(thin(&points), [points[0], points[2], points[3]]);
    }

    #[test]
    fn a_pipe_shrinks_to_its_axis_near_the_base() {
        let points: Vec<Vector> = (0..4000)
            .map(|i| {
                let angle = f64::from(i) * 2.4;
                [0.1 * libm::cos(angle), 0.1 * libm::sin(angle), f64::from(i) * 0.001]
            })
            .collect();
        let centred = centre(&points, 0, 0.3);
        let radius = |p: &Vector| (p[0] * p[0] + p[1] * p[1]).sqrt();
        let mean_of = |from: usize, to: usize| {
            centred[from..to].iter().map(radius).sum::<f64>() / (to - from) as f64
        };
        assert!(mean_of(400, 800) < 0.03, "{}", mean_of(400, 800));
        assert!((mean_of(2500, 4000) - 0.1).abs() < 1e-9);
    }
}

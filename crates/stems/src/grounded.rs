//! Stems and what only looks like one: a steep branch that begins at breast height on another tree.

use crate::chain::StemAxis;
use crate::{Error, StemsParams, slices};
use std::collections::BTreeSet;
use timberline_pointcloud::Grid3;

/// A stem whose first cross-section is not higher than this above ground stands by itself, m.
const SURE_FOOT_M: f64 = 1.0;
/// Longest leap between voxels of one branch, m.
const LEAP_M: f64 = 0.16;
/// How far above its first cross-section the way from a branch to its stem may lead, m.
const DETOUR_M: f64 = 0.3;
/// How far from its first cross-section in the plane, m.
const REACH_M: f64 = 2.0;
/// Below this height above ground everything hangs together by low vegetation, m.
const LOW_M: f64 = 0.3;

/// Leaves out the stems that hang on another one: whose lowest part is linked to it by a way through
/// occupied voxels that leads neither along the ground nor over the crowns. `height_m` is the height of
/// each position above ground; those that are ground are not given. Where no ground is seen
/// (`has_ground`), a stem also may not begin above what is beside it.
///
/// # Errors
/// [`Error::Grid`].
pub fn without_branches(
    axes: Vec<StemAxis>,
    positions: &[[f64; 3]],
    height_m: &[f64],
    has_ground: bool,
    params: &StemsParams,
) -> Result<Vec<StemAxis>, Error> {
    let foot = |axis: &StemAxis| slices::middle_m(axis.discs[0].slice, params);
    let sure = |axis: &StemAxis| foot(axis) <= SURE_FOOT_M;
    let (mut kept, doubtful): (Vec<_>, Vec<_>) = axes.into_iter().partition(sure);
    if doubtful.is_empty() || kept.is_empty() && doubtful.len() == 1 {
        return Ok(kept.into_iter().chain(doubtful).collect());
    }
    let column = |axis: usize| positions.iter().map(|p| p[axis]).collect::<Vec<f64>>();
    let grid = Grid3::new(&column(0), &column(1), &column(2), LEAP_M)?;
    let woods = Woods { positions, height_m, grid };
    for axis in doubtful {
        let hangs = woods.hangs_on_one(&axis, &kept);
        if !hangs && (has_ground || !woods.is_above_others(&axis)) {
            kept.push(axis);
        }
    }
    Ok(kept)
}

struct Woods<'a> {
    positions: &'a [[f64; 3]],
    height_m: &'a [f64],
    grid: Grid3,
}

impl Woods<'_> {
    /// Whether something within reach lies lower than a stem that stands by itself could begin.
    fn is_above_others(&self, axis: &StemAxis) -> bool {
        let [x, y, z] = axis.discs[0].centre_m;
        self.positions.iter().any(|p| {
            let (dx, dy) = (p[0] - x, p[1] - y);
            dx * dx + dy * dy <= REACH_M * REACH_M && p[2] < z - SURE_FOOT_M
        })
    }

    /// Whether the first cross-section of `branch` is linked to one of the stems.
    fn hangs_on_one(&self, branch: &StemAxis, stems: &[StemAxis]) -> bool {
        let first = branch.discs[0];
        let [x, y, z] = first.centre_m;
        let near: Vec<&StemAxis> = stems.iter().filter(|stem| comes_near(stem, [x, y])).collect();
        if near.is_empty() {
            return false;
        }
        let reach_m = first.radius_m + LEAP_M;
        let (mut seen, mut open) = (BTreeSet::new(), Vec::new());
        self.grid.candidates(first.centre_m, reach_m, |at| {
            if distance_m(self.positions[at], first.centre_m) <= reach_m && seen.insert(at) {
                open.push(at);
            }
        });
        while let Some(at) = open.pop() {
            let here = self.positions[at];
            if near.iter().any(|stem| stem_holds(stem, here)) {
                return true;
            }
            self.grid.candidates(here, LEAP_M, |to| {
                let p = self.positions[to];
                let (dx, dy) = (p[0] - x, p[1] - y);
                let inside = dx * dx + dy * dy <= REACH_M * REACH_M
                    && p[2] <= z + DETOUR_M
                    && self.height_m[to] >= LOW_M;
                if inside && distance_m(p, here) <= LEAP_M && seen.insert(to) {
                    open.push(to);
                }
            });
        }
        false
    }
}

/// Whether a way that stays within [`REACH_M`] of a place may lead to a stem.
fn comes_near(stem: &StemAxis, [x, y]: [f64; 2]) -> bool {
    // A stem leans at most 45 degrees over the gaps between its cross-sections.
    let most_m = REACH_M + 1.5 + stem.radius_m() + LEAP_M;
    stem.discs.iter().any(|disc| {
        let (dx, dy) = (disc.centre_m[0] - x, disc.centre_m[1] - y);
        dx * dx + dy * dy <= most_m * most_m
    })
}

fn stem_holds(stem: &StemAxis, at: [f64; 3]) -> bool {
    let [x, y] = stem.at_elevation(at[2]);
    let reach_m = stem.radius_m() + LEAP_M / 2.0;
    let (dx, dy) = (at[0] - x, at[1] - y);
    let [low, high] = stem.span_m();
    at[2] >= low - 1.0 && at[2] <= high && dx * dx + dy * dy <= reach_m * reach_m
}

fn distance_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::disc::{Disc, Shape};

    fn axis(x: f64, from: u32, radius_m: f64) -> StemAxis {
        let disc = |slice: u32| Disc {
            slice,
            centre_m: [x, 0.0, slices::middle_m(slice, &StemsParams::default())],
            radius_m,
            shape: Shape::Circle,
            coverage: 0.5,
            points: 30,
        };
        StemAxis { discs: (from..from + 12).map(disc).collect() }
    }

    fn row(from: [f64; 3], to: [f64; 3]) -> Vec<[f64; 3]> {
        let point =
            |k: u32| std::array::from_fn(|a| from[a] + (to[a] - from[a]) * f64::from(k) / 60.0);
        (0..=60).map(point).collect()
    }

    #[test]
    fn what_is_linked_to_a_stem_is_a_branch_and_what_is_not_is_a_stem() {
        let params = StemsParams::default();
        let mut points = row([0.0, 0.0, 0.0], [0.0, 0.0, 6.0]);
        points.extend(row([1.0, 0.0, 1.4], [1.0, 0.0, 4.0]));
        let kept = |points: &[[f64; 3]]| {
            let heights: Vec<f64> = points.iter().map(|p| p[2]).collect();
            let axes = vec![axis(0.0, 0, 0.1), axis(1.0, 6, 0.05)];
            without_branches(axes, points, &heights, true, &params).unwrap().len()
        };
        assert_eq!(kept(&points), 2);
        let low = row([0.0, 0.0, 0.1], [1.0, 0.0, 0.1]);
        assert_eq!(kept(&[points.clone(), low].concat()), 2);
        let limb = row([0.0, 0.0, 1.2], [1.0, 0.0, 1.5]);
        assert_eq!(kept(&[points, limb].concat()), 1);
    }
}

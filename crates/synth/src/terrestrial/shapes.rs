//! Simple shapes for exact tests: a pole, a bent tube, a fork.

use super::axis::{Assembly, AxisNode};
use super::tree_model::TreeModel;
use super::vector::Vec3;

/// A straight vertical stem with its foot at the origin, one piece for every 10 cm.
#[must_use]
pub fn pole(length_m: f64, foot_radius_m: f64, top_radius_m: f64) -> TreeModel {
    let steps = (length_m / 0.1).ceil().max(1.0) as u32;
    let nodes = (0..=steps).map(|i| {
        let share = f64::from(i) / f64::from(steps);
        let radius = foot_radius_m + share * (top_radius_m - foot_radius_m);
        AxisNode { at: [0.0, 0.0, share * length_m], radius }
    });
    let mut tree = Assembly::default();
    tree.add(nodes.collect(), 0, None);
    shape(tree)
}

/// A tube of one radius whose axis is an arc of a circle: it starts vertically at the origin and
/// bends towards the east by `angle_deg` (below 180) in `steps` pieces.
#[must_use]
pub fn bent_tube(bend_radius_m: f64, angle_deg: f64, radius_m: f64, steps: u32) -> TreeModel {
    let steps = steps.max(1);
    let nodes = (0..=steps).map(|i| {
        let angle = (angle_deg * f64::from(i) / f64::from(steps)).to_radians();
        let (sin, cos) = libm::sincos(angle);
        AxisNode { at: [bend_radius_m * (1.0 - cos), 0.0, bend_radius_m * sin], radius: radius_m }
    });
    let mut tree = Assembly::default();
    tree.add(nodes.collect(), 0, None);
    shape(tree)
}

/// A stem that rises vertically to `fork_m` and divides into two arms in the plane of x and z, each
/// at `half_angle_deg` from the vertical; the eastern arm goes on as order 0.
#[must_use]
pub fn y_fork(
    fork_m: f64,
    arm_m: f64,
    half_angle_deg: f64,
    stem_radius_m: f64,
    arm_radius_m: f64,
) -> TreeModel {
    let (sin, cos) = libm::sincos(half_angle_deg.to_radians());
    let arm_end = |sign: f64| -> Vec3 { [sign * arm_m * sin, 0.0, fork_m + arm_m * cos] };
    let node = |at, radius| AxisNode { at, radius };
    let fork = [0.0, 0.0, fork_m];
    let mut tree = Assembly::default();
    // The arm begins in a piece of its own, so that the stem keeps its radius up to the fork.
    let reach = (stem_radius_m - arm_radius_m).max(0.001);
    let start = [reach * sin, 0.0, fork_m + reach * cos];
    let stem = vec![
        node([0.0; 3], stem_radius_m),
        node(fork, stem_radius_m),
        node(start, arm_radius_m),
        node(arm_end(1.0), arm_radius_m),
    ];
    tree.add(stem, 0, None);
    tree.add(vec![node(fork, arm_radius_m), node(arm_end(-1.0), arm_radius_m)], 1, Some(0));
    shape(tree)
}

fn shape(tree: Assembly) -> TreeModel {
    let tops = tree.pieces.iter().map(|piece| piece.end_m[2]);
    let crown_base_height_m = tops.fold(0.0, f64::max);
    let (cylinders, leaves) = (tree.pieces, tree.leaves);
    TreeModel { id: 1, species: None, base_m: [0.0; 3], crown_base_height_m, cylinders, leaves }
}

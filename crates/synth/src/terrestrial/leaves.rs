//! Leaves and sprays of needles on thin wood.

use super::axis::Axis;
use super::cylinder::{Leaf, leaf};
use super::species::BranchingHabit;
use super::vector::{Vec3, across, along, scale, turned, unit};
use crate::random::Stream;

/// Angle between a twig and its leaves, degrees.
const LEAF_ANGLE_DEG: f64 = 50.0;
/// Length of the stalk, in halves of the blade's length.
const STALK: f64 = 0.25;

/// Adds the leaves of the leafy end of an axis.
pub(crate) fn along_axis(
    axis: &Axis,
    habit: &BranchingHabit,
    stream: &mut Stream,
    leaves: &mut Vec<Leaf>,
) {
    let foliage = &habit.foliage;
    let mut turn = 360.0 * stream.unit();
    let mut s = (axis.length() - foliage.leafy_m).max(0.02);
    while s <= axis.length() {
        let place = axis.place(s);
        if place.radius <= foliage.thickest_m {
            for _ in 0..foliage.bundle {
                turn += if habit.flat { 180.0 } else { 137.5 } + 25.0 * stream.normal();
                let [side, _] = across(place.direction);
                let side = turned(side, place.direction, turn.to_radians());
                let angle = LEAF_ANGLE_DEG + 12.0 * stream.normal();
                let tip = turned_towards(place.direction, side, angle);
                let half_m = scaled(foliage.half_m, stream.factor(0.2));
                let centre = along(place.at, tip, half_m[0] * (1.0 + STALK) + place.radius);
                leaves.push(leaf(centre, normal(foliage.level, stream), tip, half_m));
            }
        }
        s += foliage.spacing_m * stream.within(0.8, 1.2);
    }
}

fn turned_towards(axis: Vec3, side: Vec3, angle_deg: f64) -> Vec3 {
    let (sin, cos) = libm::sincos(angle_deg.to_radians());
    std::array::from_fn(|i| cos * axis[i] + sin * side[i])
}

fn scaled(half_m: [f64; 2], factor: f64) -> [f64; 2] {
    half_m.map(|half| half * factor)
}

/// A normal between straight up and any direction.
fn normal(level: f64, stream: &mut Stream) -> Vec3 {
    let any = unit([stream.normal(), stream.normal(), stream.normal()]);
    unit(along(scale(any, 1.0 - level), [0.0, 0.0, 1.0], level))
}

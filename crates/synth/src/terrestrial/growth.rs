//! Growing a tree: stem, leaders, and all that they bear.

use super::axis::{Assembly, Axis, AxisNode};
use super::branching::Crown;
use super::size::TreeSize;
use super::species::{BranchingHabit, TreeSpecies};
use super::taper::{StemTaper, TIP_RADIUS_M};
use super::tree_model::TreeModel;
use super::vector::{Vec3, across, along, turned, unit};
use crate::Error;
use crate::random::{Domain, Stream};

/// Heights of the first nodes of a stem, m: close together where the foot swells; breast height is
/// a node, so that the DBH is exact.
const FIRST_NODES_M: [f64; 9] = [0.0, 0.06, 0.14, 0.25, 0.4, 0.6, 0.85, 1.1, 1.3];
/// Distance of the nodes above, m.
const STEM_STEP_M: f64 = 0.25;
/// Share of the cross-section that goes to the second leader of a forked stem.
const FORK_SHARE: f64 = 0.42;
/// Length over which the stem gets thinner above a fork, m.
const FORK_LENGTH_M: f64 = 0.2;
/// Angle between the leaders of a forked stem at first, degrees.
const FORK_ANGLE_DEG: f64 = 24.0;
/// How far a leaning stem rights itself until its top, share of the lean.
const RIGHTING: f64 = 0.6;

/// Grows a tree with its foot at the origin; [`TreeModel::at`] plants it elsewhere.
///
/// The same species, size and seed give the same tree, to the last bit.
///
/// # Errors
/// [`Error::Parameter`] for a size out of range.
pub fn grow(species: TreeSpecies, size: &TreeSize, seed: u64) -> Result<TreeModel, Error> {
    size.check()?;
    let mut stream = Stream::new(seed, Domain::Growth, 0);
    let mut tree = Assembly::default();
    let habit = species.habit();
    let fork = size.fork_m.map(|height_m| Limb { height_m, share: FORK_SHARE });
    let limbs = limbs(species, size, &mut stream);
    let given_off: Vec<Limb> = limbs.iter().copied().chain(fork).collect();
    let stem = stem(size, habit, &given_off, &mut stream, &mut tree);
    let second = size.fork_m.map(|fork| second_leader(&stem, fork, habit, &mut stream, &mut tree));
    let mut crown = Crown::new(species, size, &stem, given_off, stream, tree);
    limbs.iter().for_each(|limb| crown.limb(&stem, limb.height_m, limb.share));
    crown.bear(&stem);
    if let Some(leader) = second {
        crown.bear(&leader);
    }
    let tree = crown.tree;
    Ok(TreeModel {
        id: 1,
        species: Some(species),
        base_m: [0.0; 3],
        crown_base_height_m: crown.lowest_m.min(size.height_m),
        cylinders: tree.pieces,
        leaves: tree.leaves,
    })
}

/// A thick branch or second leader, for which the stem itself gets thinner.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limb {
    height_m: f64,
    /// Its share of the cross-section of the stem below.
    share: f64,
}

/// What limbs leave of the radius of the stem at a distance from its foot: the cross-sections are
/// shared.
pub(crate) fn left_of_radius(limbs: &[Limb], along_m: f64) -> f64 {
    let left = |limb: &Limb| {
        let passed = ((along_m - limb.height_m) / FORK_LENGTH_M).clamp(0.0, 1.0);
        1.0 + passed * ((1.0 - limb.share).sqrt() - 1.0)
    };
    limbs.iter().map(left).product()
}

/// The limbs of a broadleaved tree: some in the lower two thirds of its crown.
fn limbs(species: TreeSpecies, size: &TreeSize, stream: &mut Stream) -> Vec<Limb> {
    if species.is_conifer() {
        return Vec::new();
    }
    let count = 3 + (3.0 * stream.unit()) as u32;
    let crown_m = size.height_m - size.crown_base_m;
    (0..count)
        .map(|index| {
            let rank = (f64::from(index) + stream.within(0.1, 0.9)) / f64::from(count);
            let height_m = size.crown_base_m + 0.65 * rank * crown_m;
            Limb { height_m, share: stream.within(0.18, 0.38) }
        })
        .collect()
}

/// The stem: a direction that starts at the lean, rights itself, and swings slightly to one side and
/// back, followed node by node.
fn stem(
    size: &TreeSize,
    habit: &BranchingHabit,
    limbs: &[Limb],
    stream: &mut Stream,
    tree: &mut Assembly,
) -> Axis {
    let taper = StemTaper {
        breast_radius_m: 0.5 * size.dbh_m,
        length_m: size.height_m,
        exponent: habit.taper,
        flare: habit.flare * stream.factor(0.2),
    };
    let [sx, sy] = stream.direction();
    let waves = stream.within(0.7, 1.6);
    let (sin, cos) = libm::sincos(size.lean_azimuth_deg.to_radians());
    let heights = node_heights(size.height_m);
    let mut at: Vec3 = [0.0; 3];
    let mut nodes = Vec::with_capacity(heights.len());
    for (index, &height) in heights.iter().enumerate() {
        let radius = (taper.radius_m(height) * left_of_radius(limbs, height)).max(TIP_RADIUS_M);
        nodes.push(AxisNode { at, radius });
        if let Some(next) = heights.get(index + 1) {
            let share = 0.5 * (height + next) / size.height_m;
            let lean = libm::tan((size.lean_deg * (1.0 - RIGHTING * share)).to_radians());
            let phase = waves * std::f64::consts::TAU * share;
            // The derivative of a sine of this amplitude over the length.
            let swing = size.sweep_m * waves * std::f64::consts::TAU / size.height_m;
            let swing = swing * libm::cos(phase);
            let direction = unit([lean * cos + swing * sx, lean * sin + swing * sy, 1.0]);
            at = along(at, direction, next - height);
        }
    }
    tree.add(nodes, 0, None)
}

fn node_heights(height_m: f64) -> Vec<f64> {
    let mut heights: Vec<f64> =
        FIRST_NODES_M.iter().copied().filter(|&h| h < height_m - 0.1).collect();
    let low = heights.last().copied().unwrap_or(0.0);
    let steps = ((height_m - low) / STEM_STEP_M).ceil().max(1.0);
    heights.extend((1..=steps as u32).map(|i| low + (height_m - low) * f64::from(i) / steps));
    heights
}

/// The other leader of a forked stem: leaves it at an angle and rises beside it.
fn second_leader(
    stem: &Axis,
    fork_m: f64,
    habit: &BranchingHabit,
    stream: &mut Stream,
    tree: &mut Assembly,
) -> Axis {
    let place = stem.place(fork_m);
    let [side, _] = across(place.direction);
    let azimuth = std::f64::consts::TAU * stream.unit();
    let side = turned(side, place.direction, azimuth);
    let length = (stem.length() - fork_m) * stream.within(0.86, 0.95);
    let first = place.radius * FORK_SHARE.sqrt();
    let steps = (length / STEM_STEP_M).ceil().max(2.0);
    let mut direction = turned(place.direction, side, FORK_ANGLE_DEG.to_radians());
    let mut at = place.insertion(direction, first);
    let mut nodes = vec![AxisNode { at, radius: first }];
    for step in 1..=steps as u32 {
        let share = f64::from(step) / steps;
        at = along(at, direction, length / steps);
        let radius = first * libm::pow(1.0 - share, habit.taper);
        nodes.push(AxisNode { at, radius: radius.max(TIP_RADIUS_M) });
        // Rises again within a quarter of its length.
        let towards = if share < 0.25 { 0.08 } else { 0.01 };
        direction = unit(along(direction, [0.0, 0.0, 1.0], towards));
    }
    tree.add(nodes, 1, Some(place.piece))
}

#[cfg(test)]
#[path = "growth/tests.rs"]
mod tests;

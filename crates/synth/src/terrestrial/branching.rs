//! Branches: where they leave, how they bend, how long and thick they are, and what they bear.

use super::axis::{Assembly, Axis, AxisNode, Place};
use super::envelope::Envelope;
use super::growth::{Limb, left_of_radius};
use super::leaves;
use super::size::TreeSize;
use super::species::{BranchingHabit, TreeSpecies};
use super::taper::{TIP_RADIUS_M, branch_radius_m, leaving_radius_m};
use super::vector::{Vec3, across, along, cross, length, turned, unit};
use crate::random::Stream;

/// Length over radius^(2/3) of broadleaved branches, m^(1/3): elastic similarity (McMahon and Kronauer
/// 1976, Tree structures: deducing the principle of mechanical design, Journal of Theoretical Biology
/// 59, 443-466); the factor makes a branch of 10 cm diameter 5 m long.
const SLENDERNESS: f64 = 37.0;
/// Angle between successive branches around an axis, degrees.
const GOLDEN_DEG: f64 = 137.508;
/// Shortest branch that is grown, m.
const SHORTEST_M: f64 = 0.08;
/// Share of the radius that the pipe model gives which a branch gets on average.
const VIGOUR: f64 = 0.95;

/// A crown being grown.
#[derive(Debug)]
pub(crate) struct Crown {
    habit: &'static BranchingHabit,
    conifer: bool,
    size: TreeSize,
    envelope: Envelope,
    /// What has its own share of the stem.
    limbs: Vec<Limb>,
    stream: Stream,
    pub(crate) tree: Assembly,
    /// Height of the lowest living branch, m.
    pub(crate) lowest_m: f64,
}

/// What is decided about a branch before it grows.
#[derive(Debug, Clone, Copy)]
struct Bud {
    place: Place,
    order: u8,
    direction: Vec3,
    length: f64,
    radius: f64,
    /// Bare inner share.
    bare: f64,
    alive: bool,
}

impl Crown {
    pub(crate) fn new(
        species: TreeSpecies,
        size: &TreeSize,
        stem: &Axis,
        limbs: Vec<Limb>,
        stream: Stream,
        tree: Assembly,
    ) -> Self {
        let envelope = Envelope::new(species, size, stem);
        let (habit, conifer) = (species.habit(), species.is_conifer());
        let (size, lowest_m) = (*size, f64::INFINITY);
        Self { habit, conifer, size, envelope, limbs, stream, tree, lowest_m }
    }

    /// Everything that a leader bears: living branches in its crown, dead ones below.
    pub(crate) fn bear(&mut self, leader: &Axis) {
        let mut turn = 360.0 * self.stream.unit();
        let mut s = self.first_branch(leader, &mut turn);
        while s < leader.length() - 0.15 {
            let depth = self.envelope.depth(leader.place(s).at[2]).clamp(0.0, 1.0);
            // Annual shoots get shorter towards the top of an old tree.
            let step = self.habit.spacing_m * (0.5 + 0.5 * depth) * self.stream.within(0.85, 1.15);
            let next = (s + step).min(leader.length());
            self.whorl(leader, [s, next], &mut turn);
            s = next;
        }
        if self.size.leaves {
            leaves::along_axis(leader, self.habit, &mut self.stream, &mut self.tree.leaves);
        }
    }

    /// A thick branch of the stem, with a share of its cross-section.
    pub(crate) fn limb(&mut self, stem: &Axis, height_m: f64, share: f64) {
        let place = stem.place(height_m);
        let depth = self.envelope.depth(place.at[2]).clamp(0.0, 1.0);
        let [top, base] = self.habit.angle_deg;
        let angle = 0.75 * (top + (base - top) * depth) + 4.0 * self.stream.normal();
        let direction = from_axis(place.direction, 360.0 * self.stream.unit(), angle);
        let radius = VIGOUR * place.radius * share.sqrt();
        let limit = 1.2 * SLENDERNESS * libm::pow(radius, 2.0 / 3.0);
        let length = self.envelope.room_m(place.at, direction, limit).max(0.5 * limit);
        self.lowest_m = self.lowest_m.min(place.at[2]);
        let (order, bare, alive) = (stem.order + 1, self.habit.bare, true);
        self.branch(&Bud { place, order, direction, length, radius, bare, alive });
    }

    /// Grows the dead branches of a conifer; returns where the crown begins on the leader.
    fn first_branch(&mut self, leader: &Axis, turn: &mut f64) -> f64 {
        let mut s = 0.0;
        let dead_from = if leader.order == 0 { 0.45 * self.size.crown_base_m } else { 0.0 };
        loop {
            let place = leader.place(s);
            if place.at[2] >= self.size.crown_base_m || s >= leader.length() {
                return s.max(if leader.order == 0 { 0.0 } else { 0.3 });
            }
            if self.conifer && place.at[2] > dead_from && self.stream.chance(0.35) {
                *turn += GOLDEN_DEG;
                self.dead_branch(place, *turn, leader.order + 1);
            }
            s += 0.3;
        }
    }

    fn dead_branch(&mut self, place: Place, turn_deg: f64, order: u8) {
        let angle = self.habit.angle_deg[1] + 4.0 * self.stream.normal();
        let direction = from_axis(place.direction, turn_deg, angle);
        let length = self.stream.within(0.15, 0.55) * self.size.crown_radius_m;
        let radius = (0.0045 * length + TIP_RADIUS_M).min(0.3 * place.radius);
        self.branch(&Bud { place, order, direction, length, radius, bare: 1.0, alive: false });
    }

    /// The branches that leave a leader between two places: a whorl at the lower one, and for conifers
    /// small ones between.
    fn whorl(&mut self, leader: &Axis, [s, next]: [f64; 2], turn: &mut f64) {
        let [fewest, most] = self.habit.whorl;
        let count = fewest + (self.stream.unit() * f64::from(most - fewest + 1)) as u32;
        let between = if self.conifer { 2 } else { 0 };
        let leaving = self.leaving_m(leader, s, next);
        let weights: Vec<f64> = (0..count + between)
            .map(|i| self.stream.within(0.7, 1.3) * if i < count { 1.0 } else { 0.25 })
            .collect();
        let all: f64 = weights.iter().sum();
        *turn += 360.0 * self.stream.unit();
        for (index, weight) in (0..).zip(&weights) {
            let small = index >= count;
            let at = if small { s + (next - s) * self.stream.within(0.25, 0.85) } else { s };
            let even = 360.0 / f64::from(count.max(1));
            *turn += if small || count == 1 { GOLDEN_DEG } else { even };
            let radius = VIGOUR * leaving * (weight / all).sqrt();
            let azimuth = *turn + 9.0 * self.stream.normal();
            self.main_branch(leader, at, azimuth, radius, if small { 0.6 } else { 1.0 });
        }
    }

    /// Radius of all that leaves a leader between two places besides its limbs, m.
    fn leaving_m(&self, leader: &Axis, s: f64, next: f64) -> f64 {
        let limbs = if leader.order == 0 { self.limbs.as_slice() } else { &[] };
        let kept = left_of_radius(limbs, next) / left_of_radius(limbs, s);
        leaving_radius_m(leader.place(s).radius, leader.place(next).radius / kept)
    }

    /// A living branch of a leader.
    fn main_branch(&mut self, leader: &Axis, s: f64, turn_deg: f64, radius: f64, vigour: f64) {
        let place = leader.place(s);
        let depth = self.envelope.depth(place.at[2]).clamp(0.0, 1.0);
        let [top, base] = self.habit.angle_deg;
        let angle = top + (base - top) * libm::pow(depth, 0.8) + 4.0 * self.stream.normal();
        let direction = from_axis(place.direction, turn_deg, angle);
        let reach = if self.conifer {
            let sine = libm::sin(angle.to_radians()).max(0.5);
            // No branch outgrows its leader.
            (self.envelope.radius_at(depth) / sine).min(0.8 * (leader.length() - s))
        } else {
            let limit = 1.35 * SLENDERNESS * libm::pow(radius.max(0.004), 2.0 / 3.0);
            self.envelope.room_m(place.at, direction, limit)
        };
        let length = vigour * reach * self.stream.factor(0.12);
        let radius = radius.clamp(1.2 * TIP_RADIUS_M, (0.6 * place.radius).max(1.2 * TIP_RADIUS_M));
        let radius = radius.min(0.95 * place.radius);
        if length >= SHORTEST_M {
            let bare = self.habit.bare * depth.max(0.15);
            self.lowest_m = self.lowest_m.min(place.at[2]);
            let order = leader.order + 1;
            self.branch(&Bud { place, order, direction, length, radius, bare, alive: true });
        }
    }

    /// Grows a branch and all that it bears.
    fn branch(&mut self, bud: &Bud) {
        let nodes = self.path(bud);
        let axis = self.tree.add(nodes, bud.order, Some(bud.place.piece));
        if bud.alive && self.size.leaves {
            leaves::along_axis(&axis, self.habit, &mut self.stream, &mut self.tree.leaves);
        }
        if bud.order >= self.habit.orders || bud.radius <= 1.05 * TIP_RADIUS_M {
            return;
        }
        let spacing = self.spacing_m(&axis) * if bud.alive { 1.0 } else { 3.0 };
        let mut s = (bud.bare * axis.length()).max(0.05) + spacing * self.stream.within(0.2, 0.8);
        let mut turn = 360.0 * self.stream.unit();
        while s < axis.length() - 0.04 {
            let next = s + spacing * self.stream.within(0.75, 1.25);
            turn += if self.habit.flat { 180.0 } else { GOLDEN_DEG };
            self.side_branch(&axis, [s, next], turn, bud);
            s = next;
        }
    }

    /// Distance of the branches on a branch, m.
    fn spacing_m(&self, axis: &Axis) -> f64 {
        match (self.conifer, self.habit.flat) {
            (true, true) => 0.13,
            (true, false) => 0.2,
            _ => (0.09 * axis.length()).clamp(0.12, 0.45),
        }
    }

    fn side_branch(&mut self, axis: &Axis, [s, next]: [f64; 2], turn_deg: f64, bud: &Bud) {
        let place = axis.place(s);
        let after = axis.place(next.min(axis.length())).radius;
        let leaving = VIGOUR * leaving_radius_m(place.radius, after) * self.stream.within(0.8, 1.0);
        let radius = leaving.max(TIP_RADIUS_M).min(0.9 * place.radius);
        let angle = self.habit.fork_angle_deg + 6.0 * self.stream.normal();
        let direction = if self.habit.flat {
            sideways(place.direction, turn_deg, angle, 5.0 * self.stream.normal())
        } else {
            from_axis(place.direction, turn_deg + 12.0 * self.stream.normal(), angle)
        };
        let rest = axis.length() - s;
        let wanted = if self.conifer {
            (0.42 * rest + 0.07).min(0.9)
        } else {
            let slender = SLENDERNESS * libm::pow(radius, 2.0 / 3.0);
            self.envelope.room_m(place.at, direction, slender.min(0.75 * rest + 0.2))
        };
        let length = wanted * self.stream.factor(0.2) * if bud.alive { 1.0 } else { 0.5 };
        if length < SHORTEST_M {
            return;
        }
        let (order, bare, alive) = (bud.order + 1, 0.15, bud.alive);
        self.branch(&Bud { place, order, direction, length, radius, bare, alive });
    }

    /// Nodes of a branch: it bends by what its species does over each half of its length, swings at
    /// random, and young wood rises towards the light.
    fn path(&mut self, bud: &Bud) -> Vec<AxisNode> {
        let step = match bud.order {
            1 => 0.24,
            2 => 0.16,
            _ => 0.12,
        };
        let steps = (bud.length / step).ceil().max(2.0);
        let mut direction = bud.direction;
        let mut at = bud.place.insertion(direction, bud.radius);
        let mut nodes = vec![AxisNode { at, radius: bud.radius }];
        for index in 1..=steps as u32 {
            let share = f64::from(index) / steps;
            at = along(at, direction, bud.length / steps);
            nodes.push(AxisNode { at, radius: branch_radius_m(bud.radius, share) });
            direction = self.bent(direction, bud.order, share <= 0.5, steps);
        }
        nodes
    }

    fn bent(&mut self, direction: Vec3, order: u8, first_half: bool, steps: f64) -> Vec3 {
        let bend = self.habit.bend_deg[usize::from(!first_half)];
        let share = if order == 1 { 1.0 } else { 0.4 };
        let down = share * bend * 2.0 / steps;
        let level = cross(direction, [0.0, 0.0, 1.0]);
        let mut bent = direction;
        if length(level) > 0.05 {
            // About the level axis to its right a direction turns upwards.
            bent = turned(bent, unit(level), -down.to_radians());
        }
        let [a, b] = across(bent);
        let deviation = libm::tan((self.habit.crooked_deg * 0.7).to_radians());
        bent = along(bent, a, deviation * self.stream.normal().clamp(-2.0, 2.0));
        bent = along(bent, b, deviation * self.stream.normal().clamp(-2.0, 2.0));
        unit(bent)
    }
}

/// The direction at an angle from an axis, turned about it; turns are counted from one direction
/// across it.
fn from_axis(axis: Vec3, turn_deg: f64, angle_deg: f64) -> Vec3 {
    let [side, _] = across(axis);
    let side = turned(side, axis, turn_deg.to_radians());
    let (sin, cos) = libm::sincos(angle_deg.to_radians());
    std::array::from_fn(|i| cos * axis[i] + sin * side[i])
}

/// The direction at an angle from a branch to its left or right (turns of 180 degrees), and a little
/// up or down.
fn sideways(axis: Vec3, turn_deg: f64, angle_deg: f64, up_deg: f64) -> Vec3 {
    let level = cross(axis, [0.0, 0.0, 1.0]);
    if length(level) < 0.2 {
        return from_axis(axis, turn_deg, angle_deg);
    }
    let side = unit(level);
    let sign = if libm::cos(turn_deg.to_radians()) >= 0.0 { 1.0 } else { -1.0 };
    let (sin, cos) = libm::sincos(angle_deg.to_radians());
    let flat: Vec3 = std::array::from_fn(|i| cos * axis[i] + sign * sin * side[i]);
    unit(along(flat, [0.0, 0.0, 1.0], libm::tan(up_deg.to_radians())))
}

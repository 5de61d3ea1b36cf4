//! Seeded shapes for tests.

use crate::SkeletonNode;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::PI;
use timberline_solids::vector::{across, cross, norm, sub, unit};

/// Random numbers from a seed.
pub(crate) struct Random(ChaCha8Rng);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    /// Uniform from 0 (inclusive) to 1.
    pub(crate) fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Standard normal (Box and Muller 1958).
    pub(crate) fn normal(&mut self) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - self.unit())).sqrt();
        radius * libm::cos(2.0 * PI * self.unit())
    }
}

/// A round body along a line: the radius at each position of its axis.
pub(crate) struct Limb {
    pub(crate) axis: Vec<[f64; 3]>,
    pub(crate) radius_m: Vec<f64>,
}

impl Limb {
    /// A limb from a rule for axis and radius between 0 and 1.
    pub(crate) fn new(steps: usize, rule: impl Fn(f64) -> ([f64; 3], f64)) -> Self {
        let (axis, radius_m) = (0..=steps).map(|step| rule(step as f64 / steps as f64)).unzip();
        Self { axis, radius_m }
    }

    /// Points of its surface, so many to the square metre, with noise across it. `seen` is the part of
    /// the circumference that is scanned, from the side of the first axis.
    pub(crate) fn scan(
        &self,
        per_m2: f64,
        noise_m: f64,
        seen: f64,
        random: &mut Random,
    ) -> Vec<[f64; 3]> {
        let mut points = Vec::new();
        for step in 1..self.axis.len() {
            let (a, b) = (self.axis[step - 1], self.axis[step]);
            let (ra, rb) = (self.radius_m[step - 1], self.radius_m[step]);
            let direction = unit(sub(b, a)).unwrap();
            let first = across(direction);
            let second = cross(direction, first);
            let wanted = per_m2 * seen * PI * (ra + rb) * norm(sub(b, a));
            let count = wanted.floor() as usize + usize::from(random.unit() < wanted.fract());
            for _ in 0..count {
                let share = random.unit();
                let radius = ra + (rb - ra) * share + noise_m * random.normal();
                let (sin, cos) = libm::sincos(seen * random.between(-PI, PI));
                points.push(std::array::from_fn(|k| {
                    a[k] + (b[k] - a[k]) * share + radius * (cos * first[k] + sin * second[k])
                }));
            }
        }
        points
    }

    /// Its volume, m3.
    pub(crate) fn volume_m3(&self) -> f64 {
        let piece = |step: usize| {
            let (a, b) = (self.radius_m[step - 1], self.radius_m[step]);
            PI / 3.0 * (a * a + a * b + b * b) * norm(sub(self.axis[step], self.axis[step - 1]))
        };
        (1..self.axis.len()).map(piece).sum()
    }
}

/// The skeleton of limbs: each but the first begins at a node of an earlier one. Its radii are wrong
/// by a factor, and its nodes lie off the axes by some noise.
pub(crate) fn skeleton_of(
    limbs: &[(&Limb, Option<(usize, usize)>)],
    factor: f64,
    off_m: f64,
    random: &mut Random,
) -> Vec<SkeletonNode> {
    let mut nodes: Vec<SkeletonNode> = Vec::new();
    let mut first = Vec::new();
    for (limb, on) in limbs {
        // The first position of a side limb is on the axis of the other: its own node is the next.
        let skip = usize::from(on.is_some());
        first.push(nodes.len() - skip.min(nodes.len()));
        let mut parent = on.map(|(other, node): (usize, usize)| (first[other] + node) as u32);
        for (position, radius) in limb.axis.iter().zip(&limb.radius_m).skip(skip) {
            let position_m = position.map(|value| value + off_m * random.normal());
            nodes.push(SkeletonNode { position_m, parent, radius_m: factor * radius });
            parent = Some(nodes.len() as u32 - 1);
        }
    }
    nodes
}

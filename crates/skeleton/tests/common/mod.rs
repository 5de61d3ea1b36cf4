//! Clouds with known axes.
#![allow(dead_code, unreachable_pub, reason = "each test uses its part")]

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use timberline_skeleton::Skeleton;

pub type Point = [f64; 3];

/// A tapering tube along a line of positions.
#[derive(Debug, Clone)]
pub struct Tube {
    pub axis: Vec<Point>,
    /// Radii at the first and the last position, m.
    pub radii_m: [f64; 2],
    /// Seen sector around the tube, from and to, radians.
    pub seen: [f64; 2],
}

impl Tube {
    pub fn new(axis: Vec<Point>, radii_m: [f64; 2]) -> Self {
        Self { axis, radii_m, seen: [0.0, std::f64::consts::TAU] }
    }

    fn length_m(&self) -> f64 {
        self.axis.windows(2).map(|pair| distance(pair[0], pair[1])).sum()
    }

    /// Points on the surface, so many per square metre, with noise across it.
    pub fn scan(&self, per_m2: f64, noise_m: f64, random: &mut ChaCha8Rng) -> Vec<Point> {
        let mut points = Vec::new();
        let (whole, mut done) = (self.length_m(), 0.0);
        for pair in self.axis.windows(2) {
            let length = distance(pair[0], pair[1]);
            let along = scale(sub(pair[1], pair[0]), 1.0 / length);
            let (u, v) = across(along);
            let radius =
                |t: f64| self.radii_m[0] + (self.radii_m[1] - self.radii_m[0]) * (done + t) / whole;
            let sector = self.seen[1] - self.seen[0];
            let count = (per_m2 * length * radius(0.5 * length) * sector) as usize;
            for _ in 0..count {
                let t = uniform(random) * length;
                let angle = self.seen[0] + uniform(random) * sector;
                let r = radius(t) + noise_m * normal(random);
                let out = add(scale(u, r * libm::cos(angle)), scale(v, r * libm::sin(angle)));
                points.push(add(pair[0], add(scale(along, t), out)));
            }
            done += length;
        }
        points
    }
}

pub fn seeded(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Near enough to normal: the sum of twelve uniform numbers.
pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| uniform(random)).sum::<f64>() - 6.0
}

pub fn scan(tubes: &[Tube], per_m2: f64, noise_m: f64, seed: u64) -> Vec<Point> {
    let mut random = seeded(seed);
    tubes.iter().flat_map(|tube| tube.scan(per_m2, noise_m, &mut random)).collect()
}

/// A stem of 10 m with whorls of four branches from 3 m up, and a twig on each branch.
pub fn spruce() -> Vec<Tube> {
    let stem: Vec<Point> = (0..=20).map(|i| [0.0, 0.0, 0.5 * f64::from(i)]).collect();
    let mut tubes = vec![Tube::new(stem, [0.12, 0.015])];
    for whorl in 0..6 {
        let z = 3.0 + f64::from(whorl);
        let length = 2.2 - 0.3 * f64::from(whorl);
        for k in 0..4 {
            let angle = f64::from(k) * 1.571 + f64::from(whorl) * 0.6;
            let out = [libm::cos(angle), libm::sin(angle)];
            let at = |t: f64| [out[0] * t, out[1] * t, z + 0.25 * t];
            tubes.push(Tube::new(vec![at(0.0), at(length)], [0.02, 0.006]));
            let fork = at(0.5 * length);
            let tip = add(fork, [-out[1] * 0.5, out[0] * 0.5, 0.2]);
            tubes.push(Tube::new(vec![fork, tip], [0.009, 0.005]));
        }
    }
    tubes
}

/// A stem that forks into two arms.
pub fn fork() -> Vec<Tube> {
    vec![
        Tube::new(vec![[0.0; 3], [0.0, 0.0, 2.0]], [0.12, 0.1]),
        Tube::new(vec![[0.0, 0.0, 2.0], [0.9, 0.0, 4.0]], [0.07, 0.04]),
        Tube::new(vec![[0.0, 0.0, 2.0], [-0.9, 0.0, 4.0]], [0.07, 0.04]),
    ]
}

/// Distances of positions every 2 cm along the skeleton from the nearest axis, m.
pub fn off_axis(skeleton: &Skeleton, tubes: &[Tube]) -> Vec<f64> {
    let mut away = Vec::new();
    for node in &skeleton.nodes {
        let Some(parent) = node.parent else {
            continue;
        };
        let from = skeleton.nodes[parent as usize].position_m;
        for t in steps(from, node.position_m) {
            away.push(to_tubes(t, tubes));
        }
    }
    away
}

/// Distances of positions every 2 cm along the axes from the skeleton, m.
pub fn missed(tubes: &[Tube], skeleton: &Skeleton) -> Vec<f64> {
    let pairs: Vec<(Point, Point)> = skeleton
        .nodes
        .iter()
        .filter_map(|n| Some((skeleton.nodes[n.parent? as usize].position_m, n.position_m)))
        .collect();
    let nearest =
        |p: Point| pairs.iter().map(|(a, b)| to_segment(p, *a, *b)).fold(f64::INFINITY, f64::min);
    let axes = tubes.iter().flat_map(|tube| tube.axis.windows(2));
    axes.flat_map(|pair| steps(pair[0], pair[1])).map(nearest).collect()
}

fn to_tubes(p: Point, tubes: &[Tube]) -> f64 {
    let axes = tubes.iter().flat_map(|tube| tube.axis.windows(2));
    axes.map(|pair| to_segment(p, pair[0], pair[1])).fold(f64::INFINITY, f64::min)
}

fn steps(a: Point, b: Point) -> Vec<Point> {
    let count = (distance(a, b) / 0.02).ceil().max(1.0) as usize;
    (0..count).map(|i| add(a, scale(sub(b, a), i as f64 / count as f64))).collect()
}

pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

pub fn share_above(values: &[f64], limit: f64) -> f64 {
    values.iter().filter(|value| **value > limit).count() as f64 / values.len() as f64
}

pub fn to_segment(p: Point, a: Point, b: Point) -> f64 {
    let along = sub(b, a);
    let length = dot(along, along);
    let t = if length > 0.0 { (dot(sub(p, a), along) / length).clamp(0.0, 1.0) } else { 0.0 };
    distance(p, add(a, scale(along, t)))
}

fn across(along: Point) -> (Point, Point) {
    let least = if along[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    let u = cross(along, least);
    let u = scale(u, 1.0 / dot(u, u).sqrt());
    (u, cross(along, u))
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub fn add(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub fn sub(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub fn scale(a: Point, by: f64) -> Point {
    a.map(|value| value * by)
}

fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn distance(a: Point, b: Point) -> f64 {
    dot(sub(a, b), sub(a, b)).sqrt()
}

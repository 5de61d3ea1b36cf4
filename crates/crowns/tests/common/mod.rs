//! Simulated crowns for tests and benchmarks: truth, echoes and how far a model is from the truth.
#![allow(dead_code, reason = "every test binary uses a part")]

pub(crate) mod feasible;
pub(crate) mod oracle;
pub(crate) mod problems;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use timberline_crowns::Window;
use timberline_crowns::starsac::Model;

/// Uniform in 0 to 1.
pub(crate) fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Nearly normal, mean 0, standard deviation 1.
pub(crate) fn normal(random: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| uniform(random)).sum::<f64>() - 6.0
}

/// A crown's true upper surface: depth = length * (r / radius)^power down to the crown's base.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TrueCrown {
    pub(crate) apex: [f64; 3],
    pub(crate) radius: f64,
    pub(crate) length: f64,
    pub(crate) power: f64,
}

impl TrueCrown {
    /// Depth below the apex, while within the radius.
    pub(crate) fn depth(&self, r: f64) -> f64 {
        self.length * libm::pow(r / self.radius, self.power)
    }

    /// Height of the crown above a position, if it is there.
    pub(crate) fn z(&self, x: f64, y: f64) -> Option<f64> {
        let (dx, dy) = (x - self.apex[0], y - self.apex[1]);
        let r = (dx * dx + dy * dy).sqrt();
        (r <= self.radius).then(|| self.apex[2] - self.depth(r))
    }

    /// A crown of realistic proportions on flat ground at 0: height, and shape from conic to round.
    pub(crate) fn random(random: &mut ChaCha8Rng, x: f64, y: f64) -> Self {
        let height = 12.0 + 20.0 * uniform(random);
        let radius = (0.08 + 0.06 * uniform(random)) * height;
        let length = (0.35 + 0.3 * uniform(random)) * height;
        Self { apex: [x, y, height], radius, length, power: 1.0 + uniform(random) }
    }
}

/// First returns of a stand: jittered grid of `per_m2` points, each on the highest crown (with
/// noise, and a fifth of them deeper inside the crown) or on the ground.
pub(crate) fn scan(
    crowns: &[TrueCrown],
    half_width: f64,
    per_m2: f64,
    random: &mut ChaCha8Rng,
) -> Vec<[f64; 3]> {
    let count = (4.0 * half_width * half_width * per_m2) as usize;
    (0..count)
        .map(|_| {
            let (x, y) = (
                half_width * (2.0 * uniform(random) - 1.0),
                half_width * (2.0 * uniform(random) - 1.0),
            );
            let top = crowns.iter().filter_map(|crown| crown.z(x, y)).fold(0.0, f64::max);
            let deeper = if uniform(random) < 0.2 { 3.0 * uniform(random) } else { 0.0 };
            let z = if top > 0.0 { (top - deeper + 0.1 * normal(random)).max(0.0) } else { 0.0 };
            [x, y, z].map(timberline_pointcloud::frame::quantise)
        })
        .collect()
}

/// A tree at the origin with up to five neighbours at their distance, and its scan; with an echo
/// exactly on the apex if `apex_echo`.
pub(crate) fn stand(seed: u64, per_m2: f64, apex_echo: bool) -> (TrueCrown, Vec<[f64; 3]>) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let target = TrueCrown::random(&mut random, 0.0, 0.0);
    let mut crowns = vec![target];
    let neighbours = (6.0 * uniform(&mut random)) as usize;
    for k in 0..neighbours {
        let (sin, cos) = libm::sincos(1.2566 * k as f64 + uniform(&mut random));
        let mut other = TrueCrown::random(&mut random, 0.0, 0.0);
        let distance = (0.85 + 0.4 * uniform(&mut random)) * (target.radius + other.radius);
        other.apex = [distance * cos, distance * sin, other.apex[2]];
        crowns.push(other);
    }
    let mut points = scan(&crowns, 10.0, per_m2, &mut random);
    if apex_echo {
        points.retain(|p| p[2] < target.apex[2]);
        points.push(target.apex.map(timberline_pointcloud::frame::quantise));
    }
    (target, points)
}

/// The window around a crown's highest echo within half a metre of its axis; that echo's position.
pub(crate) fn window(
    target: &TrueCrown,
    points: &[[f64; 3]],
    half_width: f64,
) -> (Window, [f64; 3]) {
    let near =
        |p: &&[f64; 3]| (p[0] - target.apex[0]).abs() < 0.5 && (p[1] - target.apex[1]).abs() < 0.5;
    let apex = points
        .iter()
        .filter(near)
        .fold(target.apex.map(|v| v - 1.0), |best, p| if p[2] > best[2] { *p } else { best });
    let inside =
        |p: &[f64; 3]| (p[0] - apex[0]).abs() <= half_width && (p[1] - apex[1]).abs() <= half_width;
    let seen = points.iter().enumerate().filter(|(_, p)| inside(p));
    let window =
        Window::new(seen.map(|(i, p)| {
            (i as u32, [p[0] - apex[0], p[1] - apex[1], p[2] - apex[2]], p[2] > 1.0)
        }));
    (window, apex)
}

/// Root mean square difference of a model's surface to the true one over the true crown, area
/// weighted, m. `apex_drop` is how far the model's apex lies below the true one.
pub(crate) fn surface_rmse(model: &Model, truth: &TrueCrown, apex_drop: f64) -> f64 {
    const RINGS: usize = 100;
    let (mut sum, mut weight) = (0.0, 0.0);
    for k in 0..RINGS {
        let r = truth.radius * (k as f64 + 0.5) / RINGS as f64;
        let off = model.depth(r) + apex_drop - truth.depth(r);
        sum += off * off * r;
        weight += r;
    }
    (sum / weight).sqrt()
}

//! Crowns for the tests beside the solvers.

use super::bounds::{AxisBounds, Limits};
use super::problem::Cell;
use super::scale::Scaled;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// Cells over a noisy elliptic paraboloid with outliers below.
pub(super) fn crown(seed: u64, bounds: AxisBounds, omega: f64) -> Scaled {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let count = 20 + (seed * 37) % 200;
    let mut draw = |low: f64, high: f64| low + (high - low) * uniform(&mut random);
    let (a, b, c) = (draw(0.05, 1.5), draw(0.05, 1.5), draw(-0.3, 0.3));
    let (x0, y0, share) = (draw(-1.5, 1.5), draw(-1.5, 1.5), draw(0.0, 0.3));
    let cells: Vec<Cell> = (0..count)
        .map(|_| {
            let (x, y) = (draw(-3.0, 3.0), draw(-3.0, 3.0));
            let (dx, dy) = (x - x0, y - y0);
            let fall = a * dx * dx + b * dy * dy + c * dx * dy + draw(-0.3, 0.3);
            let z = if draw(0.0, 1.0) < share { draw(-12.0, 0.0) } else { -fall };
            [x, y, z, if seed.is_multiple_of(3) { draw(0.5, 2.0) } else { 1.0 }]
        })
        .collect();
    Scaled::new(&cells, Limits::new(bounds, omega).unwrap())
}

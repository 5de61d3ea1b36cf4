//! What a problem allows and what it costs, told independently of the solvers.

use super::problems::{Case, between, pick};
use rand_chacha::ChaCha8Rng;
use timberline_crowns::surface::{AxisBounds, Paraboloid, Shape};

/// A paraboloid's two curvatures: their mean, and half of what lies between.
#[derive(Debug, Clone, Copy)]
struct Curvatures {
    mean: f64,
    half: f64,
}

/// The constant of C4 (Polewski et al., eq 15).
fn mu(omega: f64, largest_m: f64) -> f64 {
    2.0 / (largest_m * largest_m) * ((1.0 + omega) / (1.0 - omega)).sqrt()
}

impl Curvatures {
    fn of(surface: &Paraboloid) -> Self {
        let [p0, p1, p2, ..] = surface.phi;
        Self { mean: -0.5 * (p0 + p1), half: 0.5 * libm::hypot(p0 - p1, p2) }
    }

    /// Violation of C3 and of the bounds on the axes, relative to the curvature.
    fn violation(&self, case: &Case) -> f64 {
        let Self { mean, half } = *self;
        let imbalance = half - case.omega * mean;
        let bounds = match case.bounds {
            AxisBounds::Exact { smallest_m, largest_m } => (1.0 / (largest_m * largest_m) + half
                - mean)
                .max(mean + half - 1.0 / (smallest_m * smallest_m)),
            AxisBounds::Paper { largest_m } => {
                libm::hypot(half, 0.5 * mu(case.omega, largest_m)) - mean
            }
        };
        imbalance.max(bounds) / mean.abs()
    }

    /// The nearest in some sense that the problem allows.
    fn allowed(self, case: &Case) -> Self {
        let (mean, most) = match case.bounds {
            AxisBounds::Exact { smallest_m, largest_m } => {
                let [high, low] = [smallest_m, largest_m].map(|axis| 1.0 / (axis * axis));
                let mean = self.mean.clamp(low, high);
                (mean, (mean - low).min(high - mean))
            }
            AxisBounds::Paper { largest_m } => {
                let least = 0.5 * mu(case.omega, largest_m);
                let mean = self.mean.max(least);
                (mean, (mean * mean - least * least).max(0.0).sqrt())
            }
        };
        Self { mean, half: self.half.min(most).min(case.omega * mean).max(0.0) }
    }
}

/// The largest violation of any constraint: of the shape relative, of the prior box in metres.
pub(crate) fn violation(case: &Case, surface: &Paraboloid) -> f64 {
    let centre = surface.centre();
    let outside = case.prior.map_or(f64::NEG_INFINITY, |prior| {
        let off = |axis: usize| (centre[axis] - prior.centre[axis]).abs() - prior.half_width_m;
        off(0).max(off(1))
    });
    Curvatures::of(surface).violation(case).max(outside)
}

/// Weighted sum of absolute vertical residuals, m.
pub(crate) fn objective(case: &Case, surface: &Paraboloid) -> f64 {
    let cost = |(i, c): (usize, &[f64; 3])| case.weight(i) * (surface.z(c[0], c[1]) - c[2]).abs();
    case.cells.iter().enumerate().map(cost).sum()
}

/// A surface about the size of an objective's rounding, m: what relative differences are of at
/// least, so that an exact fit can be compared as well.
pub(crate) fn least_objective(case: &Case) -> f64 {
    let count = case.cells.len() as f64;
    let mean = case.cells.iter().map(|cell| cell[2]).sum::<f64>() / count;
    let square = |cell: &[f64; 3]| (cell[2] - mean) * (cell[2] - mean);
    0.1 * (case.cells.iter().map(square).sum::<f64>() / count).sqrt()
}

/// The surface moved to what the problem allows, with the height that costs least.
pub(crate) fn projected(case: &Case, shape: &Shape) -> Paraboloid {
    let [low, high] = shape.semiaxes_m.map(|axis| 1.0 / (axis * axis));
    let wanted = Curvatures { mean: 0.5 * (low + high), half: 0.5 * (high - low).abs() };
    let Curvatures { mean, half } = wanted.allowed(case);
    let centre = case.prior.map_or(shape.centre, |prior| {
        [0, 1].map(|axis| {
            let (at, reach) = (prior.centre[axis], prior.half_width_m);
            shape.centre[axis].clamp(at - reach, at + reach)
        })
    });
    let semiaxes_m = [mean - half, mean + half].map(|curvature| 1.0 / curvature.sqrt());
    let flat = Shape { centre, apex_z_m: 0.0, semiaxes_m, azimuth: shape.azimuth };
    let apex_z_m = best_height(case, &Paraboloid::from_shape(&flat));
    Paraboloid::from_shape(&Shape { apex_z_m, ..flat })
}

/// Weighted median of what a surface lacks.
fn best_height(case: &Case, surface: &Paraboloid) -> f64 {
    let mut lacks: Vec<(f64, f64)> = case
        .cells
        .iter()
        .enumerate()
        .map(|(i, cell)| (cell[2] - surface.z(cell[0], cell[1]), case.weight(i)))
        .collect();
    lacks.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * lacks.iter().map(|lack| lack.1).sum::<f64>();
    let mut below = 0.0;
    for (lack, weight) in lacks {
        below += weight;
        if below >= half {
            return lack;
        }
    }
    0.0
}

/// A surface like another one, a little or very different.
pub(crate) fn perturbed(shape: &Shape, random: &mut ChaCha8Rng) -> Shape {
    let size = pick(random, &[1e-6, 1e-4, 0.01, 0.1, 1.0]);
    let mut by = |value: f64| value * libm::exp(between(random, -size, size));
    let [long, short] = shape.semiaxes_m.map(&mut by);
    let semiaxes_m = [long.max(short), long.min(short)];
    let centre = shape.centre.map(|value| value + between(random, -size, size));
    let azimuth = shape.azimuth + between(random, -3.0, 3.0) * size;
    Shape { centre, apex_z_m: 0.0, semiaxes_m, azimuth }
}

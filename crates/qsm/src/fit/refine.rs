//! Levenberg-Marquardt with redescending weights.

use super::candidates::{Circle, cut_m};
use super::{Expected, Sample};
use nalgebra::{SMatrix, SVector};

/// Offset (2), slope (2) and radius.
type Vector = SVector<f64, 5>;
type Matrix = SMatrix<f64, 5, 5>;

/// Tukey's constant for 95 % efficiency on normal residuals (Beaton and Tukey 1974).
const TUKEY: f64 = 4.685;
/// With that constant, normal residuals e of unit variance have E[w e^2] / E[w] = 1 / 1.207.
const TUKEY_VARIANCE: f64 = 1.207;
/// From the median of absolute deviations to the standard deviation of a normal distribution.
const MAD_TO_SD: f64 = 1.4826;
/// Expected standard deviation of the axis' slope against the skeleton, m/m: with few or short
/// evidence the direction stays the skeleton's.
const SLOPE_SD: f64 = 0.1;
/// Rounds of weights, and steps in all.
const ROUNDS: usize = 14;
/// Rounds with the widest scale, and rounds after which the scale stays.
const WIDE: usize = 2;
const SETTLED: usize = 7;
/// Steps below this share of the noise end the search.
const SMALL_STEP: f64 = 1e-3;
/// The scale of residuals is at least this share of the expected noise: a few points happen to agree.
const LEAST_SCALE: f64 = 0.5;

/// A cylinder with the covariance of its parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// Offset, slope, radius as in [`super::Fit`], not yet corrected for bias.
    pub parameters: [f64; 5],
    /// Standard deviation of the points across the surface, m.
    pub noise_m: f64,
    /// Scale of the last weights, m.
    pub scale_m: f64,
    /// Standard errors of the parameters.
    pub sd: [f64; 5],
}

/// Residual of a sample (outside positive, m) and its derivatives by the parameters.
#[must_use]
pub fn residual(parameters: &[f64; 5], sample: &Sample) -> (f64, [f64; 5]) {
    let [x, y, slope_x, slope_y, radius] = *parameters;
    let length = (1.0 + slope_x * slope_x + slope_y * slope_y).sqrt();
    let u = [slope_x / length, slope_y / length, 1.0 / length];
    let p = [sample.across_m[0] - x, sample.across_m[1] - y, sample.along_m];
    let along = p[0] * u[0] + p[1] * u[1] + p[2] * u[2];
    let q = [p[0] - along * u[0], p[1] - along * u[1], p[2] - along * u[2]];
    let distance = (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]).sqrt();
    let e = if distance > 0.0 { [q[0] / distance, q[1] / distance] } else { [0.0; 2] };
    let lever = along / length;
    (distance - radius, [-e[0], -e[1], -lever * e[0], -lever * e[1], -1.0])
}

/// Tukey's weight of a residual in units of the scale.
fn tukey(e: f64) -> f64 {
    let u = e / TUKEY;
    if u.abs() >= 1.0 { 0.0 } else { (1.0 - u * u) * (1.0 - u * u) }
}

/// The sums that a step is made of.
struct Normal {
    matrix: Matrix,
    gradient: Vector,
    squares: f64,
    weight: f64,
}

fn normal(samples: &[Sample], parameters: &[f64; 5], scale: f64) -> Normal {
    let mut sums =
        Normal { matrix: Matrix::zeros(), gradient: Vector::zeros(), squares: 0.0, weight: 0.0 };
    for sample in samples {
        let (e, j) = residual(parameters, sample);
        let w = sample.weight * tukey(e / scale);
        if w <= 0.0 {
            continue;
        }
        sums.weight += w;
        sums.squares += w * e * e;
        for row in 0..5 {
            let wj = w * j[row];
            sums.gradient[row] += wj * e;
            for column in 0..=row {
                sums.matrix[(row, column)] += wj * j[column];
            }
        }
    }
    for row in 0..5 {
        for column in 0..row {
            sums.matrix[(column, row)] = sums.matrix[(row, column)];
        }
    }
    sums
}

/// Adds what is expected of the slope, in the unit of squared residuals.
fn with_prior(mut sums: Normal, parameters: &[f64; 5], noise: f64) -> Normal {
    let strength = noise * noise / (SLOPE_SD * SLOPE_SD);
    for axis in [2, 3] {
        sums.matrix[(axis, axis)] += strength;
        sums.gradient[axis] += strength * parameters[axis];
    }
    sums
}

/// Scale of the residuals that lie within reach: their median absolute value.
fn scale(samples: &[Sample], parameters: &[f64; 5], reach: f64, expected: &Expected) -> f64 {
    let mut near: Vec<f64> = samples
        .iter()
        .map(|sample| residual(parameters, sample).0.abs())
        .filter(|e| *e < reach)
        .collect();
    let least = LEAST_SCALE * expected.noise_m;
    if near.len() < 3 {
        return expected.noise_m.max(least);
    }
    let middle = near.len() / 2;
    let (_, median, _) = near.select_nth_unstable_by(middle, f64::total_cmp);
    // Residuals of a fit with five parameters are smaller than the noise.
    let few = near_correction(samples.len());
    (MAD_TO_SD * *median * few).clamp(least, (reach / 2.0).max(least))
}

/// How much smaller the residuals of n points are after three to five parameters were fitted.
fn near_correction(len: usize) -> f64 {
    let n = len as f64;
    (n / (n - 4.0).max(1.5)).sqrt()
}

/// Refines a circle to a cylinder. None where the points determine none.
#[must_use]
pub fn refine(samples: &[Sample], start: Circle, expected: &Expected) -> Option<Cylinder> {
    let mut at = [start.centre_m[0], start.centre_m[1], 0.0, 0.0, start.radius_m];
    let reach = 2.0 * cut_m(expected);
    let (mut spread, mut damping) = (0.5 * reach, 1e-3);
    for round in 0..ROUNDS {
        // From wide to narrow, so that an axis that leans away from the skeleton is found; then the
        // scale is left alone, for changing it for ever would keep the search going.
        if round == WIDE {
            spread *= 0.5;
        } else if (WIDE + 1..SETTLED).contains(&round) {
            spread = scale(samples, &at, reach, expected);
        }
        let moved = step(samples, &mut at, spread, &mut damping)?;
        if moved < SMALL_STEP * expected.noise_m && round >= SETTLED {
            break;
        }
    }
    finish(samples, at, spread, expected)
}

/// One step that lowers the weighted squares; how far it went, m.
fn step(samples: &[Sample], at: &mut [f64; 5], spread: f64, damping: &mut f64) -> Option<f64> {
    let sums = with_prior(normal(samples, at, spread), at, spread);
    let before = loss(samples, at, spread);
    for _ in 0..6 {
        let mut damped = sums.matrix;
        for axis in 0..5 {
            damped[(axis, axis)] += *damping * sums.matrix[(axis, axis)] + f64::MIN_POSITIVE;
        }
        let change = damped.cholesky()?.solve(&sums.gradient);
        let next: [f64; 5] = std::array::from_fn(|axis| at[axis] - change[axis]);
        if next[4] > 0.0 && loss(samples, &next, spread) <= before {
            *at = next;
            *damping = (*damping * 0.2).max(1e-9);
            return Some(change.norm());
        }
        *damping *= 8.0;
    }
    Some(0.0)
}

/// Tukey's loss with the prior of the slope, in units of the squared scale.
fn loss(samples: &[Sample], at: &[f64; 5], spread: f64) -> f64 {
    let most = TUKEY * TUKEY / 6.0;
    let one = |sample: &Sample| {
        let u = residual(at, sample).0 / (spread * TUKEY);
        let inside = 1.0 - (u * u).min(1.0);
        sample.weight * most * (1.0 - inside * inside * inside)
    };
    let prior = (at[2] * at[2] + at[3] * at[3]) / (2.0 * SLOPE_SD * SLOPE_SD);
    samples.iter().map(one).sum::<f64>() + prior
}

/// Noise and covariance at the solution.
fn finish(
    samples: &[Sample],
    parameters: [f64; 5],
    spread: f64,
    expected: &Expected,
) -> Option<Cylinder> {
    let sums = with_prior(normal(samples, &parameters, spread), &parameters, spread);
    let strength = spread * spread / (SLOPE_SD * SLOPE_SD);
    let inverse = sums.matrix.cholesky()?.inverse();
    // Parameters that the data determine: a slope held by its prior is none.
    let free = 5.0 - strength * (inverse[(2, 2)] + inverse[(3, 3)]);
    let freedom = (expected.noise_weight + sums.weight - free).max(1.0);
    let prior = expected.noise_weight * expected.noise_m * expected.noise_m;
    let variance = (prior + TUKEY_VARIANCE * sums.squares) / freedom;
    let sd = std::array::from_fn(|axis| (variance * inverse[(axis, axis)]).sqrt());
    let noise_m = variance.sqrt();
    let finite = parameters.iter().chain(&sd).all(|value: &f64| value.is_finite());
    finite.then_some(Cylinder { parameters, noise_m, scale_m: spread, sd })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn derivatives_agree_with_differences(
            p in prop::array::uniform5(-0.3f64..0.3), x in -1.0f64..1.0, y in -1.0f64..1.0, t in -0.5f64..0.5,
        ) {
            let sample = Sample { across_m: [x, y], along_m: t, weight: 1.0 };
            let (e, j) = residual(&p, &sample);
            prop_assume!(e + p[4] > 0.05);
            for axis in 0..5 {
                let mut moved = p;
                moved[axis] += 1e-6;
                let slope = (residual(&moved, &sample).0 - e) / 1e-6;
                prop_assert!((slope - j[axis]).abs() < 1e-4, "{axis}: {slope} {}", j[axis]);
            }
        }
    }

    #[test]
    fn the_constants_of_tukey_are_those_of_the_normal_distribution() {
        let (mut weight, mut squares, mut all) = (0.0, 0.0, 0.0);
        for i in -8000..8000 {
            let e = f64::from(i) * 1e-3;
            let density = libm::exp(-0.5 * e * e);
            weight += density * tukey(e);
            squares += density * tukey(e) * e * e;
            all += density;
        }
        assert!((weight / squares - TUKEY_VARIANCE).abs() < 2e-3, "{}", weight / squares);
        assert!((weight / all - 0.915).abs() < 2e-3);
    }
}

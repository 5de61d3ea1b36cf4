//! Logistic regression of second order by Newton's method (iteratively reweighted least squares;
//! McCullagh and Nelder 1989, Generalized Linear Models, section 2.5), with a small ridge.

use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;
use timberline_treetops::score::{logistic, terms};

/// Penalty on the squares of the factors.
const RIDGE: f64 = 2.0;
/// Newton's steps; it converges in about eight.
const MAX_STEPS: usize = 25;
/// Largest change of a factor that is none.
const CONVERGED: f64 = 1e-7;
/// Samples worked off together; sums are taken in their order, whatever the number of threads.
const CHUNK: usize = 1024;

/// What is known about one candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample<const N: usize> {
    /// What it is judged by.
    pub values: [f64; N],
    /// Whether it is right.
    pub is_right: bool,
    /// How much it counts.
    pub weight: f64,
}

/// A fitted model: probability = logistic(constant + factors * terms).
#[derive(Debug, Clone, PartialEq)]
pub struct Regression<const N: usize> {
    /// Mean of each value.
    pub means: [f64; N],
    /// Standard deviation of each value; 1 where it does not vary.
    pub scales: [f64; N],
    /// The constant.
    pub constant: f64,
    /// A factor for every term, see [`terms`].
    pub factors: Vec<f64>,
    /// Mean of the negative logarithm of the likelihood.
    pub loss: f64,
}

impl<const N: usize> Regression<N> {
    /// Fits a model; the optimum is unique.
    #[must_use]
    pub fn fit(samples: &[Sample<N>]) -> Self {
        let (means, scales) = moments(samples);
        let mut model = Self { means, scales, constant: 0.0, factors: Vec::new(), loss: f64::NAN };
        let mut weights = DVector::zeros(1 + N + N * (N + 1) / 2);
        for _ in 0..MAX_STEPS {
            let (gradient, curvature, loss) = model.sums(samples, &weights);
            model.loss = loss / samples.len().max(1) as f64;
            let Some(factor) = Cholesky::new(curvature) else { break };
            let step = factor.solve(&gradient);
            weights += &step;
            if step.amax() < CONVERGED {
                break;
            }
        }
        model.constant = weights[0];
        model.factors = weights.iter().skip(1).copied().collect();
        model
    }

    /// Gradient and curvature of the penalised likelihood and the negative likelihood.
    fn sums(
        &self,
        samples: &[Sample<N>],
        weights: &DVector<f64>,
    ) -> (DVector<f64>, DMatrix<f64>, f64) {
        let parts: Vec<_> =
            samples.par_chunks(CHUNK).map(|chunk| self.sums_of(chunk, weights)).collect();
        let size = weights.len();
        let mut gradient = weights * -RIDGE;
        gradient[0] = 0.0;
        let mut curvature = DMatrix::identity(size, size) * RIDGE;
        curvature[(0, 0)] = 1e-9;
        let mut loss = 0.0;
        for (part_gradient, part_curvature, part_loss) in parts {
            gradient += part_gradient;
            curvature += part_curvature;
            loss += part_loss;
        }
        (gradient, curvature, loss)
    }

    fn sums_of(
        &self,
        samples: &[Sample<N>],
        weights: &DVector<f64>,
    ) -> (DVector<f64>, DMatrix<f64>, f64) {
        let mut rows = DMatrix::zeros(weights.len(), samples.len());
        let mut gradient = DVector::zeros(weights.len());
        let mut loss = 0.0;
        for (mut column, sample) in rows.column_iter_mut().zip(samples) {
            column[0] = 1.0;
            let terms = terms(&sample.values, &self.means, &self.scales);
            column.iter_mut().skip(1).zip(terms).for_each(|(entry, term)| *entry = term);
            let probability = logistic(column.dot(weights));
            let right = f64::from(u8::from(sample.is_right));
            gradient.axpy(sample.weight * (right - probability), &column, 1.0);
            loss -= sample.weight
                * libm::log(
                    if sample.is_right { probability } else { 1.0 - probability }.max(1e-300),
                );
            column *= (sample.weight * probability * (1.0 - probability)).sqrt();
        }
        let curvature = &rows * rows.transpose();
        (gradient, curvature, loss)
    }
}

fn moments<const N: usize>(samples: &[Sample<N>]) -> ([f64; N], [f64; N]) {
    let count = samples.len().max(1) as f64;
    let mean = |i: usize| samples.iter().map(|sample| sample.values[i]).sum::<f64>() / count;
    let means: [f64; N] = std::array::from_fn(mean);
    let scale = |i: usize| {
        let off =
            |sample: &Sample<N>| (sample.values[i] - means[i]) * (sample.values[i] - means[i]);
        let deviation = (samples.iter().map(off).sum::<f64>() / count).sqrt();
        if deviation > 1e-9 { deviation } else { 1.0 }
    };
    (means, std::array::from_fn(scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use timberline_synth::random::{Domain, Stream};

    #[test]
    fn known_factors_are_found() {
        let mut stream = Stream::new(7, Domain::Tree, 1);
        let samples: Vec<Sample<2>> = (0..40_000)
            .map(|_| {
                let values = [stream.normal(), 3.0 + 2.0 * stream.normal()];
                let exponent = 0.5 + values[0] - 0.7 * values[0] * (values[1] - 3.0) / 2.0;
                let is_right = stream.chance(logistic(exponent));
                Sample { values, is_right, weight: 1.0 }
            })
            .collect();
        let found = Regression::fit(&samples);
        let expected = [1.0, 0.0, 0.0, -0.7, 0.0];
        assert!((found.constant - 0.5).abs() < 0.06, "{found:?}");
        for (factor, expected) in found.factors.iter().zip(expected) {
            assert!((factor - expected).abs() < 0.06, "{found:?}");
        }
    }
}

//! Automatic choice of kernel offset and smoothing.
//!
//! Candidates are ratios to the local spacing of the ground points (the kernel is homogeneous, so
//! ratios carry over between densities). Each root square scores every candidate by the leave-one-out
//! errors (Rippa 1999) of some of its patches; scores are pooled over the 3 × 3 root squares around
//! and pulled towards the ratios that are best on average, so that neighbouring patches rarely
//! differ and a square with few points is not led by chance. Since the choice is among discrete
//! candidates, last bits of the eigenvalues behind the scores (see [`crate::dense`]) do not reach the
//! surface, ties aside.

use crate::Error;
use crate::hardy::{Kernel, Sample, Trend};
use crate::loo::LeaveOneOut;

/// Candidate offsets D in units of the spacing.
pub const OFFSETS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];
/// Candidate smoothings λ in units of the spacing.
pub const SMOOTHINGS: [f64; 6] = [0.003, 0.01, 0.03, 0.1, 0.3, 1.0];
/// Number of candidates.
pub const CANDIDATES: usize = OFFSETS.len() * SMOOTHINGS.len();
/// The candidate that is best on average over real scans of 0.1 to 1 ground points per m².
const PRIOR: (usize, usize) = (1, 2);

/// Sum of squared leave-one-out errors per candidate, and the number of errors in each sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scores {
    sums: [f64; CANDIDATES],
    count: f64,
}

impl Default for Scores {
    fn default() -> Self {
        Self { sums: [0.0; CANDIDATES], count: 0.0 }
    }
}

impl Scores {
    /// Adds the errors of one sample at the nodes that `counts` selects.
    ///
    /// # Errors
    /// [`Error::Eigen`], [`Error::NoNodes`].
    pub fn add(
        &mut self,
        sample: Sample<'_>,
        spacing_m: f64,
        counts: impl Fn(usize) -> bool,
    ) -> Result<(), Error> {
        for (i, offset) in OFFSETS.iter().enumerate() {
            let system = LeaveOneOut::new(sample, offset * spacing_m, Trend::Plane)?;
            for (j, smoothing) in SMOOTHINGS.iter().enumerate() {
                let errors = system.errors(smoothing * spacing_m);
                let selected = errors.iter().enumerate().filter(|(node, _)| counts(*node));
                self.sums[i * SMOOTHINGS.len() + j] += selected.map(|(_, e)| e * e).sum::<f64>();
            }
        }
        self.count += (0..sample.len()).filter(|node| counts(*node)).count() as f64;
        Ok(())
    }

    /// Adds the scores of another square.
    pub fn pool(&mut self, other: &Self) {
        self.sums.iter_mut().zip(&other.sums).for_each(|(a, b)| *a += b);
        self.count += other.count;
    }

    /// The best ratios (D, λ) to the spacing: least n ln(mean square) + `prior_weight` × squared
    /// distance from the prior in steps of the candidates.
    #[must_use]
    pub fn best(&self, prior_weight: f64) -> [f64; 2] {
        let cost = |i: usize, j: usize| {
            let steps = (i.abs_diff(PRIOR.0).pow(2) + j.abs_diff(PRIOR.1).pow(2)) as f64;
            let mean = (self.sums[i * SMOOTHINGS.len() + j] / self.count.max(1.0)).max(1e-12);
            self.count * libm::log(mean) + prior_weight * steps
        };
        let mut best = (f64::INFINITY, PRIOR);
        for i in 0..OFFSETS.len() {
            for j in 0..SMOOTHINGS.len() {
                let value = cost(i, j);
                if value < best.0 {
                    best = (value, (i, j));
                }
            }
        }
        [OFFSETS[best.1.0], SMOOTHINGS[best.1.1]]
    }
}

/// The kernel for a patch of a given spacing and ratios.
#[must_use]
pub fn kernel_of(ratios: [f64; 2], spacing_m: f64) -> Kernel {
    Kernel { offset_m: ratios[0] * spacing_m, smoothing_m: ratios[1] * spacing_m }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A bumpy surface on a jittered lattice, with noise of the given size.
    fn scores(noise: f64) -> Scores {
        let jitter = |i: usize| {
            let mut z = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            ((z ^ (z >> 27)) >> 11) as f64 / (1u64 << 53) as f64
        };
        let x: Vec<f64> = (0..144).map(|i| (i % 12) as f64 + 0.6 * jitter(3 * i)).collect();
        let y: Vec<f64> = (0..144).map(|i| (i / 12) as f64 + 0.6 * jitter(3 * i + 1)).collect();
        let z: Vec<f64> = (0..144)
            .map(|i| {
                libm::sin(x[i] / 3.0) * libm::cos(y[i] / 4.0) + noise * (jitter(5 * i + 2) - 0.5)
            })
            .collect();
        let mut scores = Scores::default();
        scores.add(Sample { x: &x, y: &y, z: &z }, 1.0, |_| true).unwrap();
        scores
    }

    #[test]
    fn nothing_known_means_the_usual_kernel() {
        let usual = [OFFSETS[PRIOR.0], SMOOTHINGS[PRIOR.1]];
        assert_eq!(Scores::default().best(40.0), usual);
        assert_eq!(scores(0.5).best(1e9), usual);
    }

    #[test]
    fn smooth_ground_gets_a_wide_kernel_and_noisy_ground_more_smoothing() {
        let (smooth, noisy) = (scores(0.0).best(0.0), scores(0.8).best(0.0));
        assert_eq!(smooth, [2.0, 0.003]);
        assert!(noisy[1] >= 0.3, "{noisy:?}");
    }

    #[test]
    fn pooling_adds() {
        let (mut twice, once) = (scores(0.3), scores(0.3));
        twice.pool(&once);
        assert_eq!(twice.best(0.0), once.best(0.0));
        assert_eq!(twice.count, 288.0);
    }
}

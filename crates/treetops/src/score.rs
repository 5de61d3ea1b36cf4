//! From the evidence about a candidate to the probability that it is the top of a tree.

use crate::evidence::{Evidence, LEN};
use crate::weights::{CONSTANT, FACTORS, MEANS, SCALES};

/// Number of factors: each value, its square, and the products of any two.
pub const TERMS: usize = LEN + LEN * (LEN + 1) / 2;

/// The terms of a logistic regression of second order: the values brought to mean 0 and deviation
/// 1, and all products of two of them.
#[must_use]
pub fn terms<const N: usize>(values: &[f64; N], means: &[f64; N], scales: &[f64; N]) -> Vec<f64> {
    let standard: Vec<f64> = (0..N).map(|i| (values[i] - means[i]) / scales[i]).collect();
    let mut terms = standard.clone();
    for (i, a) in standard.iter().enumerate() {
        terms.extend(standard[i..].iter().map(|b| a * b));
    }
    terms
}

/// The probability of a logistic regression.
#[must_use]
pub fn logistic(exponent: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-exponent))
}

/// The probability that a candidate with this evidence is the top of a tree, on forests like those
/// the weights were found on.
pub(crate) fn score(evidence: &Evidence) -> f64 {
    let terms = terms(evidence, &MEANS, &SCALES);
    let sum = terms.iter().zip(&FACTORS).fold(CONSTANT, |sum, (term, factor)| sum + term * factor);
    logistic(sum)
}

//! How thick a branch is that reaches so far: a power law found on the tree's own measured sections.
//!
//! AdTree takes radius = a reach^1.1 for granted, with a from the stem (Du et al. 2019, section 2.3).
//! Here both are estimated, the exponent drawn towards a given one as far as the tree does not tell.

use crate::measure::median;

/// radius = `factor` reach^`exponent`, both in m, with the scatter of its logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PipeModel {
    /// Radius at a reach of 1 m, m.
    pub factor: f64,
    /// Exponent.
    pub exponent: f64,
    /// Standard deviation of the natural logarithm of a measured radius around the law.
    pub log_scatter: f64,
    /// Number of sections it rests on.
    pub sections: u32,
}

/// A measured section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Longest way to a tip, m.
    pub reach_m: f64,
    /// Radius, m.
    pub radius_m: f64,
    /// Its weight.
    pub weight: f64,
}

/// Standard deviation of exponents between trees.
const EXPONENT_SD: f64 = 0.25;
/// Scatter of logarithms that a law has at least, from few sections, and at most: what lies farther
/// away is no branch.
const SCATTER: [f64; 2] = [0.2, 0.45];
/// Rounds of weights.
const ROUNDS: usize = 8;

impl PipeModel {
    /// Radius at a reach, m.
    #[must_use]
    pub fn radius_m(&self, reach_m: f64) -> f64 {
        self.factor * libm::pow(reach_m.max(1e-3), self.exponent)
    }

    /// The law that the sections show; none without sections. `exponent` is the one expected.
    #[must_use]
    pub fn of(evidence: &[Evidence], exponent: f64) -> Option<Self> {
        let rows: Vec<[f64; 3]> = evidence
            .iter()
            .filter(|row| row.reach_m > 0.0 && row.radius_m > 0.0 && row.weight > 0.0)
            .map(|row| [libm::log(row.reach_m), libm::log(row.radius_m), row.weight])
            .collect();
        let mut offsets: Vec<f64> = rows.iter().map(|[x, y, _]| y - exponent * x).collect();
        let mut line = [median(&mut offsets)?, exponent];
        let mut scatter = SCATTER[0];
        for _ in 0..ROUNDS {
            scatter = spread(&rows, line).clamp(SCATTER[0], SCATTER[1]);
            line = reweighted(&rows, line, scatter, exponent);
        }
        let [log_factor, exponent] = line;
        let sections = rows.len() as u32;
        Some(Self { factor: libm::exp(log_factor), exponent, log_scatter: scatter, sections })
    }
}

/// Robust standard deviation around a line.
fn spread(rows: &[[f64; 3]], [offset, slope]: [f64; 2]) -> f64 {
    let mut off: Vec<f64> = rows.iter().map(|[x, y, _]| (y - offset - slope * x).abs()).collect();
    1.4826 * median(&mut off).unwrap_or(0.0)
}

/// Weighted least squares with Cauchy's weights and what is expected of the slope.
fn reweighted(rows: &[[f64; 3]], line: [f64; 2], scatter: f64, exponent: f64) -> [f64; 2] {
    let (mut sum, mut mx, mut my) = (0.0, 0.0, 0.0);
    let weight = |[x, y, w]: [f64; 3]| {
        let e = (y - line[0] - line[1] * x) / scatter;
        w / (1.0 + e * e)
    };
    for row in rows {
        let w = weight(*row);
        sum += w;
        mx += w * row[0];
        my += w * row[1];
    }
    (mx, my) = (mx / sum, my / sum);
    // What is expected is worth an observation of the slope with its standard deviation; sections of
    // one branch are alike, so that ten of them count as one.
    const ALIKE: f64 = 10.0;
    let prior = ALIKE * scatter * scatter / (EXPONENT_SD * EXPONENT_SD);
    let (mut xx, mut xy) = (prior, prior * exponent);
    for row in rows {
        let w = weight(*row);
        xx += w * (row[0] - mx) * (row[0] - mx);
        xy += w * (row[0] - mx) * (row[1] - my);
    }
    let slope = xy / xx;
    [my - slope * mx, slope]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    fn tree(factor: f64, exponent: f64, count: usize, seed: u64) -> Vec<Evidence> {
        let mut random = Random::new(seed);
        let one = |_| {
            let reach_m = libm::exp(random.between(-1.0, 2.5));
            let wrong = random.unit() < 0.15;
            let log = 0.25 * random.normal() + if wrong { 1.5 } else { 0.0 };
            let radius_m = factor * libm::pow(reach_m, exponent) * libm::exp(log);
            Evidence { reach_m, radius_m, weight: 1.0 }
        };
        (0..count).map(one).collect()
    }

    #[test]
    fn the_law_of_a_tree_is_found() {
        for (factor, exponent) in [(0.01, 0.9), (0.006, 1.4)] {
            let found = PipeModel::of(&tree(factor, exponent, 400, 5), 1.1).unwrap();
            assert!((found.exponent - exponent).abs() < 0.08, "{found:?}");
            assert!((found.factor / factor - 1.0).abs() < 0.15, "{found:?}");
            assert!((0.2..0.4).contains(&found.log_scatter), "{found:?}");
        }
    }

    #[test]
    fn little_evidence_leaves_the_exponent() {
        let found = PipeModel::of(&tree(0.01, 1.1, 3, 1), 1.1).unwrap();
        assert!((found.exponent - 1.1).abs() < 0.2, "{found:?}");
        assert_eq!(PipeModel::of(&[], 1.1), None);
        let one = Evidence { reach_m: 2.0, radius_m: 0.1, weight: 1.0 };
        let found = PipeModel::of(&[one], 1.1).unwrap();
        assert!((found.radius_m(2.0) - 0.1).abs() < 1e-9);
    }
}

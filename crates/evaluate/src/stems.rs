//! Stems of a plot: which are found, and how well their diameters are known.

use crate::matching::{MatchParams, MatchRule, Matching, match_trees};
use crate::stats::ErrorStats;
use crate::{Error, Tree};
use serde::{Deserialize, Serialize};

/// A stem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stem {
    /// Its id, unique in its list.
    pub id: u64,
    /// Where it stands, m.
    pub at_m: [f64; 2],
    /// Diameter at breast height, m; NaN where it is not known.
    pub dbh_m: f64,
    /// Height, m; NaN where it is not known.
    pub height_m: f64,
}

/// How the stems of a plot compare with the truth.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StemAccuracy {
    /// True stems.
    pub reference: usize,
    /// Detected stems.
    pub detected: usize,
    /// Pairs.
    pub matched: usize,
    /// Distance between partners in the plane, m.
    pub position_m: ErrorStats,
    /// Detected less true diameter of partners, m.
    pub dbh_m: ErrorStats,
    /// Detected less true height of partners, m.
    pub height_m: ErrorStats,
    /// Who belongs to whom.
    pub matching: Matching,
}

impl StemAccuracy {
    /// Share of the true stems that are found; none without true stems.
    #[must_use]
    pub fn recall(&self) -> Option<f64> {
        share(self.matched, self.reference)
    }

    /// Share of the detected stems that are true; none without detected stems.
    #[must_use]
    pub fn precision(&self) -> Option<f64> {
        share(self.matched, self.detected)
    }
}

fn share(part: usize, of: usize) -> Option<f64> {
    (of > 0).then(|| part as f64 / of as f64)
}

/// Matches detected with true stems one to one, as many as possible within a distance, and compares the
/// partners. Diameters do not decide who belongs to whom: an error in them must not look like a miss.
///
/// # Errors
/// As [`match_trees`].
pub fn assess_stems(
    reference: &[Stem],
    detected: &[Stem],
    max_distance_m: f64,
) -> Result<StemAccuracy, Error> {
    let place = |stem: &Stem| Tree { id: stem.id, at_m: stem.at_m, ..Tree::default() };
    let trees = |stems: &[Stem]| stems.iter().map(place).collect::<Vec<_>>();
    let params =
        MatchParams { max_distance_m, max_height_difference_m: None, rule: MatchRule::Optimal };
    let matching = match_trees(&trees(reference), &trees(detected), &params)?;
    let pairs = || matching.pairs.iter().map(|p| (&detected[p.detected], &reference[p.reference]));
    Ok(StemAccuracy {
        reference: reference.len(),
        detected: detected.len(),
        matched: matching.pairs.len(),
        position_m: ErrorStats::of(matching.pairs.iter().map(|pair| pair.distance_m)),
        dbh_m: ErrorStats::between(pairs().map(|(found, truth)| (found.dbh_m, truth.dbh_m))),
        height_m: ErrorStats::between(
            pairs().map(|(found, truth)| (found.height_m, truth.height_m)),
        ),
        matching,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stem(id: u64, x: f64, dbh_m: f64) -> Stem {
        Stem { id, at_m: [x, 0.0], dbh_m, height_m: 20.0 }
    }

    #[test]
    fn recall_precision_and_errors() {
        let truth = [stem(1, 0.0, 0.30), stem(2, 4.0, 0.20), stem(3, 8.0, 0.25)];
        let found =
            [stem(9, 4.1, 0.22), stem(8, 0.1, 0.29), stem(7, 20.0, 0.5), stem(6, 8.0, f64::NAN)];
        let accuracy = assess_stems(&truth, &found, 0.5).unwrap();
        assert_eq!((accuracy.recall(), accuracy.precision()), (Some(1.0), Some(0.75)));
        assert_eq!(accuracy.dbh_m.n, 2);
        assert!((accuracy.dbh_m.bias - 0.005).abs() < 1e-12);
        assert!((accuracy.dbh_m.rmse - 0.000_25f64.sqrt()).abs() < 1e-12);
        assert_eq!(accuracy.height_m.max_abs, 0.0);
        assert_eq!(accuracy.matching.false_alarms, [2]);
    }

    #[test]
    fn a_plot_without_stems() {
        let accuracy = assess_stems(&[], &[], 0.5).unwrap();
        assert_eq!((accuracy.recall(), accuracy.precision()), (None, None));
        assert!(assess_stems(&[stem(1, f64::NAN, 0.1)], &[], 0.5).is_err());
        assert!(assess_stems(&[], &[], -0.5).is_err());
    }
}

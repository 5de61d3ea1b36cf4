//! Statistics of errors.

use serde::{Deserialize, Serialize};

/// Statistics of a set of errors (measured minus true), in the unit of the errors.
///
/// Values that are not finite are left out. Quantiles interpolate linearly between order statistics
/// (type 7 of Hyndman and Fan 1996). Of no errors at all every statistic is 0 and `n` is 0.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct ErrorStats {
    /// Number of errors.
    pub n: usize,
    /// Mean.
    pub bias: f64,
    /// Median.
    pub median: f64,
    /// Root of the mean square.
    pub rmse: f64,
    /// Median of the absolute errors.
    pub median_abs: f64,
    /// 95th percentile of the absolute errors.
    pub p95_abs: f64,
    /// Largest absolute error.
    pub max_abs: f64,
}

impl ErrorStats {
    /// Statistics of errors, in whatever order.
    #[must_use]
    pub fn of(errors: impl IntoIterator<Item = f64>) -> Self {
        let mut signed: Vec<f64> = errors.into_iter().filter(|e| e.is_finite()).collect();
        if signed.is_empty() {
            return Self::default();
        }
        signed.sort_unstable_by(f64::total_cmp);
        let mut absolute: Vec<f64> = signed.iter().map(|e| e.abs()).collect();
        absolute.sort_unstable_by(f64::total_cmp);
        let n = signed.len();
        // Sums run over sorted values: the same bits for any order of input.
        let squares: f64 = absolute.iter().map(|e| e * e).sum();
        Self {
            n,
            bias: signed.iter().sum::<f64>() / n as f64,
            median: quantile(&signed, 0.5),
            rmse: (squares / n as f64).sqrt(),
            median_abs: quantile(&absolute, 0.5),
            p95_abs: quantile(&absolute, 0.95),
            max_abs: absolute[n - 1],
        }
    }

    /// Statistics of estimates against truth, pair by pair, for example a terrain model at check
    /// points; pairs with a value that is not finite are left out.
    #[must_use]
    pub fn between(pairs: impl IntoIterator<Item = (f64, f64)>) -> Self {
        Self::of(pairs.into_iter().map(|(estimate, truth)| estimate - truth))
    }
}

/// Quantile of ascending values, `share` in 0 to 1; 0 of none.
#[must_use]
pub fn quantile(ascending: &[f64], share: f64) -> f64 {
    let Some(last) = ascending.len().checked_sub(1) else { return 0.0 };
    let place = share.clamp(0.0, 1.0) * last as f64;
    let low = place.floor() as usize;
    let high = (low + 1).min(last);
    ascending[low] + (place - low as f64) * (ascending[high] - ascending[low])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        let stats = ErrorStats::of([3.0, -1.0, f64::NAN, 0.0, -2.0]);
        let expected = ErrorStats {
            n: 4,
            bias: 0.0,
            median: -0.5,
            rmse: 3.5f64.sqrt(),
            median_abs: 1.5,
            p95_abs: 2.85,
            max_abs: 3.0,
        };
        assert!((stats.p95_abs - expected.p95_abs).abs() < 1e-12);
        assert_eq!(ErrorStats { p95_abs: expected.p95_abs, ..stats }, expected);
    }

    #[test]
    fn of_nothing() {
        assert_eq!(ErrorStats::of([]), ErrorStats::default());
        assert_eq!(ErrorStats::between([(1.0, f64::NAN)]).n, 0);
    }

    #[test]
    fn quantiles_interpolate() {
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.75), 3.0);
        assert_eq!(quantile(&[5.0], 0.3), 5.0);
        assert_eq!(quantile(&[], 0.3), 0.0);
    }
}

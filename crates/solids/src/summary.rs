//! Many distances in five numbers.

use serde::{Deserialize, Serialize};

/// What describes many distances; always reported together, for each alone can be made small.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct DistanceSummary {
    /// How many.
    pub count: u64,
    /// Mean, m.
    pub mean_m: f64,
    /// Root of the mean square, m.
    pub rms_m: f64,
    /// 95th percentile, interpolated linearly between the two nearest ranks, m.
    pub p95_m: f64,
    /// Largest, m.
    pub max_m: f64,
}

impl DistanceSummary {
    /// The summary of some distances, which are left sorted; those that are not finite are taken out.
    /// Of no distances all is 0. The order in which they are given does not matter, not even for the
    /// last bit.
    #[must_use]
    pub fn of(distances_m: &mut Vec<f64>) -> Self {
        distances_m.retain(|distance| distance.is_finite());
        distances_m.sort_unstable_by(f64::total_cmp);
        let (Some(max_m), count) = (distances_m.last().copied(), distances_m.len()) else {
            return Self::default();
        };
        let sum: f64 = distances_m.iter().sum();
        let squares: f64 = distances_m.iter().map(|distance| distance * distance).sum();
        Self {
            count: count as u64,
            mean_m: sum / count as f64,
            rms_m: (squares / count as f64).sqrt(),
            p95_m: quantile_sorted(distances_m, 0.95),
            max_m,
        }
    }
}

/// The quantile of sorted values, interpolated linearly between the two nearest ranks; NaN of none.
#[must_use]
pub fn quantile_sorted(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let rank = share.clamp(0.0, 1.0) * last as f64;
    let below = (rank.floor() as usize).min(last);
    let above = (below + 1).min(last);
    sorted[below] + (sorted[above] - sorted[below]) * (rank - below as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_numbers() {
        let summary = DistanceSummary::of(&mut vec![3.0, 1.0, f64::NAN, 2.0, 4.0, 0.0]);
        assert_eq!((summary.count, summary.mean_m, summary.max_m), (5, 2.0, 4.0));
        assert_eq!(summary.rms_m, 6.0f64.sqrt());
        // numpy.percentile([0, 1, 2, 3, 4], 95)
        assert!((summary.p95_m - 3.8).abs() < 1e-12);
        assert_eq!(DistanceSummary::of(&mut Vec::new()), DistanceSummary::default());
    }

    #[test]
    fn the_order_does_not_matter() {
        let mut values: Vec<f64> =
            (0..1000).map(|i| 0.1 + f64::from(i * 7919 % 1000) / 3.0).collect();
        let one = DistanceSummary::of(&mut values.clone());
        values.reverse();
        assert_eq!(DistanceSummary::of(&mut values), one);
    }
}

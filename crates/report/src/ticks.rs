//! Round numbers for axes, legends and scale bars.

/// The largest of 1, 2, 5 times a power of ten that is at most `value`.
#[must_use]
pub fn round_below(value: f64) -> f64 {
    if !(value.is_finite() && value > 0.0) {
        return 1.0;
    }
    let mut power = 1.0;
    while power * 10.0 <= value {
        power *= 10.0;
    }
    while power > value {
        power /= 10.0;
    }
    let factor = if power * 5.0 <= value {
        5.0
    } else if power * 2.0 <= value {
        2.0
    } else {
        1.0
    };
    factor * power
}

/// Multiples of a round step from `low` to `high`, about `count` of them.
#[must_use]
pub fn ticks(low: f64, high: f64, count: f64) -> Vec<f64> {
    let step = round_below((high - low) / count.max(1.0) * 1.5);
    let first = (low / step).ceil() as i64;
    let last = (high / step).floor() as i64;
    (first..=last).map(|index| index as f64 * step).take(1000).collect()
}

/// Decimals that a step needs.
#[must_use]
pub fn decimals(step: f64) -> usize {
    (0..6)
        .find(|d| {
            let scaled = step * [1.0, 10.0, 100.0, 1e3, 1e4, 1e5][*d];
            (scaled - scaled.round()).abs() < 1e-6
        })
        .unwrap_or(6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_numbers() {
        let found = [0.0047, 0.3, 1.0, 1.99, 4.9, 77.0, 100.0, 12_345.0].map(round_below);
        let wanted = [0.002, 0.2, 1.0, 1.0, 2.0, 50.0, 100.0, 10_000.0];
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found - wanted).abs() < 1e-9 * wanted, "{found} {wanted}");
        }
        assert_eq!(round_below(f64::NAN), 1.0);
    }

    #[test]
    fn ticks_lie_inside() {
        assert_eq!(ticks(0.0, 32.5, 5.0), [0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0]);
        assert_eq!(
            ticks(481_216.0, 481_316.0, 4.0),
            [481_220.0, 481_240.0, 481_260.0, 481_280.0, 481_300.0]
        );
        assert_eq!([decimals(5.0), decimals(0.5), decimals(0.02)], [0, 1, 2]);
    }
}

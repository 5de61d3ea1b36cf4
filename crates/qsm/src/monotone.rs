//! Regression by functions that never rise (isotonic regression, Ayer et al. 1955; pool adjacent
//! violators).

/// A run of equal fitted values.
#[derive(Debug, Clone, Copy)]
struct Block {
    value: f64,
    weight: f64,
    len: usize,
}

/// Least squares by a function that never rises. Weights are positive; those of 0 count as nearly so.
#[must_use]
pub fn decreasing(values: &[f64], weights: &[f64]) -> Vec<f64> {
    let mut blocks: Vec<Block> = Vec::with_capacity(values.len());
    for (&value, &weight) in values.iter().zip(weights) {
        let mut block = Block { value, weight: weight.max(f64::MIN_POSITIVE), len: 1 };
        while let Some(before) = blocks.pop_if(|before| before.value < block.value) {
            let weight = before.weight + block.weight;
            let value = before.value + (block.value - before.value) * (block.weight / weight);
            block = Block { value, weight, len: before.len + block.len };
        }
        blocks.push(block);
    }
    blocks.iter().flat_map(|block| std::iter::repeat_n(block.value, block.len)).collect()
}

/// Least absolute deviations by a function that never rises: in blocks the weighted median.
#[must_use]
pub fn decreasing_median(values: &[f64], weights: &[f64]) -> Vec<f64> {
    // Where each block begins, and its median.
    let mut blocks: Vec<(usize, f64)> = Vec::new();
    for (place, &value) in values.iter().enumerate() {
        let (mut begin, mut middle) = (place, value);
        while let Some((earlier, _)) = blocks.pop_if(|before| before.1 < middle) {
            begin = earlier;
            middle = weighted_median(&values[begin..=place], &weights[begin..=place]);
        }
        blocks.push((begin, middle));
    }
    let mut fitted = Vec::with_capacity(values.len());
    for (number, &(begin, middle)) in blocks.iter().enumerate() {
        let end = blocks.get(number + 1).map_or(values.len(), |next| next.0);
        fitted.extend(std::iter::repeat_n(middle, end - begin));
    }
    fitted
}

/// The value at which half of the weight is reached; 0 of no values.
#[must_use]
pub fn weighted_median(values: &[f64], weights: &[f64]) -> f64 {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_unstable_by(|a, b| values[*a].total_cmp(&values[*b]).then(a.cmp(b)));
    let half = 0.5 * weights.iter().sum::<f64>();
    let mut sum = 0.0;
    for &place in &order {
        sum += weights[place];
        if sum >= half {
            return values[place];
        }
    }
    order.last().map_or(0.0, |last| values[*last])
}

/// A function that never rises through values with standard errors, some of which are wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Robust {
    /// The fitted values.
    pub fitted: Vec<f64>,
    /// Weight of each value against what its standard error says, 0 for outliers.
    pub trust: Vec<f64>,
    /// What values scatter beyond their standard errors.
    pub scatter: f64,
}

/// Rounds of weights.
const ROUNDS: usize = 4;
/// Tukey's constant (Beaton and Tukey 1974).
const TUKEY: f64 = 4.685;

/// Starts from least absolute deviations, then repeats least squares with Tukey's weights.
#[must_use]
pub fn robust_decreasing(values: &[f64], sds: &[f64]) -> Robust {
    let start: Vec<f64> = sds.iter().map(|sd| 1.0 / sd).collect();
    let mut fitted = decreasing_median(values, &start);
    let mut trust = vec![1.0; values.len()];
    let mut scatter = 0.0;
    for _ in 0..ROUNDS {
        scatter = extra_scatter(values, sds, &fitted);
        let mut weights = Vec::with_capacity(values.len());
        for place in 0..values.len() {
            let variance = sds[place] * sds[place] + scatter * scatter;
            let u = (values[place] - fitted[place]) / (TUKEY * variance.sqrt());
            trust[place] = if u.abs() < 1.0 { (1.0 - u * u) * (1.0 - u * u) } else { 0.0 };
            weights.push(trust[place] / variance);
        }
        fitted = decreasing(values, &weights);
    }
    Robust { fitted, trust, scatter }
}

/// What makes the median deviation as large as it is, beyond the standard errors.
fn extra_scatter(values: &[f64], sds: &[f64], fitted: &[f64]) -> f64 {
    const MAD_TO_SD: f64 = 1.4826;
    let mut off: Vec<f64> = values.iter().zip(fitted).map(|(v, f)| (v - f).abs()).collect();
    let mut expected: Vec<f64> = sds.to_vec();
    let deviation = crate::measure::median(&mut off).unwrap_or(0.0) * MAD_TO_SD;
    let error = crate::measure::median(&mut expected).unwrap_or(0.0);
    (deviation * deviation - error * error).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn violators_are_pooled() {
        let ones = [1.0; 5];
        assert_eq!(decreasing(&[5.0, 3.0, 4.0, 2.0, 1.0], &ones), [5.0, 3.5, 3.5, 2.0, 1.0]);
        assert_eq!(decreasing(&[1.0, 4.0], &[3.0, 1.0]), [1.75, 1.75]);
        let median = decreasing_median(&[5.0, 1.0, 4.0, 4.0, 2.0], &ones);
        assert_eq!(median, [5.0, 4.0, 4.0, 4.0, 2.0]);
    }

    #[test]
    fn one_wrong_value_moves_nothing() {
        let mut values: Vec<f64> = (0..20).map(|i| 0.2 - 0.005 * f64::from(i)).collect();
        values[9] = 0.6;
        values[14] = 0.02;
        let found = robust_decreasing(&values, &[0.004; 20]);
        assert_eq!((found.trust[9], found.trust[14]), (0.0, 0.0));
        for (place, fitted) in found.fitted.iter().enumerate() {
            let truth = 0.2 - 0.005 * place as f64;
            assert!((fitted - truth).abs() < 0.006, "{place}: {fitted} for {truth}");
        }
    }

    proptest! {
        #[test]
        fn never_rising_and_no_worse_than_any_constant(
            rows in prop::collection::vec((0.0f64..1.0, 0.1f64..3.0), 1..40), constant in 0.0f64..1.0,
        ) {
            let (values, weights): (Vec<f64>, Vec<f64>) = rows.into_iter().unzip();
            let squares = |fitted: &[f64]| -> f64 {
                (0..values.len()).map(|i| weights[i] * (values[i] - fitted[i]) * (values[i] - fitted[i])).sum()
            };
            let fitted = decreasing(&values, &weights);
            prop_assert!(fitted.windows(2).all(|pair| pair[0] >= pair[1]));
            prop_assert!(squares(&fitted) <= squares(&vec![constant; values.len()]) + 1e-9);
            let median = decreasing_median(&values, &weights);
            prop_assert!(median.windows(2).all(|pair| pair[0] >= pair[1]));
        }
    }
}

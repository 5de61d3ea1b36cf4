//! Values by rank: where trees may cut them.

use rayon::prelude::*;

/// Most cuts of a value; their numbers and one more fit a byte.
const MOST_CUTS: usize = 255;

/// One value of all samples.
#[derive(Debug)]
pub(crate) struct Column {
    /// Thresholds, ascending.
    pub(crate) cuts: Vec<f32>,
    /// How many thresholds lie below each sample's value; all below what is no number.
    pub(crate) codes: Vec<u8>,
}

/// The columns of values, one row a sample.
pub(crate) fn columns<const N: usize>(values: &[&[f64; N]]) -> Vec<Column> {
    let column = |place: usize| {
        let all: Vec<f64> = values.iter().map(|row| row[place]).collect();
        let cuts = cuts(all.clone());
        let is_above = |value: f64, cut: f32| value.is_nan() || f64::from(cut) < value;
        let code = |value: f64| cuts.partition_point(|cut| is_above(value, *cut)) as u8;
        Column { codes: all.into_iter().map(code).collect(), cuts }
    };
    (0..N).into_par_iter().map(column).collect()
}

/// Thresholds between which there are about as many samples each.
fn cuts(mut values: Vec<f64>) -> Vec<f32> {
    values.sort_unstable_by(f64::total_cmp);
    values.retain(|value| value.is_finite());
    let Some(highest) = values.last().copied() else { return Vec::new() };
    let at = |step: usize| rounded(values[step * values.len() / (MOST_CUTS + 1)]);
    let mut cuts: Vec<f32> = (1..=MOST_CUTS).map(at).collect();
    cuts.dedup();
    cuts.retain(|cut| f64::from(*cut) < highest);
    cuts
}

/// A number of four digits: thresholds are printed.
fn rounded(value: f64) -> f32 {
    format!("{value:.3e}").parse().unwrap_or(value as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_tell_on_which_side_of_every_cut_a_value_lies() {
        let rows: Vec<[f64; 1]> = (0..2000).map(|i| [f64::from(i * 7919 % 2000) / 3.0]).collect();
        let columns = columns(&rows.iter().collect::<Vec<_>>());
        let Column { cuts, codes } = &columns[0];
        assert!(cuts.len() > 200 && cuts.is_sorted());
        for (row, code) in rows.iter().zip(codes) {
            for (place, cut) in cuts.iter().enumerate() {
                assert_eq!(row[0] <= f64::from(*cut), usize::from(*code) <= place);
            }
        }
    }

    #[test]
    fn a_value_that_does_not_vary_has_no_cut() {
        assert_eq!(cuts(vec![3.0; 40]), Vec::<f32>::new());
        assert_eq!(cuts(vec![f64::NAN; 2]), Vec::<f32>::new());
        assert_eq!(cuts(vec![0.0, 1.0]), [0.0]);
    }
}

//! One tree: the leaf that gains most is split until there are enough (best first; Friedman et al.
//! 2000, Additive logistic regression, section 8).

use crate::Params;
use crate::bins::Column;
use rayon::prelude::*;

/// First and second derivative of a sample's loss.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Slope {
    pub(crate) gradient: f64,
    pub(crate) curvature: f64,
}

/// Sums over the samples of a bin or of a leaf.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    slope: Slope,
    count: u32,
}

impl Sum {
    fn add(&mut self, slope: Slope, count: u32) {
        self.slope.gradient += slope.gradient;
        self.slope.curvature += slope.curvature;
        self.count += count;
    }

    fn without(&self, other: &Self) -> Self {
        let slope = Slope {
            gradient: self.slope.gradient - other.slope.gradient,
            curvature: self.slope.curvature - other.slope.curvature,
        };
        Self { slope, count: self.count - other.count }
    }

    /// Twice what the loss falls by when the samples move together as far as is best.
    fn gain(&self, ridge: f64) -> f64 {
        self.slope.gradient * self.slope.gradient / (self.slope.curvature + ridge)
    }
}

/// Where a leaf is best split.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Split {
    gain: f64,
    pub(crate) column: usize,
    pub(crate) cut: usize,
}

/// A leaf while its tree grows.
#[derive(Debug)]
pub(crate) struct Leaf {
    /// Its samples.
    pub(crate) rows: Vec<u32>,
    /// Sums by column and bin.
    histogram: Vec<Vec<Sum>>,
    total: Sum,
    pub(crate) split: Option<Split>,
}

impl Leaf {
    pub(crate) fn new(
        rows: Vec<u32>,
        columns: &[Column],
        slopes: &[Slope],
        params: &Params,
    ) -> Self {
        let histogram = columns.par_iter().map(|column| sums(column, &rows, slopes)).collect();
        Self::with(rows, histogram, params)
    }

    fn with(rows: Vec<u32>, histogram: Vec<Vec<Sum>>, params: &Params) -> Self {
        let mut total = Sum::default();
        histogram.first().into_iter().flatten().for_each(|sum| total.add(sum.slope, sum.count));
        let best = |(place, bins): (usize, &Vec<Sum>)| best(place, bins, &total, params);
        let splits: Vec<Option<Split>> = histogram.par_iter().enumerate().map(best).collect();
        let split = splits.into_iter().flatten().reduce(|a, b| if b.gain > a.gain { b } else { a });
        Self { rows, histogram, total, split }
    }

    /// What the split gains; nothing where there is none.
    pub(crate) fn gain(&self) -> f64 {
        self.split.map_or(0.0, |split| split.gain)
    }

    /// The step that is best for its samples.
    pub(crate) fn step(&self, params: &Params) -> f64 {
        -self.total.slope.gradient / (self.total.slope.curvature + params.ridge)
    }

    /// The two leaves of its split, that of lower values first.
    pub(crate) fn divided(
        self,
        split: Split,
        columns: &[Column],
        slopes: &[Slope],
        params: &Params,
    ) -> [Self; 2] {
        let codes = &columns[split.column].codes;
        let is_below = |row: &u32| usize::from(codes[*row as usize]) <= split.cut;
        let (below, above): (Vec<u32>, Vec<u32>) = self.rows.iter().partition(|row| is_below(row));
        let below_is_less = below.len() < above.len();
        let (less, more) = if below_is_less { (below, above) } else { (above, below) };
        let less = Self::new(less, columns, slopes, params);
        let rest = self.histogram.iter().zip(&less.histogram).map(|(all, part)| {
            all.iter().zip(part).map(|(all, part)| all.without(part)).collect::<Vec<Sum>>()
        });
        let more = Self::with(more, rest.collect(), params);
        if below_is_less { [less, more] } else { [more, less] }
    }
}

/// Sums by bin, added up in the order of the rows.
fn sums(column: &Column, rows: &[u32], slopes: &[Slope]) -> Vec<Sum> {
    let mut sums = vec![Sum::default(); column.cuts.len() + 1];
    for row in rows {
        let row = *row as usize;
        sums[usize::from(column.codes[row])].add(slopes[row], 1);
    }
    sums
}

/// The best cut of a column, the first of equals.
fn best(column: usize, bins: &[Sum], total: &Sum, params: &Params) -> Option<Split> {
    let mut below = Sum::default();
    let mut best: Option<Split> = None;
    for (cut, bin) in bins.iter().enumerate().take(bins.len().saturating_sub(1)) {
        below.add(bin.slope, bin.count);
        let above = total.without(&below);
        if below.count < params.leaf_samples || above.count < params.leaf_samples {
            continue;
        }
        let ridge = params.ridge;
        let gain = below.gain(ridge) + above.gain(ridge) - total.gain(ridge);
        if gain > best.map_or(0.0, |best| best.gain) {
            best = Some(Split { gain, column, cut });
        }
    }
    best
}

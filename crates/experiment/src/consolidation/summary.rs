//! Changes over all trees.

use super::{Assessed, Figures, Mode, Source};
use serde::Serialize;

/// How models from consolidated points differ from those from points as scanned, over trees that have
/// both.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Change {
    /// How trees were modelled.
    pub mode: Mode,
    /// From which points.
    pub source: Source,
    /// Trees with both models.
    pub trees: usize,
    /// Trees whose mean distance from the points to the model became smaller.
    pub better: usize,
    /// Mean over the trees of the relative change of the mean distance from the points to the model.
    pub mean: f64,
    /// The same of the root mean square distance.
    pub rms: f64,
    /// The same of the mean distance from the model to the points.
    pub back: f64,
    /// The largest relative change of the mean distance from the points to the model ...
    pub worst: f64,
    /// ... and its tree.
    pub worst_tree: String,
    /// Mean over the trees of the absolute difference of the diameter at breast height, m, where both have
    /// one.
    pub dbh_m: f64,
}

/// The changes for every mode and source.
#[must_use]
pub fn changes(all: &[Assessed]) -> Vec<Change> {
    let mut changes = Vec::new();
    for mode in Mode::ALL {
        for source in &Source::ALL[1..] {
            changes.extend(change(all, mode, *source));
        }
    }
    changes
}

/// After over before, less one.
pub(super) fn relative(before: f64, after: f64) -> f64 {
    after / before - 1.0
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    values.iter().sum::<f64>() / values.len() as f64
}

fn change(all: &[Assessed], mode: Mode, source: Source) -> Option<Change> {
    let both = |tree: &Assessed| {
        let pair = (*tree.figures(mode, Source::Scanned)?, *tree.figures(mode, source)?);
        Some((tree.name.clone(), pair))
    };
    let pairs: Vec<(String, (Figures, Figures))> = all.iter().filter_map(both).collect();
    let of_mean = |(before, after): &(Figures, Figures)| {
        relative(before.cloud_to_model.mean_m, after.cloud_to_model.mean_m)
    };
    let worst = pairs.iter().max_by(|a, b| of_mean(&a.1).total_cmp(&of_mean(&b.1)))?;
    let each = |value: fn(&Figures) -> f64| {
        mean(pairs.iter().map(|(_, (before, after))| relative(value(before), value(after))))
    };
    let dbh =
        pairs.iter().filter_map(|(_, (before, after))| Some((after.dbh_m? - before.dbh_m?).abs()));
    Some(Change {
        mode,
        source,
        trees: pairs.len(),
        better: pairs.iter().filter(|(_, pair)| of_mean(pair) < 0.0).count(),
        mean: each(|figures| figures.cloud_to_model.mean_m),
        rms: each(|figures| figures.cloud_to_model.rms_m),
        back: each(|figures| figures.model_to_cloud.mean_m),
        worst: of_mean(&worst.1),
        worst_tree: worst.0.clone(),
        dbh_m: mean(dbh),
    })
}

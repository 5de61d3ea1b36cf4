//! A whole experiment: datasets, all methods, figures to compare.

use super::cluster::Cluster;
use super::compare::{Comparison, Row, compare};
use super::dataset::{DatasetParams, generate};
use super::plan::{Bounds, Setting, deltas_m, omegas};
use crate::Error;
use serde::Serialize;
use std::collections::BTreeMap;

/// What an experiment on generated data consists of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Experiment {
    /// Seed; every other gives other trees.
    pub seed: u64,
    /// Trees of a dataset in one repetition.
    pub trees: usize,
    /// Repetitions, each with trees of its own.
    pub repeats: u64,
    /// Edges of the cells to which clusters are thinned, m.
    pub cells_m: Vec<f64>,
    /// The datasets.
    pub datasets: Vec<DatasetParams>,
}

impl Default for Experiment {
    /// The paper's two datasets, five times 110 trees each, cells of 0.4 and 0.5 m.
    fn default() -> Self {
        Self {
            seed: 1,
            trees: 110,
            repeats: 5,
            cells_m: vec![0.4, 0.5],
            datasets: vec![DatasetParams::spruce(), DatasetParams::douglas_fir()],
        }
    }
}

/// Means over the clusters of a dataset: the paper's Table 1.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Facts {
    /// Name of the dataset.
    pub dataset: String,
    /// Clusters.
    pub trees: usize,
    /// Repetitions they come from.
    pub repeats: usize,
    /// Mean height of the trees, m.
    pub height_m: f64,
    /// Mean radius of the smallest circle around a cluster, m.
    pub enclosing_radius_m: f64,
    /// Mean number of points per square metre of a cluster's hull.
    pub density_per_m2: f64,
    /// Mean number of points of a cluster.
    pub points: f64,
    /// Clusters by what is wrong with them.
    pub faults: BTreeMap<&'static str, usize>,
}

impl Facts {
    /// The facts of a dataset. Heights that are not known do not count.
    #[must_use]
    pub fn of(dataset: &str, clusters: &[Cluster]) -> Self {
        let mean = |value: &dyn Fn(&Cluster) -> f64| {
            let known: Vec<f64> = clusters.iter().map(value).filter(|v| v.is_finite()).collect();
            known.iter().sum::<f64>() / known.len() as f64
        };
        let mut faults = BTreeMap::new();
        for fault in clusters.iter().flat_map(|cluster| &cluster.faults) {
            *faults.entry(*fault).or_insert(0) += 1;
        }
        let mut repeats: Vec<u64> = clusters.iter().map(|cluster| cluster.repeat).collect();
        repeats.dedup();
        Self {
            dataset: dataset.to_owned(),
            trees: clusters.len(),
            repeats: repeats.len(),
            height_m: mean(&|cluster| cluster.height_m),
            enclosing_radius_m: mean(&|cluster| cluster.extent().enclosing_radius_m),
            density_per_m2: mean(&|cluster| cluster.extent().density_per_m2),
            points: mean(&|cluster| cluster.points.len() as f64),
            faults,
        }
    }
}

/// All methods over one dataset.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessed {
    /// What the data are like.
    pub facts: Facts,
    /// The clusters.
    pub clusters: Vec<Cluster>,
    /// Every setting with every cell size, tree by tree.
    pub comparisons: Vec<Comparison>,
    /// The same in numbers.
    pub rows: Vec<Row>,
}

/// Runs settings over clusters with references, for every cell size.
///
/// `tick` is called once for every cluster and cell size that is done, from any thread.
///
/// # Errors
/// As [`compare`].
pub fn assess(
    dataset: &str,
    clusters: Vec<Cluster>,
    settings: &[Setting],
    cells_m: &[f64],
    tick: &(dyn Fn() + Sync),
) -> Result<Assessed, Error> {
    let mut comparisons = Vec::with_capacity(settings.len() * cells_m.len());
    for &cell_m in cells_m {
        comparisons.extend(compare(&clusters, settings, cell_m, tick)?);
    }
    let rows = comparisons.iter().map(|one| one.row(dataset, &clusters)).collect();
    Ok(Assessed { facts: Facts::of(dataset, &clusters), clusters, comparisons, rows })
}

impl Experiment {
    /// The clusters of one of the datasets, repetition by repetition.
    ///
    /// # Errors
    /// As [`generate`], and [`Error::Parameter`] for an experiment without trees.
    pub fn clusters(&self, dataset: &DatasetParams) -> Result<Vec<Cluster>, Error> {
        for (name, value) in [("trees", self.trees as f64), ("repeats", self.repeats as f64)] {
            if value < 1.0 {
                return Err(Error::Parameter { name, value, expected: "1 or more" });
            }
        }
        let mut all = Vec::new();
        for repeat in 1..=self.repeats {
            // Repetitions have seeds of their own, and so have experiments.
            let seed = (self.seed << 16) + repeat;
            let own = generate(dataset, self.trees, seed)?;
            all.extend(own.into_iter().map(|cluster| Cluster { repeat, ..cluster }));
        }
        all.iter_mut().zip(1..).for_each(|(cluster, id)| cluster.id = id);
        Ok(all)
    }
}

impl Assessed {
    /// The row of a setting with a cell size.
    #[must_use]
    pub fn row(&self, setting: &Setting, cell_m: f64) -> Option<&Row> {
        self.rows.iter().find(|row| row.setting == *setting && row.cell_m == cell_m)
    }

    fn rows_of(&self, settings: impl IntoIterator<Item = Setting>, cell_m: f64) -> Vec<&Row> {
        settings.into_iter().filter_map(|setting| self.row(&setting, cell_m)).collect()
    }

    /// L1 without a prior over omega.
    #[must_use]
    pub fn over_omega(&self, bounds: Bounds, cell_m: f64) -> Vec<&Row> {
        self.rows_of(omegas().into_iter().map(|omega| Setting::l1(omega, bounds)), cell_m)
    }

    /// L1 with a prior over delta.
    #[must_use]
    pub fn over_delta(&self, free: Setting, cell_m: f64) -> Vec<&Row> {
        self.rows_of(deltas_m().into_iter().map(|delta| free.with_prior(delta)), cell_m)
    }
}

/// The row with the smallest median, the first of equals.
#[must_use]
pub fn best<'a>(rows: &[&'a Row]) -> Option<&'a Row> {
    rows.iter().copied().min_by(|a, b| a.median_m.total_cmp(&b.median_m))
}

//! Runs methods over clusters.

use super::cluster::Cluster;
use super::plan::Setting;
use crate::Error;
use rayon::prelude::*;
use std::collections::BTreeMap;
use timberline_crowns::surface::{Certificate, Fit, Flag, Method, Prior, Problem, thin};
use timberline_evaluate::ErrorStats;
use timberline_evaluate::stats::quantile;

/// What a method made of one cluster.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Position found minus reference, m.
    pub offset_m: [f64; 2],
    /// Whether there is a surface: without one the position is that of the highest cell, except for
    /// methods that never have any.
    pub has_surface: bool,
    /// What is remarkable.
    pub flags: Vec<Flag>,
    /// How good the surface is proved to be.
    pub certificate: Option<Certificate>,
    /// Why the method gave up, if it did; the position is then that of the highest point.
    pub failure: Option<String>,
}

impl Outcome {
    /// Whether the position comes from a surface with an apex.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        self.has_surface && !self.flags.contains(&Flag::NotElliptic)
    }

    /// Distance in the plane from the reference, m.
    #[must_use]
    pub fn error_m(&self) -> f64 {
        let [dx, dy] = self.offset_m;
        (dx * dx + dy * dy).sqrt()
    }
}

/// One method over all clusters of a dataset.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The method and its parameters.
    pub setting: Setting,
    /// Edge of the cells to which clusters are thinned, m.
    pub cell_m: f64,
    /// Outcomes in the order of the clusters.
    pub outcomes: Vec<Outcome>,
}

/// Runs every setting on every cluster, thinned to cells of the given edge. `tick` is called once
/// for every cluster that is done, in any order.
///
/// # Errors
/// [`Error::Cluster`] for clusters without points or with numbers that are not finite,
/// [`Error::Crowns`] for a cell size that is none. A method that gives up is an [`Outcome`].
pub fn compare(
    clusters: &[Cluster],
    settings: &[Setting],
    cell_m: f64,
    tick: &(dyn Fn() + Sync),
) -> Result<Vec<Comparison>, Error> {
    let methods: Vec<Box<dyn Method>> = settings.iter().map(Setting::method).collect();
    let of_cluster = |cluster: &Cluster| -> Result<Vec<Outcome>, Error> {
        let crown = Crown::new(cluster, cell_m)?;
        let each = settings.iter().zip(&methods);
        let outcomes = each.map(|(setting, method)| crown.run(setting, &**method)).collect();
        tick();
        Ok(outcomes)
    };
    let by_cluster: Result<Vec<Vec<Outcome>>, Error> =
        clusters.par_iter().map(of_cluster).collect();
    let mut by_setting: Vec<Vec<Outcome>> = vec![Vec::new(); settings.len()];
    for outcomes in by_cluster? {
        by_setting.iter_mut().zip(outcomes).for_each(|(all, outcome)| all.push(outcome));
    }
    let comparison = |(setting, outcomes)| Comparison { setting, cell_m, outcomes };
    Ok(settings.iter().copied().zip(by_setting).map(comparison).collect())
}

/// A cluster relative to its highest point.
struct Crown {
    points: Vec<[f64; 3]>,
    cells: Vec<[f64; 3]>,
    reference: [f64; 2],
}

impl Crown {
    fn new(cluster: &Cluster, cell_m: f64) -> Result<Self, Error> {
        let fault = |reason| Error::Cluster { id: cluster.id, reason };
        let finite = cluster.points.iter().flatten().chain(&cluster.reference);
        if !finite.into_iter().all(|value| value.is_finite()) {
            return Err(fault("a position is not a finite number"));
        }
        let anchor = cluster.highest().ok_or_else(|| fault("it has no points"))?;
        let cells = thin(cluster.points.iter().copied(), anchor, cell_m)?;
        let relative = |p: &[f64; 3]| std::array::from_fn(|axis| p[axis] - anchor[axis]);
        let points = cluster.points.iter().map(relative).collect();
        let reference = [0, 1].map(|axis| cluster.reference[axis] - anchor[axis]);
        Ok(Self { points, cells, reference })
    }

    fn run(&self, setting: &Setting, method: &dyn Method) -> Outcome {
        let cells = if setting.sees_points() { &self.points } else { &self.cells };
        let mut problem = Problem::new(cells);
        if let Some(half_width_m) = setting.delta_m {
            // The highest point is where the coordinates begin.
            problem = problem.with_prior(Prior { centre: [0.0; 2], half_width_m });
        }
        let (fit, failure) = match method.fit(&problem) {
            Ok(fit) => (fit, None),
            Err(error) => (unfitted(), Some(error.to_string())),
        };
        Outcome {
            offset_m: [0, 1].map(|axis| fit.position[axis] - self.reference[axis]),
            has_surface: fit.surface.is_some(),
            flags: fit.flags,
            certificate: fit.certificate,
            failure,
        }
    }
}

fn unfitted() -> Fit {
    Fit { position: [0.0; 2], surface: None, certificate: None, flags: Vec::new() }
}

/// A comparison in numbers. All lengths are metres.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// Dataset or campaign.
    pub dataset: String,
    /// The method and its parameters.
    #[serde(flatten)]
    pub setting: Setting,
    /// Edge of the cells.
    pub cell_m: f64,
    /// Trees.
    pub trees: usize,
    /// Median distance from the reference: the paper's figure.
    pub median_m: f64,
    /// Smallest and largest median of a repetition of the dataset.
    pub median_range_m: [f64; 2],
    /// Mean distance.
    pub mean_m: f64,
    /// Root of the mean squared distance.
    pub rmse_m: f64,
    /// First and third quartile.
    pub quartiles_m: [f64; 2],
    /// 95th percentile.
    pub p95_m: f64,
    /// Trees with a surface.
    pub surfaces: usize,
    /// Trees for which the method gave up.
    pub failures: usize,
    /// Trees by flag.
    pub flags: BTreeMap<&'static str, usize>,
    /// Largest certified gap relative to the objective; none without certificates.
    pub largest_gap: Option<f64>,
    /// Largest number of convex programs solved for a tree.
    pub most_nodes: Option<u32>,
    /// Mean number of convex programs.
    pub mean_nodes: Option<f64>,
}

impl Comparison {
    /// The comparison in numbers; `clusters` are those it was made of.
    #[must_use]
    pub fn row(&self, dataset: &str, clusters: &[Cluster]) -> Row {
        let errors: Vec<f64> = self.outcomes.iter().map(Outcome::error_m).collect();
        let stats = ErrorStats::of(errors.iter().copied());
        let mut sorted = errors.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let certificates: Vec<&Certificate> =
            self.certified().filter_map(|outcome| outcome.certificate.as_ref()).collect();
        let nodes = certificates.iter().map(|certificate| certificate.nodes);
        let sum: u32 = nodes.clone().sum();
        let mean = || f64::from(sum) / certificates.len() as f64;
        let gaps = certificates.iter().map(|certificate| certificate.relative_gap());
        Row {
            dataset: dataset.to_owned(),
            setting: self.setting,
            cell_m: self.cell_m,
            trees: stats.n,
            median_m: stats.median,
            median_range_m: median_range(&errors, clusters),
            mean_m: stats.bias,
            rmse_m: stats.rmse,
            quartiles_m: [0.25, 0.75].map(|share| quantile(&sorted, share)),
            p95_m: stats.p95_abs,
            surfaces: self.outcomes.iter().filter(|outcome| outcome.has_surface).count(),
            failures: self.outcomes.iter().filter(|outcome| outcome.failure.is_some()).count(),
            flags: self.flags(),
            largest_gap: gaps.reduce(f64::max),
            most_nodes: nodes.max(),
            mean_nodes: (!certificates.is_empty()).then(mean),
        }
    }

    /// Outcomes whose certificate bounds every other surface: those of L1.
    fn certified(&self) -> impl Iterator<Item = &Outcome> {
        let proved = self.setting.family == super::plan::Family::L1;
        self.outcomes.iter().filter(move |_| proved)
    }

    fn flags(&self) -> BTreeMap<&'static str, usize> {
        let mut counts = BTreeMap::new();
        for flag in self.outcomes.iter().flat_map(|outcome| &outcome.flags) {
            *counts.entry(flag.name()).or_insert(0) += 1;
        }
        counts
    }
}

/// Smallest and largest median among the repetitions.
fn median_range(errors: &[f64], clusters: &[Cluster]) -> [f64; 2] {
    let mut by_repeat: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for (error, cluster) in errors.iter().zip(clusters) {
        by_repeat.entry(cluster.repeat).or_default().push(*error);
    }
    let medians = by_repeat.into_values().map(|own| ErrorStats::of(own).median);
    medians.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], median| {
        [low.min(median), high.max(median)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::crowns::plan::{Bounds, Family, sweeps};

    /// Points on an even crown over a stem at (100.3, 200.4).
    fn even(id: u64) -> Cluster {
        let place =
            |i: i32| [100.3 + 0.17 * f64::from(i % 21 - 10), 200.4 + 0.17 * f64::from(i / 21 - 10)];
        let point = |[x, y]: [f64; 2]| {
            [x, y, 20.0 - ((x - 100.3) * (x - 100.3) + (y - 200.4) * (y - 200.4)) / 1.2]
        };
        let points = (0..441).map(place).map(point).collect();
        Cluster { id, points, reference: [100.3, 200.4], ..Cluster::default() }
    }

    #[test]
    fn every_method_finds_an_even_crown() {
        let found = compare(&[even(1)], &sweeps(), 0.5, &|| ()).unwrap();
        for one in found {
            let outcome = &one.outcomes[0];
            assert_eq!(outcome.failure, None);
            // StarSac's peak is the centre of the highest cell.
            let allowed = if one.setting.family == Family::StarSac { 0.36 } else { 0.12 };
            assert!(outcome.error_m() < allowed, "{}: {}", one.setting, outcome.error_m());
        }
    }

    #[test]
    fn rows_by_hand() {
        let mut clusters = vec![even(1), even(2), even(3)];
        for (cluster, offset) in clusters.iter_mut().zip([1.0, 2.0, 5.0]) {
            cluster.reference[0] -= offset;
            cluster.repeat = u64::from(offset > 1.5);
        }
        let settings = [Setting::plain(Family::HighestPoint), Setting::l1(0.2, Bounds::Exact)];
        let found = compare(&clusters, &settings, 0.5, &|| ()).unwrap();
        let rows: Vec<Row> = found.iter().map(|one| one.row("x", &clusters)).collect();
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        near(rows[0].median_m, 2.0);
        near(rows[0].mean_m, 8.0 / 3.0);
        near(rows[0].rmse_m, 10f64.sqrt());
        near(rows[0].median_range_m[0], 1.0);
        near(rows[0].median_range_m[1], 3.5);
        assert_eq!((rows[0].trees, rows[0].surfaces, rows[0].largest_gap), (3, 0, None));
        assert_eq!(rows[1].surfaces, 3);
        assert!(rows[1].largest_gap.unwrap() < 1e-6);
    }

    #[test]
    fn clusters_of_nothing_are_named() {
        let empty = Cluster { id: 7, ..Cluster::default() };
        let error = compare(&[empty], &sweeps(), 0.5, &|| ()).unwrap_err();
        assert_eq!(error.to_string(), "cluster 7: it has no points");
        let mut wrong = even(8);
        wrong.reference[1] = f64::NAN;
        assert!(compare(&[wrong], &sweeps(), 0.5, &|| ()).is_err());
    }
}

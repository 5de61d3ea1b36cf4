//! Runs all segmenters on all cases.

use super::chain::Chain;
use super::judge::{Judged, judge};
use super::method::Method;
use super::plan::{Case, Experiment};
use super::plot::Plot;
use super::summary::Summary;
use crate::Error;
use rayon::prelude::*;
use serde::Serialize;
use timberline_segmentation::Marker;

/// One segmenter on one case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// The case.
    pub case: Case,
    /// Name of the segmenter.
    pub method: &'static str,
    /// Whether it found the trees itself.
    pub own_trees: bool,
    /// Points where trees are judged, 1/m².
    pub density_per_m2: f64,
    /// Pulses there, 1/m².
    pub pulses_per_m2: f64,
    /// Every judged tree.
    #[serde(skip)]
    pub judged: Judged,
    /// Its figures.
    pub summary: Summary,
}

/// All outcomes, in the sequence of [`Experiment::cases`], in each of the methods given.
///
/// `done` is called after every case. The result is the same whatever the number of threads.
///
/// # Errors
/// [`Error::Parameter`], and what the stages and segmenters refuse.
pub fn compare(
    experiment: &Experiment,
    chain: &Chain,
    methods: &[Method],
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Outcome>, Error> {
    experiment.check()?;
    let one = |case: &Case| {
        let outcomes = one_case(experiment, chain, methods, case);
        done();
        outcomes
    };
    // Cases of many points first: the last one to end is then a small one.
    let cases = experiment.cases();
    let mut order: Vec<usize> = (0..cases.len()).collect();
    order.sort_by(|&a, &b| cases[b].density_per_m2.total_cmp(&cases[a].density_per_m2));
    let outcomes: Result<Vec<_>, Error> = order.par_iter().map(|&i| one(&cases[i])).collect();
    let mut placed: Vec<_> = order.into_iter().zip(outcomes?).collect();
    placed.sort_by_key(|(place, _)| *place);
    Ok(placed.into_iter().flat_map(|(_, outcomes)| outcomes).collect())
}

fn one_case(
    experiment: &Experiment,
    chain: &Chain,
    methods: &[Method],
    case: &Case,
) -> Result<Vec<Outcome>, Error> {
    let plot = Plot::generate(experiment, case)?;
    let markers = chain.markers(&plot)?;
    methods.iter().map(|method| outcome(experiment, case, &plot, &markers, method)).collect()
}

fn outcome(
    experiment: &Experiment,
    case: &Case,
    plot: &Plot,
    markers: &[Marker],
    method: &Method,
) -> Result<Outcome, Error> {
    let judged = judge(plot, &method.run(plot, markers)?, experiment)?;
    Ok(Outcome {
        case: *case,
        method: method.name,
        own_trees: method.has_own_trees(),
        density_per_m2: plot.density_per_m2,
        pulses_per_m2: plot.pulses_per_m2,
        summary: Summary::of(&[&judged], &experiment.height_edges_m),
        judged,
    })
}

/// The repetitions of a stand, density and segmenter together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Pooled {
    /// The case of the first repetition.
    pub case: Case,
    /// Name of the segmenter.
    pub method: &'static str,
    /// Whether it found the trees itself.
    pub own_trees: bool,
    /// Mean density of points, 1/m².
    pub density_per_m2: f64,
    /// Mean density of pulses, 1/m².
    pub pulses_per_m2: f64,
    /// Smallest and largest F of all trees of a repetition.
    pub f_range: Option<[f64; 2]>,
    /// The figures of all repetitions' trees.
    pub summary: Summary,
}

/// Pools repetitions; sequence by stand, density, method as in the outcomes.
#[must_use]
pub fn pool(outcomes: &[Outcome], edges_m: &[f64]) -> Vec<Pooled> {
    let first = outcomes.iter().filter(|outcome| outcome.case.repeat == 1);
    first.map(|outcome| pooled(outcomes, outcome, edges_m)).collect()
}

fn pooled(outcomes: &[Outcome], first: &Outcome, edges_m: &[f64]) -> Pooled {
    let same = |other: &&Outcome| {
        (other.case.stand, other.method) == (first.case.stand, first.method)
            && other.case.density_per_m2 == first.case.density_per_m2
    };
    let all: Vec<&Outcome> = outcomes.iter().filter(same).collect();
    let mean = |value: fn(&Outcome) -> f64| {
        all.iter().map(|one| value(one)).sum::<f64>() / all.len() as f64
    };
    let scores: Vec<f64> = all.iter().filter_map(|one| one.summary.all.f_score()).collect();
    let range = |scores: &[f64]| {
        let low = scores.iter().copied().fold(f64::INFINITY, f64::min);
        [low, scores.iter().copied().fold(0.0, f64::max)]
    };
    let judged: Vec<&Judged> = all.iter().map(|one| &one.judged).collect();
    Pooled {
        case: first.case,
        method: first.method,
        own_trees: first.own_trees,
        density_per_m2: mean(|one| one.density_per_m2),
        pulses_per_m2: mean(|one| one.pulses_per_m2),
        f_range: (!scores.is_empty()).then(|| range(&scores)),
        summary: Summary::of(&judged, edges_m),
    }
}

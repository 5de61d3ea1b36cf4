//! Candidates on generated stands, each known to be right or not.

use crate::Error;
use crate::segmentation::{Case, Chain, Experiment, Plot, StandKind};
use rayon::prelude::*;
use std::collections::BTreeMap;
use timberline_boosting::Sample;
use timberline_treetops::evidence::LEN;
use timberline_treetops::{Candidate, Input, Params, candidates};

/// The stands models are found on: those of an experiment, on several slopes, with crowns smooth
/// and dented. What repetitions take in turn goes in step, so not everything meets everything.
#[derive(Debug, Clone, PartialEq)]
pub struct Training {
    /// Stands, densities and repetitions.
    pub experiment: Experiment,
    /// Slopes of the ground, degrees; repetitions take them in turn.
    pub slopes_deg: Vec<f64>,
    /// Width of the crowns, relative to that of the kind of stand; repetitions take them in turn.
    pub crown_scales: Vec<f64>,
    /// Relief of the crowns, relative to what is common; repetitions take them in turn.
    pub reliefs: Vec<f64>,
}

impl Default for Training {
    /// Seed 1000: experiments of other seeds share no stand with it.
    ///
    /// Repetition r takes the values at r modulo their number, so that the six give these six
    /// combinations, with every kind of stand and density, and no others:
    ///
    /// | r | slope | crown scale | relief |
    /// |--:|------:|------------:|-------:|
    /// | 1 |   25° |         1.0 |    1.0 |
    /// | 2 |    4° |         0.8 |    2.0 |
    /// | 3 |   25° |         1.5 |    0.0 |
    /// | 4 |    4° |         1.0 |    1.0 |
    /// | 5 |   25° |         1.0 |    2.0 |
    /// | 6 |    4° |         0.8 |    0.0 |
    ///
    /// Narrow crowns stood on gentle slopes only, wide ones on steep ground only, and smooth ones of
    /// the common width not at all.
    fn default() -> Self {
        Self {
            experiment: Experiment { seed: 1000, repeats: 6, ..Experiment::default() },
            slopes_deg: vec![4.0, 25.0],
            crown_scales: vec![1.0, 1.0, 0.8, 1.5],
            reliefs: vec![0.0, 1.0, 2.0],
        }
    }
}

impl Training {
    /// The cases with their plots, one after the other; `done` is called after each.
    ///
    /// # Errors
    /// The first error of `visit` or of the generation.
    pub fn each<T: Send>(
        &self,
        visit: impl Fn(&Plot) -> Result<T, Error> + Sync,
        done: &(dyn Fn() + Sync),
    ) -> Result<Vec<(StandKind, T)>, Error> {
        let of = |case: &Case| {
            let result = visit(&Plot::generate(&self.of_case(case), case)?);
            done();
            result.map(|value| (case.stand, value))
        };
        self.experiment.cases().par_iter().map(of).collect()
    }

    /// The experiment with what is a case's turn.
    fn of_case(&self, case: &Case) -> Experiment {
        let turn = |values: &[f64]| {
            let place = case.repeat as usize % values.len().max(1);
            values.get(place).copied().unwrap_or_default()
        };
        Experiment {
            slope_deg: turn(&self.slopes_deg),
            crown_scale: turn(&self.crown_scales),
            crown_relief: turn(&self.reliefs),
            ..self.experiment.clone()
        }
    }
}

/// The candidates for treetops of all stands, with what the points around them say.
///
/// # Errors
/// What growing, scanning and searching refuse.
pub fn treetops(
    training: &Training,
    params: &Params,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Sample<LEN>>, Error> {
    let of = |plot: &Plot| {
        let found = candidates(&Input::new(&plot.cloud, &plot.height_m), params)?;
        let points: Vec<u32> = found.iter().map(|candidate| candidate.index).collect();
        let right = right(plot, &points);
        let samples = found.into_iter().zip(right).filter(|(one, _)| judged(plot, one.index));
        let sample = |(one, is_right): (Candidate, bool)| Sample {
            values: one.evidence,
            is_right,
            weight: 1.0,
        };
        Ok(samples.map(sample).collect::<Vec<_>>())
    };
    Ok(balanced(training.each(of, done)?))
}

/// The candidates that treetops and crown models leave, with what speaks for and against each.
///
/// Among the values is the score of the treetop. Where its model was found on the same stands, as
/// that of the default parameters was, these scores are surer than they are on stands it has never
/// seen, and what is found here leans on them the more.
///
/// # Errors
/// As [`treetops`].
pub fn trees(
    training: &Training,
    chain: &Chain,
    done: &(dyn Fn() + Sync),
) -> Result<Vec<Sample<{ timberline_crowns::detection::LEN }>>, Error> {
    let of = |plot: &Plot| {
        let (candidates, points) = chain.candidates(plot)?;
        let right = right(plot, &points);
        let samples = points.iter().zip(candidates.evidence()).zip(right);
        let samples = samples.filter(|((point, _), _)| judged(plot, **point));
        let sample = |((_, values), is_right)| Sample { values, is_right, weight: 1.0 };
        Ok(samples.map(sample).collect::<Vec<_>>())
    };
    Ok(balanced(training.each(of, done)?))
}

fn judged(plot: &Plot, point: u32) -> bool {
    let [x, y, _] = plot.cloud.world(point as usize);
    plot.is_judged([x, y])
}

/// Whether each point is the highest of these points in its true tree.
fn right(plot: &Plot, points: &[u32]) -> Vec<bool> {
    let mut best: BTreeMap<u64, usize> = BTreeMap::new();
    let z = |place: usize| plot.cloud.z[points[place] as usize];
    for (place, point) in points.iter().enumerate() {
        let best = best.entry(plot.label[*point as usize]).or_insert(place);
        if z(place) > z(*best) {
            *best = place;
        }
    }
    best.remove(&0);
    let mut right = vec![false; points.len()];
    best.values().for_each(|place| right[*place] = true);
    right
}

/// A kind of stand counts at most this much more than another for each of its trees.
const LARGEST_WEIGHT: f64 = 8.0;

/// All samples, such that every kind of stand counts as much as the one with the most true trees, as
/// far as the largest weight allows: savannas have few trees, plantations many.
fn balanced<const N: usize>(cases: Vec<(StandKind, Vec<Sample<N>>)>) -> Vec<Sample<N>> {
    let mut right: BTreeMap<StandKind, f64> = BTreeMap::new();
    for (kind, samples) in &cases {
        *right.entry(*kind).or_default() += samples.iter().filter(|s| s.is_right).count() as f64;
    }
    let most = right.values().copied().fold(1.0, f64::max);
    let weight =
        |kind| (most / right.get(&kind).copied().unwrap_or(1.0).max(1.0)).min(LARGEST_WEIGHT);
    let weighted = cases.into_iter().flat_map(|(kind, samples)| {
        let weight = weight(kind);
        samples.into_iter().map(move |sample| Sample { weight, ..sample })
    });
    weighted.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_has_the_combinations_that_its_documentation_tells() {
        let training = Training::default();
        let cases = training.experiment.cases();
        let mut found: Vec<(u32, [f64; 3])> = cases
            .iter()
            .map(|case| {
                let of = training.of_case(case);
                (case.repeat, [of.slope_deg, of.crown_scale, of.crown_relief])
            })
            .collect();
        found.sort_by_key(|(repeat, _)| *repeat);
        found.dedup();
        let expected = [
            (1, [25.0, 1.0, 1.0]),
            (2, [4.0, 0.8, 2.0]),
            (3, [25.0, 1.5, 0.0]),
            (4, [4.0, 1.0, 1.0]),
            (5, [25.0, 1.0, 2.0]),
            (6, [4.0, 0.8, 0.0]),
        ];
        assert_eq!(found, expected);
    }
}

//! Radii of all sections from those that were measured.
//!
//! Along a branch, measured radii are fitted by a function that does not rise towards the tip. Where
//! nothing was measured, the branch follows the tree's pipe model by the ratio that its measured
//! sections have to it; a branch without any follows the pipe model itself. Every radius is drawn
//! towards the pipe model as far as it is uncertain: noise makes thin branches look thick.

use crate::branches::Branch;
use crate::fit::Fit;
use crate::measure::Measured;
use crate::monotone::{Robust, decreasing, robust_decreasing};
use crate::pipe::{Evidence, PipeModel};
use crate::sections::{Section, Sections};
use crate::{Params, RadiusSource};

/// A section is no circle: standard deviation of its radius over itself. Stems are oval by some
/// per cent (Pulkkinen 2012 has 4 to 6 % between the largest and the smallest diameter of pines).
const ROUNDNESS: f64 = 0.02;
/// Part of the noise that all points of a section have in common: footprint and mixed pixels.
const COMMON_NOISE: f64 = 0.4;
/// A measured radius this many standard deviations from what the pipe model or the branch below say
/// is something else: leaves, a neighbour, a branch at its fork.
const TOO_FAR: f64 = 3.0;
/// Below this trust a measured radius counts as an outlier among its neighbours along the branch.
const LEAST_TRUST: f64 = 0.1;
/// Sections that share the error of a fitted value: neighbours overlap and bark goes on.
const SHARING: f64 = 3.0;
/// Along a branch the ratio to the pipe model is forgotten over this many radii.
const MEMORY_RADII: f64 = 40.0;
/// Scatter of radii around the skeleton's own where nothing was measured on the tree.
const BLIND_SCATTER: f64 = 0.5;
/// Sections of branches tell the pipe model when the logarithm of their radius is this near to the
/// model of the stem.
const OF_A_KIND: f64 = 1.0;
/// A measured section of a branch is believed when a neighbour, at most so many sections away, has
/// its radius, up to their errors and this share of it ...
const NEIGHBOURS: usize = 2;
const ALIKE: f64 = 0.15;
/// ... or when it shows so much of itself: points and part of the circumference.
const ALONE: (u32, f64) = (20, 0.4);
/// Fits that tell the pipe model: radius over noise, and standard error over radius.
const TELLING: (f64, f64) = (3.0, 0.15);

/// A radius, and what it rests on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radius {
    /// Radius, m.
    pub radius_m: f64,
    /// Standard error, m.
    pub sd_m: f64,
    /// What it rests on.
    pub source: RadiusSource,
}

/// What radii are estimated from.
#[derive(Debug, Clone, Copy)]
pub struct Given<'a> {
    /// The branches.
    pub branches: &'a [Branch],
    /// Their sections.
    pub sections: &'a Sections,
    /// The fits of the sections.
    pub measured: &'a [Option<Measured>],
    /// What points scatter across surfaces, m.
    pub noise_m: f64,
}

/// Radii of all sections, and the pipe model where anything was measured.
#[must_use]
pub fn radii(given: &Given<'_>, params: &Params) -> (Vec<Radius>, Option<PipeModel>) {
    let pipe = pipe_model(given, params);
    let mut found: Vec<Radius> = Vec::with_capacity(given.sections.all.len());
    for number in 0..given.branches.len() {
        let parent = given.branches[number].fork.map(|fork| {
            let below = found[given.sections.at(fork.branch as usize, fork.at_m)];
            (below.radius_m, below.sd_m)
        });
        found.extend(of_branch(given, number, pipe.as_ref(), parent, params));
    }
    (found, pipe)
}

/// The pipe model: first of the stem, whose lower half is wood beyond doubt, then also of those
/// sections of branches that are of its kind.
fn pipe_model(given: &Given<'_>, params: &Params) -> Option<PipeModel> {
    let rows = evidence(given);
    let half = given.sections.all.first().map_or(0.0, |section| 0.5 * section.reach_m);
    let lower = |row: &&(Evidence, u32)| row.1 == 0 && row.0.reach_m >= half;
    let mut stem: Vec<Evidence> = rows.iter().filter(lower).map(|row| row.0).collect();
    let Some(first) = PipeModel::of(&stem, params.pipe_exponent) else {
        let all: Vec<Evidence> = rows.iter().map(|row| row.0).collect();
        return PipeModel::of(&all, params.pipe_exponent);
    };
    let of_a_kind = |row: &&(Evidence, u32)| {
        let ratio = libm::log(row.0.radius_m / first.radius_m(row.0.reach_m));
        row.1 != 0 && ratio.abs() <= OF_A_KIND
    };
    let sides: Vec<Evidence> = rows.iter().filter(of_a_kind).map(|row| row.0).collect();
    // The stem is one branch among many, however many sections it has.
    let weight: f64 = sides.iter().map(|row| row.weight).sum();
    let of_stem: f64 = stem.iter().map(|row| row.weight).sum();
    let share = (weight / of_stem).clamp(0.1, 1.0);
    stem.iter_mut().for_each(|row| row.weight *= share);
    stem.extend(sides);
    PipeModel::of(&stem, params.pipe_exponent)
}

/// The sections that tell the pipe model, thick against the noise, and their branches.
fn evidence(given: &Given<'_>) -> Vec<(Evidence, u32)> {
    let pairs = given.sections.all.iter().zip(given.measured);
    let rows = pairs.filter_map(|(section, measured)| {
        let fit = measured.as_ref()?.fit;
        let telling =
            fit.radius_m > TELLING.0 * fit.noise_m && fit.radius_sd_m < TELLING.1 * fit.radius_m;
        let weight = section.length_m();
        let row = Evidence { reach_m: section.reach_m, radius_m: fit.radius_m, weight };
        telling.then_some((row, section.branch))
    });
    rows.collect()
}

/// A measured section of one branch.
#[derive(Debug, Clone, Copy)]
struct Known {
    /// Place within the branch.
    place: usize,
    /// Along the branch, m.
    at_m: f64,
    radius_m: f64,
    sd_m: f64,
    /// Logarithm of the radius over that of the pipe model, and its standard deviation.
    log_ratio: f64,
    log_sd: f64,
    points: u32,
    arc_coverage: f64,
}

impl Known {
    /// A fit with all errors that it can have; `common_m` is the error that its points share.
    fn new(place: usize, section: &Section, fit: &Fit, expected_m: f64, common_m: f64) -> Self {
        let rough = ROUNDNESS * fit.radius_m;
        let sd_m =
            libm::sqrt(fit.radius_sd_m * fit.radius_sd_m + rough * rough + common_m * common_m);
        Self {
            place,
            at_m: section.middle_m(),
            radius_m: fit.radius_m,
            sd_m,
            log_ratio: libm::log(fit.radius_m / expected_m),
            log_sd: sd_m / fit.radius_m,
            points: fit.points,
            arc_coverage: fit.arc_coverage,
        }
    }
}

/// Radii of one branch; `parent` is radius and standard error of the branch below at the fork.
fn of_branch(
    given: &Given<'_>,
    number: usize,
    pipe: Option<&PipeModel>,
    parent: Option<(f64, f64)>,
    params: &Params,
) -> Vec<Radius> {
    let sections = &given.sections.all[given.sections.of(number)];
    let expected: Vec<f64> = sections
        .iter()
        .map(|section| pipe.map_or(section.radius_m, |pipe| pipe.radius_m(section.reach_m)))
        .map(|radius| radius.max(params.min_radius_m))
        .collect();
    let scatter = pipe.map_or(BLIND_SCATTER, |pipe| pipe.log_scatter);
    let known = along_branch(plausible(given, number, &expected, scatter, parent), scatter);
    let mut found: Vec<Radius> = sections
        .iter()
        .zip(&expected)
        .enumerate()
        .map(|(place, (section, &expected))| {
            let (log_ratio, log_sd, source) =
                ratio_at(&known, place, section.middle_m(), expected, scatter);
            let radius_m = expected * libm::exp(log_ratio);
            Radius { radius_m, sd_m: radius_m * log_sd, source }
        })
        .collect();
    let values: Vec<f64> = found.iter().map(|radius| radius.radius_m).collect();
    let weights: Vec<f64> = found.iter().map(|radius| 1.0 / (radius.sd_m * radius.sd_m)).collect();
    let most = parent.map_or(f64::INFINITY, |(radius, _)| radius);
    for (radius, value) in found.iter_mut().zip(decreasing(&values, &weights)) {
        radius.radius_m = value.min(most).max(params.min_radius_m);
    }
    found
}

/// The measured sections of a branch that may be true, with all errors a single one can have.
fn plausible(
    given: &Given<'_>,
    number: usize,
    expected: &[f64],
    scatter: f64,
    parent: Option<(f64, f64)>,
) -> Vec<Known> {
    let range = given.sections.of(number);
    let rows = given.sections.all[range.clone()].iter().zip(&given.measured[range]).enumerate();
    let common = COMMON_NOISE * given.noise_m;
    let rows = rows.filter_map(|(place, (section, measured))| {
        let known = Known::new(place, section, &measured.as_ref()?.fit, expected[place], common);
        let Some((below, below_sd)) = parent else { return Some(known) };
        let allowed = TOO_FAR * libm::hypot(scatter, known.log_sd);
        let wider = TOO_FAR * libm::hypot(known.sd_m, below_sd);
        let likely = known.log_ratio.abs() <= allowed && known.radius_m <= below + wider;
        likely.then_some(known)
    });
    let found: Vec<Known> = rows.collect();
    if parent.is_none() {
        return found;
    }
    let shows = |known: &Known| known.points >= ALONE.0 && known.arc_coverage >= ALONE.1;
    found.iter().filter(|known| shows(known) || has_like(known, &found)).copied().collect()
}

/// Whether a neighbour along the branch has about the same radius.
fn has_like(known: &Known, all: &[Known]) -> bool {
    all.iter().any(|other| {
        let apart = other.place.abs_diff(known.place);
        let off = (other.radius_m - known.radius_m).abs();
        let error = libm::hypot(other.sd_m, known.sd_m);
        (1..=NEIGHBOURS).contains(&apart) && off <= 2.0 * error + ALIKE * known.radius_m
    })
}

/// Takes out what neighbours along the branch contradict, and puts the fitted radii in place of the
/// measured ones, drawn towards the pipe model.
fn along_branch(mut known: Vec<Known>, scatter: f64) -> Vec<Known> {
    let values: Vec<f64> = known.iter().map(|known| known.radius_m).collect();
    let sds: Vec<f64> = known.iter().map(|known| known.sd_m).collect();
    let Robust { fitted, trust, scatter: beyond } = robust_decreasing(&values, &sds);
    for (place, known) in known.iter_mut().enumerate() {
        let expected = known.radius_m / libm::exp(known.log_ratio);
        let near = fitted.iter().filter(|other| **other == fitted[place]).count() as f64;
        let sharing = near.min(SHARING);
        known.radius_m = fitted[place];
        known.sd_m = libm::sqrt((known.sd_m * known.sd_m + beyond * beyond) / sharing);
        known.log_sd = known.sd_m / known.radius_m;
        known.log_ratio = libm::log(known.radius_m / expected);
        let drawn = scatter * scatter / (scatter * scatter + known.log_sd * known.log_sd);
        known.log_ratio *= drawn;
        known.log_sd *= drawn.sqrt();
    }
    let mut places = trust.iter();
    known.retain(|_| places.next().is_some_and(|trust| *trust > LEAST_TRUST));
    known
}

/// Ratio to the pipe model at a place of a branch: that of measured sections, between them by
/// distance; with the standard deviation and the source.
fn ratio_at(
    known: &[Known],
    place: usize,
    at_m: f64,
    expected_m: f64,
    scatter: f64,
) -> (f64, f64, RadiusSource) {
    let next = known.partition_point(|known| known.place < place);
    if let Some(here) = known.get(next).filter(|known| known.place == place) {
        return (here.log_ratio, here.log_sd, RadiusSource::Measured);
    }
    let forgotten =
        |known: &Known| 1.0 - libm::exp(-(at_m - known.at_m).abs() / (MEMORY_RADII * expected_m));
    let beside = [next.checked_sub(1).and_then(|k| known.get(k)), known.get(next)];
    let (log_ratio, variance) = match beside {
        [Some(a), Some(b)] => {
            let share = (at_m - a.at_m) / (b.at_m - a.at_m);
            let lost = forgotten(a).min(forgotten(b)) * scatter * scatter;
            let own = a.log_sd * a.log_sd * (1.0 - share) + b.log_sd * b.log_sd * share;
            (a.log_ratio + (b.log_ratio - a.log_ratio) * share, own + lost)
        }
        [Some(one), None] | [None, Some(one)] => {
            let kept = 1.0 - forgotten(one);
            (one.log_ratio * kept, one.log_sd * one.log_sd + forgotten(one) * scatter * scatter)
        }
        [None, None] => return (0.0, scatter, RadiusSource::Inferred),
    };
    (log_ratio, variance.sqrt(), RadiusSource::Interpolated)
}

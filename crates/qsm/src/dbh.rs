//! The diameter at breast height.

use crate::fit::{Expected, Fit, Sample, fit};
use crate::measure::{Owned, View, accepted, within};
use crate::monotone::weighted_median;
use crate::{Model, ModelCylinder, Params, RadiusSource};
use timberline_solids::vector::{along, dot, sub, unit};

/// A diameter at breast height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dbh {
    /// The diameter, m.
    pub diameter_m: f64,
    /// Its standard error, m.
    pub sd_m: f64,
    /// Part of the circumference that has points, 0 to 1.
    pub arc_coverage: f64,
    /// Number of points it rests on.
    pub points: u32,
    /// Measured on slices around breast height, or interpolated between measured sections of the stem.
    pub source: RadiusSource,
}

/// Middles of the slices from breast height, in thicknesses of a slice: they overlap by a third.
const SLICES: [f64; 5] = [-1.3, -0.65, 0.0, 0.65, 1.3];
/// Slices that tell something of their own, of five that overlap.
const INDEPENDENT: f64 = 4.0;
/// Fewest slices that make a measurement.
const FEWEST_SLICES: usize = 2;
/// Noise is as well known as by this many residuals: the whole tree told it.
const NOISE_WEIGHT: f64 = 8.0;
/// A slice is no circle: standard deviation of its radius over itself. Bark and ovality go on from
/// slice to slice, so that several do not lower it.
const ROUNDNESS: f64 = 0.01;
/// Slices and the stem's own radius may differ by this share of it, besides their errors.
const AGREEMENT: f64 = 0.1;
/// Standard error over the diameter from which the rest of the stem may know better.
const POOR: f64 = 0.1;
/// Standard error over the diameter above which a diameter between measurements tells nothing.
const UNCERTAIN: f64 = 0.33;
/// Window of points around the expected axis, in expected radii, and in noises.
const WINDOW: (f64, f64) = (2.0, 5.0);

/// Where the stem passes a height, and how thick it is there.
#[derive(Debug, Clone, Copy)]
struct Place<'a> {
    at_m: [f64; 3],
    along: [f64; 3],
    cylinder: &'a ModelCylinder,
}

/// The diameter of the stem at `params.breast_height_m` above the base. None where the stem does not
/// reach so high, or nothing of it could be measured: it is never guessed from the tree's height.
#[must_use]
pub fn dbh(
    model: &Model,
    owned: &Owned<'_>,
    base_z_m: f64,
    noise_m: Option<f64>,
    params: &Params,
) -> Option<Dbh> {
    let (_, place) = at_height(model, base_z_m + params.breast_height_m)?;
    let noise_m = noise_m.unwrap_or(params.noise_m);
    if params.method == crate::Method::Fitted
        && let Some(found) = of_slices(model, &place, owned, noise_m, params)
    {
        return Some(found);
    }
    let cylinder = place.cylinder;
    let adtree = params.method == crate::Method::Adtree;
    if !adtree && cylinder.source == RadiusSource::Inferred {
        return None;
    }
    let (diameter_m, sd_m) = (2.0 * cylinder.solid.radius_m, 2.0 * cylinder.radius_sd_m);
    let is_told = sd_m <= UNCERTAIN * diameter_m;
    if !adtree && !is_told {
        return None;
    }
    Some(Dbh {
        diameter_m,
        sd_m,
        arc_coverage: cylinder.arc_coverage,
        points: cylinder.points,
        source: if adtree { RadiusSource::Inferred } else { RadiusSource::Interpolated },
    })
}

/// The lowest cylinder of the stem that passes an elevation, and its place on the stem.
fn at_height(model: &Model, z_m: f64) -> Option<(usize, Place<'_>)> {
    model.stem().iter().enumerate().find_map(|(number, cylinder)| {
        let (low, high) = (cylinder.solid.start_m, cylinder.solid.end_m);
        if !(low[2] <= z_m && high[2] > z_m) {
            return None;
        }
        let share = (z_m - low[2]) / (high[2] - low[2]);
        let at_m = along(low, sub(high, low), share);
        Some((number, Place { at_m, along: unit(sub(high, low))?, cylinder }))
    })
}

/// Circles on slices across the stem.
fn of_slices(
    model: &Model,
    place: &Place<'_>,
    owned: &Owned<'_>,
    noise_m: f64,
    params: &Params,
) -> Option<Dbh> {
    let stem = stem_points(model, owned, place, params);
    let radius_m = place.cylinder.solid.radius_m;
    let expected = Expected { radius_m, noise_m, noise_weight: NOISE_WEIGHT };
    let fits: Vec<Fit> = SLICES
        .iter()
        .filter_map(|step| {
            let origin = along(place.at_m, place.along, step * params.slice_m);
            let view = View::new(origin, place.along);
            let samples: Vec<Sample> =
                stem.iter().map(|(at, weight)| view.sample(*at, *weight)).collect();
            let window = WINDOW.0 * radius_m + WINDOW.1 * noise_m;
            let samples = within(samples, 0.5 * params.slice_m, window);
            fit(&samples, &expected).filter(|fit| accepted(fit, None, params))
        })
        .collect();
    let found = combined(&fits)?;
    let stem_sd_m = 2.0 * place.cylinder.radius_sd_m;
    let off = (found.diameter_m - 2.0 * radius_m).abs();
    let agrees = off <= 2.0 * AGREEMENT * radius_m + 3.0 * libm::hypot(found.sd_m, stem_sd_m);
    // Slices that tell less than the stem around them are no measurement at breast height.
    let poor = found.sd_m > POOR * found.diameter_m && found.sd_m > stem_sd_m;
    (agrees && !poor).then_some(found)
}

/// Points of the stem around breast height with their weights.
fn stem_points(
    model: &Model,
    owned: &Owned<'_>,
    place: &Place<'_>,
    params: &Params,
) -> Vec<([f64; 3], f64)> {
    let reach = 2.0 * params.slice_m;
    let stem = model.branches.first().map_or(0, |stem| stem.len as usize);
    let near = |at: [f64; 3]| dot(sub(at, place.at_m), place.along).abs() <= reach;
    (0..stem)
        .flat_map(|section| owned.of(section))
        .map(|point| (owned.position_m(*point), owned.weight(*point)))
        .filter(|(at, _)| near(*at))
        .collect()
}

/// The weighted mean of slices near their weighted median.
fn combined(fits: &[Fit]) -> Option<Dbh> {
    let variance = |fit: &Fit| {
        let rough = ROUNDNESS * fit.radius_m;
        fit.radius_sd_m * fit.radius_sd_m + rough * rough
    };
    let radii: Vec<f64> = fits.iter().map(|fit| fit.radius_m).collect();
    let weights: Vec<f64> = fits.iter().map(|fit| 1.0 / variance(fit).sqrt()).collect();
    let middle = weighted_median(&radii, &weights);
    let mut deviations: Vec<f64> = radii.iter().map(|radius| (radius - middle).abs()).collect();
    let spread = 1.4826 * crate::measure::median(&mut deviations)?;
    let agrees = |fit: &&Fit| {
        (fit.radius_m - middle).abs() <= 3.0 * libm::sqrt(variance(fit) + spread * spread)
    };
    let good: Vec<&Fit> = fits.iter().filter(agrees).collect();
    if good.len() < FEWEST_SLICES {
        return None;
    }
    let sum: f64 = good.iter().map(|fit| 1.0 / variance(fit)).sum();
    let mean = good.iter().map(|fit| fit.radius_m / variance(fit)).sum::<f64>() / sum;
    let count = good.len() as f64;
    let independent = count * INDEPENDENT / SLICES.len() as f64;
    let between = good.iter().map(|fit| (fit.radius_m - mean) * (fit.radius_m - mean)).sum::<f64>();
    let between = between / (count - 1.0);
    let within = count / sum;
    let rough = ROUNDNESS * mean;
    let sd_m = libm::sqrt(between.max(within) / independent + rough * rough);
    let mut arcs: Vec<f64> = good.iter().map(|fit| fit.arc_coverage).collect();
    Some(Dbh {
        diameter_m: 2.0 * mean,
        sd_m: 2.0 * sd_m,
        arc_coverage: crate::measure::median(&mut arcs)?,
        points: good.iter().map(|fit| fit.points).max().unwrap_or(0),
        source: RadiusSource::Measured,
    })
}

/// The stem's diameter at a height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaperStep {
    /// Height above the base, m.
    pub height_m: f64,
    /// Diameter, m.
    pub diameter_m: f64,
    /// What it rests on.
    pub source: RadiusSource,
}

/// Diameters of the stem at every multiple of `params.taper_step_m` that it passes, each interpolated
/// between the middles of cylinders.
#[must_use]
pub fn taper(model: &Model, base_z_m: f64, params: &Params) -> Vec<TaperStep> {
    let stem = model.stem();
    let ends = stem.iter().map(|cylinder| cylinder.solid.end_m[2]);
    let top = ends.fold(f64::NEG_INFINITY, f64::max) - base_z_m;
    if !top.is_finite() || top < 0.0 {
        return Vec::new();
    }
    let steps = (top / params.taper_step_m).floor() as usize;
    let one = |step: usize| {
        let height_m = step as f64 * params.taper_step_m;
        let z_m = base_z_m + height_m;
        let (at, place) = at_height(model, z_m)?;
        let diameter_m = 2.0 * radius_between(stem, at, z_m);
        Some(TaperStep { height_m, diameter_m, source: place.cylinder.source })
    };
    (0..=steps).filter_map(one).collect()
}

/// Radius at an elevation within a cylinder, by those of the nearest middles of cylinders.
fn radius_between(stem: &[ModelCylinder], at: usize, z_m: f64) -> f64 {
    let middle = |c: &ModelCylinder| 0.5 * (c.solid.start_m[2] + c.solid.end_m[2]);
    let here = &stem[at];
    let other = if middle(here) > z_m { at.checked_sub(1) } else { Some(at + 1) };
    let Some(other) = other.and_then(|other| stem.get(other)) else {
        return here.solid.radius_m;
    };
    let apart = middle(other) - middle(here);
    let share = if apart == 0.0 { 0.0 } else { ((z_m - middle(here)) / apart).clamp(0.0, 1.0) };
    here.solid.radius_m + (other.solid.radius_m - here.solid.radius_m) * share
}

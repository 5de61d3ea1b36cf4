//! Fits of all sections.

use crate::Params;
use crate::fit::{Expected, Fit, Sample, fit};
use crate::sections::{Section, Sections};
use rayon::prelude::*;
use timberline_solids::vector::{across, add, along, cross, dot, scale, sub, unit};

/// Most points of one fit: with more the radius of a section is better known than it is round.
const MOST_POINTS: usize = 240;
/// How far beyond its section a fit takes points, in lengths of the section: sections overlap.
const OVERLAP: f64 = 0.25;
/// How far from the axis a fit takes points, in expected radii, and in standard deviations of noise.
const WINDOW_RADII: f64 = 3.0;
const WINDOW_NOISES: f64 = 5.0;
/// Least part of the circumference that a measured section must show: 30 degrees. It only keeps out
/// what is flat; the standard error decides.
const LEAST_ARC: f64 = 30.0 / 360.0;
/// Least weight of a point, so that a tree taken for leaves as a whole can still be measured.
const LEAST_WEIGHT: f64 = 0.05;
/// Weight of the noise before the tree has told its own, and after, in residuals.
const NOISE_WEIGHT: [f64; 2] = [3.0, 8.0];
/// Points of one section scatter at most this many times as much as those of the whole tree.
const MOST_NOISE: f64 = 1.6;
/// Expected noise of a thin branch as a share of the largest that can be measured, and the least, m.
const NOISE_RADII: f64 = 0.75;
const LEAST_NOISE_M: f64 = 0.0015;
/// Fits with at least this many points, and radii of this many times their noise, tell the noise.
const TELLING: (u32, f64) = (20, 3.0);

/// The points of a tree, by section.
#[derive(Debug)]
pub struct Owned<'a> {
    points_m: &'a [[f64; 3]],
    weight: Option<&'a [f32]>,
    order: Vec<u32>,
    first: Vec<usize>,
}

impl<'a> Owned<'a> {
    /// Sorts points by the section that each belongs to. Within a section they keep their order.
    #[must_use]
    pub fn new(
        points_m: &'a [[f64; 3]],
        weight: Option<&'a [f32]>,
        owner: &[u32],
        sections: usize,
    ) -> Self {
        let mut first = vec![0usize; sections + 1];
        owner.iter().for_each(|section| first[*section as usize + 1] += 1);
        (0..sections).for_each(|section| first[section + 1] += first[section]);
        let mut next = first.clone();
        let mut order = vec![0u32; owner.len()];
        for (point, section) in (0u32..).zip(owner) {
            order[next[*section as usize]] = point;
            next[*section as usize] += 1;
        }
        Self { points_m, weight, order, first }
    }

    /// The points of a section.
    #[must_use]
    pub fn of(&self, section: usize) -> &[u32] {
        &self.order[self.first[section]..self.first[section + 1]]
    }

    /// Position of a point, m.
    #[must_use]
    pub fn position_m(&self, point: u32) -> [f64; 3] {
        self.points_m[point as usize]
    }

    /// How likely a point is on wood, as the weight of a fit.
    #[must_use]
    pub fn weight(&self, point: u32) -> f64 {
        let wood = self.weight.map_or(1.0, |weight| f64::from(weight[point as usize]));
        // A likelihood that is not known is no reason against a point.
        if wood.is_nan() { 1.0 } else { wood.clamp(LEAST_WEIGHT, 1.0) }
    }
}

/// Axes across and along a section, around its middle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Origin, m.
    pub origin_m: [f64; 3],
    /// Two directions across.
    pub across: [[f64; 3]; 2],
    /// Direction along.
    pub along: [f64; 3],
}

impl View {
    /// A view along a direction.
    #[must_use]
    pub fn new(origin_m: [f64; 3], along: [f64; 3]) -> Self {
        let first = across(along);
        Self { origin_m, across: [first, cross(along, first)], along }
    }

    /// A point as it is seen.
    #[must_use]
    pub fn sample(&self, position_m: [f64; 3], weight: f64) -> Sample {
        let offset = sub(position_m, self.origin_m);
        let across_m = self.across.map(|axis| dot(offset, axis));
        Sample { across_m, along_m: dot(offset, self.along), weight }
    }

    /// Position of a place across, m.
    #[must_use]
    pub fn position_m(&self, across_m: [f64; 2]) -> [f64; 3] {
        add(self.origin_m, self.direction(across_m))
    }

    /// Direction across with the given components.
    #[must_use]
    pub fn direction(&self, across_m: [f64; 2]) -> [f64; 3] {
        add(scale(self.across[0], across_m[0]), scale(self.across[1], across_m[1]))
    }
}

/// A section's view: along it and, in part, along its neighbours, for skeletons zigzag. None of a
/// section without length.
#[must_use]
pub fn view(sections: &Sections, place: usize) -> Option<View> {
    let section = &sections.all[place];
    let own = unit(sub(section.end_m, section.start_m))?;
    let mut direction = scale(own, 2.0);
    let range = sections.of(section.branch as usize);
    let beside = [place.checked_sub(1), Some(place + 1)];
    for other in beside.into_iter().flatten().filter(|other| range.contains(other)) {
        let other = &sections.all[other];
        let Some(next) = unit(sub(other.end_m, other.start_m)) else { continue };
        if dot(own, next) > 0.5 {
            direction = add(direction, next);
        }
    }
    let middle = along(section.start_m, sub(section.end_m, section.start_m), 0.5);
    Some(View::new(middle, unit(direction)?))
}

/// A measured section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The fit.
    pub fit: Fit,
    /// What it is seen in.
    pub view: View,
}

/// Fits every section; none where the points do not tell a radius.
#[must_use]
pub fn measure(
    sections: &Sections,
    owned: &Owned<'_>,
    noise_m: Option<f64>,
    params: &Params,
) -> Vec<Option<Measured>> {
    measure_some(sections, 0..sections.all.len(), owned, noise_m, params)
}

/// What points scatter across the surface of the tree, from its stem below half of its reach, where
/// there is wood and little else; none where no section of it tells.
#[must_use]
pub fn noise_of_stem(sections: &Sections, owned: &Owned<'_>, params: &Params) -> Option<f64> {
    let stem = sections.of(0);
    let half = sections.all.first().map_or(0.0, |section| 0.5 * section.reach_m);
    let lower = sections.all[stem.clone()].partition_point(|section| section.reach_m >= half);
    noise_of(&measure_some(sections, stem.start..stem.start + lower, owned, None, params))
}

fn measure_some(
    sections: &Sections,
    places: std::ops::Range<usize>,
    owned: &Owned<'_>,
    noise_m: Option<f64>,
    params: &Params,
) -> Vec<Option<Measured>> {
    places
        .into_par_iter()
        .map(|place| {
            let view = view(sections, place)?;
            let samples = samples(sections, place, &view, owned, noise_m.unwrap_or(params.noise_m));
            let expected = expected(&sections.all[place], noise_m, params);
            let fit = fit(&samples, &expected)?;
            accepted(&fit, noise_m.map(|_| expected.noise_m), params)
                .then_some(Measured { fit, view })
        })
        .collect()
}

/// What a fit of a section starts from. The noise is that of the tree, most of which is bark; where
/// that would hide the inside of a thin branch, only a branch with less can be measured at all.
#[must_use]
pub fn expected(section: &Section, noise_m: Option<f64>, params: &Params) -> Expected {
    let visible = NOISE_RADII * params.max_relative_noise * section.radius_m;
    let noise_weight = NOISE_WEIGHT[usize::from(noise_m.is_some())];
    let noise = noise_m.unwrap_or(params.noise_m);
    let noise_m = noise.min(visible.max(LEAST_NOISE_M));
    Expected { radius_m: section.radius_m, noise_m, noise_weight }
}

/// The points of a section and its neighbours on the branch that lie in its window.
fn samples(
    sections: &Sections,
    place: usize,
    view: &View,
    owned: &Owned<'_>,
    noise_m: f64,
) -> Vec<Sample> {
    let section = &sections.all[place];
    let half = (0.5 + OVERLAP) * section.length_m();
    let range = sections.of(section.branch as usize);
    let mut found = Vec::new();
    for other in place.saturating_sub(1).max(range.start)..(place + 2).min(range.end) {
        for &point in owned.of(other) {
            found.push(view.sample(owned.position_m(point), owned.weight(point)));
        }
    }
    let window = WINDOW_RADII * section.radius_m + WINDOW_NOISES * noise_m;
    within(found, half, window)
}

/// Samples within half a length along and a window across, thinned to the most that a fit takes.
#[must_use]
pub fn within(mut samples: Vec<Sample>, half_m: f64, window_m: f64) -> Vec<Sample> {
    samples.retain(|sample| {
        let [x, y] = sample.across_m;
        sample.along_m.abs() <= half_m && x * x + y * y <= window_m * window_m
    });
    let stride = samples.len().div_ceil(MOST_POINTS).max(1);
    if stride == 1 { samples } else { samples.into_iter().step_by(stride).collect() }
}

/// Whether a fit is that of a stem or branch: enough points on it, few in it, and not scattered more
/// than those of the tree's surfaces are, nor so much that the inside could not be told from it.
#[must_use]
pub fn accepted(fit: &Fit, noise_m: Option<f64>, params: &Params) -> bool {
    let usual = noise_m.map_or(f64::INFINITY, |noise| MOST_NOISE * noise);
    fit.points >= params.min_points
        && fit.noise_m <= usual
        && fit.noise_m <= params.max_relative_noise * fit.radius_m
        && fit.radius_m >= params.min_radius_m
        && fit.radius_sd_m <= params.max_relative_sd * fit.radius_m
        && fit.inside_share <= params.max_inside_share
        && fit.surface_share >= params.min_surface_share
        && fit.arc_coverage >= LEAST_ARC
}

/// What points scatter across the surface of this tree: the median of well-determined fits.
#[must_use]
pub fn noise_of(measured: &[Option<Measured>]) -> Option<f64> {
    let telling = |fit: &Fit| fit.points >= TELLING.0 && fit.radius_m > TELLING.1 * fit.noise_m;
    let fits = measured.iter().flatten().map(|measured| measured.fit);
    let mut noise: Vec<f64> = fits.filter(telling).map(|fit| fit.noise_m).collect();
    median(&mut noise)
}

/// The median; of an even number of values the upper of the two in the middle.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

//! The shape of a section: the points of a branch between two level sets.

use super::circle::{Circle, Prior, fit};
use crate::vector::{Vector, across, add, dot, mean, norm, scale, sub, unit};

/// A piece of a branch between two level sets of the distance from the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Section {
    /// The section before it; [`crate::paths::NONE`] for the first.
    pub(crate) parent: u32,
    /// Where its points are among the grown points.
    pub(crate) start: u32,
    pub(crate) end: u32,
    pub(crate) shape: Shape,
}

/// Where the axis of a section is, how it runs, and how thick the branch is there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shape {
    pub(crate) centre: Vector,
    /// Mean of the points.
    pub(crate) middle: Vector,
    /// Direction of the axis away from the base, of length one.
    pub(crate) along: Vector,
    /// Radius, m: of the circle where there is one, else the mean distance of the points.
    pub(crate) radius: f64,
    /// Whether centre and radius are those of a circle.
    pub(crate) round: bool,
    /// Radius that the next section is cut and parted by, m.
    pub(crate) reach: f64,
    /// The last circle on the way from the base.
    pub(crate) last: Known,
    /// Mean distance to the fourth neighbour, m.
    pub(crate) spacing: f64,
}

/// A radius and how many points the branch carried there: it and all beyond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Known {
    pub(crate) centre: Option<Vector>,
    pub(crate) radius: f64,
    pub(crate) carried: f64,
}

impl Known {
    /// The radius by the pipe model (Shinozaki et al. 1964) where the branch carries other points.
    fn at(&self, carried: f64) -> f64 {
        self.radius * (carried / self.carried).min(1.0).sqrt()
    }
}

/// Fewest points of a circle.
const CIRCLE_POINTS: usize = 8;

/// A radius of less than this many spacings is not seen as a circle.
const CIRCLE_SPACINGS: f64 = 1.0;

/// Largest median distance to a circle, relative to its radius.
const CIRCLE_SPREAD: f64 = 0.25;

/// How much thicker than the last circles the next may be.
const SWELL: f64 = 1.5;

/// How much thicker than by the pipe model a circle may be, and a section without a circle.
const ROUND_ABOVE_PIPE: f64 = 1.8;
const ABOVE_PIPE: f64 = 1.15;

/// Share of the reach below that a section without a circle keeps: one bad section of a stem must
/// not part those above it.
const HOLD: f64 = 0.8;

/// Standard deviation of a radius from what the pipe model makes of the last circle, relative.
const PRIOR_DEVIATION: f64 = 0.25;

/// The points of a section and what is known of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Members<'a> {
    pub(crate) points: &'a [Vector],
    /// Likelihood of wood of each: leaves do not move the axis.
    pub(crate) wood: &'a [f32],
    pub(crate) spacing: f64,
    /// Points of the branch here and of all beyond.
    pub(crate) carried: f64,
}

/// Finds the shape of a section above another, or of the first one, of which a radius is known
/// roughly.
pub(crate) fn shape(members: &Members<'_>, below: Option<&Shape>, first: Known) -> Shape {
    let middle = weighted_mean(members);
    let along = match below {
        None => [0.0, 0.0, 1.0],
        Some(below) => {
            let step = unit(sub(middle, below.middle)).unwrap_or(below.along);
            unit(add(step, below.along)).unwrap_or(step)
        }
    };
    let last = below.map_or(first, |below| below.last);
    let pipe = last.at(members.carried);
    let most = match below {
        None => ROUND_ABOVE_PIPE * first.radius,
        Some(_) => (SWELL * last.radius).min(ROUND_ABOVE_PIPE * pipe),
    };
    let spacing = members.spacing;
    if let Some((centre, radius)) = round(members, middle, along, below, most) {
        // One bad circle must not lead those after it astray: the middle of what was known and seen.
        let known = below.map_or(radius, |_| pipe);
        let (radius_known, centre_known) = (0.5 * (known + radius), Some(centre));
        let last =
            Known { centre: centre_known, radius: radius_known, carried: members.carried };
        return Shape { centre, middle, along, radius, round: true, reach: radius, last, spacing };
    }
    let away = |p: &Vector| {
        let out = sub(*p, middle);
        norm(sub(out, scale(along, dot(out, along))))
    };
    let radius = members.points.iter().map(away).sum::<f64>() / members.points.len() as f64;
        let held = below.map_or(0.0, |below| HOLD * below.reach);
    let reach = radius.max(held).min(ABOVE_PIPE * pipe);
    Shape { centre: middle, middle, along, radius, round: false, reach, last, spacing }
}

fn weighted_mean(members: &Members<'_>) -> Vector {
    let weight = |&likely: &f32| f64::from(likely).max(0.05);
    let total: f64 = members.wood.iter().map(weight).sum();
    let each = members.points.iter().zip(members.wood).map(|(p, w)| scale(*p, weight(w)));
    scale(mean(each), members.points.len() as f64 / total)
}

/// Centre and radius of the circle that the points lie on across the axis, if they do.
fn round(
    members: &Members<'_>,
    middle: Vector,
    along: Vector,
    below: Option<&Shape>,
    most: f64,
) -> Option<(Vector, f64)> {
    let [u, v] = across(along);
    let seen = members.points.iter().zip(members.wood).filter(|(_, wood)| **wood >= 0.5);
    let flat: Vec<[f64; 2]> = seen
        .map(|(p, _)| sub(*p, middle))
        .map(|out| [dot(out, u), dot(out, v)])
        .collect();
    if flat.len() < CIRCLE_POINTS {
        return None;
    }
    let prior = below.map(|b| b.last.at(members.carried));
    let prior = prior.map(|radius| Prior { radius, deviation: PRIOR_DEVIATION * radius });
    accept(&fit(&flat, prior)?, members, middle, [u, v], below, most)
}

/// Centre and radius of a circle that can be the branch.
fn accept(
    circle: &Circle,
    members: &Members<'_>,
    middle: Vector,
    [u, v]: [Vector; 2],
    below: Option<&Shape>,
    most: f64,
) -> Option<(Vector, f64)> {
    let off = add(scale(u, circle.centre[0]), scale(v, circle.centre[1]));
    let centre = add(middle, off);
    let thick = circle.radius >= CIRCLE_SPACINGS * members.spacing;
    let thin_wall = circle.spread <= CIRCLE_SPREAD * circle.radius;
    let inside = norm(off) <= 1.2 * circle.radius;
    let near_axis = below.is_none_or(|below| {
        let from = below.last.centre.unwrap_or(below.centre);
        let step = sub(centre, from);
        let sideways = sub(step, scale(below.along, dot(step, below.along)));
        norm(sideways) <= (0.7 * below.last.radius).max(0.4 * norm(step))
    });
    let good = thick && thin_wall && inside && near_axis && circle.radius <= most;
    good.then_some((centre, circle.radius))
}

//! The shape of a section: the points of a branch between two level sets.

use super::circle::{Prior, fit};
use crate::vector::{Vector, across, add, distance, dot, mean, norm, scale, sub, unit};

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
    /// Direction of the axis away from the base, of length one.
    pub(crate) along: Vector,
    /// Radius, m: of the circle where there is one, else the mean distance of the points.
    pub(crate) radius: f64,
    /// Whether centre and radius are those of a circle.
    pub(crate) round: bool,
    /// Radius that the next section is cut and parted by, m: where no circle is seen, it falls.
    pub(crate) reach: f64,
    /// Radius of the last circle on the way from the base, m; of none, the first section's.
    pub(crate) last_round: f64,
    /// Mean distance to the fourth neighbour, m.
    pub(crate) spacing: f64,
}

/// Fewest points of a circle.
const CIRCLE_POINTS: usize = 8;

/// A radius of less than this many spacings is not seen as a circle.
const CIRCLE_SPACINGS: f64 = 1.0;

/// Largest median distance to a circle, relative to its radius.
const CIRCLE_SPREAD: f64 = 0.25;

/// How much thicker than the section below a section may be: stems swell below whorls.
const SWELL: f64 = 1.15;

/// How much smaller [`Shape::reach`] is after a section without a circle: above the last fork that
/// shows as one, branches are thinner than their clumps of points.
const FALL: f64 = 0.85;

/// Share of its own points that the radius below counts as in a circle.
const PRIOR_SHARE: f64 = 0.1;

/// The points of a section and what is known of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Members<'a> {
    pub(crate) points: &'a [Vector],
    /// Likelihood of wood of each: leaves do not move the axis.
    pub(crate) wood: &'a [f32],
    pub(crate) spacing: f64,
}

/// Finds the shape of a section above another, or of the first one.
pub(crate) fn shape(members: &Members<'_>, below: Option<&Shape>, first_radius: f64) -> Shape {
    let middle = weighted_mean(members);
    let along = match below {
        None => [0.0, 0.0, 1.0],
        Some(below) => {
            let step = unit(sub(middle, below.centre)).unwrap_or(below.along);
            unit(add(step, below.along)).unwrap_or(step)
        }
    };
    let most = below.map_or(first_radius, |below| SWELL * below.last_round);
    let spacing = members.spacing;
    if let Some((centre, radius)) = round(members, middle, along, below, most) {
        let (round, reach, last_round) = (true, radius, radius);
        return Shape { centre, along, radius, round, reach, last_round, spacing };
    }
    let away = |p: &Vector| {
        let out = sub(*p, middle);
        norm(sub(out, scale(along, dot(out, along))))
    };
    let radius = members.points.iter().map(away).sum::<f64>() / members.points.len() as f64;
    let radius = radius.min(most);
    let reach = below.map_or(radius, |below| radius.min(FALL * below.reach));
    let last_round = below.map_or(first_radius, |below| below.last_round);
    Shape { centre: middle, along, radius, round: false, reach, last_round, spacing }
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
    let weight = PRIOR_SHARE * flat.len() as f64;
    let prior = below.filter(|b| b.round).map(|b| Prior { radius: b.radius, weight });
    let circle = fit(&flat, prior)?;
    let off = add(scale(u, circle.centre[0]), scale(v, circle.centre[1]));
    let centre = add(middle, off);
    let thick = circle.radius >= CIRCLE_SPACINGS * members.spacing;
    let thin_wall = circle.spread <= CIRCLE_SPREAD * circle.radius;
    let inside = norm(off) <= 1.2 * circle.radius;
    let near_axis = below.is_none_or(|below| {
        let step = sub(centre, below.centre);
        let sideways = sub(step, scale(below.along, dot(step, below.along)));
        norm(sideways) <= below.radius.max(0.5 * distance(centre, below.centre))
    });
    let good = thick && thin_wall && inside && near_axis && circle.radius <= most;
    good.then_some((centre, circle.radius))
}

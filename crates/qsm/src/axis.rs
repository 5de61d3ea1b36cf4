//! Axes moved to where the fits say they are, joined along branches.

use crate::RadiusSource;
use crate::branches::{Branch, Fork, position_at};
use crate::fit::Sample;
use crate::measure::{Measured, Owned, view};
use crate::radii::Radius;
use crate::sections::{Section, Sections};
use rayon::prelude::*;
use timberline_solids::vector::{add, distance, scale, sub};

/// How far a section's ends are moved, and how sure that is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shift {
    start: [f64; 3],
    end: [f64; 3],
    weight: f64,
}

/// A branch after its axis was moved: the ends of its sections.
#[derive(Debug, Clone, PartialEq)]
pub struct Joints {
    /// One position more than sections, m.
    pub at_m: Vec<[f64; 3]>,
    /// Where it begins, in stations of the moved axis of the other branch.
    pub fork: Option<Fork>,
    /// The place on the axis of the other branch where it begins, m.
    pub root_m: Option<[f64; 3]>,
}

/// Rounds of the search for a centre.
const ROUNDS: usize = 8;
/// Tukey's constant (Beaton and Tukey 1974).
const TUKEY: f64 = 4.685;
/// Farthest that a section without a measured radius is moved, in radii plus noises: the skeleton is
/// somewhere in the wood.
const FARTHEST: f64 = 2.0;

/// Moves the axes of all sections.
#[must_use]
pub fn moved(
    branches: &[Branch],
    sections: &Sections,
    measured: &[Option<Measured>],
    radii: &[Radius],
    owned: &Owned<'_>,
    noise_m: f64,
) -> Vec<Joints> {
    let shifts: Vec<Option<Shift>> = (0..sections.all.len())
        .into_par_iter()
        .map(|place| match measured[place] {
            Some(found) if radii[place].source == RadiusSource::Measured => {
                Some(of_fit(&sections.all[place], &found))
            }
            _ => of_points(sections, place, radii[place].radius_m, owned, noise_m),
        })
        .collect();
    let mut all: Vec<Joints> = Vec::with_capacity(branches.len());
    for (number, branch) in branches.iter().enumerate() {
        let joints = of_branch(branch, number, sections, &shifts, &all);
        all.push(joints);
    }
    all
}

/// Where the fitted axis passes the ends of the section.
fn of_fit(section: &Section, found: &Measured) -> Shift {
    let fit = &found.fit;
    let shift = |end: [f64; 3]| {
        let seen = found.view.sample(end, 1.0);
        let across = std::array::from_fn(|k| {
            fit.offset_m[k] + fit.slope[k] * seen.along_m - seen.across_m[k]
        });
        found.view.direction(across)
    };
    let weight = 1.0 / (fit.offset_sd_m * fit.offset_sd_m).max(1e-12);
    Shift { start: shift(section.start_m), end: shift(section.end_m), weight }
}

/// Where a cylinder of known radius fits the section's own points best, the skeleton's axis being as
/// likely as half a radius away. None with fewer than two points.
fn of_points(
    sections: &Sections,
    place: usize,
    radius_m: f64,
    owned: &Owned<'_>,
    noise_m: f64,
) -> Option<Shift> {
    let points = owned.of(place);
    let view = view(sections, place).filter(|_| points.len() >= 2)?;
    let stride = points.len().div_ceil(100);
    let samples: Vec<Sample> = points
        .iter()
        .step_by(stride)
        .map(|&point| view.sample(owned.position_m(point), owned.weight(point)))
        .collect();
    let near = Near { samples: &samples, radius_m, noise_m, free_m: 0.5 * radius_m + noise_m };
    let count = samples.len() as f64;
    let mean = [0, 1].map(|k| samples.iter().map(|s| s.across_m[k]).sum::<f64>() / (count + 1.0));
    let starts = [near.descend([0.0; 2]), near.descend(mean)];
    let best = if starts[1].1 < starts[0].1 { starts[1] } else { starts[0] };
    let [x, y] = best.0;
    let allowed = FARTHEST * (radius_m + noise_m);
    if x * x + y * y > allowed * allowed {
        return None;
    }
    let by = view.direction(best.0);
    let variance = noise_m * noise_m / count + 0.05 * radius_m * radius_m;
    Some(Shift { start: by, end: by, weight: 1.0 / variance })
}

/// The search for the centre of a circle of known radius.
struct Near<'a> {
    samples: &'a [Sample],
    radius_m: f64,
    noise_m: f64,
    /// Standard deviation of the centre before the points are seen, m.
    free_m: f64,
}

impl Near<'_> {
    /// Gauss-Newton from a start; the centre and its loss.
    fn descend(&self, start: [f64; 2]) -> ([f64; 2], f64) {
        let scale = self.noise_m.max(0.2 * self.radius_m);
        let prior = (scale / self.free_m) * (scale / self.free_m);
        let mut centre = start;
        for _ in 0..ROUNDS {
            let (mut xx, mut xy, mut yy) = (prior, 0.0, prior);
            let mut gradient = centre.map(|value| value * prior);
            for sample in self.samples {
                let (e, [ux, uy]) = self.residual(centre, sample);
                let u = e / (scale * TUKEY);
                let w = sample.weight * (1.0 - (u * u).min(1.0)) * (1.0 - (u * u).min(1.0));
                xx += w * ux * ux;
                xy += w * ux * uy;
                yy += w * uy * uy;
                gradient[0] -= w * e * ux;
                gradient[1] -= w * e * uy;
            }
            let determinant = xx * yy - xy * xy;
            centre[0] -= (yy * gradient[0] - xy * gradient[1]) / determinant;
            centre[1] -= (xx * gradient[1] - xy * gradient[0]) / determinant;
        }
        (centre, self.loss(centre, scale, prior))
    }

    /// How far a sample is outside, and the direction from the centre to it.
    fn residual(&self, centre: [f64; 2], sample: &Sample) -> (f64, [f64; 2]) {
        let (x, y) = (sample.across_m[0] - centre[0], sample.across_m[1] - centre[1]);
        let d = (x * x + y * y).sqrt();
        let direction = if d > 0.0 { [x / d, y / d] } else { [0.0; 2] };
        (d - self.radius_m, direction)
    }

    fn loss(&self, centre: [f64; 2], scale: f64, prior: f64) -> f64 {
        let one = |sample: &Sample| {
            let u = self.residual(centre, sample).0 / (scale * TUKEY);
            let inside = 1.0 - (u * u).min(1.0);
            sample.weight * TUKEY * TUKEY / 3.0 * (1.0 - inside * inside * inside)
        };
        let squares = centre[0] * centre[0] + centre[1] * centre[1];
        self.samples.iter().map(one).sum::<f64>() + prior * squares / (scale * scale)
    }
}

/// The joints of one branch; those of the branches before it are known.
fn of_branch(
    branch: &Branch,
    number: usize,
    sections: &Sections,
    shifts: &[Option<Shift>],
    before: &[Joints],
) -> Joints {
    let range = sections.of(number);
    let pieces = &sections.all[range.clone()];
    let mut stations = vec![pieces[0].from_m];
    stations.extend(pieces.iter().map(|piece| piece.to_m));
    let mut old = vec![pieces[0].start_m];
    old.extend(pieces.iter().map(|piece| piece.end_m));
    let mut by = joint_shifts(&shifts[range]);
    let (mut fork, mut root_m) = (None, None);
    if let Some(old_fork) = branch.fork {
        let (new_fork, root, shift) = moved_fork(branch, old_fork, sections, before);
        // Nothing seen of the branch at its foot: it goes with the one it grows on.
        if by[0].is_none() {
            by[0] = Some(shift);
        }
        (fork, root_m) = (Some(new_fork), Some(root));
    }
    let by = filled(&by, &stations);
    let at_m = old.iter().zip(&by).map(|(old, by)| add(*old, *by)).collect();
    Joints { at_m, fork, root_m }
}

/// Shift of every joint from the sections on either side of it.
fn joint_shifts(shifts: &[Option<Shift>]) -> Vec<Option<[f64; 3]>> {
    let one = |joint: usize| {
        let below = joint.checked_sub(1).and_then(|k| shifts[k]).map(|s| (s.end, s.weight));
        let above = shifts.get(joint).copied().flatten().map(|s| (s.start, s.weight));
        match (below, above) {
            (Some((a, wa)), Some((b, wb))) => {
                Some(scale(add(scale(a, wa), scale(b, wb)), 1.0 / (wa + wb)))
            }
            (one, other) => one.or(other).map(|(shift, _)| shift),
        }
    };
    (0..=shifts.len()).map(one).collect()
}

/// Where a fork is on the moved axis of the other branch, and how far it moved.
fn moved_fork(
    branch: &Branch,
    fork: Fork,
    sections: &Sections,
    before: &[Joints],
) -> (Fork, [f64; 3], [f64; 3]) {
    let other = fork.branch as usize;
    let joints = &before[other];
    let place = sections.at(other, fork.at_m);
    let local = place - sections.of(other).start;
    let section = &sections.all[place];
    let length = section.to_m - section.from_m;
    let share = ((fork.at_m - section.from_m) / length).clamp(0.0, 1.0);
    let ends = [joints.at_m[local], joints.at_m[local + 1]];
    let root = add(ends[0], scale(sub(ends[1], ends[0]), share));
    let root_to_first = joints.root_m.map_or(0.0, |root| distance(root, joints.at_m[0]));
    let below: f64 = joints.at_m[..=local].windows(2).map(|p| distance(p[0], p[1])).sum();
    let at_m = root_to_first + below + share * distance(ends[0], ends[1]);
    (Fork { branch: fork.branch, at_m }, root, sub(root, branch.path_m[0]))
}

/// Shifts of all joints: between known ones by distance, beyond them that of the last.
fn filled(by: &[Option<[f64; 3]>], stations: &[f64]) -> Vec<[f64; 3]> {
    let known: Vec<usize> = (0..by.len()).filter(|joint| by[*joint].is_some()).collect();
    if known.is_empty() {
        return vec![[0.0; 3]; by.len()];
    }
    let path: Vec<[f64; 3]> = known.iter().filter_map(|joint| by[*joint]).collect();
    let at: Vec<f64> = known.iter().map(|joint| stations[*joint]).collect();
    stations.iter().map(|station| position_at(&path, &at, *station)).collect()
}

/// The branches that the moved joints and new radii make.
#[must_use]
pub fn rebuilt(
    branches: &[Branch],
    joints: &[Joints],
    sections: &Sections,
    radii: &[Radius],
) -> Vec<Branch> {
    let one = |(number, (branch, joints)): (usize, (&Branch, &Joints))| {
        let range = sections.of(number);
        let mut path_m: Vec<[f64; 3]> = joints.root_m.into_iter().collect();
        let mut radius_m = Vec::new();
        if joints.root_m.is_some() {
            radius_m.push(radii[range.start].radius_m);
        }
        path_m.extend(&joints.at_m);
        radius_m.extend(radii[range].iter().map(|radius| radius.radius_m));
        Branch { path_m, radius_m, fork: joints.fork, order: branch.order, begin_m: 0.0 }
    };
    branches.iter().zip(joints).enumerate().map(one).collect()
}

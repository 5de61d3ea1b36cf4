//! From cross-sections to stems: discs of neighbouring slices that lie on one line.

use crate::disc::{Disc, Shape};
use crate::{StemsParams, slices};

/// Slices without a disc that a stem may have in between: hidden behind a branch.
const LONGEST_GAP: u32 = 5;
/// Discs whose line tells where the next one is expected.
const MEMORY: usize = 5;
/// Steepest lean of a stem: 45 degrees.
const STEEPEST: f64 = 1.0;
/// Least sum of the weights of a stem's discs: two full circles.
const LEAST_WEIGHT: f64 = 2.0;
/// Blobs alone are a stem only where they are in most slices of this many.
const BLOBS_ALONE: usize = 12;

/// A stem: its cross-sections from low to high.
#[derive(Debug, Clone, PartialEq)]
pub struct StemAxis {
    /// The cross-sections, one a slice at most.
    pub discs: Vec<Disc>,
}

impl StemAxis {
    /// Sum of the weights of the cross-sections.
    #[must_use]
    pub fn weight(&self) -> f64 {
        self.discs.iter().map(Disc::weight).sum()
    }

    /// Median radius of the circles, m; of the blobs where there are no circles.
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        let of = |shape: Shape| {
            let radii = self.discs.iter().filter(|disc| disc.shape == shape);
            let mut radii: Vec<f64> = radii.map(|disc| disc.radius_m).collect();
            radii.sort_by(f64::total_cmp);
            radii.get(radii.len() / 2).copied()
        };
        of(Shape::Circle).or_else(|| of(Shape::Blob)).unwrap_or(0.0)
    }

    /// Easting and northing of the axis at an elevation, m, on the line through the nearest discs.
    #[must_use]
    pub fn at_elevation(&self, z_m: f64) -> [f64; 2] {
        let middle = self.discs.partition_point(|disc| disc.centre_m[2] < z_m);
        let first = middle.saturating_sub(MEMORY).min(self.discs.len().saturating_sub(2 * MEMORY));
        let near = &self.discs[first..self.discs.len().min(first + 2 * MEMORY)];
        line(near).at(z_m)
    }

    /// Diameter at a height above ground, m, by a line through the radii of the circles within 1 m
    /// of it; none if there are fewer than three.
    #[must_use]
    pub fn diameter_at(&self, height_m: f64, params: &StemsParams) -> Option<f64> {
        let near =
            self.discs.iter().filter(|disc| disc.shape == Shape::Circle).filter_map(|disc| {
                let off_m = slices::middle_m(disc.slice, params) - height_m;
                (off_m.abs() <= 1.0).then_some((off_m, disc.radius_m))
            });
        let mut radii: Vec<f64> = near.map(|(_, radius)| radius).collect();
        radii.sort_by(f64::total_cmp);
        (radii.len() >= 3).then(|| 2.0 * radii[radii.len() / 2])
    }

    /// Elevations of the lowest and the highest cross-section, m.
    #[must_use]
    pub fn span_m(&self) -> [f64; 2] {
        let z = |disc: Option<&Disc>| disc.map_or(0.0, |disc| disc.centre_m[2]);
        [z(self.discs.first()), z(self.discs.last())]
    }
}

/// Stems among cross-sections, the surest first. Every disc serves one stem at most.
#[must_use]
pub fn stems(discs: &[Disc], params: &StemsParams) -> Vec<StemAxis> {
    let by_slice = BySlice::new(discs);
    let mut seeds: Vec<usize> = (0..discs.len()).collect();
    let rank = |disc: &Disc| (disc.weight() * disc.points.min(100) as f64, disc.centre_m);
    seeds.sort_by(|&a, &b| {
        let (a, b) = (rank(&discs[a]), rank(&discs[b]));
        b.partial_cmp(&a).unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut used = vec![false; discs.len()];
    let mut found = Vec::new();
    for seed in seeds {
        if used[seed] {
            continue;
        }
        let members = follow(discs, &by_slice, &used, seed);
        let axis = StemAxis { discs: members.iter().map(|&at| discs[at]).collect() };
        if is_stem(&axis, params) {
            members.iter().for_each(|&at| used[at] = true);
            found.push(axis);
        }
    }
    found.sort_by(|a, b| b.weight().total_cmp(&a.weight()));
    without_doubles(found)
}

/// Discs by the slice they lie in.
struct BySlice {
    start: Vec<usize>,
}

impl BySlice {
    /// `discs` are sorted by slice.
    fn new(discs: &[Disc]) -> Self {
        let last = discs.last().map_or(0, |disc| disc.slice as usize + 1);
        let begin = |slice: usize| discs.partition_point(|disc| (disc.slice as usize) < slice);
        Self { start: (0..=last).map(begin).collect() }
    }

    fn range(&self, slice: u32) -> std::ops::Range<usize> {
        let at = |slice: usize| self.start.get(slice).copied();
        match (at(slice as usize), at(slice as usize + 1)) {
            (Some(first), Some(end)) => first..end,
            _ => 0..0,
        }
    }
}

/// Follows a stem from a disc upwards and downwards.
fn follow(discs: &[Disc], by_slice: &BySlice, used: &[bool], seed: usize) -> Vec<usize> {
    let mut members = vec![seed];
    for up in [true, false] {
        let mut slice = discs[seed].slice;
        let mut gap = 0;
        while gap <= LONGEST_GAP {
            let Some(next) = (if up { slice.checked_add(1) } else { slice.checked_sub(1) }) else {
                break;
            };
            slice = next;
            match best(discs, by_slice.range(slice), used, &members, up) {
                Some(at) => {
                    let place = if up { members.len() } else { 0 };
                    members.insert(place, at);
                    gap = 0;
                }
                None => gap += 1,
            }
        }
    }
    members
}

/// The disc of a slice that continues the members of a stem best.
fn best(
    discs: &[Disc],
    slice: std::ops::Range<usize>,
    used: &[bool],
    members: &[usize],
    up: bool,
) -> Option<usize> {
    let near: Vec<Disc> = match up {
        true => members.iter().rev().take(MEMORY).map(|&at| discs[at]).collect(),
        false => members.iter().take(MEMORY).map(|&at| discs[at]).collect(),
    };
    let (axis, last) = (line(&near), near[0]);
    let circles = near.iter().filter(|disc| disc.shape == Shape::Circle).map(|disc| disc.radius_m);
    let radius_m = circles.fold(0.0, f64::max);
    let off = |at: usize| {
        let disc = &discs[at];
        let ([x, y], [cx, cy, z]) = (axis.at(disc.centre_m[2]), disc.centre_m);
        let off_m = ((cx - x) * (cx - x) + (cy - y) * (cy - y)).sqrt();
        let room_m =
            0.04 + 0.15 * (z - last.centre_m[2]).abs() + 0.4 * disc.radius_m.max(last.radius_m);
        let alike = disc.shape == Shape::Blob
            || radius_m <= 0.0
            || (0.6..=1.6).contains(&(disc.radius_m / radius_m));
        // A circle is preferred to a blob beside it.
        let badness = off_m / room_m + if disc.shape == Shape::Blob { 0.5 } else { 0.0 };
        (!used[at] && alike && off_m <= room_m).then_some((badness, at))
    };
    let found = slice.filter_map(off);
    found.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, at)| at)
}

/// A steep line in space.
struct Line {
    middle_m: [f64; 3],
    slope: [f64; 2],
}

impl Line {
    fn at(&self, z_m: f64) -> [f64; 2] {
        let dz = z_m - self.middle_m[2];
        [self.middle_m[0] + self.slope[0] * dz, self.middle_m[1] + self.slope[1] * dz]
    }
}

/// The line through the centres of discs, drawn towards the vertical where they are few.
fn line(discs: &[Disc]) -> Line {
    /// Strength of the pull: as that of points 0.3 m above and below the middle.
    const UPRIGHT_M2: f64 = 0.18;
    let total: f64 = discs.iter().map(Disc::weight).sum();
    let mean = |axis: usize| {
        discs.iter().map(|d| d.weight() * d.centre_m[axis]).sum::<f64>() / total.max(1e-9)
    };
    let middle_m = [mean(0), mean(1), mean(2)];
    let moment = |axis: usize| {
        let term = |d: &Disc| {
            d.weight() * (d.centre_m[axis] - middle_m[axis]) * (d.centre_m[2] - middle_m[2])
        };
        discs.iter().map(term).sum::<f64>()
    };
    let spread = moment(2) + UPRIGHT_M2;
    Line { middle_m, slope: [moment(0) / spread, moment(1) / spread] }
}

fn is_stem(axis: &StemAxis, params: &StemsParams) -> bool {
    let [low, high] = axis.span_m();
    let circles = axis.discs.iter().filter(|disc| disc.shape == Shape::Circle).count();
    let slope = line(&axis.discs).slope;
    let enough = match circles {
        0 | 1 => axis.discs.len() >= BLOBS_ALONE,
        _ => axis.weight() >= LEAST_WEIGHT,
    };
    enough
        && high - low >= params.smallest_span_m
        && slope[0] * slope[0] + slope[1] * slope[1] <= STEEPEST * STEEPEST
        && 2.0 * axis.radius_m() >= params.smallest_dbh_m
}

/// Leaves out stems that lie in the wood of a surer one.
fn without_doubles(found: Vec<StemAxis>) -> Vec<StemAxis> {
    let mut kept: Vec<StemAxis> = Vec::new();
    for axis in found {
        let overlaps = |other: &StemAxis| {
            let touching = axis.discs.iter().filter(|disc| {
                let ([x, y], [cx, cy, z]) = (other.at_elevation(disc.centre_m[2]), disc.centre_m);
                let [low, high] = other.span_m();
                let reach_m = other.radius_m().max(disc.radius_m) + 0.02;
                let (dx, dy) = (cx - x, cy - y);
                z >= low - 1.0 && z <= high + 1.0 && dx * dx + dy * dy <= reach_m * reach_m
            });
            2 * touching.count() > axis.discs.len()
        };
        if !kept.iter().any(overlaps) {
            kept.push(axis);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(slice: u32, x: f64, y: f64, radius_m: f64, shape: Shape) -> Disc {
        let z = f64::from(slice) * 0.2 + 0.5;
        let coverage = if shape == Shape::Circle { 0.5 } else { 0.0 };
        Disc { slice, centre_m: [x, y, z], radius_m, shape, coverage, points: 30 }
    }

    #[test]
    fn a_leaning_stem_is_followed_through_gaps() {
        let mut discs: Vec<Disc> = (0..20)
            .filter(|slice| !(7..10).contains(slice))
            .map(|slice| disc(slice, f64::from(slice) * 0.04, 0.0, 0.1, Shape::Circle))
            .collect();
        discs.push(disc(19, 3.0, 3.0, 0.1, Shape::Circle));
        discs.sort_by_key(|disc| disc.slice);
        let found = stems(&discs, &StemsParams::default());
        assert_eq!(found.len(), 1);
        assert_eq!(found[0].discs.len(), 17);
        let [x, _] = found[0].at_elevation(0.5);
        assert!(x.abs() < 0.02, "{x}");
    }

    #[test]
    fn scattered_circles_are_no_stem() {
        let discs: Vec<Disc> = (0..12)
            .map(|s| disc(s, f64::from(s * 7 % 5), f64::from(s), 0.1, Shape::Circle))
            .collect();
        assert_eq!(stems(&discs, &StemsParams::default()), []);
    }

    #[test]
    fn two_stems_side_by_side_stay_two() {
        let mut discs = Vec::new();
        for slice in 0..15 {
            discs.push(disc(slice, 0.0, 0.0, 0.1, Shape::Circle));
            discs.push(disc(slice, 0.25, 0.0, 0.12, Shape::Circle));
        }
        assert_eq!(stems(&discs, &StemsParams::default()).len(), 2);
    }

    #[test]
    fn few_blobs_are_no_stem_and_many_are() {
        let column =
            |n: u32| (0..n).map(|s| disc(s, 1.0, 1.0, 0.04, Shape::Blob)).collect::<Vec<_>>();
        assert_eq!(stems(&column(8), &StemsParams::default()).len(), 0);
        assert_eq!(stems(&column(16), &StemsParams::default()).len(), 1);
    }
}

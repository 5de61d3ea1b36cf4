//! A stem's cross-section in a cluster of points: circle evidence.
//!
//! Circles through three points are tried and scored by the points near them (RANSAC, Fischler and
//! Bolles 1981), and the best is refined by least squares of the distances with Tukey's biweight. A
//! partial arc is enough, as long as the inside of the circle is empty: a scanner does not see
//! through wood.

use crate::StemsParams;
use crate::slices::{Cluster, SlicePoint};

/// Sectors of the circumference whose points are counted.
const SECTORS: usize = 36;
/// Circles tried for a cluster. With a third of the points on the stem, the chance that no triple
/// lies on it is below one in ten thousand: (1 - 1/27)^250.
const TRIALS: u64 = 250;
/// Points of a cluster that circles are tried on; more are thinned evenly.
const MOST_POINTS: usize = 600;
/// Rounds of the refinement.
const ROUNDS: usize = 12;
/// Least part of the circumference that has points: 60 degrees.
const LEAST_COVERAGE: f64 = 1.0 / 6.0;
/// Points within this part of the radius are inside the wood.
const INSIDE: f64 = 0.75;
/// Largest share of points inside the wood, relative to those on the circle.
const MOST_INSIDE: f64 = 0.2;
/// Fewest points on a circle.
const FEWEST: usize = 6;

/// What a cross-section rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A circle was found.
    Circle,
    /// The points lie close together, too few or too scattered for a circle.
    Blob,
}

/// The cross-section of what may be a stem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Disc {
    /// Number of the slice, from the lowest.
    pub slice: u32,
    /// Easting and northing of the centre and mean elevation of the points, m.
    pub centre_m: [f64; 3],
    /// Radius, m.
    pub radius_m: f64,
    /// What it rests on.
    pub shape: Shape,
    /// Part of the circumference that has points, 0 to 1; 0 for a blob.
    pub coverage: f64,
    /// Points it rests on.
    pub points: usize,
}

impl Disc {
    /// How much it says for a stem: a full circle 1, a blob a third of a narrow arc.
    #[must_use]
    pub fn weight(&self) -> f64 {
        match self.shape {
            Shape::Circle => 0.5 + 0.5 * self.coverage,
            Shape::Blob => 0.2,
        }
    }
}

/// The cross-sections in a cluster: circles one after the other from the points that are left, or
/// else a blob.
#[must_use]
pub fn discs(cluster: &Cluster, params: &StemsParams) -> Vec<Disc> {
    let (mut left, mut found) = (cluster.points.clone(), Vec::new());
    while let Some(circle) = circle(&left, params) {
        found.push(disc(cluster.slice, &left, &circle, params));
        // What is near the circle or inside it is explained by it.
        let reach_m = circle.radius_m + 2.0 * params.noise_m;
        left.retain(|point| circle.distance_from_centre_m(point) > reach_m);
    }
    if found.is_empty() {
        found.extend(blob(cluster, params));
    }
    found
}

/// A circle in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Circle {
    centre_m: [f64; 2],
    radius_m: f64,
}

impl Circle {
    fn distance_from_centre_m(&self, point: &SlicePoint) -> f64 {
        let (dx, dy) = (point.x - self.centre_m[0], point.y - self.centre_m[1]);
        (dx * dx + dy * dy).sqrt()
    }

    /// The circle through three points, unless they lie on a line.
    fn through(a: &SlicePoint, b: &SlicePoint, c: &SlicePoint) -> Option<Self> {
        let (bx, by, cx, cy) = (b.x - a.x, b.y - a.y, c.x - a.x, c.y - a.y);
        let d = 2.0 * (bx * cy - by * cx);
        let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
        let (ux, uy) = ((cy * b2 - by * c2) / d, (bx * c2 - cx * b2) / d);
        let radius_m = (ux * ux + uy * uy).sqrt();
        radius_m.is_finite().then_some(Self { centre_m: [a.x + ux, a.y + uy], radius_m })
    }
}

/// The best circle in some points, if it looks like a stem.
fn circle(points: &[SlicePoint], params: &StemsParams) -> Option<Circle> {
    if points.len() < FEWEST {
        return None;
    }
    let stride = points.len().div_ceil(MOST_POINTS);
    let thin: Vec<SlicePoint> = points.iter().step_by(stride).copied().collect();
    let fits = |circle: &Circle| {
        (params.smallest_dbh_m / 2.0..=params.largest_dbh_m / 2.0).contains(&circle.radius_m)
    };
    let best = (0..TRIALS)
        .filter_map(|trial| {
            let [a, b, c] = triple(trial, thin.len());
            Circle::through(&thin[a], &thin[b], &thin[c])
        })
        .filter(fits)
        .map(|circle| (score(&circle, &thin, params.noise_m), circle))
        .reduce(|best, next| if next.0 > best.0 { next } else { best })?;
    let refined = refine(best.1, &thin, params.noise_m);
    (fits(&refined) && is_stem(&refined, points, params)).then_some(refined)
}

/// Three different indices below `len`, the same for the same trial: a scrambled counter.
fn triple(trial: u64, len: usize) -> [usize; 3] {
    let draw = |k: u64| {
        // SplitMix64 (Steele, Lea and Flood 2014).
        let mut z = (3 * trial + k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % len as u64) as usize
    };
    let first = draw(0);
    let second = if draw(1) == first { (first + 1) % len } else { draw(1) };
    let mut third = draw(2);
    while third == first || third == second {
        third = (third + 1) % len;
    }
    [first, second, third]
}

/// How well points fit a circle: those near it count, those inside count against it.
fn score(circle: &Circle, points: &[SlicePoint], noise_m: f64) -> f64 {
    let value = |point: &SlicePoint| {
        let distance_m = circle.distance_from_centre_m(point);
        let residual = (distance_m - circle.radius_m) / noise_m;
        if residual.abs() < 1.0 {
            1.0 - residual * residual
        } else if distance_m < INSIDE * circle.radius_m {
            -1.0
        } else {
            0.0
        }
    };
    points.iter().map(value).sum()
}

/// Gauss-Newton steps on the distances to the circle, weighted by Tukey's biweight.
fn refine(mut circle: Circle, points: &[SlicePoint], noise_m: f64) -> Circle {
    for _ in 0..ROUNDS {
        let (mut normal, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
        for point in points {
            let distance_m = circle.distance_from_centre_m(point);
            let residual_m = distance_m - circle.radius_m;
            let scaled = residual_m / (2.0 * noise_m);
            if scaled.abs() >= 1.0 || distance_m <= 0.0 {
                continue;
            }
            let weight = (1.0 - scaled * scaled) * (1.0 - scaled * scaled);
            let row = nalgebra::Vector3::new(
                (point.x - circle.centre_m[0]) / distance_m,
                (point.y - circle.centre_m[1]) / distance_m,
                1.0,
            );
            normal += row * row.transpose() * weight;
            right += row * (residual_m * weight);
        }
        let Some(step) = normal.cholesky().map(|factor| factor.solve(&right)) else { break };
        circle.centre_m = [circle.centre_m[0] + step[0], circle.centre_m[1] + step[1]];
        circle.radius_m += step[2];
        if step.norm() < 1e-6 {
            break;
        }
    }
    circle
}

/// Whether a circle looks like a stem: enough of its circumference has points, its inside has few.
fn is_stem(circle: &Circle, points: &[SlicePoint], params: &StemsParams) -> bool {
    let (on, inside) = support(circle, points, params.noise_m);
    let around =
        points.iter().filter(|p| circle.distance_from_centre_m(p) <= 1.5 * circle.radius_m).count();
    on.len() >= FEWEST
        && coverage(circle, &on) >= LEAST_COVERAGE
        && inside as f64 <= MOST_INSIDE * on.len() as f64
        && 2 * on.len() >= around
}

/// Points on the circle, and the number of points inside it.
fn support<'a>(
    circle: &Circle,
    points: &'a [SlicePoint],
    noise_m: f64,
) -> (Vec<&'a SlicePoint>, usize) {
    let (mut on, mut inside) = (Vec::new(), 0);
    for point in points {
        let distance_m = circle.distance_from_centre_m(point);
        if (distance_m - circle.radius_m).abs() <= noise_m {
            on.push(point);
        } else if distance_m < INSIDE * circle.radius_m {
            inside += 1;
        }
    }
    (on, inside)
}

fn coverage(circle: &Circle, on: &[&SlicePoint]) -> f64 {
    let mut seen = [false; SECTORS];
    for point in on {
        let angle = libm::atan2(point.y - circle.centre_m[1], point.x - circle.centre_m[0]);
        let turn = angle / std::f64::consts::TAU + 0.5;
        seen[((turn * SECTORS as f64) as usize).min(SECTORS - 1)] = true;
    }
    seen.iter().filter(|seen| **seen).count() as f64 / SECTORS as f64
}

fn disc(slice: u32, points: &[SlicePoint], circle: &Circle, params: &StemsParams) -> Disc {
    let (on, _) = support(circle, points, params.noise_m);
    let z = on.iter().map(|point| point.z).sum::<f64>() / on.len().max(1) as f64;
    Disc {
        slice,
        centre_m: [circle.centre_m[0], circle.centre_m[1], z],
        radius_m: circle.radius_m,
        shape: Shape::Circle,
        coverage: coverage(circle, &on),
        points: on.len(),
    }
}

/// A cluster that is too sparse for a circle but narrow: its middle and the spread around it.
fn blob(cluster: &Cluster, params: &StemsParams) -> Option<Disc> {
    const FEWEST_IN_BLOB: usize = 4;
    const WIDEST_M: f64 = 0.3;
    let points = &cluster.points;
    if points.len() < FEWEST_IN_BLOB {
        return None;
    }
    let range = |axis: fn(&SlicePoint) -> f64| {
        let fold = |(low, high): (f64, f64), value: f64| (low.min(value), high.max(value));
        points.iter().map(axis).fold((f64::INFINITY, f64::NEG_INFINITY), fold)
    };
    let ((west, east), (south, north)) = (range(|p| p.x), range(|p| p.y));
    let width_m = (east - west).max(north - south);
    let z = points.iter().map(|point| point.z).sum::<f64>() / points.len() as f64;
    (width_m >= params.smallest_dbh_m / 2.0 && width_m <= WIDEST_M).then_some(Disc {
        slice: cluster.slice,
        centre_m: [(west + east) / 2.0, (south + north) / 2.0, z],
        radius_m: width_m / 2.0,
        shape: Shape::Blob,
        coverage: 0.0,
        points: points.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Points on an arc with noise that repeats every seven points, and some beside it.
    fn arc(centre: [f64; 2], radius: f64, from: f64, degrees: f64, count: usize) -> Cluster {
        let point = |k: usize| {
            let angle = (from + degrees * k as f64 / count as f64).to_radians();
            let r = radius + 0.004 * ((k * 5 % 7) as f64 / 3.0 - 1.0);
            let (sin, cos) = libm::sincos(angle);
            SlicePoint { x: centre[0] + r * cos, y: centre[1] + r * sin, z: 1.3, height_m: 1.3 }
        };
        Cluster { slice: 4, points: (0..count).map(point).collect() }
    }

    proptest! {
        #[test]
        fn an_arc_of_ninety_degrees_gives_its_circle(x in -50f64..50., y in -50f64..50., radius in 0.05f64..0.5, from in 0f64..360.) {
            let found = discs(&arc([x, y], radius, from, 90.0, 60), &StemsParams::default());
            prop_assert_eq!(found.len(), 1);
            prop_assert_eq!(found[0].shape, Shape::Circle);
            prop_assert!((found[0].radius_m - radius).abs() < 0.02 + 0.1 * radius, "{:?}", found[0]);
        }
    }

    #[test]
    fn a_branch_through_the_slice_does_not_hide_the_stem() {
        let mut cluster = arc([1.0, 2.0], 0.12, 20.0, 200.0, 80);
        let twig = |k: u32| SlicePoint {
            x: 1.12 + 0.01 * f64::from(k),
            y: 2.0 + 0.003 * f64::from(k % 5),
            z: 1.3,
            height_m: 1.3,
        };
        cluster.points.extend((0..60).map(twig));
        let found = discs(&cluster, &StemsParams::default());
        assert!((found[0].radius_m - 0.12).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn two_stems_that_touch_are_two() {
        let mut cluster = arc([0.0, 0.0], 0.15, 0.0, 360.0, 120);
        cluster.points.extend(arc([0.27, 0.0], 0.11, 0.0, 360.0, 100).points);
        let found = discs(&cluster, &StemsParams::default());
        assert_eq!(found.iter().filter(|disc| disc.shape == Shape::Circle).count(), 2, "{found:?}");
    }

    #[test]
    fn foliage_is_no_stem() {
        // A filled square: low discrepancy points (Kronecker with the golden ratio and its square).
        let point = |k: u32| {
            let part = |step: f64| (f64::from(k) * step).fract();
            let (x, y) = (part(0.618_033_988_75) * 0.8, part(0.754_877_666_25) * 0.8);
            SlicePoint { x, y, z: 1.3, height_m: 1.3 }
        };
        let cluster = Cluster { slice: 0, points: (0..300).map(point).collect() };
        let found = discs(&cluster, &StemsParams::default());
        assert!(found.iter().all(|disc| disc.coverage < 0.5), "{found:?}");
    }

    #[test]
    fn points_on_a_line_are_no_circle() {
        let point = |k: u32| SlicePoint { x: 0.02 * f64::from(k), y: 1.0, z: 1.3, height_m: 1.3 };
        let cluster = Cluster { slice: 0, points: (0..40).map(point).collect() };
        assert_eq!(discs(&cluster, &StemsParams::default()), []);
    }
}

//! Circles to start from.

use super::{Expected, Sample};

/// A circle across the expected axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Centre, m.
    pub centre_m: [f64; 2],
    /// Radius, m.
    pub radius_m: f64,
}

/// Triples of points that are tried: with two of three points on leaves or neighbours, one of 27
/// triples is good, and 60 hold a good one in nine cases of ten; with one of three, always.
const TRIPLES: usize = 60;
/// Points by which circles are compared.
const JUDGES: usize = 120;
/// A point inside a circle speaks more strongly against it than one outside: leaves and neighbours
/// lie outside, and inside wood there is nothing.
const INSIDE_COST: f64 = 2.0;
/// Half width, in standard deviations of the noise, within which a point agrees with a circle ...
const CUT_NOISES: f64 = 3.0;
/// ... but at least this share of the expected radius: sections are neither round nor straight.
const CUT_RADII: f64 = 0.1;
/// Largest radius against the extent of the points: an arc of 60 degrees is as wide as its radius.
const RADIUS_PER_EXTENT: f64 = 1.5;

/// Half width within which a point agrees with a surface, m.
#[must_use]
pub fn cut_m(expected: &Expected) -> f64 {
    (CUT_NOISES * expected.noise_m).max(CUT_RADII * expected.radius_m)
}

/// Largest distance between points across the axis, along either direction, m.
#[must_use]
pub fn extent_m(samples: &[Sample]) -> f64 {
    let width = |axis: usize| {
        let (low, high) =
            samples.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), sample| {
                (low.min(sample.across_m[axis]), high.max(sample.across_m[axis]))
            });
        high - low
    };
    width(0).max(width(1))
}

/// The circle that agrees best with the points, by a truncated quadratic loss (MSAC, Torr and
/// Zisserman 2000) that counts points inside twice.
#[must_use]
pub fn best(samples: &[Sample], expected: &Expected) -> Option<Circle> {
    let cut = cut_m(expected);
    let largest = RADIUS_PER_EXTENT * extent_m(samples);
    let stride = samples.len().div_ceil(JUDGES).max(1);
    let judges: Vec<Sample> = samples.iter().copied().step_by(stride).collect();
    let mut choice = Choice { judges: &judges, cut, largest, found: None };
    choice.consider(algebraic(samples.iter().map(|sample| (sample.across_m, sample.weight))));
    each_triple(samples.len(), |[i, j, k]| {
        choice.consider(through([samples[i].across_m, samples[j].across_m, samples[k].across_m]));
    });
    let (_, circle) = choice.found?;
    // What agrees with the winner gives a better start than its three points.
    let near = samples.iter().filter(|s| residual(&circle, s.across_m).abs() < 2.0 * cut);
    choice.consider(algebraic(near.map(|sample| (sample.across_m, sample.weight))));
    choice.found.map(|(_, circle)| circle)
}

/// The circle of least cost so far.
struct Choice<'a> {
    judges: &'a [Sample],
    cut: f64,
    largest: f64,
    found: Option<(f64, Circle)>,
}

impl Choice<'_> {
    fn consider(&mut self, circle: Option<Circle>) {
        let Some(circle) = circle.filter(|c| c.radius_m > 0.0 && c.radius_m <= self.largest) else {
            return;
        };
        let most = self.found.map_or(f64::INFINITY, |(cost, _)| cost);
        if let Some(cost) = cost_below(&circle, self.judges, self.cut, most) {
            self.found = Some((cost, circle));
        }
    }
}

/// Distance of a position from the circle's centre, less its radius, m.
fn residual(circle: &Circle, at_m: [f64; 2]) -> f64 {
    let (x, y) = (at_m[0] - circle.centre_m[0], at_m[1] - circle.centre_m[1]);
    (x * x + y * y).sqrt() - circle.radius_m
}

/// What the points say against a circle, if it is below `most`.
fn cost_below(circle: &Circle, samples: &[Sample], cut: f64, most: f64) -> Option<f64> {
    let mut sum = 0.0;
    for sample in samples {
        let e = residual(circle, sample.across_m) / cut;
        let loss = if e < -1.0 { INSIDE_COST } else { (e * e).min(1.0) };
        sum += sample.weight * loss;
        if sum >= most {
            return None;
        }
    }
    Some(sum)
}

/// The circle through three points; none where they are in line.
#[must_use]
pub fn through(points_m: [[f64; 2]; 3]) -> Option<Circle> {
    let [a, b, c] = points_m;
    let (bx, by, cx, cy) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
    let twice = 2.0 * (bx * cy - by * cx);
    let (b2, c2) = (bx * bx + by * by, cx * cx + cy * cy);
    // Nearly in line: the radius is a hundred times the distance between the points.
    if twice.abs() < 1e-2 * b2.max(c2) {
        return None;
    }
    let (x, y) = ((cy * b2 - by * c2) / twice, (bx * c2 - cx * b2) / twice);
    Some(Circle { centre_m: [a[0] + x, a[1] + y], radius_m: (x * x + y * y).sqrt() })
}

/// Gives all triples of few points, and of many a fixed sequence of [`TRIPLES`].
fn each_triple(len: usize, mut give: impl FnMut([usize; 3])) {
    if len <= 8 {
        for i in 0..len {
            for j in i + 1..len {
                (j + 1..len).for_each(|k| give([i, j, k]));
            }
        }
        return;
    }
    // Weyl sequences with the fractional parts of the plastic number's powers (Roberts 2018) fill
    // the cube evenly, the same for the same number of points.
    const STEPS: [f64; 3] =
        [0.819_172_513_396_164_5, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3];
    for trial in 1..=TRIPLES {
        let place = |step: f64| {
            let turn = 0.5 + step * trial as f64;
            (((turn - turn.floor()) * len as f64) as usize).min(len - 1)
        };
        let triple = STEPS.map(place);
        if triple[0] != triple[1] && triple[1] != triple[2] && triple[0] != triple[2] {
            give(triple);
        }
    }
}

/// Sums of a weighted point set, for the algebraic fit.
#[derive(Debug, Default, Clone, Copy)]
struct Moments {
    xx: f64,
    yy: f64,
    xy: f64,
    xz: f64,
    yz: f64,
    zz: f64,
}

/// The "hyper" fit, algebraic without essential bias (Al-Sharadqah and Chernov 2009, section 8), of
/// weighted points; none where they are in line or too few.
#[must_use]
pub fn algebraic(points: impl Iterator<Item = ([f64; 2], f64)> + Clone) -> Option<Circle> {
    let (sum, mean) = weighted_mean(points.clone())?;
    let mut m = Moments::default();
    for (at, weight) in points {
        let (x, y, w) = (at[0] - mean[0], at[1] - mean[1], weight / sum);
        let z = x * x + y * y;
        m.xx += w * x * x;
        m.yy += w * y * y;
        m.xy += w * x * y;
        m.xz += w * x * z;
        m.yz += w * y * z;
        m.zz += w * z * z;
    }
    let root = smallest_root(&m);
    let determinant = root * root - root * (m.xx + m.yy) + m.xx * m.yy - m.xy * m.xy;
    // Points in line have a determinant of 0 but for rounding.
    if determinant.abs() <= 1e-12 * (m.xx + m.yy) * (m.xx + m.yy) {
        return None;
    }
    let x = (m.xz * (m.yy - root) - m.yz * m.xy) / determinant / 2.0;
    let y = (m.yz * (m.xx - root) - m.xz * m.xy) / determinant / 2.0;
    let squared = x * x + y * y + m.xx + m.yy - 2.0 * root;
    let radius_m = squared.max(0.0).sqrt();
    radius_m.is_finite().then_some(Circle { centre_m: [mean[0] + x, mean[1] + y], radius_m })
}

fn weighted_mean(points: impl Iterator<Item = ([f64; 2], f64)>) -> Option<(f64, [f64; 2])> {
    let (mut sum, mut x, mut y, mut count) = (0.0, 0.0, 0.0, 0);
    for (at, weight) in points {
        sum += weight;
        x += weight * at[0];
        y += weight * at[1];
        count += 1;
    }
    (count >= 3 && sum > 0.0).then(|| (sum, [x / sum, y / sum]))
}

/// Newton's method from 0 on the characteristic polynomial (ibid.).
fn smallest_root(m: &Moments) -> f64 {
    let z = m.xx + m.yy;
    let (cov, var_z) = (m.xx * m.yy - m.xy * m.xy, m.zz - z * z);
    let a2 = 4.0 * cov - 3.0 * z * z - m.zz;
    let a1 = var_z * z + 4.0 * cov * z - m.xz * m.xz - m.yz * m.yz;
    let a0 = m.xz * (m.xz * m.yy - m.yz * m.xy) + m.yz * (m.yz * m.xx - m.xz * m.xy) - var_z * cov;
    let (mut root, mut value) = (0.0, a0);
    for _ in 0..20 {
        let slope = a1 + root * (2.0 * a2 + 16.0 * root * root);
        let next = root - value / slope;
        if !next.is_finite() || next == root {
            break;
        }
        let at_next = a0 + next * (a1 + next * (a2 + 4.0 * next * next));
        if at_next.abs() >= value.abs() {
            break;
        }
        (root, value) = (next, at_next);
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(circle: &Circle, angle: f64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(angle);
        [circle.centre_m[0] + circle.radius_m * cos, circle.centre_m[1] + circle.radius_m * sin]
    }

    proptest! {
        #[test]
        fn exact_circles_are_found_exactly(
            x in -5.0f64..5.0, y in -5.0f64..5.0, radius in 0.005f64..1.0, from in 0.0f64..6.0, arc in 0.5f64..6.0,
        ) {
            let circle = Circle { centre_m: [x, y], radius_m: radius };
            let points: Vec<[f64; 2]> = (0..12).map(|i| at(&circle, from + arc * f64::from(i) / 11.0)).collect();
            let three = through([points[0], points[5], points[11]]).unwrap();
            let all = algebraic(points.iter().map(|p| (*p, 1.0))).unwrap();
            for found in [three, all] {
                prop_assert!((found.radius_m - radius).abs() < 1e-6, "{found:?}");
                prop_assert!((found.centre_m[0] - x).abs() < 1e-6 && (found.centre_m[1] - y).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn points_in_line_have_no_circle() {
        let points: Vec<[f64; 2]> = (0..9).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        assert_eq!(through([points[0], points[3], points[8]]), None);
        assert_eq!(algebraic(points.iter().map(|p| (*p, 1.0))), None);
        assert_eq!(algebraic([([1.0, 1.0], 1.0); 7].into_iter()), None, "one point seven times");
    }

    #[test]
    fn triples_of_few_points_are_all_and_of_many_are_different() {
        let mut all = 0;
        each_triple(7, |_| all += 1);
        assert_eq!(all, 35);
        let mut many = std::collections::BTreeSet::new();
        each_triple(500, |mut triple| {
            triple.sort_unstable();
            many.insert(triple);
        });
        assert!(many.len() > 50, "{}", many.len());
    }
}

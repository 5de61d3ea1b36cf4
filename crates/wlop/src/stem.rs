//! Which points are the stem's: a cylinder followed upwards from the base.

/// Height of a slice, m.
const SLICE_M: f64 = 0.2;
/// A slice's circle needs as many points.
const FEWEST: usize = 10;
/// The stem ends where this many slices in a row show no circle: a metre.
const MOST_MISSES: u32 = 5;
/// Points are looked for up to this many radii from where the axis should be, and this much more.
const SEARCH: (f64, f64) = (1.6, 0.05);
/// Points are the stem's up to this many radii from its axis, and this much more.
const BELONGS: (f64, f64) = (1.3, 0.02);
/// Radius of a slice over that of the last, least and most.
const RADIUS_RATIO: (f64, f64) = (0.6, 1.25);
/// Root mean square distance of the points from their circle over its radius, at most.
const ROUGHNESS: f64 = 0.35;
/// Thinner stems are branches like others, m.
const THINNEST_M: f64 = 0.015;

/// A circle in a horizontal slice, m.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Circle {
    x: f64,
    y: f64,
    radius_m: f64,
}

/// For every point whether it is part of the stem: within a cylinder that follows the circles of
/// slices of 0.2 m upwards from the base. It begins with the diameter at breast height, or where
/// there is none with the circle through the lowest half metre, follows the axis through slices
/// without a circle, and ends after a metre of these or when it is thinner than 3 cm. The crown's
/// points within the cylinder count as the stem's. All in one local frame, m.
#[must_use]
pub fn stem_points(points: &[[f64; 3]], base_m: [f64; 3], dbh_m: Option<f64>) -> Vec<bool> {
    let slice_of = |p: &[f64; 3]| ((p[2] - base_m[2]) / SLICE_M).floor();
    let mut slices: Vec<(i64, u32)> =
        points.iter().zip(0..).map(|(p, i)| (slice_of(p).max(0.0) as i64, i)).collect();
    slices.sort_unstable();
    let mut is_stem = vec![false; points.len()];
    let Some(mut axis) = first_circle(points, base_m, dbh_m) else { return is_stem };
    let (mut lean, mut misses, mut last) = ([0.0; 2], 0, -1);
    for slice in slices.chunk_by(|a, b| a.0 == b.0) {
        let members = || slice.iter().map(|(_, i)| *i as usize);
        misses += (slice[0].0 - last - 1).clamp(0, i64::from(MOST_MISSES)) as u32;
        let up = (slice[0].0 - last) as f64;
        last = slice[0].0;
        (axis.x, axis.y) = (axis.x + up * lean[0], axis.y + up * lean[1]);
        match next_circle(points, members, axis) {
            Some(next) => {
                // Slowly: a single slice must not turn the stem aside.
                let by = [(next.x - axis.x) * 0.3 / up, (next.y - axis.y) * 0.3 / up];
                lean = [lean[0] + by[0], lean[1] + by[1]];
                axis = Circle { radius_m: (axis.radius_m + next.radius_m) / 2.0, ..next };
                misses = 0;
            }
            None => misses += 1,
        }
        if misses >= MOST_MISSES || axis.radius_m < THINNEST_M {
            break;
        }
        let most_m = BELONGS.0 * axis.radius_m + BELONGS.1;
        members()
            .filter(|&i| distance_m(points[i], axis) <= most_m)
            .for_each(|i| is_stem[i] = true);
    }
    is_stem
}

fn distance_m(p: [f64; 3], circle: Circle) -> f64 {
    let (dx, dy) = (p[0] - circle.x, p[1] - circle.y);
    (dx * dx + dy * dy).sqrt()
}

/// Where the stem begins; nothing where the lowest points show no circle.
fn first_circle(points: &[[f64; 3]], base_m: [f64; 3], dbh_m: Option<f64>) -> Option<Circle> {
    const LOWEST_M: f64 = 0.5;
    if let Some(dbh_m) = dbh_m.filter(|dbh| *dbh > 0.0) {
        return Some(Circle { x: base_m[0], y: base_m[1], radius_m: dbh_m / 2.0 });
    }
    let low = points.iter().filter(|p| p[2] - base_m[2] < LOWEST_M);
    let low: Vec<[f64; 2]> = low.map(|p| [p[0], p[1]]).collect();
    fit(&low).filter(|circle| circle.radius_m < 2.0)
}

/// The circle of a slice near where the last one leads, if there is one.
fn next_circle<I: Iterator<Item = usize>>(
    points: &[[f64; 3]],
    members: impl Fn() -> I,
    axis: Circle,
) -> Option<Circle> {
    let most_m = SEARCH.0 * axis.radius_m + SEARCH.1;
    let mut near: Vec<[f64; 2]> = members()
        .filter(|&i| distance_m(points[i], axis) <= most_m)
        .map(|i| [points[i][0], points[i][1]])
        .collect();
    let mut circle = fit(&near)?;
    // Twice without what is far from the circle: twigs and leaves.
    for _ in 0..2 {
        let off = |p: &[f64; 2]| (distance_m([p[0], p[1], 0.0], circle) - circle.radius_m).abs();
        let mut offs: Vec<f64> = near.iter().map(off).collect();
        offs.sort_unstable_by(f64::total_cmp);
        let most_m = 3.0 * offs[offs.len() / 2] + 1e-3;
        near.retain(|p| off(p) <= most_m);
        circle = fit(&near)?;
    }
    let off = |p: &[f64; 2]| distance_m([p[0], p[1], 0.0], circle) - circle.radius_m;
    let mean_square = near.iter().map(|p| off(p) * off(p)).sum::<f64>() / near.len() as f64;
    let ratio = circle.radius_m / axis.radius_m;
    let shift_m = distance_m([circle.x, circle.y, 0.0], axis);
    let good = (RADIUS_RATIO.0..=RADIUS_RATIO.1).contains(&ratio)
        && mean_square.sqrt() <= ROUGHNESS * circle.radius_m
        && shift_m <= 0.5 * axis.radius_m + SEARCH.1;
    good.then_some(circle)
}

/// The algebraic circle through points in the plane (Kåsa 1976): nothing for fewer than
/// [`FEWEST`] or for points on a line.
fn fit(points: &[[f64; 2]]) -> Option<Circle> {
    if points.len() < FEWEST {
        return None;
    }
    let count = points.len() as f64;
    let mut mean = [0.0; 2];
    points.iter().for_each(|p| (0..2).for_each(|k| mean[k] += p[k] / count));
    let (mut uu, mut uv, mut vv) = (0.0, 0.0, 0.0);
    let (mut uq, mut vq, mut q) = (0.0, 0.0, 0.0);
    for p in points {
        let (u, v) = (p[0] - mean[0], p[1] - mean[1]);
        let square = u * u + v * v;
        (uu, uv, vv) = (uu + u * u, uv + u * v, vv + v * v);
        (uq, vq, q) = (uq + u * square, vq + v * square, q + square);
    }
    let determinant = uu * vv - uv * uv;
    if determinant <= 1e-9 * q * q {
        return None;
    }
    let x = (uq * vv - vq * uv) / (2.0 * determinant);
    let y = (vq * uu - uq * uv) / (2.0 * determinant);
    let radius_m = (x * x + y * y + q / count).sqrt();
    Some(Circle { x: mean[0] + x, y: mean[1] + y, radius_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A leaning stem of 10 cm radius up to 6 m, a branch from 3 m, and a crown from 5 m up.
    fn tree() -> (Vec<[f64; 3]>, usize) {
        let mut points = Vec::new();
        for i in 0..6000 {
            let (t, z) = (f64::from(i) * 2.399_963, f64::from(i) * 0.001);
            points.push([0.1 * libm::cos(t) + 0.05 * z, 0.1 * libm::sin(t), z]);
        }
        let stem = points.len();
        for i in 0..500 {
            let (t, d) = (f64::from(i) * 2.399_963, 0.2 + f64::from(i) * 0.003);
            points.push([0.15, d, 3.0 + 0.5 * d + 0.02 * libm::sin(t)]);
        }
        (points, stem)
    }

    #[test]
    fn the_stem_is_told_from_a_branch() {
        let (points, stem) = tree();
        for dbh_m in [Some(0.2), None] {
            let found = stem_points(&points, [0.0; 3], dbh_m);
            let right = found[..stem].iter().filter(|s| **s).count();
            assert!(right > stem * 95 / 100, "{dbh_m:?}: {right} of {stem}");
            assert!(!found[stem..].iter().any(|s| *s), "{dbh_m:?}");
        }
    }

    #[test]
    fn without_a_lower_stem_nothing_is_stem() {
        let line: Vec<[f64; 3]> = (0..300).map(|i| [f64::from(i) * 0.01, 0.0, 0.2]).collect();
        assert!(!stem_points(&line, [0.0; 3], None).contains(&true));
        assert!(stem_points(&[], [0.0; 3], None).is_empty());
    }
}

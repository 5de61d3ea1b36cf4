//! Robust circles through few points, also where they cover only part of the arc.

use nalgebra::{Matrix3, Vector3};

/// A circle in the plane, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Circle {
    pub(crate) centre: [f64; 2],
    pub(crate) radius: f64,
    /// Median absolute distance of the points to the circle, m.
    pub(crate) spread: f64,
}

/// What is known before the points are looked at: a radius and its standard deviation, m. An arc
/// long enough for its noise overrules it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Prior {
    pub(crate) radius: f64,
    pub(crate) deviation: f64,
}

/// Rounds of reweighting: changes are far below the noise after that many.
const ROUNDS: usize = 8;

/// Points beyond this many median distances are left out of the start.
const TRIM: f64 = 2.5;

/// Tukey's constant, in robust standard deviations (Beaton and Tukey 1974).
const TUKEY: f64 = 4.685;

/// Standard deviations in a median absolute deviation.
const MAD: f64 = 1.4826;

/// Rounds in which the algebraic start leaves out what lies far off.
const TRIMS: usize = 3;

/// A circle this many times wider than its points are apart is a line.
const FLATTEST: f64 = 20.0;

/// Fits a circle: algebraically (Kåsa 1976) to what lies near, then by geometric distance in
/// Gauss-Newton steps under Tukey's loss. `None` when the points lie on a line or the steps lead
/// nowhere.
pub(crate) fn fit(points: &[[f64; 2]], prior: Option<Prior>) -> Option<Circle> {
    let mut circle = start(points, prior)?;
    for _ in 0..ROUNDS {
        let before = circle;
        circle = step(points, &circle, prior)?;
        circle.spread = spread(points, &circle);
        if moved(&before, &circle) < 1e-5 {
            break;
        }
    }
    let away = points.iter().map(|p| apart(*p, points[0])).fold(0.0, f64::max);
    let sound = circle.radius > 0.0 && circle.radius <= FLATTEST * away;
    (sound && circle.centre.iter().all(|value| value.is_finite())).then_some(circle)
}

fn moved(a: &Circle, b: &Circle) -> f64 {
    apart(a.centre, b.centre).max((a.radius - b.radius).abs())
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    let d = [a[0] - b[0], a[1] - b[1]];
    (d[0] * d[0] + d[1] * d[1]).sqrt()
}

fn start(points: &[[f64; 2]], prior: Option<Prior>) -> Option<Circle> {
    let mut circle = algebraic(points)?;
    circle.spread = spread(points, &circle);
    for _ in 0..TRIMS {
        let near = |p: &&[f64; 2]| from_circle(p, &circle).abs() <= TRIM * circle.spread;
        let kept: Vec<[f64; 2]> = points.iter().filter(near).copied().collect();
        if kept.len() == points.len() {
            break;
        }
        let Some(trimmed) = algebraic(&kept) else {
            break;
        };
        circle = Circle { spread: spread(points, &trimmed), ..trimmed };
    }
    // On a short noisy arc this circle is far too small: begin with the known radius instead.
    if let Some(prior) = prior.filter(|prior| circle.radius < 0.5 * prior.radius) {
        circle = pushed_in(points, &circle, prior);
        circle.spread = spread(points, &circle);
    }
    Some(circle)
}

fn algebraic(points: &[[f64; 2]]) -> Option<Circle> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for p in points {
        let row = Vector3::new(p[0], p[1], 1.0);
        matrix += row * row.transpose();
        right += row * (p[0] * p[0] + p[1] * p[1]);
    }
    let [a, b, c]: [f64; 3] = matrix.cholesky()?.solve(&right).into();
    let centre = [a / 2.0, b / 2.0];
    let squared = c + centre[0] * centre[0] + centre[1] * centre[1];
    Some(Circle { centre, radius: squared.max(0.0).sqrt(), spread: 0.0 })
}

/// The circle of the known radius on the same side of the points as one through them.
fn pushed_in(points: &[[f64; 2]], circle: &Circle, prior: Prior) -> Circle {
    let n = points.len() as f64;
    let sum = points.iter().fold([0.0; 2], |sum, p| [sum[0] + p[0], sum[1] + p[1]]);
    let mean = [sum[0] / n, sum[1] / n];
    let to = [circle.centre[0] - mean[0], circle.centre[1] - mean[1]];
    let length = (to[0] * to[0] + to[1] * to[1]).sqrt();
    let by = if length > 1e-9 { (prior.radius - circle.radius) / length } else { 0.0 };
    let centre = [circle.centre[0] + by * to[0], circle.centre[1] + by * to[1]];
    Circle { centre, radius: prior.radius, spread: 0.0 }
}

/// One Gauss-Newton step on weighted distances.
fn step(points: &[[f64; 2]], at: &Circle, prior: Option<Prior>) -> Option<Circle> {
    let scale = (TUKEY * MAD * at.spread).max(1e-6);
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for p in points {
        let out = [p[0] - at.centre[0], p[1] - at.centre[1]];
        let length = (out[0] * out[0] + out[1] * out[1]).sqrt().max(1e-9);
        let residual = length - at.radius;
        let u = residual / scale;
        if u.abs() >= 1.0 {
            continue;
        }
        let weight = (1.0 - u * u) * (1.0 - u * u);
        let row = Vector3::new(out[0] / length, out[1] / length, 1.0);
        matrix += row * row.transpose() * weight;
        right += row * (residual * weight);
    }
    if let Some(prior) = prior {
        let ratio = (MAD * at.spread / prior.deviation).max(1e-6);
        matrix[(2, 2)] += ratio * ratio;
        right[2] += ratio * ratio * (prior.radius - at.radius);
    }
    let by: [f64; 3] = matrix.cholesky()?.solve(&right).into();
    let centre = [at.centre[0] + by[0], at.centre[1] + by[1]];
    Some(Circle { centre, radius: at.radius + by[2], spread: at.spread })
}

fn spread(points: &[[f64; 2]], circle: &Circle) -> f64 {
    let mut away: Vec<f64> = points.iter().map(|p| from_circle(p, circle).abs()).collect();
    let middle = away.len() / 2;
    *away.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn from_circle(p: &[f64; 2], circle: &Circle) -> f64 {
    let out = [p[0] - circle.centre[0], p[1] - circle.centre[1]];
    (out[0] * out[0] + out[1] * out[1]).sqrt() - circle.radius
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(from: f64, to: f64, noise: f64) -> Vec<[f64; 2]> {
        (0..60)
            .map(|i| {
                let angle = from + (to - from) * f64::from(i) / 59.0;
                let r = 0.15 + noise * f64::from((i * 37) % 11 - 5) / 5.0;
                [3.0 + r * libm::cos(angle), -2.0 + r * libm::sin(angle)]
            })
            .collect()
    }

    #[test]
    fn full_and_third_arcs_and_outliers() {
        let whole = fit(&arc(0.0, 6.28, 0.003), None).unwrap();
        assert!((whole.radius - 0.15).abs() < 0.001 && whole.spread < 0.003, "{whole:?}");
        let mut third = arc(0.3, 2.4, 0.003);
        third.extend([[3.4, -2.3], [2.6, -1.5], [3.1, -1.4]]);
        let prior = Prior { radius: 0.16, deviation: 0.04 };
        let part = fit(&third, Some(prior)).unwrap();
        assert!((part.radius - 0.15).abs() < 0.01, "{part:?}");
        assert!((part.centre[0] - 3.0).abs() < 0.01 && (part.centre[1] + 2.0).abs() < 0.01);
    }

    #[test]
    fn no_circle_through_a_line() {
        let line: Vec<[f64; 2]> = (0..9).map(|i| [f64::from(i), 2.0]).collect();
        assert_eq!(fit(&line, None), None);
        assert_eq!(fit(&[[1.0, 1.0]; 5], None), None);
    }
}

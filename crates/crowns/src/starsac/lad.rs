//! Least absolute deviations in two unknowns that are not negative.
//!
//! A descent along the edges of the piecewise linear objective (Bloomfield and Steiger 1983): every
//! step keeps one point (or one bound) tight and goes to the weighted median of where the others
//! become tight. Two unknowns, so two things are tight at a vertex.

/// One equation `b1 u + b2 v = target`, to be met as well as can be. For a surface `h = b1 r + b2 r²`
/// with weight w: u = w r, v = w r², target = w h.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Factor of the first unknown.
    pub u: f64,
    /// Factor of the second unknown.
    pub v: f64,
    /// Right hand side.
    pub target: f64,
}

impl Row {
    fn residual(&self, [b1, b2]: [f64; 2]) -> f64 {
        self.target - (b1 * self.u + b2 * self.v)
    }
}

/// What is tight at a vertex.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Tight {
    /// The surface passes through this point.
    Point(usize),
    /// b1 = 0.
    First,
    /// b2 = 0.
    Second,
}

/// Steps after which a descent that cycles through ties is left where it is; a few suffice.
const MAX_STEPS: usize = 40;

/// Relative gain below which a step counts as none.
const GAIN: f64 = 1e-12;

/// Minimises the sum of |target - b1 u - b2 v| from a start with b1, b2 >= 0.
///
/// Returns the coefficients. Optimal except in degenerate position (three rows tight at once),
/// where it may stop at a vertex of equal or slightly larger value; never worse than the start.
#[must_use]
pub fn refine(rows: &[Row], start: [f64; 2]) -> [f64; 2] {
    let mut b = start.map(|value| value.max(0.0));
    let mut value = objective(rows, b);
    let mut tight: [Option<Tight>; 2] = [None, None];
    let mut failed = 0;
    for _ in 0..MAX_STEPS {
        let Some((next, reached)) = step(rows, b, direction(rows, tight[0])) else { break };
        let lower = objective(rows, next);
        if lower < value - GAIN * (1.0 + value) {
            (b, value, failed) = (next, lower, 0);
            tight = [Some(reached), tight[0]];
        } else {
            failed += 1;
            tight = [tight[1].or(Some(reached)), tight[0]];
        }
        if failed > 2 {
            break;
        }
    }
    b
}

fn objective(rows: &[Row], b: [f64; 2]) -> f64 {
    rows.iter().map(|row| row.residual(b).abs()).sum()
}

/// The direction along which what is tight stays tight.
fn direction(rows: &[Row], tight: Option<Tight>) -> [f64; 2] {
    match tight {
        None | Some(Tight::First) => [0.0, 1.0],
        Some(Tight::Second) => [1.0, 0.0],
        Some(Tight::Point(i)) => [rows[i].v, -rows[i].u],
    }
}

/// The minimum along a line within the bounds, and what becomes tight there. `None` when no point
/// sees a difference along the line.
fn step(rows: &[Row], b: [f64; 2], d: [f64; 2]) -> Option<([f64; 2], Tight)> {
    let (mut low, mut high) = ((f64::NEG_INFINITY, None), (f64::INFINITY, None));
    for (axis, bound) in [(0, Tight::First), (1, Tight::Second)] {
        let t = -b[axis] / d[axis];
        if d[axis] > 0.0 && t > low.0 {
            low = (t, Some(bound));
        } else if d[axis] < 0.0 && t < high.0 {
            high = (t, Some(bound));
        }
    }
    let (t, point) = median(rows, b, d)?;
    let (t, tight) = match (low, high) {
        ((limit, Some(bound)), _) if t <= limit => (limit, bound),
        (_, (limit, Some(bound))) if t >= limit => (limit, bound),
        _ => (t, Tight::Point(point)),
    };
    let mut next = [(b[0] + t * d[0]).max(0.0), (b[1] + t * d[1]).max(0.0)];
    match tight {
        Tight::First => next[0] = 0.0,
        Tight::Second => next[1] = 0.0,
        Tight::Point(_) => {}
    }
    Some((next, tight))
}

/// The weighted median of the steps at which the points become tight, and the point it is.
fn median(rows: &[Row], b: [f64; 2], d: [f64; 2]) -> Option<(f64, usize)> {
    let mut crossings: Vec<(f64, f64, usize)> = Vec::with_capacity(rows.len());
    let mut total = 0.0;
    for (i, row) in rows.iter().enumerate() {
        let slope = d[0] * row.u + d[1] * row.v;
        if slope.abs() > 1e-12 {
            crossings.push((row.residual(b) / slope, slope.abs(), i));
            total += slope.abs();
        }
    }
    crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    let mut passed = 0.0;
    for &(t, weight, i) in &crossings {
        passed += weight;
        if 2.0 * passed >= total {
            return Some((t, i));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The optimum by all vertices: pairs of points, points on a bound, the origin.
    fn brute(rows: &[Row]) -> f64 {
        let mut best = objective(rows, [0.0, 0.0]);
        let mut attempt = |b: [f64; 2]| {
            if b[0] >= 0.0 && b[1] >= 0.0 && b[0].is_finite() && b[1].is_finite() {
                best = best.min(objective(rows, b));
            }
        };
        for (i, a) in rows.iter().enumerate() {
            attempt([a.target / a.u, 0.0]);
            attempt([0.0, a.target / a.v]);
            for b in &rows[..i] {
                let det = a.u * b.v - a.v * b.u;
                let b1 = (a.target * b.v - a.v * b.target) / det;
                attempt([b1, (a.u * b.target - a.target * b.u) / det]);
            }
        }
        best
    }

    fn rows(points: &[(f64, f64)]) -> Vec<Row> {
        points.iter().map(|&(r, h)| Row { u: r, v: r * r, target: h }).collect()
    }

    proptest! {
        #[test]
        fn as_brute_force(
            points in prop::collection::vec((0.05f64..5.0, -0.5f64..9.0), 1..25),
            b1 in 0.0f64..4.0, b2 in 0.0f64..2.0,
        ) {
            let rows = rows(&points);
            let b = refine(&rows, [b1, b2]);
            prop_assert!(b[0] >= 0.0 && b[1] >= 0.0);
            let (found, best) = (objective(&rows, b), brute(&rows));
            prop_assert!(found <= best * (1.0 + 1e-9) + 1e-9, "{found} against {best}");
        }
    }

    #[test]
    fn outliers_are_shrugged_off() {
        let surface = |i: i32| {
            let r = 0.1 * f64::from(i);
            (r, 1.2 * r + 0.3 * r * r + if i % 4 == 1 { 2.0 } else { 0.0 })
        };
        let b = refine(&rows(&(1..40).map(surface).collect::<Vec<_>>()), [0.5, 0.5]);
        assert!((b[0] - 1.2).abs() < 1e-9 && (b[1] - 0.3).abs() < 1e-9, "{b:?}");
    }

    #[test]
    fn no_points_leave_the_start() {
        assert_eq!(refine(&[], [1.0, 2.0]), [1.0, 2.0]);
        assert_eq!(refine(&rows(&[(0.0, 0.0)]), [1.0, 2.0]), [1.0, 2.0]);
    }
}

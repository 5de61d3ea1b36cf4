//! The axis of a branch: sections' centres made even, smoothed and simplified.

use super::section::Shape;
use crate::vector::{Vector, add, distance, scale, sub, to_segment};

/// Taubin's factors: the second undoes the shrinking of the first (Taubin 1995, k_PB = 0.1).
const LAMBDA: f64 = 0.5;
const MU: f64 = -0.526;

/// Sections that are no circle are set between the next circles at most this far along.
const BETWEEN: usize = 4;

/// Centres that are no circle's, between circles and off their line by more than a third of the
/// radius, are moved onto it: what they saw was one side of the branch, or a fork.
pub(crate) fn even_out(shapes: &[Shape]) -> Vec<Vector> {
    let mut centres: Vec<Vector> = shapes.iter().map(|shape| shape.centre).collect();
    for i in 0..shapes.len() {
        if shapes[i].round {
            continue;
        }
        let before = (i.saturating_sub(BETWEEN)..i).rev().find(|&j| shapes[j].round);
        let after = (i + 1..(i + 1 + BETWEEN).min(shapes.len())).find(|&j| shapes[j].round);
        if let (Some(a), Some(b)) = (before, after) {
            let (a, b) = (&shapes[a], &shapes[b]);
            let (away, t) = to_segment(shapes[i].centre, a.centre, b.centre);
            if away > 0.33 * a.radius.min(b.radius) {
                centres[i] = add(a.centre, scale(sub(b.centre, a.centre), t));
            }
        }
    }
    centres
}

/// Smooths a line without moving its ends and without shrinking it.
pub(crate) fn smooth(line: &mut [Vector], passes: u32) {
    for _ in 0..passes {
        for factor in [LAMBDA, MU] {
            let old = line.to_vec();
            for i in 1..old.len().saturating_sub(1) {
                // Neighbours at different distances: the nearer has more weight.
                let (a, b) = (distance(old[i], old[i - 1]), distance(old[i], old[i + 1]));
                let share = if a + b > 0.0 { b / (a + b) } else { 0.5 };
                let middle = add(scale(old[i - 1], share), scale(old[i + 1], 1.0 - share));
                line[i] = add(old[i], scale(sub(middle, old[i]), factor));
            }
        }
    }
}

/// Which places of a line are needed so that no other is further from it than its tolerance
/// (Douglas and Peucker 1973). Both ends and those `fixed` are.
pub(crate) fn simplify(line: &[Vector], tolerance: &[f64], fixed: &[bool]) -> Vec<bool> {
    let mut needed = fixed.to_vec();
    let last = line.len() - 1;
    (needed[0], needed[last]) = (true, true);
    let stops: Vec<usize> = (0..line.len()).filter(|&i| needed[i]).collect();
    let mut open: Vec<(usize, usize)> = stops.windows(2).map(|w| (w[0], w[1])).collect();
    while let Some((from, to)) = open.pop() {
        let excess = |i: usize| to_segment(line[i], line[from], line[to]).0 - tolerance[i];
        let worst = (from + 1..to).map(|i| (excess(i), i)).fold((0.0, 0), |worst, new| {
            if new.0 > worst.0 { new } else { worst }
        });
        if worst.0 > 0.0 {
            needed[worst.1] = true;
            open.extend([(from, worst.1), (worst.1, to)]);
        }
    }
    needed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_takes_the_zigzag_and_keeps_the_arc() {
        let at = |i: usize, off: f64| {
            let angle = 0.05 * i as f64;
            [(1.0 + off) * libm::cos(angle), (1.0 + off) * libm::sin(angle), 0.0]
        };
        let mut line: Vec<Vector> =
            (0..31).map(|i| at(i, if i % 2 == 0 { 0.02 } else { -0.02 })).collect();
        smooth(&mut line, 3);
        for (i, p) in line.iter().enumerate().skip(2).take(27) {
            let radius = (p[0] * p[0] + p[1] * p[1]).sqrt();
            assert!((radius - 1.0).abs() < 0.004, "{i}: {radius}");
        }
    }

    #[test]
    fn a_corner_stays_and_the_straight_goes() {
        let line = [[0.0; 3], [1.0, 0.01, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 2.0, 0.0]];
        let needed = simplify(&line, &[0.05; 5], &[false, false, false, true, false]);
        assert_eq!(needed, [true, false, true, true, true]);
    }
}

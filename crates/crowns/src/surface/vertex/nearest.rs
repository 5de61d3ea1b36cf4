//! The nearest point of a polyhedron: a strictly convex quadratic program of a few unknowns.

use super::super::dense::{Cholesky, dot};

/// `normal * t + shift >= 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Half<const K: usize> {
    pub(super) normal: [f64; K],
    pub(super) shift: f64,
    /// By how much it may be violated.
    pub(super) tiny: f64,
}

impl<const K: usize> Half<K> {
    pub(super) fn value(&self, t: &[f64; K]) -> f64 {
        dot(&self.normal, t) + self.shift
    }
}

/// Sizes below this share of their terms are rounding.
const ROUNDING: f64 = 1e-13;

/// The halves that hold with equality: place, normal divided by the metric, multiplier.
struct Active<const K: usize> {
    halves: Vec<(usize, [f64; K], f64)>,
}

/// The point of a polyhedron nearest to `t` in the metric whose factor is given.
///
/// The dual active set method of Goldfarb and Idnani 1983. Every half that is added raises the
/// distance strictly, so that it ends without any assumption about ties. `None` when the polyhedron
/// is empty, or after more steps than rounding explains.
pub(super) fn nearest<const K: usize>(
    metric: &Cholesky<K>,
    mut t: [f64; K],
    halves: &[Half<K>],
) -> Option<[f64; K]> {
    let mut active = Active { halves: Vec::new() };
    for _ in 0..100 + halves.len() {
        let Some(worst) = most_violated(&t, halves) else { return Some(t) };
        active.add(metric, halves, worst, &mut t)?;
    }
    None
}

fn most_violated<const K: usize>(t: &[f64; K], halves: &[Half<K>]) -> Option<usize> {
    let mut worst = (0.0, None);
    for (place, half) in halves.iter().enumerate() {
        let value = half.value(t);
        let square = dot(&half.normal, &half.normal);
        if value < -half.tiny && value * value > worst.0 * square {
            worst = (value * value / square, Some(place));
        }
    }
    worst.1
}

impl<const K: usize> Active<K> {
    /// Moves `t` until a violated half holds, dropping those that need not hold with equality.
    fn add(
        &mut self,
        metric: &Cholesky<K>,
        halves: &[Half<K>],
        new: usize,
        t: &mut [f64; K],
    ) -> Option<()> {
        let normal = halves[new].normal;
        let own = metric.solve(&normal);
        let mut multiplier = 0.0;
        for _ in 0..=K {
            let (shares, direction) = self.project(halves, &own);
            let gain = dot(&direction, &normal);
            let open = -halves[new].value(t);
            let full = gain > ROUNDING * dot(&own, &normal) && self.halves.len() < K;
            let far = if full { open / gain } else { f64::INFINITY };
            let first = self.first_to_leave(&shares);
            let length = first.map_or(far, |(_, length)| length.min(far));
            if length == f64::INFINITY {
                return None;
            }
            let moved = if full { length } else { 0.0 };
            t.iter_mut().zip(direction).for_each(|(t, step)| *t += moved * step);
            self.halves.iter_mut().zip(shares).for_each(|(half, share)| half.2 -= length * share);
            multiplier += length;
            match first.filter(|_| length < far) {
                Some((place, _)) => drop(self.halves.remove(place)),
                None => {
                    self.halves.push((new, own, multiplier));
                    return Some(());
                }
            }
        }
        None
    }

    /// A normal as a combination of the active ones, and what is left of it, both in the metric.
    fn project(&self, halves: &[Half<K>], own: &[f64; K]) -> ([f64; K], [f64; K]) {
        let mut gram = [[0.0; K]; K];
        let mut rhs = [0.0; K];
        for i in 0..K {
            gram[i][i] = 1.0;
        }
        for (i, (at, ..)) in self.halves.iter().enumerate() {
            for (j, (_, other, _)) in self.halves.iter().enumerate().take(i + 1) {
                gram[i][j] = dot(&halves[*at].normal, other);
            }
            rhs[i] = dot(&halves[*at].normal, own);
        }
        let shares = Cholesky::new(&gram).map_or([0.0; K], |factor| factor.solve(&rhs));
        let mut direction = *own;
        for ((_, other, _), share) in self.halves.iter().zip(shares) {
            direction.iter_mut().zip(other).for_each(|(d, o)| *d -= share * o);
        }
        (shares, direction)
    }

    /// The active half whose multiplier reaches nought first, and after which length.
    fn first_to_leave(&self, shares: &[f64; K]) -> Option<(usize, f64)> {
        let length = |(place, half): (usize, &(usize, [f64; K], f64))| {
            (shares[place] > 0.0).then(|| (place, half.2.max(0.0) / shares[place]))
        };
        self.halves.iter().enumerate().filter_map(length).min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

//! The engine of the linear programs: descent from vertex to vertex.
//!
//! After Barrodale and Roberts 1973 and Bloomfield and Steiger 1983, Least absolute deviations: a
//! basis of as many rows as there are unknowns, whose residuals are nought; its multipliers say which
//! row should leave; along the edge that opens, the weighted median of the places where residuals
//! change sign is the lowest point, and its row enters. Bounds are rows of infinite weight: the
//! median never passes them, and as multipliers only one sign is allowed.
//!
//! Crowns have many ties (cells on a grid, heights in centimetres), where plain descent can go in
//! circles. Here row `i` is thought to be raised by an infinitesimal `e_i`, `e_0 >> e_1 >> ...`, with
//! those of the first basis smallest: then no vertex is degenerate, every step is a strict descent,
//! and none returns (the lexicographic rule of Dantzig, Orden and Wolfe 1955). Nothing is
//! computed with the `e_i`: the state is the side on which each row lies, and they only decide the
//! order of equal breakpoints.
//!
//! The result has a dual certificate, and it is unique: where several surfaces are optimal, it is
//! that of the smallest weighted sum of squares ([`face`]).

mod certificate;
mod descent;
mod face;
mod nearest;
mod search;
mod step;
#[cfg(test)]
mod tests;

use super::dense::{Cholesky, add_outer, least_squares};
use super::program::{Cone, Optimum, Program};
use certificate::Certificate;
use descent::{Descent, ROUNDING};
use nearest::{Half, nearest};

/// Arrays that can be used again.
#[derive(Debug, Default)]
pub(super) struct Scratch {
    /// Residual of each row, then slack of each bound.
    residual: Vec<f64>,
    /// Weight of each row with the sign of its side, infinite for bounds, 0 in the basis.
    signed: Vec<f64>,
    /// Change of the residual along the edge.
    along: Vec<f64>,
    /// Sizes that count as nought: of the residuals, then of each bound.
    tiny: Vec<f64>,
    points: Vec<search::Break<f64>>,
    /// Rows and bounds that a step meets, and those of them at its end.
    met: Vec<usize>,
    tied: Vec<usize>,
}

/// Largest difference of objective and bound, as a share of the objective and the heights, above
/// which the result counts as failed: rounding alone gives a thousandth of it.
const MAX_GAP: f64 = 1e-10;

/// Solves a program whose constraints are all linear. `None`: it did not finish.
pub(super) fn solve<const K: usize>(program: &Program<K>) -> Option<Optimum<K>> {
    solve_with(program, &mut Scratch::default())
}

/// As [`solve`], with arrays of an earlier one.
pub(super) fn solve_with<const K: usize>(
    program: &Program<K>,
    scratch: &mut Scratch,
) -> Option<Optimum<K>> {
    let start = start(program)?;
    let mut descent = Descent::new(program, start, scratch);
    let iterations = descent.run()?;
    let x = if descent.is_unique() { descent.point() } else { descent.middle_of_face()? };
    let Certificate { objective, lower_bound, magnitude } = descent.certificate(&x);
    let gap = objective - lower_bound;
    let sound = gap <= MAX_GAP * (objective + magnitude);
    sound.then_some(Optimum { x, objective, lower_bound, iterations })
}

/// Where a descent ended: the start of that of a similar program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Vertex<const K: usize> {
    pub(super) x: [f64; K],
    pub(super) objective: f64,
    /// By how much the objective changes per change of the program.
    pub(super) slope: f64,
    basis: [usize; K],
}

/// The optimum of one of a series of programs with the same rows and bounds but other numbers, from
/// that of the one before. Without certificate, and any of several optimal points.
///
/// `change` says by how much the value of a row changes at a point while the program goes on.
pub(super) fn solve_near<const K: usize>(
    program: &Program<K>,
    before: Option<&Vertex<K>>,
    scratch: &mut Scratch,
    change: impl Fn(usize, &[f64; K]) -> f64,
) -> Option<Vertex<K>> {
    let warm = before.and_then(|vertex| {
        let mut descent = Descent::new(program, vertex.x, scratch);
        descent.start_at(&vertex.basis)?;
        finish(descent, &change)
    });
    warm.or_else(|| finish(Descent::new(program, start(program)?, scratch), &change))
}

fn finish<const K: usize>(
    mut descent: Descent<'_, K>,
    change: &impl Fn(usize, &[f64; K]) -> f64,
) -> Option<Vertex<K>> {
    descent.run()?;
    let (x, basis) = (descent.point(), descent.basis);
    let objective = descent.program.objective(&x);
    let slope = descent.sensitivity(|row| change(row, &x));
    Some(Vertex { x, objective, slope, basis })
}

/// The solution of the least squares problem under the bounds.
fn start<const K: usize>(program: &Program<K>) -> Option<[f64; K]> {
    let free = least_squares(&program.rows)?;
    let half = |cone: &Cone<K>| {
        let (normal, shift) = (cone.rows[0], cone.shift[0]);
        let terms: f64 = (0..K).map(|k| (normal[k] * free[k]).abs()).sum();
        Half { normal, shift, tiny: ROUNDING * (terms + shift.abs()) }
    };
    let halves: Vec<Half<K>> = program.cones.iter().map(half).collect();
    if halves.iter().all(|half| half.value(&free) >= 0.0) {
        return Some(free);
    }
    let mut gram = [[0.0; K]; K];
    program.rows.iter().for_each(|row| add_outer(&mut gram, &row.d, row.w));
    nearest(&Cholesky::new(&gram)?, free, &halves)
}

//! How well the cells determine the centre.

use super::scale::Scale;
use super::{Paraboloid, Solver};

/// Share of the residuals within which their density at zero is measured: wide enough to be
/// stable, narrow enough to leave out the tails.
const CENTRAL: f64 = 0.5;

/// Standard error of the centre, both axes together, m.
///
/// The covariance of an L1 estimate is tau² (D'D)^-1 with tau = 1 / (2 f(0)), f the density of the
/// residuals (Koenker and Bassett 1978, theorem 4.2); f(0) is estimated from the median of their
/// sizes, leaving out as many as there are unknowns, which are zero by construction. The centre
/// -phi3 / (2 phi0) follows by the derivative. Equal axes only: with others phi1 and phi2 would
/// move the centre too.
pub(super) fn standard_error(
    cells: &[[f64; 3]],
    surface: &Paraboloid,
    solver: &impl Solver,
) -> Option<f64> {
    let unknowns = solver.unknowns();
    let mut sizes: Vec<f64> = cells.iter().map(|c| (surface.z(c[0], c[1]) - c[2]).abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let sizes = sizes.get(unknowns..).filter(|rest| !rest.is_empty())?;
    let rank = ((CENTRAL * sizes.len() as f64).ceil() as usize).clamp(1, sizes.len());
    // Density: a share of `rank / len` within +- size; tau = 1 / (2 density) in metres of height.
    let tau = sizes[rank - 1] * sizes.len() as f64 / rank as f64;
    let scale = Scale::of(cells);
    let gram = gram(&scale.apply(cells), solver);
    let centre = surface.centre();
    // In scaled units, about the middle of the cells: x0 = -p3 / (2 p0).
    let p0 = surface.phi[0] * scale.length_m * scale.length_m;
    let mut variance = 0.0;
    for axis in 0..2 {
        let x0 = (centre[axis] - scale.centre[axis]) / scale.length_m;
        let mut gradient = [0.0; 6];
        gradient[0] = -x0 / p0;
        gradient[1 + axis] = -0.5 / p0;
        let along = solve(gram, gradient, unknowns)?;
        variance += (0..unknowns).map(|k| along[k] * gradient[k]).sum::<f64>();
    }
    let error = tau * variance.max(0.0).sqrt() * scale.length_m;
    error.is_finite().then_some(error)
}

fn gram(scaled: &[[f64; 3]], solver: &impl Solver) -> [[f64; 6]; 6] {
    let mut gram = [[0.0; 6]; 6];
    for cell in scaled {
        let row = solver.row(cell[0], cell[1]);
        for (line, a) in gram.iter_mut().zip(row) {
            line.iter_mut().zip(row).for_each(|(sum, b)| *sum += a * b);
        }
    }
    gram
}

/// Solves the leading `n` equations of a positive definite system by elimination.
fn solve(mut matrix: [[f64; 6]; 6], mut rhs: [f64; 6], n: usize) -> Option<[f64; 6]> {
    for k in 0..n {
        let pivot = matrix[k][k];
        if pivot <= 0.0 {
            return None;
        }
        for i in k + 1..n {
            let factor = matrix[i][k] / pivot;
            (k..n).for_each(|j| matrix[i][j] -= factor * matrix[k][j]);
            rhs[i] -= factor * rhs[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|j| matrix[k][j] * rhs[j]).sum();
        rhs[k] = (rhs[k] - known) / matrix[k][k];
    }
    Some(rhs)
}

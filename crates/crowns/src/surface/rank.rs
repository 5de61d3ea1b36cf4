//! How many unknowns the cells determine.

use super::Solver;
use super::scale::Scale;

/// A column whose part not explained by the others is smaller than this share of the largest
/// column adds nothing. Cells on a line or circle leave 1e-15, honest crowns more than 1e-3.
const RELATIVE: f64 = 1e-9;

/// Numerical rank of the design matrix by Gram-Schmidt with column pivoting on scaled cells.
pub(super) fn rank(cells: &[[f64; 3]], solver: &impl Solver) -> usize {
    let scaled = Scale::of(cells).apply(cells);
    let rows: Vec<[f64; 6]> = scaled.iter().map(|cell| solver.row(cell[0], cell[1])).collect();
    let mut columns: Vec<Vec<f64>> =
        (0..solver.unknowns()).map(|k| rows.iter().map(|row| row[k]).collect()).collect();
    let (mut rank, mut first) = (0, 0.0);
    while let Some((norm, pivot)) = take_largest(&mut columns) {
        if rank == 0 {
            first = norm;
        }
        if norm <= RELATIVE * first || rank == cells.len() {
            break;
        }
        rank += 1;
        for column in &mut columns {
            // Twice is enough (Parlett 1980): the second pass removes what rounding left.
            for _ in 0..2 {
                let along = dot(column, &pivot) / (norm * norm);
                column.iter_mut().zip(&pivot).for_each(|(value, p)| *value -= along * p);
            }
        }
    }
    rank
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Removes the longest column and returns its length and values.
fn take_largest(columns: &mut Vec<Vec<f64>>) -> Option<(f64, Vec<f64>)> {
    let norms = columns.iter().map(|column| dot(column, column).sqrt());
    let longest = norms.enumerate().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))?;
    Some((longest.1, columns.remove(longest.0)))
}

//! How many unknowns the cells determine.

use super::problem::Cell;
use super::scale::Scale;

/// A column whose part not explained by the others is smaller than this share of the largest
/// column adds nothing. Cells on a line or circle leave 1e-15, honest crowns more than 1e-3.
const RELATIVE: f64 = 1e-9;

/// Columns of the design matrix of surfaces with equal axes.
pub(super) fn equal_row(x: f64, y: f64) -> [f64; 4] {
    [x * x + y * y, x, y, 1.0]
}

/// Columns of the design matrix of surfaces with two axes.
pub(super) fn elliptic_row(x: f64, y: f64) -> [f64; 6] {
    [x * x, y * y, x * y, x, y, 1.0]
}

/// Whether the cells determine all unknowns of a design matrix: the rank by Gram-Schmidt with
/// column pivoting on scaled cells.
pub(super) fn determines<const K: usize>(cells: &[Cell], row: fn(f64, f64) -> [f64; K]) -> bool {
    if cells.len() < K {
        return false;
    }
    let scale = Scale::of(cells);
    let scaled = |cell: &Cell| {
        let unit = |axis: usize| (cell[axis] - scale.centre[axis]) / scale.length_m;
        row(unit(0), unit(1))
    };
    let mut rows: Vec<[f64; K]> = cells.iter().map(scaled).collect();
    let (mut free, mut first) = ([true; K], 0.0);
    for rank in 0..K {
        let mut gram = [0.0; K];
        rows.iter().for_each(|row| (0..K).for_each(|k| gram[k] += row[k] * row[k]));
        let longest =
            |best: usize, k: usize| if free[k] && gram[k] > gram[best] { k } else { best };
        let start = free.iter().position(|free| *free).unwrap_or(0);
        let pivot = (0..K).fold(start, longest);
        let norm = gram[pivot].sqrt();
        if rank == 0 {
            first = norm;
        }
        if norm <= RELATIVE * first {
            return false;
        }
        free[pivot] = false;
        // Twice is enough (Parlett 1980): the second pass removes what rounding left.
        (0..2).for_each(|_| remove(&mut rows, pivot, &free));
    }
    true
}

/// Takes the part along the pivot's column out of all free columns.
fn remove<const K: usize>(rows: &mut [[f64; K]], pivot: usize, free: &[bool; K]) {
    let mut along = [0.0; K];
    let mut square = 0.0;
    for row in rows.iter() {
        square += row[pivot] * row[pivot];
        along.iter_mut().zip(row).for_each(|(sum, value)| *sum += value * row[pivot]);
    }
    let share: [f64; K] = std::array::from_fn(|k| if free[k] { along[k] / square } else { 0.0 });
    for row in rows {
        let own = row[pivot];
        (0..K).for_each(|k| row[k] -= share[k] * own);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64) -> Cell {
        [x, y, 0.0, 1.0]
    }

    #[test]
    fn circles_and_lines_determine_nothing() {
        let around = |i: u32| {
            let (sin, cos) = libm::sincos(f64::from(i));
            at(3.0 + 2.0 * cos, 2.0 * sin - 7.0)
        };
        let circle: Vec<Cell> = (0..12).map(around).collect();
        assert!(!determines(&circle, equal_row) && !determines(&circle, elliptic_row));
        let line: Vec<Cell> = (0..12).map(|i| at(f64::from(i), 2.0 * f64::from(i))).collect();
        assert!(!determines(&line, equal_row));
        let ellipse: Vec<Cell> = circle.iter().map(|c| at(2.0 * c[0] + c[1], c[1])).collect();
        assert!(determines(&ellipse, equal_row) && !determines(&ellipse, elliptic_row));
        let grid: Vec<Cell> = (0..12).map(|i| at(f64::from(i % 4), f64::from(i / 4))).collect();
        assert!(determines(&grid, elliptic_row));
    }
}

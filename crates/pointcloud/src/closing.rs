//! Where a raster may show a value: on and between the data, not beyond.
//!
//! A model of a surface has values wherever it is asked. What is shown of it is the morphological closing
//! (Serra 1982, chapter II) of the cells with points by a square: gaps narrower than the square are
//! covered, wide ones (lakes, the surroundings of the survey) are not.

use crate::Window;

/// The closing of `occupied` by a square of `2 reach + 1` cells, for the cells of `window`.
///
/// `occupied` is that of `window.grown(2 * reach)`.
#[must_use]
pub fn closed(occupied: &[bool], window: Window, reach: u32) -> Vec<bool> {
    let source = window.grown(2 * reach);
    let mut cells = occupied.to_vec();
    spread(&mut cells, source, reach);
    cells.iter_mut().for_each(|cell| *cell = !*cell);
    spread(&mut cells, source, reach);
    let rows = window.row0..window.end_row();
    let columns = || window.column0..window.end_column();
    rows.flat_map(|row| columns().map(move |column| (column, row)))
        .map(|(column, row)| !cells[source.index(column, row)])
        .collect()
}

/// Sets every cell within `reach` columns and rows of one that is set.
fn spread(cells: &mut [bool], window: Window, reach: u32) {
    let (columns, rows) = (window.columns as usize, window.rows as usize);
    for row in 0..rows {
        spread_line(cells, row * columns, 1, columns, reach as usize);
    }
    for column in 0..columns {
        spread_line(cells, column, columns, rows, reach as usize);
    }
}

/// The same along `len` cells from `first`, each `step` from the one before.
fn spread_line(cells: &mut [bool], first: usize, step: usize, len: usize, reach: usize) {
    let set: Vec<bool> = (0..len).map(|i| cells[first + i * step]).collect();
    let mut inside = set.iter().take(reach).filter(|cell| **cell).count();
    for i in 0..len {
        inside += usize::from(i + reach < len && set[i + reach]);
        cells[first + i * step] = inside > 0;
        inside -= usize::from(i >= reach && set[i - reach]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The definition, cell by cell.
    fn by_definition(occupied: &[bool], window: Window, reach: u32) -> Vec<bool> {
        let source = window.grown(2 * reach);
        let r = i64::from(reach);
        let square = move |c: i64, y: i64| {
            (-r..=r).flat_map(move |dx| (-r..=r).map(move |dy| (c + dx, y + dy)))
        };
        let dilated = |c: i64, y: i64| square(c, y).any(|(c, y)| occupied[source.index(c, y)]);
        let rows = window.row0..window.end_row();
        rows.flat_map(|y| (window.column0..window.end_column()).map(move |c| (c, y)))
            .map(|(c, y)| square(c, y).all(|(c, y)| dilated(c, y)))
            .collect()
    }

    proptest! {
        #[test]
        fn as_defined(
            seed in prop::collection::vec(prop::bool::weighted(0.12), 400), reach in 0u32..3,
            columns in 1u32..7, rows in 1u32..7,
        ) {
            let window = Window { column0: -3, row0: 11, columns, rows };
            let occupied = &seed[..window.grown(2 * reach).len()];
            prop_assert_eq!(closed(occupied, window, reach), by_definition(occupied, window, reach));
        }
    }

    #[test]
    fn narrow_gaps_close_and_edges_stay() {
        let window = Window { column0: 0, row0: 0, columns: 12, rows: 1 };
        let source = window.grown(4);
        let mut occupied = vec![false; source.len()];
        for row in -4..5 {
            for column in [2, 3, 7, 8] {
                occupied[source.index(column, row)] = true;
            }
        }
        let cells: String =
            closed(&occupied, window, 2).iter().map(|c| if *c { '#' } else { '.' }).collect();
        assert_eq!(cells, "..#######...");
    }
}

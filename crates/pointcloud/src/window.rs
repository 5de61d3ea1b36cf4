//! Rectangles of cells on the world lattice of a raster.

use crate::Rect;

/// A rectangle of lattice cells: cell (column, row) covers `[column * cell, (column + 1) * cell)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// World index of the westernmost column.
    pub column0: i64,
    /// World index of the southernmost row.
    pub row0: i64,
    /// Number of columns.
    pub columns: u32,
    /// Number of rows.
    pub rows: u32,
}

impl Window {
    /// The cells that a closed world rectangle touches.
    #[must_use]
    pub fn touching(rect: &Rect, cell_m: f64) -> Self {
        let index = |value: f64| (value / cell_m).floor() as i64;
        let (column0, row0) = (index(rect.min[0]), index(rect.min[1]));
        let columns = (index(rect.max[0]) - column0 + 1).max(0) as u32;
        let rows = (index(rect.max[1]) - row0 + 1).max(0) as u32;
        Self { column0, row0, columns, rows }
    }

    /// Number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    /// Whether there are no cells.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.columns == 0 || self.rows == 0
    }

    /// The window with a margin of cells on all sides.
    #[must_use]
    pub fn grown(&self, margin: u32) -> Self {
        Self {
            column0: self.column0 - i64::from(margin),
            row0: self.row0 - i64::from(margin),
            columns: self.columns + 2 * margin,
            rows: self.rows + 2 * margin,
        }
    }

    /// The cells in both; `None` when there are none.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let column0 = self.column0.max(other.column0);
        let row0 = self.row0.max(other.row0);
        let columns = self.end_column().min(other.end_column()) - column0;
        let rows = self.end_row().min(other.end_row()) - row0;
        let window =
            Self { column0, row0, columns: columns.max(0) as u32, rows: rows.max(0) as u32 };
        (!window.is_empty()).then_some(window)
    }

    /// The smallest window that holds both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        let column0 = self.column0.min(other.column0);
        let row0 = self.row0.min(other.row0);
        Self {
            column0,
            row0,
            columns: (self.end_column().max(other.end_column()) - column0) as u32,
            rows: (self.end_row().max(other.end_row()) - row0) as u32,
        }
    }

    /// First column to the east of the window.
    #[must_use]
    pub fn end_column(&self) -> i64 {
        self.column0 + i64::from(self.columns)
    }

    /// First row to the north of the window.
    #[must_use]
    pub fn end_row(&self) -> i64 {
        self.row0 + i64::from(self.rows)
    }

    /// Place of a cell in values given row by row from the south.
    #[must_use]
    pub fn index(&self, column: i64, row: i64) -> usize {
        (row - self.row0) as usize * self.columns as usize + (column - self.column0) as usize
    }

    /// Whether a cell lies inside.
    #[must_use]
    pub fn contains(&self, column: i64, row: i64) -> bool {
        (self.column0..self.end_column()).contains(&column)
            && (self.row0..self.end_row()).contains(&row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rectangle_touches_the_cells_of_its_edges() {
        let rect = Rect { min: [-0.1, 0.0], max: [1.0, 0.9] };
        let window = Window::touching(&rect, 0.5);
        assert_eq!(window, Window { column0: -1, row0: 0, columns: 4, rows: 2 });
    }

    #[test]
    fn intersection_and_union() {
        let a = Window { column0: 0, row0: 0, columns: 4, rows: 4 };
        let b = Window { column0: 3, row0: -2, columns: 4, rows: 4 };
        assert_eq!(a.intersection(&b), Some(Window { column0: 3, row0: 0, columns: 1, rows: 2 }));
        assert_eq!(a.union(&b), Window { column0: 0, row0: -2, columns: 7, rows: 6 });
        assert_eq!(a.intersection(&Window { column0: 4, ..a }), None);
    }
}

//! Centring and scaling: without it solvers stop early on world coordinates.

/// What was subtracted and divided by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scale {
    /// Mean of the cells, m.
    pub(super) centre: [f64; 3],
    /// Root mean square distance from the centre in the plane, m.
    pub(super) length_m: f64,
    /// Standard deviation of the heights, m; 1 for cells of one height.
    pub(super) height_m: f64,
}

/// Mean position of the cells.
pub(super) fn mean(cells: &[[f64; 3]]) -> [f64; 3] {
    let count = cells.len().max(1) as f64;
    let add = |sum: [f64; 3], cell: &[f64; 3]| std::array::from_fn(|axis| sum[axis] + cell[axis]);
    cells.iter().fold([0.0; 3], add).map(|sum| sum / count)
}

impl Scale {
    /// The scale of a crown's cells.
    pub(super) fn of(cells: &[[f64; 3]]) -> Self {
        let centre = mean(cells);
        let count = cells.len().max(1) as f64;
        let square = |cell: &[f64; 3], axis: usize| {
            (cell[axis] - centre[axis]) * (cell[axis] - centre[axis])
        };
        let plane: f64 = cells.iter().map(|cell| square(cell, 0) + square(cell, 1)).sum();
        let height: f64 = cells.iter().map(|cell| square(cell, 2)).sum();
        let positive = |value: f64| if value > 1e-9 { value } else { 1.0 };
        Self {
            centre,
            length_m: positive((plane / count).sqrt()),
            height_m: positive((height / count).sqrt()),
        }
    }

    /// The cells in units of the scale.
    pub(super) fn apply(&self, cells: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let unit = [self.length_m, self.length_m, self.height_m];
        cells
            .iter()
            .map(|cell| std::array::from_fn(|axis| (cell[axis] - self.centre[axis]) / unit[axis]))
            .collect()
    }
}

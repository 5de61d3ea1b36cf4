//! Rasters to draw.

use timberline_artefact::Raster;
use timberline_pointcloud::Window;

/// Values on the world lattice of a cell size.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// The cells.
    pub window: Window,
    /// Values row by row from the south, NaN where there is none.
    pub values: Vec<f32>,
}

impl Grid {
    /// A raster without values.
    #[must_use]
    pub fn empty(window: Window, cell_m: f64) -> Self {
        Self { cell_m, window, values: vec![f32::NAN; window.len()] }
    }

    /// Takes over the values of a window where they are higher; NaN is nothing.
    pub fn raise(&mut self, window: Window, values: &[f32]) {
        let Some(common) = self.window.intersection(&window) else { return };
        for row in common.row0..common.end_row() {
            let own = self.window.index(common.column0, row);
            let other = window.index(common.column0, row);
            let columns = common.columns as usize;
            for (own, other) in self.values[own..own + columns].iter_mut().zip(&values[other..]) {
                // `max` takes the number when the other is NaN.
                *own = own.max(*other);
            }
        }
    }

    /// The value of a cell; `None` outside and where there is none.
    #[must_use]
    pub fn get(&self, column: i64, row: i64) -> Option<f64> {
        let inside = self.window.contains(column, row);
        let value = inside.then(|| self.values[self.window.index(column, row)])?;
        (!value.is_nan()).then_some(f64::from(value))
    }

    /// The cell that holds a world position.
    #[must_use]
    pub fn cell_at(&self, [x, y]: [f64; 2]) -> [i64; 2] {
        [(x / self.cell_m).floor() as i64, (y / self.cell_m).floor() as i64]
    }

    /// The part of the window whose rows [`Grid::sample`] looks at between two world y, with so many
    /// rows more on either side as the window has.
    #[must_use]
    pub fn rows_around(&self, [south, north]: [f64; 2], margin: i64) -> Window {
        let row = |y: f64| (y / self.cell_m).floor() as i64;
        let row0 = (row(south) - 1 - margin).max(self.window.row0);
        let end = (row(north) + 2 + margin).min(self.window.end_row());
        Window { row0, rows: (end - row0).max(0) as u32, ..self.window }
    }

    /// Bilinear value at a world position among the cells that have values; `None` where the cell
    /// that holds the position has none.
    #[must_use]
    pub fn sample(&self, at: [f64; 2]) -> Option<f64> {
        self.sample_like(at, f64::INFINITY)
    }

    /// As [`Grid::sample`], among the cells whose values are within `tolerance` of that of the cell
    /// that holds the position: edges stay sharp.
    #[must_use]
    pub fn sample_like(&self, at: [f64; 2], tolerance: f64) -> Option<f64> {
        let [column, row] = self.cell_at(at);
        let own = self.get(column, row)?;
        let (u, v) = (at[0] / self.cell_m - 0.5, at[1] / self.cell_m - 0.5);
        let (left, low) = (u.floor(), v.floor());
        let (mut sum, mut weights) = (0.0, 0.0);
        for (dc, dr) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let weight = |place: f64, first: f64, step: i64| {
                if step == 0 { 1.0 - (place - first) } else { place - first }
            };
            let value = self.get(left as i64 + dc, low as i64 + dr);
            if let Some(value) = value.filter(|value| (value - own).abs() <= tolerance) {
                let share = weight(u, left, dc) * weight(v, low, dr);
                sum += share * value;
                weights += share;
            }
        }
        (weights > 0.0).then(|| sum / weights)
    }

    /// The smallest and largest values, after leaving out the given share at either end; `None`
    /// without values.
    #[must_use]
    pub fn range(&self, left_out: f64) -> Option<[f64; 2]> {
        range(self.values.iter().copied(), left_out)
    }
}

/// As [`Grid::range`], of any values.
pub(crate) fn range(values: impl Iterator<Item = f32>, left_out: f64) -> Option<[f64; 2]> {
    let mut values: Vec<f32> = values.filter(|value| value.is_finite()).collect();
    let last = values.len().checked_sub(1)?;
    let skip = (values.len() as f64 * left_out) as usize;
    let mut pick =
        |place: usize| f64::from(*values.select_nth_unstable_by(place, f32::total_cmp).1);
    Some([pick(skip.min(last)), pick(last - skip.min(last))])
}

impl From<&Raster> for Grid {
    fn from(raster: &Raster) -> Self {
        Self {
            cell_m: raster.cell_m,
            window: raster.window(),
            values: raster.values.iter().map(|value| *value as f32).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_between_centres_and_beside_gaps() {
        let window = Window { column0: 0, row0: 0, columns: 3, rows: 1 };
        let grid = Grid { cell_m: 2.0, window, values: vec![1.0, 3.0, f32::NAN] };
        assert_eq!(grid.sample([2.0, 1.0]), Some(2.0));
        assert_eq!(grid.sample([3.9, 1.0]), Some(3.0));
        assert_eq!(grid.sample_like([2.0, 1.0], 1.0), Some(3.0));
        assert_eq!([grid.sample([4.1, 1.0]), grid.sample([-0.1, 1.0])], [None, None]);
    }

    #[test]
    fn the_higher_value_stays() {
        let window = Window { column0: 0, row0: 0, columns: 2, rows: 2 };
        let mut grid = Grid { cell_m: 1.0, window, values: vec![1.0, f32::NAN, 3.0, 4.0] };
        let other = Window { column0: 1, row0: -1, columns: 2, rows: 3 };
        grid.raise(other, &[9.0, 9.0, 2.0, 9.0, 3.5, 9.0]);
        assert_eq!(grid.values, [1.0, 2.0, 3.0, 4.0]);
    }

    #[test]
    fn a_range_leaves_out_extremes() {
        let window = Window { column0: 0, row0: 0, columns: 101, rows: 1 };
        let mut values: Vec<f32> = (0..100).map(|i| i as f32).collect();
        values.push(f32::NAN);
        let grid = Grid { cell_m: 1.0, window, values };
        assert_eq!(grid.range(0.0), Some([0.0, 99.0]));
        assert_eq!(grid.range(0.02), Some([2.0, 97.0]));
        assert_eq!(Grid::empty(window, 1.0).range(0.0), None);
    }
}

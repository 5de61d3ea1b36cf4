//! How much ground points cover, in bounded memory.

use crate::voxels::floor;
use std::collections::BTreeSet;

/// Edge of the cells at first, metres; it doubles when there are too many or too few points in them.
const CELL_M: f64 = 0.5;
/// More cells than this are merged four to one.
const MAX_CELLS: usize = 1 << 15;
/// Points that a covered cell should hold on average: fewer, and holes are gaps between points.
const POINTS_PER_CELL: f64 = 8.0;

/// The cells of a lattice fixed in the world in which there are points.
#[derive(Debug, Clone)]
pub(crate) struct Cover {
    cell_m: f64,
    cells: BTreeSet<[i32; 2]>,
}

impl Default for Cover {
    fn default() -> Self {
        Self { cell_m: CELL_M, cells: BTreeSet::new() }
    }
}

impl Cover {
    /// Takes in positions, metres.
    pub(crate) fn add(&mut self, x: &[f64], y: &[f64]) {
        let mut last = None;
        for (x, y) in x.iter().zip(y) {
            let cell = [*x, *y].map(|value| floor(value / self.cell_m));
            if last != Some(cell) {
                self.cells.insert(cell);
                last = Some(cell);
            }
            if self.cells.len() > MAX_CELLS {
                self.coarsen();
                last = None;
            }
        }
    }

    fn coarsen(&mut self) {
        self.cell_m *= 2.0;
        let cells = std::mem::take(&mut self.cells);
        self.cells = cells.into_iter().map(|cell| cell.map(|i| i.div_euclid(2))).collect();
    }

    /// The ground that so many points cover; `None` without points.
    pub(crate) fn area_m2(mut self, points: u64) -> Option<f64> {
        // The four cells around 0 never become one.
        while self.cells.len() > 4 && (points as f64) < POINTS_PER_CELL * self.cells.len() as f64 {
            self.coarsen();
        }
        (points > 0).then_some(self.cells.len() as f64 * self.cell_m * self.cell_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(step_m: f64, side: i32) -> f64 {
        let mut cover = Cover::default();
        let all = (0..side).flat_map(|i| (0..side).map(move |j| (i, j)));
        let (x, y): (Vec<f64>, Vec<f64>) =
            all.map(|(i, j)| (f64::from(i) * step_m - 7.0, f64::from(j) * step_m)).unzip();
        cover.add(&x, &y);
        cover.area_m2(x.len() as u64).unwrap()
    }

    #[test]
    fn sparse_points_cover_the_ground_between_them() {
        assert_eq!(area(0.1, 200), 400.0);
        let sparse = area(2.0, 100);
        assert!((4e4..4.5e4).contains(&sparse), "{sparse}");
    }

    #[test]
    fn cells_are_bounded() {
        let mut cover = Cover::default();
        let x: Vec<f64> = (0..200_000).map(f64::from).collect();
        cover.add(&x, &x);
        assert!(cover.cells.len() <= MAX_CELLS);
        assert_eq!(Cover::default().area_m2(0), None);
    }

    /// Found by fuzzing: merging went on for ever.
    #[test]
    fn few_points_on_both_sides_of_zero() {
        let mut cover = Cover::default();
        cover.add(&[1.5, -4.0], &[2.0, 500.0]);
        assert_eq!(cover.area_m2(2), Some(0.5));
    }
}

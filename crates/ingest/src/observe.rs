//! What the points of a file say about the file: facts that its header does not tell.

use crate::Notes;
use std::collections::BTreeMap;
use timberline_pointcloud::{Bounds3, PointCloud};

/// Edge of the cells whose lowest point is looked at, at first; it doubles when there are too many.
const CELL_M: f64 = 20.0;
/// More cells than this are merged four to one: memory does not grow with the area.
const MAX_CELLS: usize = 1 << 15;
/// Cells with fewer points may have no ground return.
const MIN_POINTS: u32 = 20;
/// A cell whose lowest point is nearer to 0 than this has its ground at 0.
const NEAR_ZERO_M: f64 = 0.5;
/// The share of cells, or of points of the ground class, at 0 from which a file counts as normalised.
const NORMALISED_SHARE: f64 = 0.9;
/// So many points of the ground class decide alone: points below the terrain they were normalised
/// with would hide it from the cells.
const ENOUGH_GROUND: u64 = 100;
const GROUND: u8 = 2;
/// Room for rounding in bounds that a header states.
const BOUNDS_SLACK_M: f64 = 0.01;

/// Collects facts about the points of one file, in bounded memory.
#[derive(Debug, Clone)]
pub(crate) struct Observed {
    pub(crate) points: u64,
    pub(crate) bounds: Bounds3,
    pub(crate) zero_returns: u64,
    pub(crate) ground: u64,
    ground_near_zero: u64,
    outside_stated: u64,
    stated: Option<Bounds3>,
    cell_m: f64,
    cells: BTreeMap<[i32; 2], Cell>,
}

#[derive(Debug, Clone, Copy)]
struct Cell {
    lowest_m: f64,
    points: u32,
}

impl Observed {
    /// `stated` are the header's bounds in metres.
    pub(crate) fn new(stated: Option<Bounds3>) -> Self {
        Self {
            points: 0,
            bounds: Bounds3::EMPTY,
            zero_returns: 0,
            ground: 0,
            ground_near_zero: 0,
            outside_stated: 0,
            stated,
            cell_m: CELL_M,
            cells: BTreeMap::new(),
        }
    }

    /// Takes in a batch in the world frame.
    pub(crate) fn add(&mut self, cloud: &PointCloud) {
        self.points += cloud.len() as u64;
        self.zero_returns += cloud.return_number.iter().filter(|n| **n == 0).count() as u64;
        let batch = cloud.bounds();
        self.bounds = self.bounds.union(&batch);
        self.count_outside(cloud, &batch);
        let mut at = ([i32::MAX; 2], Cell { lowest_m: f64::INFINITY, points: 0 });
        for index in 0..cloud.len() {
            let z = cloud.z[index];
            if cloud.classification[index] == GROUND {
                self.ground += 1;
                self.ground_near_zero += u64::from(z.abs() < NEAR_ZERO_M);
            }
            if !crate::rules::is_company(cloud.classification[index], cloud.flags[index]) {
                continue;
            }
            let cell =
                [cloud.x[index], cloud.y[index]].map(|v| crate::voxels::floor(v / self.cell_m));
            if cell != at.0 {
                self.add_cell(at.0, at.1);
                at = (cell, Cell { lowest_m: f64::INFINITY, points: 0 });
            }
            at.1.lowest_m = at.1.lowest_m.min(z);
            at.1.points += 1;
        }
        self.add_cell(at.0, at.1);
        while self.cells.len() > MAX_CELLS {
            self.coarsen();
        }
    }

    fn count_outside(&mut self, cloud: &PointCloud, batch: &Bounds3) {
        let Some(stated) = self.stated else { return };
        let within = |bounds: &Bounds3| {
            (0..3).all(|axis| {
                bounds.min[axis] >= stated.min[axis] - BOUNDS_SLACK_M
                    && bounds.max[axis] <= stated.max[axis] + BOUNDS_SLACK_M
            })
        };
        if within(batch) {
            return;
        }
        let outside = |i: &usize| {
            let at = cloud.local(*i);
            !within(&Bounds3 { min: at, max: at })
        };
        self.outside_stated += (0..cloud.len()).filter(outside).count() as u64;
    }

    fn add_cell(&mut self, key: [i32; 2], cell: Cell) {
        if cell.points == 0 {
            return;
        }
        self.cells
            .entry(key)
            .and_modify(|old| {
                old.lowest_m = old.lowest_m.min(cell.lowest_m);
                old.points = old.points.saturating_add(cell.points);
            })
            .or_insert(cell);
    }

    /// Doubles the cells. Whether that happens depends only on the set of all cells: if some of
    /// them are too many, all of them are.
    fn coarsen(&mut self) {
        self.cell_m *= 2.0;
        for (key, cell) in std::mem::take(&mut self.cells) {
            self.add_cell(key.map(|index| index.div_euclid(2)), cell);
        }
    }

    /// Share of cells whose lowest point is at 0; `None` without a cell of enough points.
    pub(crate) fn share_at_zero(&self) -> Option<f64> {
        let counted = || self.cells.values().filter(|cell| cell.points >= MIN_POINTS);
        let at_zero = counted().filter(|cell| cell.lowest_m.abs() < NEAR_ZERO_M).count();
        let all = counted().count();
        (all > 0).then(|| at_zero as f64 / all as f64)
    }

    /// Whether elevations look like heights above ground: the ground is at 0 everywhere.
    pub(crate) fn is_normalised(&self) -> bool {
        let at_zero = self.ground_near_zero as f64 >= NORMALISED_SHARE * self.ground as f64;
        if self.ground >= ENOUGH_GROUND || (self.ground > 0 && !at_zero) {
            return at_zero;
        }
        self.share_at_zero().is_some_and(|share| share >= NORMALISED_SHARE)
    }

    /// Says what a user should know; `has_returns` when the file should know return numbers.
    pub(crate) fn report(&self, has_returns: bool, notes: &mut Notes) {
        if !has_returns {
            // A format without them is not to be blamed.
        } else if self.points > 0 && self.zero_returns == self.points {
            notes.say(
                "the return number is 0 everywhere: every point is taken as the only return of \
                 its pulse",
            );
        } else if self.zero_returns > 0 {
            let (zero, all) = (self.zero_returns, self.points);
            notes.say(format!(
                "the return number of {zero} of {all} points is 0: they are taken as single returns"
            ));
        }
        if self.outside_stated > 0 {
            notes.say(format!(
                "{} of {} points lie outside the bounds in the header (bytes 179 to 226); the \
                 header or the points may be damaged",
                self.outside_stated, self.points
            ));
        }
        if self.is_normalised() {
            notes.say(format!(
                "the elevations look like heights above ground (within {NEAR_ZERO_M} m of 0: {} of {} \
                 points of the ground class, the lowest point in {:.0} % of cells of {} m): tree \
                 heights are right, the terrain is flat",
                self.ground_near_zero,
                self.ground,
                100.0 * self.share_at_zero().unwrap_or_default(),
                self.cell_m
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timberline_pointcloud::Point;

    fn observed(ground: impl Fn(f64, f64) -> f64) -> Observed {
        let mut cloud = PointCloud::default();
        for i in 0..100 {
            for j in 0..100 {
                let (x, y) = (f64::from(i), f64::from(j));
                cloud.push_world([x, y, ground(x, y) + f64::from((i + j) % 17)], &Point::default());
            }
        }
        let mut observed = Observed::new(None);
        observed.add(&cloud);
        observed
    }

    #[test]
    fn heights_above_ground_are_recognised() {
        assert!(observed(|_, _| 0.0).is_normalised());
        assert!(!observed(|x, _| 0.1 * x).is_normalised());
        assert!(!observed(|_, _| 312.0).is_normalised());
    }

    #[test]
    fn returns_of_zero_are_said() {
        let mut notes = Notes::default();
        observed(|_, _| 312.0).report(true, &mut notes);
        assert_eq!(notes.messages().len(), 1);
        assert!(notes.messages()[0].contains("0 everywhere"));
    }

    #[test]
    fn many_cells_are_merged_whatever_the_sequence() {
        let cloud = |order: &[i32]| {
            let mut observed = Observed::new(None);
            for part in order {
                let mut cloud = PointCloud::default();
                for i in 0..12_000 {
                    let x = f64::from(part * 12_000 + i) * 20.0;
                    cloud.push_world([x, 0.0, f64::from(i)], &Point::default());
                }
                observed.add(&cloud);
            }
            observed
        };
        let (a, b) = (cloud(&[0, 1, 2, 3]), cloud(&[3, 1, 0, 2]));
        assert_eq!((a.cell_m, a.cells.len()), (b.cell_m, b.cells.len()));
        assert!(a.cells.len() <= MAX_CELLS && a.cell_m == 40.0);
    }

    #[test]
    fn points_outside_the_stated_bounds_are_said() {
        let mut observed = Observed::new(Some(Bounds3 { min: [0.0; 3], max: [10.0; 3] }));
        let mut cloud = PointCloud::default();
        cloud.push_world([10.005, 5.0, 5.0], &Point { return_number: 1, ..Point::default() });
        cloud.push_world([11.0, 5.0, 5.0], &Point { return_number: 1, ..Point::default() });
        observed.add(&cloud);
        let mut notes = Notes::default();
        observed.report(true, &mut notes);
        assert!(notes.messages()[0].starts_with("1 of 2 points lie outside"), "{notes:?}");
    }
}

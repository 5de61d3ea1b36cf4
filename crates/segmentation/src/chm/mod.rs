//! Canopy height models from points: rasters of height above ground on a lattice fixed in the world.

mod tin;

use crate::{Error, View};
use timberline_pointcloud::{Frame, Rect, Window};

/// A canopy height model.
#[derive(Debug, Clone, PartialEq)]
pub struct Chm {
    /// The cells, on the world's lattice.
    pub window: Window,
    /// Edge of a cell, m.
    pub cell_m: f64,
    /// Where the coordinates of queries count from.
    pub frame: Frame,
    /// Height above ground, m, row by row from the south; never below 0 nor the negative 0, NaN
    /// where nothing is known.
    pub height_m: Vec<f32>,
    /// Index of the highest point of every cell, of equal ones the first; [`Chm::NO_POINT`] where
    /// there is none.
    pub top: Vec<u32>,
}

/// How a pit-free canopy height model is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PitFree {
    /// Edge of a cell, m.
    pub cell_m: f64,
    /// Longest edge of a triangle above the ground layer, m.
    pub max_edge_m: f64,
    /// Distance of the layers from 5 m upwards, m; at least 0.1.
    pub step_m: f64,
}

impl Chm {
    /// In [`Chm::top`]: a cell without a point.
    pub const NO_POINT: u32 = u32::MAX;

    /// The highest point of every cell. Points of unknown height do not count; heights below the
    /// ground count as 0.
    ///
    /// # Errors
    /// [`Error::Length`]; [`Error::Grid`] unless the cell is positive and finite.
    pub fn highest(view: &View<'_>, cell_m: f64) -> Result<Self, Error> {
        view.check()?;
        if !(cell_m.is_finite() && cell_m > 0.0) {
            return Err(timberline_pointcloud::Error::CellSize(cell_m).into());
        }
        let window = window(view, cell_m);
        let (height_m, top) = (vec![f32::NAN; window.len()], vec![Self::NO_POINT; window.len()]);
        let mut chm = Self { window, cell_m, frame: view.frame, height_m, top };
        for index in (0..view.len()).filter(|index| !view.height_m[*index].is_nan()) {
            let height_m = view.height_m[index].max(0.0) + 0.0;
            if let Some(cell) = chm.cell_at(view.x[index], view.y[index])
                && (chm.top[cell] == Self::NO_POINT || height_m > chm.height_m[cell])
            {
                (chm.height_m[cell], chm.top[cell]) = (height_m, index as u32);
            }
        }
        Ok(chm)
    }

    /// The pit-free model of Khosravipour et al. 2014: the highest of several surfaces, each a
    /// Delaunay triangulation of the first returns above a height (0, 2, 5 m and on in steps), those
    /// above 0 without long triangles. So the pulses that went deep into a crown leave no hole, and
    /// neither are gaps between trees bridged.
    ///
    /// The highest first return of a cell stands for all in it, as is usual before this method
    /// (Isenburg 2014). Cells outside the triangulation have the height of their highest point.
    ///
    /// # Errors
    /// As [`Chm::highest`]; [`Error::Triangulation`] for coordinates that are not finite.
    pub fn pit_free(view: &View<'_>, how: &PitFree) -> Result<Self, Error> {
        let mut chm = Self::highest(view, how.cell_m)?;
        let highest = std::mem::replace(&mut chm.height_m, vec![f32::NAN; chm.window.len()]);
        let mut vertices = thinned(view, how.cell_m)?;
        let top_m = vertices.iter().fold(0.0, |top, vertex| f64::max(top, vertex[2]));
        let mut tin = tin::Tin::new();
        // From the top, so that every surface is the one above with more vertices.
        for level_m in levels(how.step_m, top_m).into_iter().rev() {
            let (above, below) = vertices.into_iter().partition(|vertex| vertex[2] >= level_m);
            vertices = below;
            let above: Vec<[f64; 3]> = above;
            tin.add(&above)?;
            let longest_m = if level_m > 0.0 { how.max_edge_m } else { f64::INFINITY };
            tin.each_triangle(|corners| {
                if tin::longest_squared(&corners) <= longest_m * longest_m {
                    chm.raise(corners);
                }
            });
        }
        let gaps = chm.height_m.iter_mut().zip(highest).filter(|(height, _)| height.is_nan());
        gaps.for_each(|(height, highest)| *height = highest);
        Ok(chm)
    }

    /// The place of the cell that holds a position of the frame, if the model has it.
    #[must_use]
    pub fn cell_at(&self, x_m: f64, y_m: f64) -> Option<usize> {
        let [column, row] = self.lattice(x_m, y_m).map(|value| value.floor() as i64);
        self.window.contains(column, row).then(|| self.window.index(column, row))
    }

    /// Column and row of a place.
    #[must_use]
    pub fn column_row(&self, cell: usize) -> [i64; 2] {
        let columns = (self.window.columns as usize).max(1);
        [self.window.column0 + (cell % columns) as i64, self.window.row0 + (cell / columns) as i64]
    }

    /// Calls `visit` with the places of the up to eight cells around one, from the south-west, row
    /// by row.
    pub fn around(&self, cell: usize, mut visit: impl FnMut(usize)) {
        let [column, row] = self.column_row(cell);
        for [dx, dy] in AROUND {
            if self.window.contains(column + dx, row + dy) {
                visit(self.window.index(column + dx, row + dy));
            }
        }
    }

    /// Calls `visit` with the places of the up to four cells that share an edge with one: south,
    /// west, east, north.
    pub fn beside(&self, cell: usize, mut visit: impl FnMut(usize)) {
        let [column, row] = self.column_row(cell);
        for [dx, dy] in [AROUND[1], AROUND[3], AROUND[4], AROUND[6]] {
            if self.window.contains(column + dx, row + dy) {
                visit(self.window.index(column + dx, row + dy));
            }
        }
    }

    /// Squared distance of the centres of two cells, m².
    #[must_use]
    pub fn squared_m2(&self, a: usize, b: usize) -> f64 {
        let (a, b) = (self.column_row(a), self.column_row(b));
        let [dx, dy] = [0, 1].map(|axis| (a[axis] - b[axis]) as f64 * self.cell_m);
        dx * dx + dy * dy
    }

    /// The surface at a position: height, m, and squared slope. It goes through the centres of the
    /// cells around the position that `joined` lets take part; for the others the position's own
    /// cell stands.
    #[must_use]
    pub fn surface(&self, x_m: f64, y_m: f64, joined: impl Fn(usize) -> bool) -> Option<[f64; 2]> {
        let own = f64::from(self.height_m[self.cell_at(x_m, y_m)?]);
        let [u, v] = self.lattice(x_m, y_m).map(|value| value - 0.5);
        let (column, row) = (u.floor() as i64, v.floor() as i64);
        let height = |dx: i64, dy: i64| {
            let inside = self.window.contains(column + dx, row + dy);
            let cell = inside.then(|| self.window.index(column + dx, row + dy));
            let cell = cell.filter(|cell| !self.height_m[*cell].is_nan() && joined(*cell));
            cell.map_or(own, |cell| f64::from(self.height_m[cell]))
        };
        let (s, t) = (u - u.floor(), v - v.floor());
        let [a, b, c, d] = [height(0, 0), height(1, 0), height(0, 1), height(1, 1)];
        let along = ((b - a) * (1.0 - t) + (d - c) * t) / self.cell_m;
        let across = ((c - a) * (1.0 - s) + (d - b) * s) / self.cell_m;
        let height_m = (a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t;
        (!own.is_nan()).then_some([height_m, along * along + across * across])
    }

    /// A position of the frame in cells of the world's lattice.
    fn lattice(&self, x_m: f64, y_m: f64) -> [f64; 2] {
        let [x, y, _] = self.frame.world_from_local([x_m, y_m, 0.0]);
        [x / self.cell_m, y / self.cell_m]
    }

    /// Raises the cells whose centre lies in a triangle to its plane.
    fn raise(&mut self, corners: [[f64; 3]; 3]) {
        // Rounding must not open a gap between two triangles.
        const SLACK: f64 = 1e-9;
        let [a, b, c] = corners;
        let twice = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        let low = [0, 1].map(|axis| a[axis].min(b[axis]).min(c[axis]));
        let high = [0, 1].map(|axis| a[axis].max(b[axis]).max(c[axis]));
        let low = self.lattice(low[0], low[1]).map(|value| (value - 0.5 - SLACK).ceil() as i64);
        let high = self.lattice(high[0], high[1]).map(|value| (value - 0.5 + SLACK).floor() as i64);
        for row in low[1]..=high[1] {
            for column in low[0]..=high[0] {
                let [x, y] = self.centre(column, row);
                let v = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / twice;
                let w = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / twice;
                if v >= -SLACK && w >= -SLACK && v + w <= 1.0 + SLACK {
                    // Rounding must not take it below the ground.
                    let height = (a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2])).max(0.0);
                    if self.window.contains(column, row) {
                        let cell = self.window.index(column, row);
                        self.height_m[cell] = self.height_m[cell].max(height as f32 + 0.0);
                    }
                }
            }
        }
    }

    /// Centre of a cell in the frame.
    fn centre(&self, column: i64, row: i64) -> [f64; 2] {
        let world = [column, row].map(|place| (place as f64 + 0.5) * self.cell_m);
        let [x, y, _] = self.frame.local_from_world([world[0], world[1], 0.0]);
        [x, y]
    }
}

/// Offsets of the eight cells around one, from the south-west, row by row.
const AROUND: [[i64; 2]; 8] =
    [[-1, -1], [0, -1], [1, -1], [-1, 0], [1, 0], [-1, 1], [0, 1], [1, 1]];

/// The lattice's cells that the points touch.
fn window(view: &View<'_>, cell_m: f64) -> Window {
    let mut rect = Rect::EMPTY;
    for (x, y) in view.x.iter().zip(view.y) {
        let [x, y, _] = view.frame.world_from_local([*x, *y, 0.0]);
        rect = rect.union(&Rect { min: [x, y], max: [x, y] });
    }
    if view.is_empty() {
        return Window { column0: 0, row0: 0, columns: 0, rows: 0 };
    }
    Window::touching(&rect, cell_m)
}

/// Position and height of the highest first return of every cell of a lattice, by cells; of all
/// returns where no return is a first one.
fn thinned(view: &View<'_>, cell_m: f64) -> Result<Vec<[f64; 3]>, Error> {
    let mut height_m = view.height_m.to_vec();
    if view.is_first.contains(&true) {
        let later = height_m.iter_mut().zip(view.is_first).filter(|(_, first)| !**first);
        later.for_each(|(height, _)| *height = f32::NAN);
    }
    let chm = Chm::highest(&View { height_m: &height_m, ..*view }, cell_m)?;
    let tops = chm.top.iter().zip(&chm.height_m).filter(|(top, _)| **top != Chm::NO_POINT);
    let vertex = |(top, height): (&u32, &f32)| {
        let index = *top as usize;
        [view.x[index], view.y[index], f64::from(*height)]
    };
    Ok(tops.map(vertex).collect())
}

/// Heights from which on points make a surface of their own: 0, 2, 5 m (Khosravipour et al. 2014,
/// section "Pit-free CHM algorithm") and on in steps, as far as there are points.
fn levels(step_m: f64, top_m: f64) -> Vec<f64> {
    let step_m = step_m.max(0.1);
    let steps = ((top_m - FIRST_STEP_M) / step_m).floor().max(-1.0) as i64;
    let upper = (0..=steps).map(|step| FIRST_STEP_M + step as f64 * step_m);
    [0.0, 2.0].into_iter().filter(|level| *level <= top_m).chain(upper).collect()
}

/// Lowest of the layers that are a step apart, m.
const FIRST_STEP_M: f64 = 5.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Piece;
    use proptest::prelude::*;

    const HOW: PitFree = PitFree { cell_m: 0.5, max_edge_m: 1.5, step_m: 5.0 };

    /// First returns at positions with heights; elevations do not matter.
    fn piece(points: &[[f64; 3]], frame: Frame) -> Piece {
        let local: Vec<[f64; 3]> = points.iter().map(|p| frame.local_from_world(*p)).collect();
        Piece {
            frame,
            x: local.iter().map(|p| p[0]).collect(),
            y: local.iter().map(|p| p[1]).collect(),
            z: vec![0.0; points.len()],
            height_m: points.iter().map(|p| p[2] as f32).collect(),
            is_first: vec![true; points.len()],
            markers: Vec::new(),
        }
    }

    /// A point in the middle of every cell of a square of 10 m.
    fn plate(height_m: impl Fn(i32, i32) -> f64) -> Vec<[f64; 3]> {
        let place = |i: i32, j: i32| [f64::from(i) * 0.5 + 0.25, f64::from(j) * 0.5 + 0.25];
        let cells = (0..20).flat_map(|i| (0..20).map(move |j| (i, j)));
        cells.map(|(i, j)| [place(i, j)[0], place(i, j)[1], height_m(i, j)]).collect()
    }

    #[test]
    fn the_highest_point_of_a_cell_and_of_equal_ones_the_first() {
        let mut points = vec![[0.1, 0.1, 3.0], [0.2, 0.3, 7.0], [0.3, 0.2, 7.0], [1.2, 0.1, -0.5]];
        points.push([0.1, 0.7, f64::NAN]);
        let piece = piece(&points, Frame::default());
        let chm = Chm::highest(&piece.view(), 0.5).unwrap();
        assert_eq!(chm.window, Window { column0: 0, row0: 0, columns: 3, rows: 2 });
        assert_eq!((chm.height_m[0], chm.top[0]), (7.0, 1));
        assert_eq!((chm.height_m[2].to_bits(), chm.top[2]), (0, 3), "below ground");
        assert!(chm.height_m[3].is_nan() && chm.top[3] == Chm::NO_POINT, "height unknown");
    }

    #[test]
    fn a_pulse_deep_into_a_crown_leaves_no_pit() {
        let points = plate(|i, j| if (i, j) == (8, 8) { 1.0 } else { 12.0 });
        let piece = piece(&points, Frame::default());
        let (raw, free) = (Chm::highest(&piece.view(), 0.5), Chm::pit_free(&piece.view(), &HOW));
        let (raw, free) = (raw.unwrap(), free.unwrap());
        let cell = free.cell_at(4.25, 4.25).unwrap();
        assert_eq!((raw.height_m[cell], free.height_m[cell]), (1.0, 12.0));
    }

    #[test]
    fn a_gap_between_crowns_stays_open() {
        let piece =
            piece(&plate(|i, _| if (6..14).contains(&i) { 0.0 } else { 12.0 }), Frame::default());
        let free = Chm::pit_free(&piece.view(), &HOW).unwrap();
        assert_eq!(free.height_m[free.cell_at(5.1, 5.1).unwrap()], 0.0);
        assert_eq!(free.height_m[free.cell_at(2.1, 5.1).unwrap()], 12.0);
    }

    #[test]
    fn later_returns_do_not_count_unless_there_are_no_others() {
        let mut piece = piece(&plate(|_, _| 8.0), Frame::default());
        piece.is_first.iter_mut().step_by(3).for_each(|first| *first = false);
        piece.height_m.iter_mut().step_by(3).for_each(|height| *height = 2.5);
        let middle = |piece: &Piece| {
            let chm = Chm::pit_free(&piece.view(), &HOW).unwrap();
            (0..4)
                .map(|i| chm.height_m[chm.cell_at(4.1 + 0.5 * f64::from(i), 5.1).unwrap()])
                .collect::<Vec<_>>()
        };
        assert_eq!(middle(&piece), [8.0; 4]);
        piece.is_first.fill(false);
        assert!(middle(&piece).iter().all(|height| *height <= 8.0));
        assert_eq!(
            Chm::pit_free(&Piece::default().view(), &HOW).unwrap().height_m,
            Vec::<f32>::new()
        );
    }

    #[test]
    fn the_surface_is_the_plane_and_ends_where_cells_do_not_join() {
        let piece =
            piece(&plate(|i, j| 3.0 + 0.5 * f64::from(i) + 0.25 * f64::from(j)), Frame::default());
        let chm = Chm::highest(&piece.view(), 0.5).unwrap();
        let [height_m, slope] = chm.surface(4.4, 5.3, |_| true).unwrap();
        let expected = 3.0 + (4.4 - 0.25) + 0.5 * (5.3 - 0.25);
        assert!((height_m - expected).abs() < 1e-6, "{height_m}");
        assert!((slope - 1.25).abs() < 1e-9, "{slope}");
        let own = chm.height_m[chm.cell_at(4.4, 5.3).unwrap()];
        assert_eq!(chm.surface(4.4, 5.3, |_| false), Some([f64::from(own), 0.0]));
        assert_eq!(chm.surface(-0.1, 5.3, |_| true), None);
    }

    #[test]
    fn levels_go_as_far_as_the_points() {
        assert_eq!(levels(5.0, 16.0), [0.0, 2.0, 5.0, 10.0, 15.0]);
        assert_eq!(levels(5.0, 1.0), [0.0]);
        assert_eq!(levels(0.0, 5.2), [0.0, 2.0, 5.0, 5.1, 5.2]);
    }

    #[test]
    fn a_cell_of_no_size_is_refused() {
        let message = Chm::highest(&Piece::default().view(), 0.0).unwrap_err().to_string();
        assert!(message.contains('0'), "{message}");
    }

    proptest! {
        #[test]
        fn frames_do_not_matter(
            points in prop::collection::vec((0i32..80, 0i32..80, 0i32..200), 1..80),
            origin in -50i64..50,
        ) {
            let points: Vec<[f64; 3]> = points.iter().map(|p| [p.0, p.1, p.2].map(|v| f64::from(v) * 0.125)).collect();
            let chm = |frame: Frame| Chm::pit_free(&piece(&points, frame).view(), &HOW).unwrap();
            let (a, b) = (chm(Frame::default()), chm(Frame::new([origin, -origin, 9])));
            prop_assert_eq!((a.window, &a.top), (b.window, &b.top));
            let bits = |chm: &Chm| chm.height_m.iter().map(|h| h.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&a), bits(&b));
        }
    }
}

//! The highest point of every cell, and the test of a point against its window.

use crate::cells::Cells;
use crate::input::Ranked;
use crate::window::Window;
use crate::{Params, WindowKind};
use rayon::prelude::*;
use timberline_pointcloud::frame::{TICK_M, TICKS_PER_M};

/// Edge of the coarsest cells: 0.5 m, in ticks of 0.1 mm.
pub(crate) const CELL_TICKS: i64 = 5_000;

/// Radius in which the spacing of the points is taken.
const SPACING_REACH_M: f64 = 5.0;
/// How far from a point its spacing can depend on others: the radius and the diagonal of a cell.
pub(crate) const SPACING_HALO_M: f64 =
    SPACING_REACH_M + CELL_TICKS as f64 * TICK_M * std::f64::consts::SQRT_2;

/// The upper surface of the points: the highest supported point of every cell.
#[derive(Debug)]
pub(crate) struct Surface<'a> {
    pub(crate) ranked: Ranked<'a>,
    pub(crate) cells: Cells,
    /// By place of the cell; none where no point of the cell is supported.
    pub(crate) best: Vec<Option<u32>>,
}

impl<'a> Surface<'a> {
    pub(crate) fn new(ranked: Ranked<'a>, edge_ticks: i64) -> Self {
        let mut surface = Self { ranked, cells: Cells::new(&ranked, edge_ticks), best: Vec::new() };
        surface.best = (0..surface.cells.len())
            .into_par_iter()
            .map(|place| surface.highest_supported(place))
            .collect();
        surface
    }

    fn highest_supported(&self, place: usize) -> Option<u32> {
        let higher = |a: u32, b: u32| self.ranked.outranks(a as usize, b as usize);
        let mut refused: Option<u32> = None;
        loop {
            let points = self.cells.points(place).iter().copied();
            let left = points.filter(|&i| refused.is_none_or(|r| higher(r, i)));
            let best = left.reduce(|a, b| if higher(b, a) { b } else { a })?;
            if self.is_supported(best as usize) {
                return Some(best);
            }
            refused = Some(best);
        }
    }

    /// Whether enough other points lie in the sphere around a point.
    fn is_supported(&self, index: usize) -> bool {
        let params = self.ranked.params;
        let (wanted, radius) = (params.support_points as usize, params.support_radius_m);
        if wanted == 0 {
            return true;
        }
        let cloud = self.ranked.input.cloud;
        let at = cloud.local(index);
        let is_near = |other: usize| {
            let [dx, dy, dz] =
                [cloud.x[other] - at[0], cloud.y[other] - at[1], cloud.z[other] - at[2]];
            other != index && dx * dx + dy * dy + dz * dz <= radius * radius
        };
        let cell = self.cells.cell_at(cloud.world(index));
        let places = self.cells.around(cell, self.cells.span(radius));
        let points = places.flat_map(|place| self.cells.points(place));
        points.filter(|&&other| is_near(other as usize)).take(wanted).count() == wanted
    }

    /// Mean distance of the first returns around a point, metres: the root of the area of a disc of
    /// [`SPACING_REACH_M`], in whole cells, for each of them.
    fn spacing_m(&self, index: usize) -> f64 {
        let cloud = self.ranked.input.cloud;
        let [column, row] = self.cells.cell_at(cloud.world(index));
        let edge_m = self.cells.edge_m();
        let span = (SPACING_REACH_M / edge_m) as i32;
        let (mut firsts, mut area) = (0usize, 0i32);
        for away in -span..=span {
            let half = f64::from(span * span - away * away).sqrt() as i32;
            area += 2 * half + 1;
            let places = self.cells.run(column + away, row - half, row + half);
            let points = places.flat_map(|place| self.cells.points(place));
            firsts += points.filter(|&&i| cloud.return_number[i as usize] <= 1).count();
        }
        (f64::from(area) / firsts.max(1) as f64).sqrt() * edge_m
    }

    /// Whether a point is the highest of its window; the window if so.
    pub(crate) fn test(&self, index: usize) -> Option<Window> {
        let params = self.ranked.params;
        let window = Window::at_height(params, self.ranked.height(index));
        if !self.is_maximum(index, window) {
            return None;
        }
        if params.window != WindowKind::Variable || params.window_min_spacings == 0.0 {
            return Some(window);
        }
        let least_m = params.window_min_spacings * self.spacing_m(index);
        let wide = window.widened(least_m.min(params.window_max_m));
        (wide == window || self.is_maximum(index, wide)).then_some(wide)
    }

    /// Whether no supported point of its window outranks a point.
    fn is_maximum(&self, index: usize, window: Window) -> bool {
        let cell = self.cells.cell_at(self.ranked.input.cloud.world(index));
        let span = self.cells.span(window.reach_m());
        !self.cells.around(cell, span).any(|place| self.cell_beats(place, index, window))
    }

    /// Whether a supported point of the cell lies in the window of `index` and outranks it.
    fn cell_beats(&self, place: usize, index: usize, window: Window) -> bool {
        let outranks = |other: u32| self.ranked.outranks(other as usize, index);
        let inside = |other: u32| window.contains(self.ranked.offset_ticks(index, other as usize));
        match self.best[place] {
            Some(best) if outranks(best) => {
                let beats = |&other: &u32| {
                    outranks(other) && inside(other) && self.is_supported(other as usize)
                };
                inside(best) || self.cells.points(place).iter().any(beats)
            }
            _ => false,
        }
    }
}

/// An edge such that every window covers the cell of its centre: then only the highest point of a
/// cell can be a treetop.
pub(crate) fn cell_ticks(params: &Params) -> i64 {
    let (smallest_m, diagonal) = match params.window {
        WindowKind::Variable => (params.window_base_m, std::f64::consts::SQRT_2),
        WindowKind::Circle => (params.window_m, std::f64::consts::SQRT_2),
        WindowKind::Square => (params.window_m, 1.0),
    };
    let reach_ticks = smallest_m / 2.0 * TICKS_PER_M;
    let mut edge = CELL_TICKS;
    while edge > 1 && edge as f64 * diagonal > reach_ticks {
        edge /= 2;
    }
    edge
}

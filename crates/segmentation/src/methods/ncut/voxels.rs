//! Points in voxels, and how alike two voxels are.

use super::{Graph, NcutParams, Top};
use crate::View;
use std::ops::Range;

/// The occupied voxels of a lattice that is fixed in the world in the plane and starts at the
/// ground in height.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Voxels {
    /// Column, row and level of every voxel, sorted.
    pub(super) cells: Vec<[i64; 3]>,
    /// The voxel of every point, or [`Voxels::NONE`].
    pub(super) of_point: Vec<u32>,
    /// Voxels that stand on one another, by column and row.
    stacks: Vec<Range<u32>>,
}

/// How far a top may lie above the points of its crown, m: a scan seldom meets the very top.
const ABOVE_POINTS_M: f64 = 3.0;

/// How far apart voxels may be to be compared, in columns and rows, and how alike they are as far as
/// the plane goes.
type Kernel = Vec<([i64; 2], f64)>;

impl Voxels {
    /// What the voxel of a point that is too low is.
    pub(super) const NONE: u32 = u32::MAX;

    pub(super) fn new(view: &View<'_>, params: &NcutParams) -> Self {
        let mut keyed: Vec<([i64; 3], u32)> = (0..view.len())
            .filter(|&i| f64::from(view.height_m[i]) >= params.min_height_m)
            .map(|i| {
                (cell(view, [view.x[i], view.y[i]], f64::from(view.height_m[i]), params), i as u32)
            })
            .collect();
        keyed.sort_unstable();
        let mut voxels =
            Self { cells: Vec::new(), of_point: vec![Self::NONE; view.len()], stacks: Vec::new() };
        for (cell, point) in keyed {
            if voxels.cells.last() != Some(&cell) {
                voxels.add(cell);
            }
            voxels.of_point[point as usize] = voxels.cells.len() as u32 - 1;
        }
        voxels
    }

    /// Adds the next voxel in order.
    fn add(&mut self, cell: [i64; 3]) {
        let place = self.cells.len() as u32;
        match (self.cells.last(), self.stacks.last_mut()) {
            (Some(last), Some(stack)) if last[..2] == cell[..2] => stack.end = place + 1,
            _ => self.stacks.push(place..place + 1),
        }
        self.cells.push(cell);
    }

    /// The voxel that holds a top or, for one that is no point, the next below it, if there is one.
    pub(super) fn at(&self, view: &View<'_>, top: &Top, params: &NcutParams) -> Option<u32> {
        let wanted = cell(view, top.at, top.height_m, params);
        let above = self.cells.partition_point(|cell| *cell <= wanted);
        let place = above.checked_sub(1)?;
        let found = self.cells[place];
        let gap_m = (wanted[2] - found[2]) as f64 * params.voxel_height_m;
        (found[..2] == wanted[..2] && gap_m <= ABOVE_POINTS_M).then_some(place as u32)
    }

    /// Centre of every voxel in the plane, in the frame of the view.
    pub(super) fn centres(&self, view: &View<'_>, params: &NcutParams) -> Vec<[f64; 2]> {
        let centre = |cell: &[i64; 3]| {
            let [x, y] = [cell[0], cell[1]].map(|place| (place as f64 + 0.5) * params.voxel_m);
            let [x, y, _] = view.frame.local_from_world([x, y, 0.0]);
            [x, y]
        };
        self.cells.iter().map(centre).collect()
    }

    /// The graph: an edge between voxels within the radius in the plane, of weight
    /// exp(-(Dxy/sxy)²) exp(-(Dz/sz)²) G, where G is the smaller `nearness` of the two; each has an
    /// edge to itself.
    pub(super) fn graph(&self, nearness: &[f64], params: &NcutParams) -> Graph {
        let kernel = kernel(params);
        let high = self.cells.iter().map(|cell| cell[2]).max().unwrap_or(0) as usize;
        let by_level: Vec<f64> = (0..=high + 1)
            .map(|d| gauss(d as f64 * params.voxel_height_m, params.sigma_z_m))
            .collect();
        let mut around = Vec::new();
        let rows = self.stacks.iter().flat_map(|stack| {
            around.clear();
            self.around(stack.start, &kernel, &mut around);
            let own = stack.clone();
            let near = around.clone();
            let by_level = &by_level;
            own.map(move |voxel| self.row(voxel as usize, &near, by_level, nearness))
        });
        Graph::from_rows(rows)
    }

    /// The stacks around that of a voxel with their weights.
    fn around(&self, voxel: u32, kernel: &Kernel, found: &mut Vec<(Range<u32>, f64)>) {
        let [column, row, _] = self.cells[voxel as usize];
        for ([dx, dy], weight) in kernel {
            let wanted = [column + dx, row + dy];
            let place = self.stacks.binary_search_by(|stack| {
                let [column, row, _] = self.cells[stack.start as usize];
                [column, row].cmp(&wanted)
            });
            if let Ok(place) = place {
                found.push((self.stacks[place].clone(), *weight));
            }
        }
    }

    fn row(
        &self,
        voxel: usize,
        around: &[(Range<u32>, f64)],
        by_level: &[f64],
        nearness: &[f64],
    ) -> Vec<(u32, f32)> {
        let mut row = Vec::new();
        for (stack, weight) in around {
            for other in stack.clone() {
                let levels = self.cells[voxel][2].abs_diff(self.cells[other as usize][2]) as usize;
                let near = nearness[voxel].min(nearness[other as usize]);
                let weight = (weight * by_level[levels] * near) as f32;
                if weight > 0.0 {
                    row.push((other, weight));
                }
            }
        }
        row
    }
}

fn cell(view: &View<'_>, [x, y]: [f64; 2], height_m: f64, params: &NcutParams) -> [i64; 3] {
    let [x, y, _] = view.frame.world_from_local([x, y, 0.0]);
    let [column, row] = [x, y].map(|value| (value / params.voxel_m).floor() as i64);
    [column, row, (height_m / params.voxel_height_m).floor() as i64]
}

/// Offsets within the radius, sorted, with their weights.
fn kernel(params: &NcutParams) -> Kernel {
    let reach = (params.radius_m / params.voxel_m).floor() as i64;
    let mut kernel = Vec::new();
    for dx in -reach..=reach {
        for dy in -reach..=reach {
            let distance = ((dx * dx + dy * dy) as f64).sqrt() * params.voxel_m;
            if distance <= params.radius_m {
                kernel.push(([dx, dy], gauss(distance, params.sigma_xy_m)));
            }
        }
    }
    kernel
}

/// exp(-(d/s)²).
pub(super) fn gauss(distance: f64, sigma: f64) -> f64 {
    libm::exp(-(distance / sigma) * (distance / sigma))
}

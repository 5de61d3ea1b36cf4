//! Ground points of a region, block by block.
//!
//! The plane is divided into world-fixed square blocks. What is decided about the points of a block
//! depends only on the points within it and its buffer, so that any part of a campaign that holds
//! these gives the same answer, whatever the tiles.

use crate::Error;
use crate::params::{GroundParams, Returns, Source};
use crate::ptd::{densify, on_ground};
use crate::thin::lowest_per_cell;
use rayon::prelude::*;
use std::collections::BTreeSet;
use timberline_pointcloud::{Grid2, PointCloud, Rect};

/// What is decided about a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Label {
    /// No ground, or outside the region asked for.
    #[default]
    Other,
    /// Ground by the supplier's class.
    Supplied,
    /// Ground by classification.
    Classified,
}

const CLASS_GROUND: u8 = 2;
const CLASS_WATER: u8 = 9;
const CLASS_LOW_NOISE: u8 = 7;
const CLASS_HIGH_NOISE: u8 = 18;

/// Edge of the cells by which the coverage of the supplier's classes is judged, metres.
const COVERAGE_CELL_M: f64 = 8.0;
/// Share of the cells with points that must hold supplied ground or water.
const COVERAGE_SHARE: f64 = 0.5;

/// Labels the points of a cloud that lie in a world rectangle. The cloud must hold all points of the
/// blocks that touch it and of their buffers ([`region_of`]).
///
/// # Errors
/// [`Error::Triangulation`]; [`Error::Parameter`] for blocks of no size.
pub fn classify(
    cloud: &PointCloud,
    rect: Rect,
    params: &GroundParams,
) -> Result<Vec<Label>, Error> {
    let grid = Grid2::new(&cloud.x, &cloud.y, params.buffer_m.max(4.0))?;
    let blocks = blocks_over(rect, params.block_m);
    let found: Result<Vec<Vec<(usize, Label)>>, Error> = blocks
        .par_iter()
        .map(|block| Block::gather(cloud, &grid, *block, params).label(cloud, params))
        .collect();
    let mut labels = vec![Label::Other; cloud.len()];
    for (index, label) in found?.into_iter().flatten() {
        let [x, y, _] = cloud.world(index);
        if rect.contains(x, y) {
            labels[index] = label;
        }
    }
    Ok(labels)
}

/// The world rectangle whose points decide about the points of another.
#[must_use]
pub fn region_of(rect: Rect, params: &GroundParams) -> Rect {
    let edge = params.block_m;
    let min = rect.min.map(|v| (v / edge).floor() * edge);
    let max = rect.max.map(|v| (v / edge).ceil() * edge);
    Rect { min, max }.grown(params.buffer_m)
}

/// World corners of the blocks that share a position with a half-open rectangle.
fn blocks_over(rect: Rect, edge_m: f64) -> Vec<[f64; 2]> {
    let first = rect.min.map(|v| (v / edge_m).floor() as i64);
    let end = rect.max.map(|v| (v / edge_m).ceil() as i64);
    let mut blocks = Vec::new();
    for iy in first[1]..end[1] {
        for ix in first[0]..end[0] {
            blocks.push([ix as f64 * edge_m, iy as f64 * edge_m]);
        }
    }
    blocks
}

/// The points of a block and its buffer.
struct Block {
    /// Indices in the cloud, in its order.
    indices: Vec<usize>,
    /// Positions relative to the buffer's corner, z as in a frame of whole metres.
    positions: Vec<[f64; 3]>,
    /// Whether a point lies in the block itself.
    own: Vec<bool>,
    /// Edge with buffers, metres.
    edge_m: f64,
}

impl Block {
    fn gather(cloud: &PointCloud, grid: &Grid2, corner: [f64; 2], params: &GroundParams) -> Self {
        let edge_m = params.block_m + 2.0 * params.buffer_m;
        let origin = cloud.frame.origin_m;
        let low = [0, 1].map(|a| corner[a] - params.buffer_m - origin[a] as f64);
        let half = edge_m / 2.0;
        let mut indices = Vec::new();
        grid.candidates(low[0] + half, low[1] + half, half, |index| {
            let (x, y) = (cloud.x[index] - low[0], cloud.y[index] - low[1]);
            if x >= 0.0 && x < edge_m && y >= 0.0 && y < edge_m {
                indices.push(index);
            }
        });
        indices.sort_unstable();
        let base = indices.iter().map(|&i| cloud.z[i]).fold(f64::INFINITY, f64::min).floor();
        let place = |&i: &usize| [cloud.x[i] - low[0], cloud.y[i] - low[1], cloud.z[i] - base];
        let positions: Vec<[f64; 3]> = indices.iter().map(place).collect();
        let inside = |v: f64| v >= params.buffer_m && v < params.buffer_m + params.block_m;
        let own = positions.iter().map(|p| inside(p[0]) && inside(p[1])).collect();
        Self { indices, positions, own, edge_m }
    }

    fn label(
        &self,
        cloud: &PointCloud,
        params: &GroundParams,
    ) -> Result<Vec<(usize, Label)>, Error> {
        let supplied = match params.source {
            Source::Use => true,
            Source::Classify => false,
            Source::Auto => self.is_covered(cloud),
        };
        if supplied {
            return Ok(self.supplied(cloud));
        }
        let candidates: Vec<usize> = (0..self.indices.len())
            .filter(|&place| may_be_ground(cloud, self.indices[place], params.returns))
            .collect();
        let candidates = lowest_per_cell(candidates, &self.positions, params.thin_m);
        let points: Vec<[f64; 3]> = candidates.iter().map(|&place| self.positions[place]).collect();
        let vertices = densify(&points, self.edge_m, params)?;
        let on = on_ground(&points, &vertices, self.edge_m, params.tolerance_m)?;
        let own = candidates.iter().zip(on).filter(|(place, on)| *on && self.own[**place]);
        Ok(own.map(|(&place, _)| (self.indices[place], Label::Classified)).collect())
    }

    /// The own points of the supplier's ground and water classes: the surface goes on over a lake.
    fn supplied(&self, cloud: &PointCloud) -> Vec<(usize, Label)> {
        let own = self.indices.iter().zip(&self.own).filter(|(_, own)| **own).map(|(i, _)| *i);
        own.filter(|&i| [CLASS_GROUND, CLASS_WATER].contains(&cloud.classification[i]))
            .map(|i| (i, Label::Supplied))
            .collect()
    }

    /// Whether the supplier's ground and water cover half of the area that has points.
    fn is_covered(&self, cloud: &PointCloud) -> bool {
        let (mut all, mut classed) = (BTreeSet::new(), BTreeSet::new());
        for (&index, p) in self.indices.iter().zip(&self.positions) {
            let cell = [0, 1].map(|a| (p[a] / COVERAGE_CELL_M).floor() as i32);
            all.insert(cell);
            if [CLASS_GROUND, CLASS_WATER].contains(&cloud.classification[index]) {
                classed.insert(cell);
            }
        }
        classed.len() as f64 >= COVERAGE_SHARE * all.len() as f64 && !classed.is_empty()
    }
}

fn may_be_ground(cloud: &PointCloud, index: usize, returns: Returns) -> bool {
    let is_noise = [CLASS_LOW_NOISE, CLASS_HIGH_NOISE].contains(&cloud.classification[index]);
    let (number, of) = (cloud.return_number[index], cloud.number_of_returns[index]);
    let is_last = number == 0 || of == 0 || number >= of;
    !is_noise && (returns == Returns::All || is_last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use timberline_pointcloud::{Frame, Point};

    /// A lake without it sags between its shores and grows a canopy of its own surface.
    #[test]
    fn supplied_water_belongs_to_the_ground() {
        let mut cloud = PointCloud::new(Frame::default());
        for (x, classification) in [(1.0, 2), (9.0, 9), (17.0, 1)] {
            let point = Point { classification, ..Point::default() };
            cloud.push_world([x, 1.0, 5.0], &point);
        }
        let rect = Rect { min: [0.0, 0.0], max: [64.0, 64.0] };
        let params = GroundParams { source: Source::Use, ..GroundParams::default() };
        let labels = classify(&cloud, rect, &params).unwrap();
        assert_eq!(labels, [Label::Supplied, Label::Supplied, Label::Other]);
    }
}

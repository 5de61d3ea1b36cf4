//! The terrain surface: patches blended by a partition of unity.
//!
//! Elevation = sum of weight × patch / sum of weights, over the patches in one world-fixed order, so
//! that values do not depend on which part of a campaign the surface was built for. Where no
//! smoothing is asked, every patch with weight at a node passes through it, hence so does the blend.

use crate::Error;
use crate::hardy::Kernel;
use crate::nodes::{Cell, Nodes};
use crate::params::{DtmParams, Tuning};
use crate::patch::{Patch, PatchNodes};
use crate::quadtree::{BLEND_MARGIN, Division, SUPPORT_MARGIN, blend_rect};
use crate::tuning::{Scores, kernel_of};
use rayon::prelude::*;
use std::collections::BTreeMap;
use timberline_pointcloud::Rect;

/// Edge of the buckets that list the patches with weight in them, metres.
pub(crate) const BUCKET_M: f64 = 2.0;

/// A terrain surface over a world rectangle.
#[derive(Debug, Clone)]
pub struct Surface {
    patches: Vec<Patch>,
    buckets: Buckets,
}

impl Surface {
    /// Fits all patches with weight in a world rectangle. `nodes` must hold every ground point
    /// within [`DtmParams::reach_m`] of it.
    ///
    /// # Errors
    /// [`Error::Singular`] or [`Error::Eigen`] where a system cannot be solved.
    pub fn build(nodes: &Nodes, rect: Rect, params: &DtmParams) -> Result<Self, Error> {
        let division = params.division();
        let leaves = division.leaves_over(nodes, whole_buckets(rect));
        let ratios = match params.tuning {
            Tuning::Auto => tuned(nodes, &leaves, &division, params)?,
            Tuning::Given => BTreeMap::new(),
        };
        let fitted: Result<Vec<Option<Patch>>, Error> = leaves
            .par_iter()
            .map(|leaf| {
                let gathered = PatchNodes::gather(nodes, *leaf, LEAST_NODES, params.gather_m());
                if gathered.is_empty() {
                    return Ok(None);
                }
                let kernel = match ratios.get(&root_of(*leaf, &division)) {
                    Some(ratios) => kernel_of(*ratios, gathered.spacing_m),
                    None => Kernel { offset_m: params.offset_m, smoothing_m: params.smoothing_m },
                };
                Patch::fit(*leaf, &gathered, kernel).map(Some)
            })
            .collect();
        let patches = fitted?.into_iter().flatten().collect();
        Ok(Self::from_patches(patches, rect, params.max_distance_m))
    }

    /// A surface from fitted patches (as read back), for positions in a world rectangle. There is
    /// no surface in the world-fixed squares of 2 m whose centre is farther than `max_distance_m`
    /// from every node of the patches with weight there.
    #[must_use]
    pub fn from_patches(patches: Vec<Patch>, rect: Rect, max_distance_m: f64) -> Self {
        let buckets = Buckets::new(&patches, rect, max_distance_m);
        Self { patches, buckets }
    }

    /// The patches, in the order of their summation.
    #[must_use]
    pub fn patches(&self) -> &[Patch] {
        &self.patches
    }

    /// World elevations at world positions, as [`Surface::at`], in parallel and in their order.
    #[must_use]
    pub fn elevations(&self, world: &[[f64; 2]]) -> Vec<f64> {
        world.par_iter().with_min_len(GRAIN).map(|p| self.at(*p)).collect()
    }

    /// Heights of world positions above the surface, metres, in their order; NaN without one.
    #[must_use]
    pub fn heights(&self, world: &[[f64; 3]]) -> Vec<f64> {
        let height = |p: &[f64; 3]| p[2] - self.at([p[0], p[1]]);
        world.par_iter().with_min_len(GRAIN).map(height).collect()
    }

    /// World elevation at a world position of the rectangle, metres; NaN where no patch reaches.
    #[must_use]
    pub fn at(&self, world: [f64; 2]) -> f64 {
        let (mut weights, mut sum) = (0.0, 0.0);
        for &index in self.buckets.at(world) {
            if let Some((weight, elevation)) = self.patches[index as usize].at(world) {
                weights += weight;
                sum += weight * elevation;
            }
        }
        sum / weights
    }
}

/// Evaluations that one thread does at a time.
const GRAIN: usize = 1024;
/// A patch with fewer nodes looks further afield: a plane's three, and some redundancy.
const LEAST_NODES: usize = 16;
/// Patches of a root square that are scored when kernels are chosen.
const SCORED_PATCHES: usize = 2;

/// The rectangle grown to whole buckets, so that all patches with weight in a bucket are known.
fn whole_buckets(rect: Rect) -> Rect {
    let min = rect.min.map(|v| (v / BUCKET_M).floor() * BUCKET_M);
    let max = rect.max.map(|v| (v / BUCKET_M).floor() * BUCKET_M + BUCKET_M);
    Rect { min, max }
}

fn root_of(leaf: Cell, division: &Division) -> Cell {
    let shift = division.log2_root - leaf.log2_edge;
    Cell { log2_edge: division.log2_root, iy: leaf.iy >> shift, ix: leaf.ix >> shift }
}

/// The chosen ratios of every root square that holds a leaf.
fn tuned(
    nodes: &Nodes,
    leaves: &[Cell],
    division: &Division,
    params: &DtmParams,
) -> Result<BTreeMap<Cell, [f64; 2]>, Error> {
    let mut roots: Vec<Cell> = leaves.iter().map(|leaf| root_of(*leaf, division)).collect();
    roots.sort_unstable();
    roots.dedup();
    let mut around: Vec<Cell> = roots.iter().flat_map(|root| ring(*root)).collect();
    around.sort_unstable();
    around.dedup();
    let scored: Result<BTreeMap<Cell, Scores>, Error> =
        around.par_iter().map(|root| Ok((*root, scores_of(nodes, *root, division)?))).collect();
    let scored = scored?;
    let chosen = roots.into_iter().map(|root| {
        let mut pooled = Scores::default();
        ring(root).filter_map(|cell| scored.get(&cell)).for_each(|scores| pooled.pool(scores));
        (root, pooled.best(params.prior_weight))
    });
    Ok(chosen.collect())
}

/// A cell and its eight neighbours.
fn ring(cell: Cell) -> impl Iterator<Item = Cell> {
    (-1..=1).flat_map(move |dy| {
        (-1..=1).map(move |dx| Cell { iy: cell.iy + dy, ix: cell.ix + dx, ..cell })
    })
}

/// Scores of the candidates over some leaves of a root square, spread evenly over their order.
fn scores_of(nodes: &Nodes, root: Cell, division: &Division) -> Result<Scores, Error> {
    let leaves = division.leaves_of(nodes, root);
    let mut scores = Scores::default();
    for leaf in leaves.iter().step_by(leaves.len().div_ceil(SCORED_PATCHES).max(1)) {
        let margin = SUPPORT_MARGIN * leaf.edge_m();
        let gathered = PatchNodes::gather(nodes, *leaf, 0, margin);
        if gathered.len() < LEAST_NODES {
            continue;
        }
        let half = (0.5 + BLEND_MARGIN) * leaf.edge_m();
        let inside = |i: usize| gathered.x[i].abs() <= half && gathered.y[i].abs() <= half;
        scores.add(gathered.sample(), gathered.spacing_m, inside)?;
    }
    Ok(scores)
}

/// For every square of a lattice over a rectangle, the patches with weight in it.
#[derive(Debug, Clone)]
struct Buckets {
    low: [i64; 2],
    columns: usize,
    rows: usize,
    starts: Vec<u32>,
    patches: Vec<u32>,
}

impl Buckets {
    fn new(patches: &[Patch], rect: Rect, max_distance_m: f64) -> Self {
        let index = |v: f64| (v / BUCKET_M).floor() as i64;
        let low = rect.min.map(index);
        let high = rect.max.map(index);
        let columns = (high[0] - low[0] + 1).max(0) as usize;
        let rows = (high[1] - low[1] + 1).max(0) as usize;
        let mut entries: Vec<(u32, u32)> = Vec::new();
        for (number, patch) in patches.iter().enumerate() {
            let reach = blend_rect(patch.cell);
            let from = [0, 1].map(|a| (index(reach.min[a]) - low[a]).max(0));
            let to = [0, 1].map(|a| (index(reach.max[a]) - low[a]).min(high[a] - low[a]));
            for row in from[1]..=to[1] {
                for column in from[0]..=to[0] {
                    entries.push(((row * columns as i64 + column) as u32, number as u32));
                }
            }
        }
        entries.sort_unstable();
        let centre = |bucket: u32| {
            let place = [i64::from(bucket) % columns as i64, i64::from(bucket) / columns as i64];
            [0, 1].map(|a| ((low[a] + place[a]) as f64 + 0.5) * BUCKET_M)
        };
        let entries: Vec<(u32, u32)> = entries
            .chunk_by(|a, b| a.0 == b.0)
            .filter(|run| {
                let at = centre(run[0].0);
                run.iter().any(|(_, patch)| patches[*patch as usize].has_node(at, max_distance_m))
            })
            .flatten()
            .copied()
            .collect();
        let mut starts = vec![0u32; columns * rows + 1];
        entries.iter().for_each(|(bucket, _)| starts[*bucket as usize + 1] += 1);
        (1..starts.len()).for_each(|i| starts[i] += starts[i - 1]);
        let patches = entries.into_iter().map(|(_, patch)| patch).collect();
        Self { low, columns, rows, starts, patches }
    }

    fn at(&self, world: [f64; 2]) -> &[u32] {
        let place = [0, 1].map(|a| (world[a] / BUCKET_M).floor() as i64 - self.low[a]);
        let inside = place[0] >= 0 && place[1] >= 0;
        let (column, row) = (place[0] as usize, place[1] as usize);
        if !inside || column >= self.columns || row >= self.rows {
            return &[];
        }
        let bucket = row * self.columns + column;
        &self.patches[self.starts[bucket] as usize..self.starts[bucket + 1] as usize]
    }
}

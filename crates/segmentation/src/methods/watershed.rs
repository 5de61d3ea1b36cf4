//! Marker-controlled watershed by flooding in order of priority (Meyer 1994, section 4; Soille 2003,
//! chapter 9).

use crate::SegmentationParams;
use crate::chm::Chm;
use crate::methods::raster::{NO_TREE, Seed};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A cell at the shore of a basin: first the higher level, then who came first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Shore {
    /// Bits of the height at which the cell is flooded; order as the heights, which are positive.
    level: u32,
    arrival: Reverse<u32>,
    cell: usize,
    seed: u32,
}

/// The seed of every cell ([`NO_TREE`] for none): trees spread downwards from their apex, at equal
/// levels in the sequence in which the cells were reached, at first that of the seeds.
///
/// A basin never rises above the level at which it was entered, so that a top without a marker
/// belongs to the tree from which it is reached over the highest saddle. Cells lower than
/// `min_height_m`, unknown or further from the apex than `raster_radius_m` are not flooded. Works on
/// the eight cells around each; O(n log n).
#[must_use]
pub fn flood(chm: &Chm, seeds: &[Seed], params: &SegmentationParams) -> Vec<u32> {
    let mut trees = vec![NO_TREE; chm.window.len()];
    let (mut shores, mut arrivals) = (BinaryHeap::new(), 0_u32..);
    for (seed, Seed { cell, .. }) in seeds.iter().enumerate() {
        let level = chm.height_m[*cell].to_bits();
        let arrival = Reverse(arrivals.next().unwrap_or(u32::MAX));
        shores.push(Shore { level, arrival, cell: *cell, seed: seed as u32 });
    }
    let (least_m, largest_m2) = (params.min_height_m as f32, params.raster_radius_m.powi(2));
    while let Some(Shore { level, cell, seed, .. }) = shores.pop() {
        if trees[cell] != NO_TREE {
            continue;
        }
        trees[cell] = seed;
        let apex = seeds[seed as usize].cell;
        chm.around(cell, |next| {
            let open = trees[next] == NO_TREE && chm.height_m[next] >= least_m;
            if open && chm.squared_m2(next, apex) <= largest_m2 {
                let level = level.min(chm.height_m[next].to_bits());
                let arrival = Reverse(arrivals.next().unwrap_or(u32::MAX));
                shores.push(Shore { level, arrival, cell: next, seed });
            }
        });
    }
    trees
}

//! Region growing from treetops (Dalponte and Coomes 2016, section "Individual tree crown
//! segmentation").

use crate::SegmentationParams;
use crate::chm::Chm;
use crate::methods::raster::{NO_TREE, Seed};

/// Highest a cell may be above its tree's apex cell, as a share: 5 %, as in the authors' own program
/// (R package itcSegment).
const ABOVE_SHARE: f64 = 1.05;

/// A growing crown.
struct Region {
    seed: Seed,
    /// Sum of the heights of its cells, m.
    sum_m: f64,
    cells: u32,
    /// Free cells beside it that are high and near enough, but were too low for its mean so far.
    waiting: Vec<usize>,
}

/// The seed of every cell ([`NO_TREE`] for none).
///
/// Crowns grow sweep by sweep by the cells that share an edge with them and are higher than
/// `min_height_m`, higher than `dalponte_seed_share` of the apex cell, higher than
/// `dalponte_crown_share` of the crown's mean at the sweep's beginning, not more than 5 % higher than
/// the apex cell, and within `raster_radius_m` of it; until a sweep adds nothing. A cell that several
/// crowns want in one sweep goes to the one with the highest apex cell, of equal ones to the first.
#[must_use]
pub fn grow(chm: &Chm, seeds: &[Seed], params: &SegmentationParams) -> Vec<u32> {
    let mut trees = vec![NO_TREE; chm.window.len()];
    let mut regions: Vec<Region> = seeds
        .iter()
        .map(|seed| Region { seed: *seed, sum_m: seed.height_m, cells: 1, waiting: Vec::new() })
        .collect();
    let mut added: Vec<(usize, u32)> =
        seeds.iter().enumerate().map(|(seed, Seed { cell, .. })| (*cell, seed as u32)).collect();
    added.iter().for_each(|(cell, seed)| trees[*cell] = *seed);
    while !added.is_empty() {
        for (cell, seed) in added.drain(..) {
            let region = &mut regions[seed as usize];
            chm.beside(cell, |next| {
                if trees[next] == NO_TREE && region.may_ever(chm, next, params) {
                    region.waiting.push(next);
                }
            });
        }
        for (seed, region) in regions.iter_mut().enumerate() {
            let wanted = region.wanted(chm, &trees, params);
            added.extend(wanted.into_iter().map(|cell| (cell, seed as u32)));
        }
        settle(&mut added, &mut trees, &mut regions, chm);
    }
    trees
}

impl Region {
    /// Whether a cell passes all tests but that of the mean.
    fn may_ever(&self, chm: &Chm, cell: usize, params: &SegmentationParams) -> bool {
        let (height_m, apex_m) = (f64::from(chm.height_m[cell]), self.seed.height_m);
        height_m > params.min_height_m
            && height_m > params.dalponte_seed_share * apex_m
            && height_m <= ABOVE_SHARE * apex_m
            && chm.squared_m2(cell, self.seed.cell) <= params.raster_radius_m.powi(2)
    }

    /// Takes the cells that are high enough for the mean out of those waiting, ascending.
    fn wanted(&mut self, chm: &Chm, trees: &[u32], params: &SegmentationParams) -> Vec<usize> {
        let least_m = params.dalponte_crown_share * self.sum_m / f64::from(self.cells);
        self.waiting.retain(|cell| trees[*cell] == NO_TREE);
        self.waiting.sort_unstable();
        self.waiting.dedup();
        let high = |cell: &usize| f64::from(chm.height_m[*cell]) > least_m;
        let wanted = self.waiting.iter().copied().filter(high).collect();
        self.waiting.retain(|cell| !high(cell));
        wanted
    }
}

/// Gives every wanted cell to one crown; `wanted` keeps those given.
fn settle(wanted: &mut Vec<(usize, u32)>, trees: &mut [u32], regions: &mut [Region], chm: &Chm) {
    wanted.sort_by(|a, b| {
        let apex_m = |seed: u32| regions[seed as usize].seed.height_m;
        (a.0.cmp(&b.0)).then(apex_m(b.1).total_cmp(&apex_m(a.1))).then(a.1.cmp(&b.1))
    });
    wanted.dedup_by_key(|(cell, _)| *cell);
    for (cell, seed) in wanted {
        trees[*cell] = *seed;
        let region = &mut regions[*seed as usize];
        region.sum_m += f64::from(chm.height_m[*cell]);
        region.cells += 1;
    }
}

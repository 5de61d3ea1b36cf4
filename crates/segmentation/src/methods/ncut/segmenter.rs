//! Trees given, and trees found.

use super::{NcutParams, Top, parts};
use crate::methods::raster::NO_TREE;
use crate::methods::{Segments, li, surface};
use crate::{Claim, Error, SegmentationParams, Segmenter, View, segment_in_blocks};
use std::collections::BTreeMap;
use timberline_artefact::tree_id;

/// Cuts the graph until every tree that is given has a part of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct Ncut {
    /// Those named `ncut_`, `min_height_m`, and those for the canopy's surface and trees below it.
    pub params: SegmentationParams,
}

impl Segmenter for Ncut {
    /// A crown, and those it meets.
    fn reach_m(&self) -> f64 {
        self.params.reach_m
    }

    fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, Error> {
        view.check()?;
        let top = |marker: &crate::Marker| {
            let [x, y, _] = marker.crown.apex;
            Top { at: [x, y], height_m: marker.height_m }
        };
        let tops: Vec<Top> = view.markers.iter().map(top).collect();
        let mut tree = parts(view, &tops, true, &NcutParams::of(&self.params));
        keep_within(view, &tops, self.params.reach_m, &mut tree);
        surface::claims(view, &tree, &self.params)
    }
}

/// Takes the tree from points further than `reach_m` from its top in the plane: a part may be long.
fn keep_within(view: &View<'_>, tops: &[Top], reach_m: f64, tree: &mut [u32]) {
    for (index, tree) in tree.iter_mut().enumerate() {
        let far = tops.get(*tree as usize).is_some_and(|top| {
            let (dx, dy) = (view.x[index] - top.at[0], view.y[index] - top.at[1]);
            dx * dx + dy * dy > reach_m * reach_m
        });
        if far {
            *tree = NO_TREE;
        }
    }
}

/// Finds trees: parts that no cut divides any more, with a top of at least `min_top_m`.
///
/// Local maxima within `window_m` of themselves are supposed to be tops. Squares of
/// `params.block_m` that are fixed in the world are cut one by one, with surroundings of
/// `params.reach_m`. What two squares cut off is one tree where both find the same highest point in it;
/// else it falls apart at their border.
///
/// # Errors
/// [`Error::Length`] when columns differ in length.
pub fn trees(
    view: &View<'_>,
    window_m: f64,
    min_top_m: f64,
    params: &SegmentationParams,
) -> Result<Segments, Error> {
    let free = Free { params, window_m, min_top_m };
    let claims = segment_in_blocks(&free, view, &vec![true; view.len()], params.block_m)?;
    let mut highest: BTreeMap<u64, u32> = BTreeMap::new();
    for (index, claim) in claims.iter().enumerate().filter(|(_, claim)| claim.id != 0) {
        let top = highest.entry(claim.id).or_insert(index as u32);
        if view.height_m[index] > view.height_m[*top as usize] {
            *top = index as u32;
        }
    }
    let mut order: Vec<(u64, u32)> = highest.into_iter().collect();
    let height = |top: u32| view.height_m[top as usize];
    order.sort_by(|a, b| height(b.1).total_cmp(&height(a.1)).then(a.1.cmp(&b.1)));
    let rank: BTreeMap<u64, u32> =
        order.iter().zip(0..).map(|(tree, rank)| (tree.0, rank)).collect();
    let tree = claims.iter().map(|claim| rank.get(&claim.id).copied().unwrap_or(Segments::NONE));
    Ok(Segments { tree: tree.collect(), tops: order.into_iter().map(|tree| tree.1).collect() })
}

/// One square of [`trees`]; a tree's id is that of its highest point's position.
struct Free<'a> {
    params: &'a SegmentationParams,
    window_m: f64,
    min_top_m: f64,
}

impl Segmenter for Free<'_> {
    fn reach_m(&self) -> f64 {
        self.params.reach_m
    }

    fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, Error> {
        let maxima = li::tops(view, self.window_m, self.min_top_m);
        let top = |&index: &u32| {
            let index = index as usize;
            let height_m = f64::from(view.height_m[index]);
            Top { at: [view.x[index], view.y[index]], height_m }
        };
        let tops: Vec<Top> = maxima.iter().map(top).collect();
        let part = parts(view, &tops, false, &NcutParams::of(self.params));
        let mut highest: BTreeMap<u32, usize> = BTreeMap::new();
        for (index, part) in part.iter().enumerate().filter(|(_, part)| **part != NO_TREE) {
            let top = highest.entry(*part).or_insert(index);
            if view.height_m[index] > view.height_m[*top] {
                *top = index;
            }
        }
        let id = |part: &u32| {
            let top = *highest.get(part)?;
            let [x, y, _] = view.frame.world_from_local([view.x[top], view.y[top], 0.0]);
            (f64::from(view.height_m[top]) >= self.min_top_m).then(|| tree_id(x, y))
        };
        let claim = |part| Claim { id: id(part).unwrap_or(0), score: 0.5 };
        Ok(part.iter().map(claim).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Crown, Marker, Piece};

    #[test]
    fn no_tree_reaches_beyond_the_reach() {
        // A hedge of 40 m with one tree in it.
        let x: Vec<f64> = (0..160).map(|i| 0.25 * f64::from(i)).collect();
        let apex = [0.0, 0.0, 8.0];
        let (coefficients, tolerance_m) = ([0.0; 2], 0.6);
        let crown = Crown { id: 4, apex, coefficients, radius_m: 0.0, tolerance_m, oblique: false };
        let piece = Piece {
            y: vec![0.0; x.len()],
            z: vec![8.0; x.len()],
            height_m: vec![8.0; x.len()],
            is_first: vec![true; x.len()],
            markers: vec![Marker { crown, height_m: 8.0, score: 1.0 }],
            x,
            ..Piece::default()
        };
        let params = SegmentationParams {
            ncut_threshold: 0.0,
            reach_m: 12.0,
            ..SegmentationParams::default()
        };
        let claims = Ncut { params }.segment(&piece.view()).unwrap();
        assert!((0..160).all(|i| (claims[i].id == 4) == (piece.x[i] <= 12.0)));
    }
}

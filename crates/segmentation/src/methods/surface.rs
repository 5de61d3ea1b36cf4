//! Which points of a segment lie on its upper surface, for segmenters that work on points.

use crate::chm::{Chm, PitFree};
use crate::methods::raster::{score, seeds, with_hidden};
use crate::{Claim, Error, SegmentationParams, View};

/// The claims of segments on their points; `tree` is the index of every point's marker, or
/// [`NO_TREE`](crate::methods::raster::NO_TREE).
///
/// A cell of the pit-free canopy height model belongs to the tree of its highest point. For the
/// points of that tree the surface is that of the model, for those of other trees in the cell (they
/// stand below) it is their own highest point there; see [`score`].
///
/// A tree that the model hides ([`seeds`]) has the points its crown model claims, except those on the
/// surface of another: segments that are compared in the plane leave it next to nothing.
///
/// # Errors
/// As [`Chm::pit_free`].
pub fn claims(
    view: &View<'_>,
    tree: &[u32],
    params: &SegmentationParams,
) -> Result<Vec<Claim>, Error> {
    let chm = Chm::pit_free(view, &model(params))?;
    let (_, hidden) = seeds(&chm, view.markers, params);
    with_hidden(view, on_surface(view, tree, &chm, params), &hidden, params)
}

/// How the canopy height model is made.
fn model(params: &SegmentationParams) -> PitFree {
    PitFree {
        cell_m: params.chm_cell_m,
        max_edge_m: params.chm_max_edge_m,
        step_m: params.chm_step_m,
    }
}

/// Claims without a thought of hidden trees.
fn on_surface(view: &View<'_>, tree: &[u32], chm: &Chm, params: &SegmentationParams) -> Vec<Claim> {
    let owner: Vec<Option<u32>> =
        chm.top.iter().map(|top| tree.get(*top as usize).copied()).collect();
    let tops = tops(view, tree, chm);
    let claim = |index: usize| {
        let own = tree[index];
        let marker = view.markers.get(own as usize)?;
        let cell = chm.cell_at(view.x[index], view.y[index])?;
        let surface = if owner[cell] == Some(own) {
            let joined = |cell: usize| owner[cell] == Some(own);
            chm.surface(view.x[index], view.y[index], joined)?
        } else {
            let place = tops.binary_search_by_key(&(own, cell as u32), |top| top.0).ok()?;
            [f64::from(tops[place].1), 0.0]
        };
        let score = score(surface, view.height_m[index], params)?;
        Some(Claim { id: marker.crown.id, score })
    };
    (0..view.len()).map(|index| claim(index).unwrap_or_default()).collect()
}

/// Height of the highest point of every tree in every cell, sorted by both.
fn tops(view: &View<'_>, tree: &[u32], chm: &Chm) -> Vec<((u32, u32), f32)> {
    let mut tops: Vec<((u32, u32), f32)> = (0..view.len())
        .filter(|&index| (tree[index] as usize) < view.markers.len())
        .filter_map(|index| {
            let cell = chm.cell_at(view.x[index], view.y[index])?;
            Some(((tree[index], cell as u32), view.height_m[index]))
        })
        .collect();
    tops.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
    tops.dedup_by_key(|top| top.0);
    tops
}

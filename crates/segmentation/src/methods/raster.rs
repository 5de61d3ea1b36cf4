//! What segmenters that work on a canopy height model have in common.

use crate::chm::{Chm, PitFree};
use crate::methods::{dalponte, silva, watershed};
use crate::{
    Claim, Crown, Error, Marker, SegmentMethod, SegmentationParams, Segmenter, View, label,
};

/// A tree that the canopy height model shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seed {
    /// Index of the tree among the markers.
    pub marker: usize,
    /// Place of the cell that holds its apex.
    pub cell: usize,
    /// Height of the model there, m.
    pub height_m: f64,
}

/// Cells without a tree, in what the growing functions return.
pub const NO_TREE: u32 = u32::MAX;

/// Grows the trees on a pit-free canopy height model (`watershed`, `dalponte`, `silva`).
///
/// A point has the tree of its cell; it is on the surface when it is near that of the model. Trees
/// that the model does not show, because their apex lies deep below it, have the points their crown
/// model claims ([`Crown::claim`]), except those on the surface of a tree above.
#[derive(Debug, Clone, PartialEq)]
pub struct RasterSegmenter {
    /// Which method, and the parameters named `raster_`, `chm_` and as the method; those of
    /// [`label`] for trees below the canopy.
    pub params: SegmentationParams,
}

impl Segmenter for RasterSegmenter {
    /// All trees that may have a point, which are within a radius, and half a radius of the forest
    /// around them.
    fn reach_m(&self) -> f64 {
        (1.5 * self.params.raster_radius_m).max(self.params.reach_m)
    }

    fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, Error> {
        let params = &self.params;
        let how = PitFree {
            cell_m: params.chm_cell_m,
            max_edge_m: params.chm_max_edge_m,
            step_m: params.chm_step_m,
        };
        let chm = Chm::pit_free(view, &how)?;
        let (seeds, hidden) = seeds(&chm, view.markers, params);
        let trees = match params.method {
            SegmentMethod::Dalponte => dalponte::grow(&chm, &seeds, params),
            SegmentMethod::Silva => silva::grow(&chm, &seeds, params),
            _ => watershed::flood(&chm, &seeds, params),
        };
        let claims = claims(view, &chm, &trees, &seeds, params);
        with_hidden(view, claims, &hidden, params)
    }
}

/// The trees that the model shows, by the sequence of markers, and the crowns of those it does not:
/// their apex lies further than `raster_hidden_m` below it, another one's is higher in the same cell,
/// or the cell is lower than `min_height_m` or unknown.
#[must_use]
pub fn seeds(
    chm: &Chm,
    markers: &[Marker],
    params: &SegmentationParams,
) -> (Vec<Seed>, Vec<Crown>) {
    let mut place: Vec<Option<usize>> = markers
        .iter()
        .map(|marker| {
            let cell = chm.cell_at(marker.crown.apex[0], marker.crown.apex[1])?;
            let height_m = f64::from(chm.height_m[cell]);
            let shown = height_m >= params.min_height_m
                && height_m - marker.height_m <= params.raster_hidden_m;
            shown.then_some(cell)
        })
        .collect();
    let mut by_rank: Vec<usize> = (0..markers.len()).filter(|i| place[*i].is_some()).collect();
    by_rank.sort_by(|a, b| {
        let height = |i: &usize| markers[*i].height_m;
        (place[*a].cmp(&place[*b])).then(height(b).total_cmp(&height(a))).then(a.cmp(b))
    });
    for pair in by_rank.windows(2).rev() {
        if place[pair[0]] == place[pair[1]] {
            place[pair[1]] = None;
        }
    }
    let (mut seeds, mut hidden) = (Vec::new(), Vec::new());
    for (marker, cell) in place.into_iter().enumerate() {
        match cell {
            Some(cell) => {
                let height_m = f64::from(chm.height_m[cell]);
                seeds.push(Seed { marker, cell, height_m });
            }
            None => hidden.push(markers[marker].crown),
        }
    }
    (seeds, hidden)
}

/// Claims of the trees of cells (indices of seeds) on the points in them.
///
/// Near the surface the score falls with the distance from 1 to 1/2, below it with the share of
/// the surface's height from 1/2 to 1/4; above it, it is 1/2. The distance is that across the surface,
/// to first order, up to a slope of [`STEEPEST`].
fn claims(
    view: &View<'_>,
    chm: &Chm,
    trees: &[u32],
    seeds: &[Seed],
    params: &SegmentationParams,
) -> Vec<Claim> {
    let claim = |index: usize| {
        let (x, y, height_m) = (view.x[index], view.y[index], f64::from(view.height_m[index]));
        let tree = trees[chm.cell_at(x, y)?];
        let seed = seeds.get(tree as usize).filter(|_| height_m >= params.min_height_m)?;
        let [surface_m, slope] = chm.surface(x, y, |cell| trees[cell] == tree)?;
        let below_m = surface_m - height_m;
        let distance_m = below_m.abs() / (1.0 + slope.min(STEEPEST * STEEPEST)).sqrt();
        let score = if distance_m < params.raster_surface_m {
            1.0 - 0.5 * distance_m / params.raster_surface_m
        } else if below_m < 0.0 {
            0.5
        } else {
            0.25 + 0.25 * (height_m / surface_m).clamp(0.0, 1.0)
        };
        Some(Claim { id: view.markers[seed.marker].crown.id, score: score as f32 })
    };
    (0..view.len()).map(|index| claim(index).unwrap_or_default()).collect()
}

/// Slope up to which the distance from a surface is measured across it; steeper ones are edges
/// rather than surfaces.
pub const STEEPEST: f64 = 2.0;

/// Gives hidden trees the points their crowns claim, except those on a surface.
pub(crate) fn with_hidden(
    view: &View<'_>,
    mut claims: Vec<Claim>,
    hidden: &[Crown],
    params: &SegmentationParams,
) -> Result<Vec<Claim>, Error> {
    let crowns: Vec<Crown> = hidden.iter().filter(|crown| crown.radius_m > 0.0).copied().collect();
    if crowns.is_empty() {
        return Ok(claims);
    }
    let below = label([view.x, view.y, view.z], view.height_m, &crowns, params)?;
    for (claim, hidden) in claims.iter_mut().zip(below) {
        if hidden.id != 0 && claim.score <= 0.5 {
            *claim = hidden;
        }
    }
    Ok(claims)
}

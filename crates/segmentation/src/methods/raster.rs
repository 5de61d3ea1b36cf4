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

/// Claims of the trees of cells (indices of seeds) on the points in them; see [`score`].
fn claims(
    view: &View<'_>,
    chm: &Chm,
    trees: &[u32],
    seeds: &[Seed],
    params: &SegmentationParams,
) -> Vec<Claim> {
    let claim = |index: usize| {
        let (x, y, height_m) = (view.x[index], view.y[index], view.height_m[index]);
        let tree = trees[chm.cell_at(x, y)?];
        let seed = seeds.get(tree as usize)?;
        let surface = chm.surface(x, y, |cell| trees[cell] == tree)?;
        let score = score(surface, height_m, params)?;
        Some(Claim { id: view.markers[seed.marker].crown.id, score })
    };
    (0..view.len()).map(|index| claim(index).unwrap_or_default()).collect()
}

/// How strongly a tree claims a point below or above its surface there, of which height, m, and
/// squared slope are given.
///
/// Up to `raster_surface_m` below the surface the score falls with the distance from 1 to 1/2; further
/// below with the share of the surface's height from 1/2 to 1/4. What stands out of it is on the
/// surface, too, since where points are few the model misses tops: there the score falls from 1
/// towards 1/2. A point lower than `min_height_m` is no tree's. The distance is that across the surface,
/// to first order, up to a slope of [`STEEPEST`].
#[must_use]
pub fn score(
    [surface_m, squared_slope]: [f64; 2],
    height_m: f32,
    params: &SegmentationParams,
) -> Option<f32> {
    let height_m = f64::from(height_m);
    let below_m = surface_m - height_m;
    let distance_m = below_m.abs() / (1.0 + squared_slope.min(STEEPEST * STEEPEST)).sqrt();
    let room_m = params.raster_surface_m;
    let score = if height_m.is_nan() || height_m < params.min_height_m {
        return None;
    } else if below_m <= 0.0 {
        1.0 - 0.5 * distance_m / (distance_m + room_m)
    } else if distance_m < room_m {
        1.0 - 0.5 * distance_m / room_m
    } else {
        0.25 + 0.25 * (height_m / surface_m).clamp(0.0, 1.0)
    };
    Some(score as f32)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Piece;

    fn marker(id: u64, x: f64, height_m: f64, radius_m: f64) -> Marker {
        let (apex, coefficients) = ([x, 5.0, 100.0 + height_m], [1.0, 0.0]);
        let crown = Crown { id, apex, coefficients, radius_m, tolerance_m: 0.5, oblique: false };
        Marker { crown, height_m, score: 1.0 }
    }

    /// Two cones of slope 1 with apexes at (4, 5) and (12, 5), 14 and 12 m high, filled with echoes,
    /// on level ground at 100 m.
    fn cones() -> Piece {
        let mut piece = Piece::default();
        for i in 0..64 {
            for j in 0..40 {
                let (x, y) = (f64::from(i) * 0.25 + 0.125, f64::from(j) * 0.25 + 0.125);
                let depth = |at: f64| ((x - at).powi(2) + (y - 5.0).powi(2)).sqrt();
                let top = (14.0 - depth(4.0)).max(12.0 - depth(12.0));
                for k in 0..8 {
                    let height = top - 1.5 * f64::from(k);
                    piece.x.push(x);
                    piece.y.push(y);
                    piece.z.push(100.0 + height);
                    piece.height_m.push(height as f32);
                    piece.is_first.push(k == 0);
                }
            }
        }
        piece
    }

    fn labels(piece: &Piece, method: SegmentMethod) -> Vec<Claim> {
        let params = SegmentationParams { method, ..SegmentationParams::default() };
        RasterSegmenter { params }.segment(&piece.view()).unwrap()
    }

    const METHODS: [SegmentMethod; 3] =
        [SegmentMethod::Watershed, SegmentMethod::Dalponte, SegmentMethod::Silva];

    #[test]
    fn points_have_the_tree_of_their_cell_and_only_the_surface_is_sure() {
        let mut piece = cones();
        piece.markers = vec![marker(3, 4.0, 14.0, 0.0), marker(8, 12.0, 12.0, 0.0)];
        for method in METHODS {
            let claims = labels(&piece, method);
            for (i, claim) in claims.iter().enumerate() {
                let (x, y, k) = (piece.x[i], piece.y[i], i % 8);
                let near = |at: f64| (x - at).powi(2) + (y - 5.0).powi(2) < 9.0;
                if near(4.0) || near(12.0) {
                    let expected = if near(4.0) { 3 } else { 8 };
                    let id = if piece.height_m[i] < 1.0 { 0 } else { expected };
                    assert_eq!(claim.id, id, "{method:?} at {x} {y} {k}");
                    assert_eq!(claim.score > 0.5, k == 0 && id != 0, "{method:?} at {x} {y} {k}");
                }
                assert!(
                    (0.0..=1.0).contains(&claim.score) && (claim.id == 0) == (claim.score == 0.0)
                );
            }
        }
    }

    #[test]
    fn a_tree_below_the_canopy_has_the_points_of_its_crown() {
        let mut piece = cones();
        piece.markers =
            vec![marker(2, 5.0, 6.0, 2.0), marker(3, 4.0, 14.0, 0.0), marker(8, 12.0, 12.0, 0.0)];
        for method in METHODS {
            let claims = labels(&piece, method);
            let of = |id: u64| claims.iter().filter(move |claim| claim.id == id).count();
            assert!(of(2) > 100, "{method:?}: {}", of(2));
            for (i, claim) in claims.iter().enumerate() {
                assert!(claim.id != 2 || i % 8 != 0, "the canopy's surface is not the low tree's");
            }
        }
    }

    #[test]
    fn what_the_model_does_not_show_is_hidden() {
        let piece = cones();
        let params = SegmentationParams::default();
        let how = PitFree { cell_m: 0.5, max_edge_m: 1.5, step_m: 5.0 };
        let chm = Chm::pit_free(&piece.view(), &how).unwrap();
        let markers = [
            marker(1, 4.1, 13.0, 1.0),
            marker(2, 4.2, 13.9, 1.0),
            marker(3, 12.0, 9.0, 1.0),
            marker(4, 90.0, 9.0, 1.0),
        ];
        let (seeds, hidden) = seeds(&chm, &markers, &params);
        assert_eq!(seeds.iter().map(|seed| seed.marker).collect::<Vec<_>>(), [1]);
        assert_eq!(hidden.iter().map(|crown| crown.id).collect::<Vec<_>>(), [1, 3, 4]);
        let high = SegmentationParams { min_height_m: 15.0, ..params };
        assert_eq!(super::seeds(&chm, &markers, &high).0, []);
    }

    #[test]
    fn no_trees_and_no_points() {
        for method in METHODS {
            assert!(labels(&cones(), method).iter().all(|claim| claim.id == 0));
            assert_eq!(labels(&Piece::default(), method), []);
        }
    }
}

//! The segmenters that work on a canopy height model against plain implementations of their papers.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "these are tests")]

#[path = "common/reference.rs"]
mod reference;

use proptest::prelude::*;
use reference::{Apex, Cell, Dalponte, Heights};
use std::collections::BTreeMap;
use timberline_pointcloud::{Frame, Window};
use timberline_segmentation::methods::raster::NO_TREE;
use timberline_segmentation::methods::{dalponte, silva, watershed};
use timberline_segmentation::{Chm, Piece, PitFree, Seed, SegmentationParams};

const WINDOW: Window = Window { column0: -7, row0: 3, columns: 17, rows: 13 };

/// A canopy with some cells unknown; heights are distinct when `steps` is large, with ties when it is
/// small.
fn canopy(noise: &[u32], steps: u32, cell_m: f64) -> Chm {
    let height = |(place, value): (usize, &u32)| {
        let rank =
            if steps > 1000 { (value % 400) * 1000 + place as u32 } else { value % steps * 4000 };
        if value % 23 == 0 { f32::NAN } else { rank as f32 * 1e-4 }
    };
    Chm {
        window: WINDOW,
        cell_m,
        frame: Frame::default(),
        height_m: noise.iter().enumerate().map(height).collect(),
        top: vec![Chm::NO_POINT; WINDOW.len()],
    }
}

/// Apexes at some known cells, no two in the same.
fn seeds(chm: &Chm, places: &[usize]) -> Vec<Seed> {
    let mut cells: Vec<usize> = Vec::new();
    for place in places {
        let cell = place % WINDOW.len();
        if !chm.height_m[cell].is_nan() && !cells.contains(&cell) {
            cells.push(cell);
        }
    }
    let seed = |(marker, cell): (usize, usize)| Seed {
        marker,
        cell,
        height_m: f64::from(chm.height_m[cell]),
    };
    cells.into_iter().enumerate().map(seed).collect()
}

fn plain(chm: &Chm, seeds: &[Seed]) -> (Heights, Vec<Apex>) {
    let known = (0..WINDOW.len()).filter(|cell| !chm.height_m[*cell].is_nan());
    let heights = known.map(|cell| (chm.column_row(cell), f64::from(chm.height_m[cell]))).collect();
    (heights, seeds.iter().map(|seed| chm.column_row(seed.cell)).collect())
}

fn by_cell(chm: &Chm, trees: &[u32]) -> BTreeMap<Cell, usize> {
    let labelled = trees.iter().enumerate().filter(|(_, tree)| **tree != NO_TREE);
    labelled.map(|(cell, tree)| (chm.column_row(cell), *tree as usize)).collect()
}

fn noise() -> impl Strategy<Value = Vec<u32>> {
    prop::collection::vec(0u32..1_000_000, WINDOW.len())
}

proptest! {
    #[test]
    fn flooding_is_immersion(
        noise in noise(), places in prop::collection::vec(0usize..500, 0..9), least in 0u8..30,
    ) {
        let chm = canopy(&noise, u32::MAX, 1.0);
        let params = SegmentationParams {
            min_height_m: f64::from(least),
            raster_radius_m: 1000.0,
            ..SegmentationParams::default()
        };
        let mut seeds = seeds(&chm, &places);
        seeds.retain(|seed| seed.height_m >= params.min_height_m);
        let (heights, apexes) = plain(&chm, &seeds);
        let expected = reference::immersion(&heights, &apexes, params.min_height_m);
        prop_assert_eq!(by_cell(&chm, &watershed::flood(&chm, &seeds, &params)), expected);
    }

    #[test]
    fn growing_is_sweeping(
        noise in noise(), steps in prop::sample::select(vec![7u32, u32::MAX]),
        places in prop::collection::vec(0usize..500, 0..9),
        least in 0u8..30, shares in (0u8..10, 0u8..10), radius in 1u8..12,
    ) {
        let chm = canopy(&noise, steps, 0.5);
        let params = SegmentationParams {
            min_height_m: f64::from(least),
            dalponte_seed_share: f64::from(shares.0) * 0.1,
            dalponte_crown_share: f64::from(shares.1) * 0.1,
            raster_radius_m: f64::from(radius) * 0.5,
            ..SegmentationParams::default()
        };
        let how = Dalponte {
            least: params.min_height_m,
            seed_share: params.dalponte_seed_share,
            crown_share: params.dalponte_crown_share,
            radius: f64::from(radius),
        };
        let seeds = seeds(&chm, &places);
        let (heights, apexes) = plain(&chm, &seeds);
        let expected = reference::dalponte(&heights, &apexes, &how);
        prop_assert_eq!(by_cell(&chm, &dalponte::grow(&chm, &seeds, &params)), expected);
    }

    #[test]
    fn voronoi_cells_are_those_of_the_nearest(
        noise in noise(), places in prop::collection::vec(0usize..500, 0..9), least in 0u8..20,
    ) {
        let chm = canopy(&noise, u32::MAX, 0.25);
        let params = SegmentationParams {
            min_height_m: f64::from(least),
            silva_radius_share: 0.07,
            ..SegmentationParams::default()
        };
        let seeds = seeds(&chm, &places);
        let (heights, apexes) = plain(&chm, &seeds);
        let how = [params.min_height_m, params.silva_radius_share, params.silva_least_share];
        let expected = reference::silva(&heights, &apexes, how, chm.cell_m);
        prop_assert_eq!(by_cell(&chm, &silva::grow(&chm, &seeds, &params)), expected);
    }

    #[test]
    fn flooding_goes_no_further_than_the_radius(
        noise in noise(), places in prop::collection::vec(0usize..500, 0..9), radius in 1u8..12,
    ) {
        let chm = canopy(&noise, 9, 0.5);
        let radius_m = f64::from(radius) * 0.5;
        let params = SegmentationParams {
            min_height_m: 0.0,
            raster_radius_m: radius_m,
            ..SegmentationParams::default()
        };
        let seeds = seeds(&chm, &places);
        let trees = watershed::flood(&chm, &seeds, &params);
        for (cell, tree) in trees.iter().enumerate() {
            match seeds.get(*tree as usize) {
                Some(seed) => prop_assert!(chm.squared_m2(cell, seed.cell) <= radius_m * radius_m),
                // A free cell has no neighbour whose tree could have taken it.
                None => chm.around(cell, |near| {
                    if let Some(seed) = seeds.get(trees[near] as usize) {
                        let far = chm.squared_m2(cell, seed.cell) > radius_m * radius_m;
                        assert!(far || chm.height_m[cell].is_nan());
                    }
                }),
            }
        }
        prop_assert!(seeds.iter().enumerate().all(|(i, seed)| trees[seed.cell] == i as u32));
    }

    #[test]
    fn the_pit_free_model_is_the_highest_of_its_triangulations(
        points in prop::collection::vec((0u32..60_000, 0u32..50_000, 0u32..140_000, 0u8..5), 3..14),
        longest in 10u8..40, origin in -40i64..40,
    ) {
        let frame = Frame::new([origin, 3 * origin, 0]);
        let mut piece = Piece { frame, ..Piece::default() };
        for p in &points {
            piece.x.push(f64::from(p.0) * 1e-4 - origin as f64);
            piece.y.push(f64::from(p.1) * 1e-4 - 3.0 * origin as f64);
            piece.z.push(f64::from(p.2) * 1e-4);
            piece.height_m.push((f64::from(p.2) * 1e-4) as f32);
            piece.is_first.push(p.3 != 0);
        }
        let max_edge_m = f64::from(longest) * 0.1;
        let how = PitFree { cell_m: 1.0, max_edge_m, step_m: 5.0 };
        let chm = Chm::pit_free(&piece.view(), &how).unwrap();
        let all = vertices(&piece);
        for cell in 0..chm.window.len() {
            let at = chm.column_row(cell).map(|place| place as f64 + 0.5);
            let mut expected = f64::NAN;
            for level in [0.0, 2.0, 5.0, 10.0] {
                let above: Vec<[f64; 3]> = all.iter().filter(|p| p[2] >= level).copied().collect();
                let longest = if level > 0.0 { max_edge_m } else { f64::INFINITY };
                expected = expected.max(reference::delaunay(&above, at, longest).unwrap_or(f64::NAN));
            }
            if expected.is_nan() {
                expected = highest(&piece, at);
            }
            let found = f64::from(chm.height_m[cell]);
            let same = (found - expected).abs() < 1e-3 || (found.is_nan() && expected.is_nan());
            prop_assert!(same, "{at:?}: {found}, expected {expected}");
        }
    }
}

/// World position and height of the highest first return of every cell of 1 m.
fn vertices(piece: &Piece) -> Vec<[f64; 3]> {
    let any_first = piece.is_first.contains(&true);
    let mut best: BTreeMap<[i64; 2], [f64; 3]> = BTreeMap::new();
    for i in 0..piece.x.len() {
        let [x, y, _] = piece.frame.world_from_local([piece.x[i], piece.y[i], 0.0]);
        let height = f64::from(piece.height_m[i]);
        if piece.is_first[i] || !any_first {
            let kept = best.entry([x.floor() as i64, y.floor() as i64]);
            let kept = kept.or_insert([x, y, height]);
            if height > kept[2] {
                *kept = [x, y, height];
            }
        }
    }
    best.into_values().collect()
}

/// Height of the highest point in the cell of 1 m around a world position.
fn highest(piece: &Piece, at: [f64; 2]) -> f64 {
    let inside = (0..piece.x.len()).filter(|i| {
        let [x, y, _] = piece.frame.world_from_local([piece.x[*i], piece.y[*i], 0.0]);
        x.floor() == at[0].floor() && y.floor() == at[1].floor()
    });
    inside.map(|i| f64::from(piece.height_m[i])).fold(f64::NAN, f64::max)
}

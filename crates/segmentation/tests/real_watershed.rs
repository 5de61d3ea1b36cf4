//! The watershed on real scans against plain immersion of the whole.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "these are tests"
)]

#[path = "common/scan.rs"]
mod scan;

use std::collections::BTreeSet;
use timberline_segmentation::{
    Chm, Marker, Piece, PitFree, SegmentMethod, SegmentationParams, segment_in_blocks, segmenter,
};

/// Immersion (after Vincent and Soille 1991) of the canopy height model that the segmenter works on,
/// here of the whole scan at once and without a largest radius. From the highest cell down, a cell
/// with an apex begins a basin, any other takes that of its highest neighbour in one; with it go the
/// cells, no lower than it, that are connected and have none. Returns the tree of every cell, counted
/// from 1.
fn immersion(chm: &Chm, markers: &[Marker], least_m: f32) -> Vec<usize> {
    let mut cells: Vec<usize> =
        (0..chm.height_m.len()).filter(|cell| chm.height_m[*cell] >= least_m).collect();
    cells.sort_by(|a, b| chm.height_m[*b].total_cmp(&chm.height_m[*a]));
    let mut labels = vec![0; chm.height_m.len()];
    let mut apexes = vec![0; chm.height_m.len()];
    for (place, marker) in markers.iter().enumerate() {
        apexes[chm.cell_at(marker.crown.apex[0], marker.crown.apex[1]).unwrap()] = place + 1;
    }
    for cell in cells {
        let level = chm.height_m[cell];
        let (mut label, mut highest_m) = (apexes[cell], 0.0);
        chm.around(cell, |near| {
            if apexes[cell] == 0 && labels[near] != 0 && chm.height_m[near] > highest_m {
                (label, highest_m) = (labels[near], chm.height_m[near]);
            }
        });
        let mut open = if label == 0 { Vec::new() } else { vec![cell] };
        while let Some(cell) = open.pop() {
            labels[cell] = label;
            chm.around(cell, |near| {
                if labels[near] == 0 && chm.height_m[near] >= level {
                    open.push(near);
                }
            });
        }
    }
    labels
}

/// Trees with at least one point; share of the points of trees that agree.
fn compare(scan: &str, cell_m: f64) -> [f64; 3] {
    let mut piece: Piece = scan::normalised(scan);
    piece.markers = scan::treetops(&piece, 2.5);
    let params = SegmentationParams {
        method: SegmentMethod::Watershed,
        chm_cell_m: cell_m,
        ..SegmentationParams::default()
    };
    let view = piece.view();
    let all = vec![true; view.len()];
    let ours = segment_in_blocks(&*segmenter(&params), &view, &all, params.block_m).unwrap();
    let how = PitFree { cell_m, max_edge_m: params.chm_max_edge_m, step_m: params.chm_step_m };
    let chm = Chm::pit_free(&view, &how).unwrap();
    let labels = immersion(&chm, &piece.markers, params.min_height_m as f32);
    let theirs: Vec<u64> = (0..view.len())
        .map(|i| {
            let cell = chm.cell_at(view.x[i], view.y[i]).unwrap();
            if f64::from(view.height_m[i]) >= params.min_height_m { labels[cell] as u64 } else { 0 }
        })
        .collect();
    let trees = |ids: BTreeSet<u64>| ids.iter().filter(|id| **id != 0).count() as f64;
    let counts = [
        trees(ours.iter().map(|claim| claim.id).collect()),
        trees(theirs.iter().copied().collect()),
    ];
    let (mut same, mut either) = (0_u32, 0_u32);
    for (ours, theirs) in ours.iter().zip(&theirs).filter(|(a, b)| a.id != 0 || **b != 0) {
        either += 1;
        same += u32::from(ours.id == *theirs);
    }
    let share = f64::from(same) / f64::from(either);
    println!(
        "{scan}: {} treetops, trees with points {} here, {} by immersion, {:.1} % of points alike",
        piece.markers.len(),
        counts[0],
        counts[1],
        share * 100.0
    );
    [counts[0], counts[1], share]
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn mixed_conifer_has_the_trees_of_plain_immersion() {
    let [ours, theirs, same] = compare("als/lidR/MixedConifer.laz", 0.5);
    assert!((ours / theirs - 1.0).abs() <= 0.01, "{ours} and {theirs}");
    assert!(same > 0.95, "{same}");
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn megaplot_has_the_trees_of_plain_immersion() {
    let [ours, theirs, same] = compare("als/lidR/Megaplot.laz", 0.5);
    assert!((ours / theirs - 1.0).abs() <= 0.01, "{ours} and {theirs}");
    assert!(same > 0.95, "{same}");
}

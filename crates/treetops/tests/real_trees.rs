//! The default parameters on scans with known trees.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "these are tests"
)]

mod common;

use common::{data, normalised, over_tin, tops};
use timberline_treetops::{Params, Treetop};

/// Boxes of crowns in a NeonTreeEvaluation annotation: pixels of 0.1 m from the north-west corner.
fn boxes(xml: &str, corner_m: [f64; 2]) -> Vec<[f64; 4]> {
    let value = |part: &str, tag: &str| -> f64 {
        let (open, close) = (format!("<{tag}>"), format!("</{tag}>"));
        let text = part.split(&open).nth(1).unwrap().split(&close).next().unwrap();
        text.trim().parse().unwrap()
    };
    let of = |part: &str| {
        let [left, right] = ["xmin", "xmax"].map(|tag| corner_m[0] + 0.1 * value(part, tag));
        let [top, bottom] = ["ymin", "ymax"].map(|tag| corner_m[1] - 0.1 * value(part, tag));
        [left, bottom, right, top]
    };
    xml.split("<bndbox>").skip(1).map(of).collect()
}

/// Tops in each box (a crown may be split), and tops in none.
fn tops_by_box(params: &Params) -> (Vec<usize>, usize) {
    let folder = "als/neon_SJER_052/SJER_052";
    let xml = std::fs::read_to_string(data().join(format!("{folder}.xml"))).unwrap();
    let boxes = boxes(&xml, [257_957.6, 4_110_508.8]);
    let found = tops(&normalised(&format!("{folder}.laz")), params);
    let inside =
        |b: &[f64; 4], p: &[f64; 3]| p[0] >= b[0] && p[0] <= b[2] && p[1] >= b[1] && p[1] <= b[3];
    let count = |b: &[f64; 4]| found.iter().filter(|top| inside(b, &top.world_m)).count();
    let outside = found.iter().filter(|top| !boxes.iter().any(|b| inside(b, &top.world_m))).count();
    (boxes.iter().map(count).collect(), outside)
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn hand_drawn_crowns_of_a_savanna() {
    let show = |name: &str, params: &Params| {
        let (counts, outside) = tops_by_box(params);
        println!("{name}: tops per box {counts:?}, outside {outside}");
        (counts, outside)
    };
    show("circle 3 m", &Params::fixed_circle(3.0));
    show("circle 5 m", &Params::fixed_circle(5.0));
    let sure = Params { min_score: 0.45, ..Params::default() };
    let (counts, _) = show("by evidence", &sure);
    assert!(counts.iter().filter(|&&count| count > 0).count() >= 8, "{counts:?}");
    let (counts, outside) = show("by window", &Params::by_window());
    assert!(counts.iter().filter(|&&count| count > 0).count() >= 8, "{counts:?}");
    assert!(counts.iter().sum::<usize>() <= 18 && outside <= 12, "{counts:?} {outside}");
}

/// A row of the reference of the clips: name, x and y of the top, height, elevation of the base.
fn clips() -> Vec<(String, [f64; 4])> {
    let path = data().join("uas_treeclips/tree_reference.csv");
    let mut table = csv::Reader::from_path(path).unwrap();
    let header = table.headers().unwrap().clone();
    let column = |name: &str| header.iter().position(|h| h == name).unwrap();
    let wanted = ["aveTopX", "aveTopY", "aveHeight", "aveBaseElevation"].map(column);
    let title = column("FileTitle");
    let row = |row: csv::StringRecord| {
        (row[title].to_owned(), wanted.map(|i| row[i].parse::<f64>().unwrap()))
    };
    table.records().map(|record| row(record.unwrap())).collect()
}

/// Clips of 4.7 m of a drone's scan, 400 to 4000 points per square metre, each around one tree with
/// the measured position of its top; parts of higher neighbours reach into some.
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn clips_of_single_trees() {
    let (mut found, mut tops_in_all, mut clips_read) = (0, 0, 0);
    for (title, [x, y, height, base]) in clips() {
        let cloud = common::read(&data().join(format!("uas_treeclips/{title}.laz")));
        let height_m = cloud.z.iter().map(|&z| (z - base) as f32).collect();
        let all = tops(&(cloud, height_m), &Params::by_window());
        let is_it = |top: &Treetop| {
            let (dx, dy) = (top.world_m[0] - x, top.world_m[1] - y);
            dx * dx + dy * dy <= 1.0 && (top.height_m - height).abs() <= 1.0
        };
        found += usize::from(all.iter().any(is_it));
        tops_in_all += all.len();
        clips_read += 1;
    }
    println!("{found} of {clips_read} tops within 1 m, {tops_in_all} tops in all");
    assert!(found >= clips_read - 4 && tops_in_all <= 2 * clips_read);
}

/// From 2 to 40 points a square metre the number of trees that nothing hangs over (windows find no
/// others) stays between those of a window so wide that it misses trees and one so narrow that it
/// counts branches.
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn counts_stay_reasonable() {
    for (name, scan) in [
        ("MixedConifer", normalised("als/lidR/MixedConifer.laz")),
        ("Megaplot", normalised("als/lidR/Megaplot.laz")),
        ("Topography", over_tin("als/lidR/Topography.laz")),
        ("bcts_1", over_tin("als/lasR_bcts/bcts_1.laz")),
        ("MixedEucaNat", over_tin("als/lidRtutorial/MixedEucaNat.laz")),
        ("RS12", over_tin("als/hj_andrews/RS12.laz")),
        ("RS29", over_tin("als/hj_andrews/RS29.laz")),
    ] {
        let seen = |top: &&Treetop| top.cover_m == 0.0;
        let count = |params: &Params| tops(&scan, params).iter().filter(seen).count();
        let (ours, narrow, wide) = (
            count(&Params { min_score: 0.45, ..Params::default() }),
            count(&Params::fixed_circle(3.0)),
            count(&Params::fixed_circle(5.0)),
        );
        println!("{name}: by evidence {ours}, circle 3 m {narrow}, circle 5 m {wide}");
        assert!(ours as f64 <= 1.3 * narrow as f64 && ours as f64 >= 0.6 * wide as f64, "{name}");
    }
}

//! A fixed circular window against `lmf` of lidR, on its own scans.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "these are tests"
)]

mod common;

use common::{data, normalised, over_tin, tops};
use timberline_pointcloud::{Nearest2, PointCloud};
use timberline_treetops::Params;

/// Positions in a table of lidR: columns treeID, x, y, z.
fn peer(name: &str) -> Vec<[f64; 3]> {
    let path = data().join("../peers/lidr").join(name);
    let mut reader = csv::Reader::from_path(path).unwrap();
    let row = |row: csv::StringRecord| [1, 2, 3].map(|i| row[i].parse::<f64>().unwrap());
    reader.records().map(|record| row(record.unwrap())).collect()
}

/// Which positions of `these` have one of `those` within a distance.
fn near(these: &[[f64; 3]], those: &[[f64; 3]], distance_m: f64) -> Vec<bool> {
    let plane: Vec<[f64; 2]> = those.iter().map(|p| [p[0], p[1]]).collect();
    let nearest = Nearest2::new(&plane).unwrap();
    these.iter().map(|p| !nearest.within(&[p[0], p[1]], distance_m).is_empty()).collect()
}

/// Whether another point of the same height lies in the window: then the program may choose.
fn is_tied(cloud: &PointCloud, at: [f64; 3], radius_m: f64) -> bool {
    let same = |i: &usize| {
        let p = cloud.world(*i);
        let d = ((p[0] - at[0]).powi(2) + (p[1] - at[1]).powi(2)).sqrt();
        d > 1e-6 && d <= radius_m + 1e-6 && (p[2] - at[2]).abs() < 1e-6
    };
    (0..cloud.len()).any(|i| same(&i))
}

/// Compares with lidR on a normalised scan: every top found by one side only must be tied.
fn check_equal(scan: &str, table: &str, diameter_m: f64) {
    let scan = normalised(scan);
    let ours: Vec<[f64; 3]> =
        tops(&scan, &Params::fixed_circle(diameter_m)).iter().map(|top| top.world_m).collect();
    let theirs = peer(table);
    let only = |these: &[[f64; 3]], those: &[[f64; 3]]| -> Vec<[f64; 3]> {
        let found = near(these, those, 1e-3);
        these.iter().zip(found).filter(|(_, found)| !found).map(|(p, _)| *p).collect()
    };
    let (extra, missed) = (only(&ours, &theirs), only(&theirs, &ours));
    println!(
        "{table}: ours {}, lidR {}, only ours {}, only lidR {}",
        ours.len(),
        theirs.len(),
        extra.len(),
        missed.len()
    );
    for place in extra.iter().chain(&missed) {
        assert!(is_tied(&scan.0, *place, diameter_m / 2.0), "{place:?} differs without a tie");
    }
    assert!(!theirs.is_empty());
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn mixed_conifer() {
    check_equal("als/lidR/MixedConifer.laz", "MixedConifer_lmf3.csv", 3.0);
    check_equal("als/lidR/MixedConifer.laz", "MixedConifer_lmf5.csv", 5.0);
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn megaplot() {
    check_equal("als/lidR/Megaplot.laz", "Megaplot_lmf3.csv", 3.0);
    check_equal("als/lidR/Megaplot.laz", "Megaplot_lmf5.csv", 5.0);
}

/// Share of lidR's tops with one of ours within half a metre, and the reverse.
fn agreement(scan: &str, table: &str, diameter_m: f64) -> (f64, f64) {
    let ours: Vec<[f64; 3]> = tops(&over_tin(scan), &Params::fixed_circle(diameter_m))
        .iter()
        .map(|top| top.world_m)
        .collect();
    let theirs = peer(table);
    let share =
        |found: Vec<bool>| found.iter().filter(|&&found| found).count() as f64 / found.len() as f64;
    let both = (share(near(&theirs, &ours, 0.5)), share(near(&ours, &theirs, 0.5)));
    println!(
        "{table}: ours {}, lidR {}, found {:.4}, confirmed {:.4}",
        ours.len(),
        theirs.len(),
        both.0,
        both.1
    );
    both
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn bcts_over_a_linear_tin() {
    for (table, diameter_m) in [("bcts_1_lmf3.csv", 3.0), ("bcts_1_lmf5.csv", 5.0)] {
        let (found, confirmed) = agreement("als/lasR_bcts/bcts_1.laz", table, diameter_m);
        assert!(found >= 0.97 && confirmed >= 0.97, "{table}: {found} {confirmed}");
    }
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn topography_over_a_linear_tin() {
    for (table, diameter_m) in [("Topography_lmf3.csv", 3.0), ("Topography_lmf5.csv", 5.0)] {
        let (found, confirmed) = agreement("als/lidR/Topography.laz", table, diameter_m);
        assert!(found >= 0.97 && confirmed >= 0.97, "{table}: {found} {confirmed}");
    }
}

//! Real terrestrial scans through the shipped chain, by the figures of reference that go with them.
//!
//! Without consolidation, which takes most of the time and of which diameters do not follow. All clouds
//! take four minutes on two cores, MLS_Clip a third of them. `--nocapture` prints a line of figures for
//! each tree.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test may fail"
)]

#[allow(dead_code, reason = "shared with the tests on virtual scenes")]
#[path = "terrestrial/support.rs"]
mod support;

use std::path::PathBuf;
use std::time::Instant;
use support::{Campaign, Row, number};
use timberline_ingest::{UnitChoice, scan};
use timberline_pointcloud::PointCloud;

/// Heights in TreeLS' pine count from the ground; its points up to here are the ground's, and the
/// 72,030 above it are those that other programs were measured on.
const PINE_GROUND_M: f64 = 0.2;

fn scan(name: &str) -> PathBuf {
    PathBuf::from(std::env::var("TIMBERLINE_DATA").unwrap()).join("tls").join(name)
}

/// Runs the shipped pipeline without consolidation; the rows of its trees.
fn trees(campaign: Campaign, name: &str) -> Vec<Row> {
    let campaign = campaign.with("consolidation", "method = \"none\"");
    let begun = Instant::now();
    campaign.run(&["--jobs", "2"]);
    let seconds = begun.elapsed().as_secs_f64();
    let trees = campaign.table("trees.csv");
    assert!(!trees.is_empty(), "{name}: no tree has a model");
    let files = campaign.files(&["outputs/trees"]);
    for file in ["qsm.csv", "tree.glb", "tree.mcap", "tree.png"] {
        let made = files.keys().filter(|path| path.ends_with(file)).count();
        assert_eq!(made, trees.len(), "{name}: {file}");
    }
    println!("{name}: {} trees, {seconds:.0} s", trees.len());
    trees.iter().for_each(|tree| println!("  {}", figures(tree)));
    trees
}

fn trees_of_file(name: &str) -> Vec<Row> {
    trees(Campaign::of(&[scan(name).to_str().unwrap()]), name)
}

/// What is told about a tree.
fn figures(tree: &Row) -> String {
    let litres = |part: &str| 1000.0 * number(tree, &format!("{part}_volume_m3"));
    let millimetres = |of: &str| 1000.0 * number(tree, &format!("cloud_to_model_{of}_m"));
    format!(
        "DBH {} ± {} cm ({}), height {} m, stem {:.0} l, branches {:.0} + {:.0} l, {} branches, {} \
         cylinders, {} points; mean {:.1}, RMS {:.1}, P95 {:.1}, max {:.0} mm",
        tree["dbh_cm"],
        tree["dbh_sd_cm"],
        tree["dbh_source"],
        tree["height_m"],
        litres("stem"),
        litres("thick"),
        litres("thin"),
        tree["branches"],
        tree["cylinders"],
        tree["cloud_points"],
        millimetres("mean"),
        millimetres("rms"),
        millimetres("p95"),
        millimetres("max"),
    )
}

/// The tree of a cloud of one tree: that with the most points.
fn tree_of(name: &str) -> Row {
    largest(trees_of_file(name))
}

fn largest(trees: Vec<Row>) -> Row {
    trees
        .into_iter()
        .max_by(|a, b| number(a, "cloud_points").total_cmp(&number(b, "cloud_points")))
        .unwrap()
}

fn volume_l(tree: &Row) -> f64 {
    ["stem", "thick", "thin"]
        .iter()
        .map(|part| 1000.0 * number(tree, &format!("{part}_volume_m3")))
        .sum()
}

/// Within 10 % of the reference, or 2 cm.
fn has_dbh(tree: &Row, reference_cm: f64) {
    let dbh_cm = number(tree, "dbh_cm");
    let allowed_cm = (0.1 * reference_cm).max(2.0);
    assert!((dbh_cm - reference_cm).abs() <= allowed_cm, "{dbh_cm}, not {reference_cm} cm");
    assert!(number(tree, "dbh_sd_cm") > 0.0, "{tree:?}");
}

/// The references are TreeQSM's models and, for Lille_11, a careful circle fit.
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn diameters_and_volumes_of_single_trees() {
    for (name, dbh_cm, volume) in [
        ("ITSMe/non_buttressed_trees/tree_1_pc.txt", 15.3, Some(264.0)),
        ("ITSMe/non_buttressed_trees/tree_2_pc.txt", 31.7, Some(904.0)),
        ("AdTree/Lille_11.xyz", 13.9, None),
    ] {
        let tree = tree_of(name);
        has_dbh(&tree, dbh_cm);
        if let Some(expected_l) = volume {
            let share = volume_l(&tree) / expected_l;
            assert!((share - 1.0).abs() <= 0.2, "{name}: {} l", volume_l(&tree));
        }
    }
    // Nobody knows its diameter; other programs measure none.
    let tree = tree_of("AdTree/tree13.xyz");
    assert!(number(&tree, "dbh_cm") > 5.0 && number(&tree, "dbh_sd_cm") > 0.0, "{tree:?}");
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn a_pine_with_and_without_its_ground_has_one_diameter() {
    let file = scan("TreeLS/pine.laz");
    let with = tree_of("TreeLS/pine.laz");
    has_dbh(&with, 25.3);
    let mut cloud = PointCloud::default();
    let mut scan = scan::open(&file, UnitChoice::default(), None).unwrap();
    while let Some(batch) = scan.next_batch().unwrap() {
        let above = |index: &u32| batch.world(*index as usize)[2] >= PINE_GROUND_M;
        let kept: Vec<u32> = (0..batch.len() as u32).filter(above).collect();
        cloud.append(&batch.select(&kept)).unwrap();
    }
    assert_eq!(cloud.len(), 72_030);
    let without = largest(trees(Campaign::of_cloud(&cloud), "TreeLS/pine.laz without ground"));
    has_dbh(&without, 25.3);
    let [with_cm, without_cm] = [&with, &without].map(|tree| number(tree, "dbh_cm"));
    assert!((with_cm - without_cm).abs() <= 1.0, "{with_cm} and {without_cm} cm");
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn a_plot_of_pines_has_its_stems() {
    let trees = trees_of_file("TreeLS/pine_plot.laz");
    assert!((14..=16).contains(&trees.len()), "{} stems", trees.len());
    let plausible = |tree: &&Row| (8.0..40.0).contains(&number(tree, "dbh_cm"));
    assert!(trees.iter().filter(plausible).count() >= 14, "{trees:#?}");
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn every_other_cloud_has_a_model() {
    for name in [
        "AdTree/tree1.xyz",
        "AdTree/tree33.xyz",
        "aRchi/Tree_2_point_cloud.las",
        "ITSMe/point_clouds/pc_tree.las",
        "ITSMe/point_clouds/pc_tree.ply",
        "ITSMe/point_clouds/pc_tree.txt",
        "ITSMe/point_clouds/pc_tree_temp.ply",
        "ITSMe/point_clouds/pc_tree_uav.txt",
        "spanner/MLS_Clip.laz",
    ] {
        let trees = trees_of_file(name);
        assert!(trees.iter().all(|tree| number(tree, "height_m") > 0.0), "{name}: {trees:#?}");
    }
}

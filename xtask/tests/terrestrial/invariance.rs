//! The same models of the same trees, however the scan is ordered, where in the world it lies, with how
//! many threads it is worked on and how often that is interrupted.

use crate::support::{Campaign, Row};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::LazyLock;
use std::time::Duration;
use timberline_pointcloud::{Frame, PointCloud};
use timberline_synth::terrestrial::{
    PlotParams, ScanParams, TreeSize, TreeSpecies, Understorey, plot,
};
use xtask::engine::runlog::{self, Event, Outcome};

/// Where the scan lies in the other run, from where it lies in the usual one, m.
const SHIFT_M: [i64; 3] = [500_000, 5_000_000, 1000];

/// Three small trees on a slope, seen coarsely from three positions.
static SCAN: LazyLock<PointCloud> = LazyLock::new(|| {
    use TreeSpecies::{EuropeanBeech, NorwaySpruce, ScotsPine};
    let of = |species, dbh_m| (species, TreeSize::of_dbh(species, dbh_m));
    let mut trees = vec![of(EuropeanBeech, 0.14), of(NorwaySpruce, 0.12), of(ScotsPine, 0.13)];
    trees[0].1 = trees[0].1.leafless();
    let scan = ScanParams { step_deg: 0.4, ..ScanParams::tls() };
    let params = PlotParams {
        origin_m: [37, -112],
        trees,
        edge_m: 8.0,
        understorey: Understorey { shrubs: 1, saplings: 0, herbs_per_m2: 0.5 },
        positions: 3,
        scan,
        ..PlotParams::default()
    };
    in_whole_millimetres(&plot(11, &params).unwrap().scan().thinned(0.03).cloud)
});

/// A scan whose file has its positions exactly: half a millimetre is rounded up or down, depending on
/// where in the world it lies.
fn in_whole_millimetres(scan: &PointCloud) -> PointCloud {
    let mut rounded = PointCloud::new(scan.frame);
    for index in 0..scan.len() {
        let local = scan.local(index).map(|value| (value * 1000.0).round() / 1000.0);
        rounded.push_local(local, &scan.point(index));
    }
    rounded
}

/// The usual run, with one thread.
static USUAL: LazyLock<Campaign> = LazyLock::new(|| {
    let campaign = Campaign::of_cloud(&SCAN);
    campaign.run(&["--jobs", "1"]);
    assert_eq!(campaign.table("trees.csv").len(), 3, "all trees have a model");
    campaign
});

fn assert_same_files(
    left: &BTreeMap<PathBuf, Vec<u8>>,
    right: &BTreeMap<PathBuf, Vec<u8>>,
    what: &str,
) {
    let names = |files: &BTreeMap<PathBuf, _>| files.keys().cloned().collect::<BTreeSet<_>>();
    let only: Vec<_> = names(left).symmetric_difference(&names(right)).cloned().collect();
    assert!(only.is_empty(), "{what}: in one only: {only:?}");
    let differ: Vec<_> = left.keys().filter(|path| left[*path] != right[*path]).collect();
    assert!(differ.is_empty(), "{what}: {differ:?}");
    assert!(left.len() > 30, "{what}: {} files", left.len());
}

#[test]
fn invariance_of_every_artefact_under_threads() {
    let other = Campaign::of_cloud(&SCAN);
    other.run(&["--jobs", "2"]);
    let folders = ["store", "outputs"];
    assert_same_files(&USUAL.files(&folders), &other.files(&folders), "2 threads");
}

#[test]
fn invariance_of_every_output_under_the_order_of_points() {
    let mut order: Vec<u32> = (0..SCAN.len() as u32).collect();
    order.sort_by_key(|index| (index.wrapping_mul(2_654_435_761), *index));
    let other = Campaign::of_cloud(&SCAN.select(&order));
    other.run(&["--jobs", "2"]);
    assert_same_files(&USUAL.files(&["outputs"]), &other.files(&["outputs"]), "shuffled");
}

#[test]
fn resume_of_tree_models_after_kills_at_every_stage() {
    let other = Campaign::of_cloud(&SCAN);
    let mut random = 7u64;
    for _ in 0..12 {
        random =
            random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut child = other.command(&["--jobs", "2"]).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(600 + (random >> 33) % 2400));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    other.run(&["--jobs", "2"]);
    let folders = ["store", "outputs"];
    assert_same_files(&USUAL.files(&folders), &other.files(&folders), "resumed");
    let (runs, mut times) = (other.path(".timberline/runs"), BTreeMap::new());
    let mut killed_with_work = 0;
    for id in runlog::list(&runs) {
        let before = times.len();
        for event in runlog::read(&runs, &id).unwrap() {
            if let Event::Unit(unit) = event
                && unit.outcome == Outcome::Done
            {
                *times.entry((unit.stage, unit.unit)).or_insert(0) += 1;
            }
        }
        killed_with_work += usize::from(times.len() > before);
    }
    assert!(times.values().all(|times| *times == 1), "{times:?}");
    assert!(killed_with_work >= 2, "the kills came too late, or too early, to prove anything");
}

#[test]
fn invariance_of_every_table_under_a_shift_of_the_world() {
    let mut moved = SCAN.clone();
    let [from, by] = [moved.frame.origin_m, SHIFT_M];
    moved.frame = Frame::new(std::array::from_fn(|axis| from[axis] + by[axis]));
    let other = Campaign::of_cloud(&moved);
    other.run(&["--jobs", "2"]);
    for name in ["trees.csv", "qsm.csv", "taper.csv", "branches.csv"] {
        let (left, right) = (by_place(&USUAL, name), by_place(&other, name));
        assert_eq!(left.len(), right.len(), "{name}: rows");
        assert!(left.len() >= 3, "{name}: {} rows", left.len());
        for (left, right) in left.iter().zip(&right) {
            assert_moved(left, right, name);
        }
    }
}

/// The rows of a table, tree by tree from west to east.
fn by_place(campaign: &Campaign, name: &str) -> Vec<Row> {
    let mut trees = campaign.table("trees.csv");
    trees.sort_by(|a, b| crate::support::number(a, "x").total_cmp(&crate::support::number(b, "x")));
    let rows = campaign.table(name);
    let of = |id: &str| rows.iter().filter(|row| row["tree_id"] == id).cloned().collect::<Vec<_>>();
    trees.iter().flat_map(|tree| of(&tree["tree_id"])).collect()
}

/// Compares two rows value by value, to 1 mm (or a thousandth of the unit).
fn assert_moved(left: &Row, right: &Row, what: &str) {
    /// Half of the last digit of both, beside the millimetre.
    const TOLERANCE: f64 = 0.001 + 1e-6;
    assert!(left.keys().eq(right.keys()), "{what}: columns");
    for (column, before) in left.iter().filter(|(column, _)| *column != "tree_id") {
        let after = &right[column];
        let axis = ["x", "y", "z"].iter().position(|axis| {
            column == axis || *column == format!("start_{axis}") || *column == format!("end_{axis}")
        });
        let shift = axis.map_or(0, |axis| SHIFT_M[axis]) as f64;
        let same = match (before.parse::<f64>(), after.parse::<f64>()) {
            (Ok(before), Ok(after)) => (after - shift - before).abs() <= TOLERANCE,
            _ => before == after,
        };
        assert!(same, "{what}: {column}: {before} and {after}\n{left:?}\n{right:?}");
    }
}

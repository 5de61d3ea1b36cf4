//! The shipped chain over the sample stand: the same result however it is cut up, and after kills.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test may fail"
)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;
use timberline_artefact::kinds::{GroundModel, Tree, Trees};
use xtask::engine::runlog::{self, Event, Outcome};
use xtask::engine::workdir::{leftovers, walk};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// A campaign over scans of the sample stand in a folder of its own.
struct Stand {
    folder: tempfile::TempDir,
}

impl Stand {
    fn new(scans: &str, tiles: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let scans = root().join("data-samples/als-stand/scans").join(scans);
        let campaign = format!(
            "name = \"x\"\nplatform = \"als\"\ninputs = [\"{}\"]\n[tiles]\n{tiles}\n",
            scans.display()
        );
        std::fs::write(folder.path().join("campaign.toml"), campaign).unwrap();
        Self { folder }
    }

    fn work(&self) -> PathBuf {
        self.folder.path().join(".timberline")
    }

    fn command(&self, more: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
        command
            .arg("run")
            .arg(root().join("pipelines/als-inventory.toml"))
            .arg("--campaign")
            .arg(self.folder.path());
        command.args(["--quiet", "--json"]).args(more).stdout(Stdio::null());
        command
    }

    fn run(&self, more: &[&str]) {
        let status = self.command(more).status().unwrap();
        assert_eq!(status.code(), Some(0));
    }

    /// Artefacts of a kind that a stage left.
    fn artefacts(&self, stage: &str, kind: &str) -> Vec<PathBuf> {
        let mut found = Vec::new();
        walk(&self.work().join("store").join(stage), &mut |path| {
            if path.to_str().unwrap().contains(&format!(".{kind}.")) {
                found.push(path.to_owned());
            }
        });
        assert!(!found.is_empty(), "no {kind} of {stage}");
        found
    }

    fn trees(&self) -> BTreeMap<u64, Tree> {
        let mut trees = BTreeMap::new();
        for path in self.artefacts("crown-fit", "trees") {
            for tree in timberline_artefact::read::<Trees>(&path).unwrap().1.trees {
                let twice = trees.insert(tree.id, tree);
                assert!(twice.is_none(), "a tree is in two tiles: {twice:?}");
            }
        }
        trees
    }

    /// Terrain by cell of the world.
    fn terrain(&self) -> BTreeMap<(i64, i64), f64> {
        let mut cells = BTreeMap::new();
        for path in self.artefacts("dtm", "ground-model") {
            let raster = timberline_artefact::read::<GroundModel>(&path).unwrap().1.raster;
            for row in 0..raster.rows {
                for column in 0..raster.columns {
                    let place = (raster.column0 + i64::from(column), raster.row0 + i64::from(row));
                    let twice = cells.insert(place, raster.values[raster.index(column, row)]);
                    assert!(twice.is_none(), "a cell is in two tiles: {place:?}");
                }
            }
        }
        cells.retain(|_, value| value.is_finite());
        cells
    }

    fn products(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        for part in ["store", "outputs"] {
            walk(&self.work().join(part), &mut |path| {
                let name = path.strip_prefix(self.work()).unwrap().to_owned();
                files.insert(name, std::fs::read(path).unwrap());
            });
        }
        files
    }
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 || (a.is_nan() && b.is_nan())
}

fn assert_same_trees(a: &BTreeMap<u64, Tree>, b: &BTreeMap<u64, Tree>, what: &str) {
    let only = |left: &BTreeMap<u64, Tree>, right: &BTreeMap<u64, Tree>| {
        left.values()
            .filter(|tree| !right.contains_key(&tree.id))
            .map(|tree| (tree.id, tree.apex_m))
            .collect::<Vec<_>>()
    };
    assert_eq!((only(a, b), only(b, a)), (vec![], vec![]), "{what}: trees in one only");
    for (left, right) in a.values().zip(b.values()) {
        let numbers = |tree: &Tree| {
            let planar = [tree.position_m, tree.surface_centre_m, tree.semi_axes_m];
            let single = [
                tree.height_m,
                tree.ground_m,
                tree.crown_radius_m,
                tree.crown_area_m2,
                tree.crown_base_m,
                tree.position_extent_m,
                tree.position_standard_error_m,
                tree.surface_apex_m,
                tree.rotation_deg,
                tree.fit_objective_m,
                tree.fit_gap,
            ];
            [&tree.apex_m[..], planar.as_flattened(), &single].concat()
        };
        let same = numbers(left).iter().zip(numbers(right)).all(|(a, b)| near(*a, b));
        let counts = |tree: &Tree| {
            let of_model = (tree.points, tree.inliers, tree.outliers, tree.crown_m.len());
            (of_model, tree.position_method, tree.fit_cells, tree.fit_nodes, tree.flags)
        };
        assert!(same && counts(left) == counts(right), "{what}:\n{left:#?}\n{right:#?}");
    }
}

#[test]
fn invariance_of_trees_and_terrain_under_tiles_and_threads() {
    let until = ["--until", "crown-fit", "--jobs"];
    let run = |tiles: &str, jobs: &str| {
        let stand = Stand::new("*.laz", tiles);
        stand.run(&[&until[..], &[jobs]].concat());
        stand
    };
    let usual = run("", "2");
    let (trees, terrain) = (usual.trees(), usual.terrain());
    assert!(trees.len() > 1000 && terrain.len() > 40_000, "{} {}", trees.len(), terrain.len());
    for (tiles, jobs) in [
        ("edge_m = 64\norigin_m = [13, -29]", "1"),
        ("edge_m = 101\norigin_m = [560005, 4904003]", "2"),
        ("edge_m = 512", "2"),
    ] {
        let other = run(tiles, jobs);
        let what = format!("{tiles}, {jobs} threads");
        assert_same_trees(&trees, &other.trees(), &what);
        let cells = other.terrain();
        assert!(terrain.keys().eq(cells.keys()), "{what}: other cells have a value");
        let worst =
            terrain.values().zip(cells.values()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst <= 1e-9, "{what}: terrain differs by {worst} m");
    }
}

#[test]
fn resume_of_the_chain_after_twenty_kills() {
    let (scan, tiles) = ("stand_560037_4904081.laz", "edge_m = 32");
    let undisturbed = Stand::new(scan, tiles);
    undisturbed.run(&["--jobs", "2"]);
    let stand = Stand::new(scan, tiles);
    let mut random = 7u64;
    for _ in 0..20 {
        random =
            random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut child = stand.command(&["--jobs", "2"]).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(30 + (random >> 33) % 400));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    stand.run(&["--jobs", "2"]);
    let (left, right) = (stand.products(), undisturbed.products());
    assert!(left.keys().eq(right.keys()));
    let differ: Vec<_> = left.keys().filter(|path| left[*path] != right[*path]).collect();
    assert!(differ.is_empty(), "{differ:?}");
    assert_eq!(leftovers(&stand.work()), Vec::<PathBuf>::new());
    let runs = stand.work().join("runs");
    let mut times = BTreeMap::new();
    for event in runlog::list(&runs).iter().flat_map(|id| runlog::read(&runs, id).unwrap()) {
        if let Event::Unit(unit) = event
            && unit.outcome == Outcome::Done
        {
            *times.entry((unit.stage, unit.unit)).or_insert(0) += 1;
        }
    }
    assert!(times.values().all(|times| *times == 1), "{times:?}");
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_cleanly_and_says_how_to_go_on() {
    let stand = Stand::new("stand_560037_4904081.laz", "edge_m = 32");
    let child = stand.command(&["--jobs", "2"]).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(1200));
    let interrupted =
        Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    let output = child.wait_with_output().unwrap();
    let talk = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{talk}");
    assert!(
        talk.contains("interrupted; what is finished is kept. Go on with: cargo xtask run"),
        "{talk}"
    );
    assert_eq!(leftovers(&stand.work()), Vec::<PathBuf>::new());
    stand.run(&[]);
}

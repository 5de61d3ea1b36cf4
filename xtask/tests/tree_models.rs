//! The terrestrial chain over a small virtual plot, and how `evaluate` judges its tree models.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use timberline_synth::terrestrial::{PlotParams, ScanParams, TreeSize, TreeSpecies, plot, truth};
use xtask::cli::sample::{utm_crs, write_scan};

/// The corner of the plot, from which the positions of cylinders count.
const CORNER_M: [i64; 2] = [432_110, 5_371_240];

fn xtask(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_xtask")).args(args).output().unwrap()
}

fn talk(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A campaign of two trees, run up to its tree models.
struct Plot {
    folder: tempfile::TempDir,
}

impl Plot {
    fn ran() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let of = |species, dbh_m| (species, TreeSize::of_dbh(species, dbh_m));
        let mut trees =
            vec![of(TreeSpecies::EuropeanBeech, 0.22), of(TreeSpecies::NorwaySpruce, 0.16)];
        trees[0].1 = trees[0].1.leafless();
        let scan = ScanParams { step_deg: 0.3, ..ScanParams::tls() };
        let params = PlotParams { trees, edge_m: 8.0, positions: 3, scan, ..PlotParams::default() };
        assert_eq!(params.origin_m, CORNER_M);
        let scene = plot(5, &params).unwrap();
        let path = |name: &str| folder.path().join(name);
        let crs = utm_crs(25833);
        write_scan(&path("scan.laz"), &scene.scan().thinned(0.02).cloud, &crs).unwrap();
        std::fs::write(path("trees.csv"), truth::trees(&scene)).unwrap();
        std::fs::write(path("cylinders.csv"), truth::cylinders(&scene, 0.0025)).unwrap();
        let campaign = "name = \"two trees\"\nplatform = \"tls\"\ninputs = [\"scan.laz\"]\n\
            [truth]\ntrees = \"trees.csv\"\n";
        std::fs::write(path("campaign.toml"), campaign).unwrap();
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned();
        let pipeline = root.join("pipelines/tls-trees.toml");
        let [place, pipeline] = [folder.path(), &pipeline].map(|path| path.to_str().unwrap());
        let run = xtask(&["run", pipeline, "--campaign", place, "--until", "cylinders", "--quiet"]);
        assert_eq!(run.status.code(), Some(0), "{}", talk(&run));
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A table beside the truth with every line but the heading changed.
    fn changed(&self, from: &str, to: &str, change: impl Fn(&mut Vec<String>)) -> PathBuf {
        let text = std::fs::read_to_string(self.path(from)).unwrap();
        let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
        for line in &mut lines[1..] {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            change(&mut cells);
            *line = cells.join(",");
        }
        std::fs::write(self.path(to), lines.join("\n")).unwrap();
        self.path(to)
    }

    fn evaluate(&self, more: &[&str]) -> Output {
        let place = self.folder.path().to_str().unwrap();
        xtask(&[&["evaluate", "--campaign", place][..], more].concat())
    }

    fn report(&self, cylinders: &Path, more: &[&str]) -> Value {
        let cylinders = ["--json", "--cylinders", cylinders.to_str().unwrap()];
        let output = self.evaluate(&[&cylinders[..], more].concat());
        assert_eq!(output.status.code(), Some(0), "{}", talk(&output));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    fn fails(&self, cylinders: &Path, part: &str) {
        let output = self.evaluate(&["--cylinders", cylinders.to_str().unwrap()]);
        let talk = talk(&output);
        assert!(output.status.code() != Some(0) && talk.contains(part), "{part} in\n{talk}");
    }
}

fn number(report: &Value, pointer: &str) -> f64 {
    report.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer}"))
}

/// Moves the six coordinates of a line of cylinders.
fn moved(cells: &mut [String], by_m: [f64; 2]) {
    for (column, axis) in [(5, 0), (6, 1), (8, 0), (9, 1)] {
        cells[column] = format!("{:.3}", cells[column].parse::<f64>().unwrap() + by_m[axis]);
    }
}

#[test]
fn models_of_two_trees_against_their_truth() {
    let plot = Plot::ran();
    let report = plot.report(&plot.path("cylinders.csv"), &[]);
    let models = &report["models"];
    assert_eq!(number(models, "/stems/reference"), 2.0);
    assert_eq!(number(models, "/stems/matched"), 2.0);
    assert!(number(models, "/stems/dbh_m/rmse") < 0.01, "{}", models["stems"]);
    assert!(number(models, "/stems/height_m/rmse") < 1.0, "{}", models["stems"]);
    let volume = |whose: &str| number(models, &format!("/found_volumes/{whose}/stem_m3"));
    let share = volume("model") / volume("truth");
    assert!((share - 1.0).abs() < 0.1, "stem volume: {share}");
    assert!(number(models, "/surfaces/back/mean_m") < 0.03, "{}", models["surfaces"]);
    assert!(number(models, "/branches/all/found") >= 2.0, "{}", models["branches"]);

    // It does not matter whether cylinders are given in the world or from the plot's corner.
    let [x, y] = CORNER_M.map(|metres| metres as f64);
    let world = plot.changed("cylinders.csv", "world.csv", |cells| moved(cells, [x, y]));
    assert_eq!(plot.report(&world, &[])["models"]["stems"], models["stems"]);
    // Rounding moves the places where surfaces are sampled.
    let mean = number(&plot.report(&world, &[]), "/models/surfaces/back/mean_m");
    let own = number(models, "/surfaces/back/mean_m");
    assert!((mean - own).abs() < 1e-4, "{mean} {own}");

    // A tree that is not there is false, one that is there too is missed.
    let far = plot.changed("trees.csv", "far.csv", |cells| {
        if cells[0] == "2" {
            cells[5] = (cells[5].parse::<f64>().unwrap() + 0.8).to_string();
        }
    });
    let args = ["--truth", far.to_str().unwrap()];
    let other = plot.report(&plot.path("cylinders.csv"), &args);
    let counts =
        ["missed", "false_trees"].map(|name| other["models"][name].as_array().unwrap().len());
    assert_eq!(counts[0], 1);
    assert_eq!(counts[1], models["false_trees"].as_array().unwrap().len() + 1);
    let near = [&args[..], &["--distance", "1"]].concat();
    let other = plot.report(&plot.path("cylinders.csv"), &near);
    assert_eq!(other["models"]["missed"], Value::Array(Vec::new()));

    bad_tables(&plot);
}

/// What is wrong with a table is said.
fn bad_tables(plot: &Plot) {
    let none = plot.evaluate(&[]);
    assert_eq!(none.status.code(), Some(2));
    assert!(talk(&none).contains("--cylinders"), "{}", talk(&none));
    let apart = plot.changed("cylinders.csv", "apart.csv", |cells| {
        if cells[0] == "2" {
            moved(cells, [30.0, 0.0]);
        }
    });
    plot.fails(&apart, "the first cylinder of tree 2 begins 30.0");
    let orphan = plot.changed("cylinders.csv", "orphan.csv", |cells| {
        if cells[1] == "3" {
            cells[2] = "99999999".to_owned();
        }
    });
    plot.fails(&orphan, "its parent 99999999 is not in the table");
    let nan = plot.changed("cylinders.csv", "nan.csv", |cells| cells[11] = "NaN".to_owned());
    plot.fails(&nan, "all values must be finite");
    std::fs::write(plot.path("short.csv"), "tree_id,cylinder\n1,1\n").unwrap();
    plot.fails(&plot.path("short.csv"), "missing field `parent`");
}

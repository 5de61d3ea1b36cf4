//! The crown experiment from the command line, on generated data and on a run.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

fn xtask(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_xtask")).args(args).output().unwrap()
}

fn json(args: &[&str]) -> Value {
    let output = xtask(args);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

const FILES: [&str; 9] = [
    "report.md",
    "methods.csv",
    "trees.csv",
    "clusters.csv",
    "experiment.json",
    "figure4.png",
    "figure4.svg",
    "figure4-cell0.4.png",
    "figure4-cell0.4.svg",
];

#[test]
fn the_same_files_whatever_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let run = |jobs: &str| {
        let out = folder.path().join(jobs);
        let small = ["experiment", "crowns", "--trees", "12", "--repeats", "2", "--jobs", jobs];
        assert!(xtask(&[&small[..], &["--out", out.to_str().unwrap()]].concat()).status.success());
        FILES.map(|name| std::fs::read(out.join(name)).unwrap())
    };
    let (one, three) = (run("1"), run("3"));
    for (name, (one, three)) in FILES.iter().zip(one.iter().zip(&three)) {
        assert!(one == three && !one.is_empty(), "{name}");
    }
}

#[test]
fn what_belongs_to_a_campaign_needs_one() {
    for args in [&["--truth", "x.csv"][..], &["a.toml"], &["--campaign", ".", "--seed", "2"]] {
        let output = xtask(&[&["experiment", "crowns"][..], args].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}");
    }
    assert_eq!(xtask(&["experiment", "crowns", "--cells", "0"]).status.code(), Some(2));
}

#[test]
fn a_run_with_known_stems() {
    let folder = tempfile::tempdir().unwrap();
    let sample = root().join("data-samples/als-stand");
    let campaign = format!(
        "name = \"quarter\"\nplatform = \"als\"\ninputs = [\"{}\"]\n[truth]\ntrees = \"{}\"\n",
        sample.join("scans/stand_560037_4904081.laz").display(),
        sample.join("truth/trees.csv").display()
    );
    std::fs::write(folder.path().join("campaign.toml"), campaign).unwrap();
    let place = folder.path().to_str().unwrap();
    let pipeline = root().join("pipelines/als-inventory.toml");
    let run = ["run", "--quiet", "--campaign", place, pipeline.to_str().unwrap()];
    assert!(xtask(&run).status.success());

    let report = json(&["evaluate", "--campaign", place, "--json"]);
    let rows = report["positions"].as_array().unwrap();
    let of = |name: &str| {
        let row = rows.iter().find(|row| row["method"].as_str().unwrap().starts_with(name));
        row.unwrap_or_else(|| panic!("{name}"))["errors"].clone()
    };
    // The run's positions are those of its method; but the run has the prior about the apex, this about
    // the highest of the points, which for trees below others may be another.
    let (own, l1) = (of("positions of the run"), of("L1, ω = 0, exact bounds, prior δ = 0.5 m"));
    assert_eq!(own["n"], l1["n"]);
    assert!((own["median"].as_f64().unwrap() - l1["median"].as_f64().unwrap()).abs() < 0.03);
    assert!(of("L2, free axes")["median"].as_f64().unwrap() < 1.0);

    let out = folder.path().join("out");
    let crowns = ["experiment", "crowns", "--campaign", place, "--cells", "0.5", "--json", "--out"];
    let found = json(&[&crowns[..], &[out.to_str().unwrap()]].concat());
    assert_eq!(found["datasets"][0]["facts"]["trees"], own["n"]);
    assert_eq!(found["datasets"][0]["facts"]["dataset"], "quarter");
    assert!(out.join("figure4.png").exists());
}

const SEGMENTATION_FILES: [&str; 10] = [
    "report.md",
    "cases.csv",
    "trees.csv",
    "experiment.json",
    "density.png",
    "density.svg",
    "segments.png",
    "segments.svg",
    "layers.png",
    "layers.svg",
];

#[test]
fn segmenters_are_compared_the_same_whatever_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let run = |jobs: &str| {
        let out = folder.path().join(jobs);
        let small = "experiment segmentation --edge 30 --stands open-conifer,broadleaf --densities 3,8 \
                     --segmenters starsac,watershed";
        let mut args: Vec<&str> = small.split_whitespace().collect();
        args.extend(["--jobs", jobs, "--json", "--out", out.to_str().unwrap()]);
        let found = json(&args);
        assert_eq!(found["cases"].as_array().unwrap().len(), 2 * 2 * 2);
        assert!(found["pooled"][0]["summary"]["all"]["found"].as_u64().unwrap() > 3);
        SEGMENTATION_FILES.map(|name| std::fs::read(out.join(name)).unwrap())
    };
    let (one, three) = (run("1"), run("3"));
    for (name, (one, three)) in SEGMENTATION_FILES.iter().zip(one.iter().zip(&three)) {
        assert!(one == three && !one.is_empty(), "{name}");
    }
}

#[test]
fn what_cannot_be_compared_is_named() {
    let unknown = [
        (["--stands", "taiga"], "savanna"),
        (["--segmenters", "magic"], "starsac"),
        (["--densities", "0"], "density_per_m2"),
        (["--edge", "1"], "judged_edge_m"),
    ];
    for (args, named) in unknown {
        let output = xtask(&[&["experiment", "segmentation"][..], &args].concat());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains(named), "{message}");
    }
}

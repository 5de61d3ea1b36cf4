//! Real scans as campaigns made by `init`, and bad files, through the command line.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "a test may fail")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};
use xtask::engine::workdir::walk;

fn data() -> PathBuf {
    PathBuf::from(std::env::var("TIMBERLINE_DATA").unwrap())
}

fn pipeline() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("pipelines/als-inventory.toml")
}

fn xtask() -> Command {
    Command::new(env!("CARGO_BIN_EXE_xtask"))
}

fn talk(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn real_scans_run_through_the_chain() {
    let campaigns: [(&str, &[&str]); 5] = [
        ("topography", &["lidR/Topography.laz"]),
        ("bcts", &["lasR_bcts/bcts_1.laz", "lasR_bcts/bcts_2.laz", "lasR_bcts/bcts_4.laz"]),
        (
            "hj_andrews",
            &[
                "hj_andrews/RS04.laz",
                "hj_andrews/RS12.laz",
                "hj_andrews/RS17.laz",
                "hj_andrews/RS29.laz",
                "hj_andrews/RS31.laz",
            ],
        ),
        ("eucanat", &["lidRtutorial/MixedEucaNat.laz"]),
        ("neon", &["neon_SJER_052/SJER_052.laz"]),
    ];
    for (name, scans) in campaigns {
        let folder = tempfile::tempdir().unwrap();
        let place = folder.path().join(name);
        let scans = scans.iter().map(|scan| data().join("als").join(scan));
        let made = xtask().arg("init").arg(&place).args(scans).output().unwrap();
        assert!(made.status.success(), "{name}: {}", talk(&made));
        let begun = Instant::now();
        let ran =
            xtask().arg("run").arg(pipeline()).arg("--campaign").arg(&place).output().unwrap();
        assert_eq!(ran.status.code(), Some(0), "{name}: {}", talk(&ran));
        println!(
            "{name}: {:.0} s\n{}",
            begun.elapsed().as_secs_f64(),
            String::from_utf8_lossy(&ran.stdout)
        );
        let outputs = place.join(".timberline/outputs");
        for file in ["trees.csv", "trees.gpkg", "points.laz"] {
            assert!(outputs.join(file).is_file(), "{name}: no {file}");
        }
        for (stem, ending) in [("dtm", "tif"), ("chm", "tif"), ("map", "png")] {
            // Sites far apart have a file each, numbered from 1.
            let one = outputs.join(format!("{stem}.{ending}")).is_file();
            let several = outputs.join(format!("{stem}-1.{ending}")).is_file();
            assert!(one || several, "{name}: no {stem}.{ending}");
        }
    }
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn bad_files_are_read_or_refused_in_time() {
    let mut files = Vec::new();
    for part in ["formats", "als/edge"] {
        walk(&data().join(part), &mut |path| files.push(path.to_owned()));
    }
    let mut outcomes: BTreeMap<String, usize> = BTreeMap::new();
    for file in &files {
        let (outcome, text) = take_in(file);
        println!("{:<12} {}: {text}", outcome, file.strip_prefix(data()).unwrap().display());
        *outcomes.entry(outcome.to_owned()).or_default() += 1;
    }
    println!("{outcomes:?}");
    assert!(outcomes.keys().all(|outcome| outcome == "read" || outcome == "refused"));
}

/// Runs a campaign of one file up to its tiles.
fn take_in(file: &Path) -> (&'static str, String) {
    let folder = tempfile::tempdir().unwrap();
    let quoted = toml::Value::from(glob::Pattern::escape(file.to_str().unwrap()));
    let campaign = format!("name = \"x\"\nplatform = \"als\"\ninputs = [{quoted}]\n");
    std::fs::write(folder.path().join("campaign.toml"), campaign).unwrap();
    let begun = Instant::now();
    let mut child = xtask()
        .arg("run")
        .arg(pipeline())
        .args(["--until", "tiles", "--quiet", "--campaign"])
        .arg(folder.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while child.try_wait().unwrap().is_none() {
        if begun.elapsed() > Duration::from_secs(10) {
            child.kill().unwrap();
            child.wait().unwrap();
            return ("HANGS", String::new());
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().unwrap();
    let talk = talk(&output);
    let first = talk.lines().next().unwrap_or_default().replace(&*data().to_string_lossy(), "");
    match output.status.code() {
        Some(0) => ("read", first),
        Some(1 | 3) if !talk.contains("internal error") && !first.is_empty() => ("refused", first),
        _ => ("BREAKS", talk),
    }
}

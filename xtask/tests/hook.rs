//! The shipped chain with a program in place of the built-in segmenters.

#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test may fail"
)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use xtask::engine::runlog::{self, Event, Outcome, UnitRecord};
use xtask::engine::workdir::leftovers;

/// A program of shell: all points to the first tree that it is told of.
const PROGRAM: &str = r#"
    echo "working on $TIMBERLINE_UNIT" >&2
    points=$(od -An -tu8 -j247 -N8 "$2")
    tree=$(sed -n 2p "$4" | cut -d, -f1)
    awk -v n="$points" -v t="$tree" \
        'BEGIN { print "point,tree_id"; for (i = 0; i < n; i++) print i "," t }' > "$6.csv"
"#;

/// A campaign over one scan of the sample stand, with a pipeline that differs from the shipped one in
/// one line.
struct Stand {
    folder: tempfile::TempDir,
}

impl Stand {
    fn new(command: &str) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let scan = root.join("data-samples/als-stand/scans/stand_560037_4904081.laz");
        let stand = Self { folder: tempfile::tempdir().unwrap() };
        let campaign = format!(
            "name = \"x\"\nplatform = \"als\"\ninputs = [\"{}\"]\n[tiles]\nedge_m = 32\n",
            scan.display()
        );
        stand.write("campaign.toml", &campaign);
        let shipped = std::fs::read_to_string(root.join("pipelines/als-inventory.toml")).unwrap();
        let table = format!("[segmentation]\ncommand = {command}\n");
        let pipeline = shipped.replace("[segmentation]\n", &table);
        assert_ne!(pipeline, shipped);
        stand.write("pipeline.toml", &pipeline);
        stand
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn xtask(&self, first: &[&str], more: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
        command.args(first).args(["--campaign", self.folder.path().to_str().unwrap()]).args(more);
        command.output().unwrap()
    }

    /// Runs the chain; the exit code and what the units of the run came to.
    fn run(&self) -> (i32, Vec<UnitRecord>) {
        let pipeline = self.path("pipeline.toml");
        let output = self.xtask(&["run", pipeline.to_str().unwrap()], &["--quiet", "--jobs", "2"]);
        let runs = self.path(".timberline/runs");
        let id = runlog::list(&runs).pop().unwrap();
        let events = runlog::read(&runs, &id).unwrap().into_iter();
        let units = events.filter_map(|event| match event {
            Event::Unit(unit) if unit.outcome != Outcome::Cached => Some(unit),
            _ => None,
        });
        assert_eq!(leftovers(&self.path(".timberline")), Vec::<PathBuf>::new());
        (output.status.code().unwrap(), units.collect())
    }
}

fn of<'a>(units: &'a [UnitRecord], stage: &str, outcome: Outcome) -> Vec<&'a UnitRecord> {
    units.iter().filter(|unit| unit.stage == stage && unit.outcome == outcome).collect()
}

fn stages(units: &[UnitRecord]) -> BTreeSet<&str> {
    units.iter().map(|unit| unit.stage.as_str()).collect()
}

const AFTERWARDS: [&str; 4] = ["crown-fit", "export", "map", "segmentation"];

#[test]
fn a_program_that_fails_on_a_tile_costs_that_tile() {
    let stand = Stand::new("[\"/bin/sh\", \"program.sh\"]\ncommand_time_limit_s = 5");
    stand.write("program.sh", PROGRAM);
    let (code, units) = stand.run();
    assert_eq!(code, 0, "{units:#?}");
    let done = of(&units, "segmentation", Outcome::Done);
    assert!(done.len() > WRONGS.len(), "{}", done.len());
    for unit in &done {
        assert!(unit.log[0].contains(&format!("working on {}", unit.unit)), "{:?}", unit.log);
    }

    let bad = done[1].unit.clone();
    let failing =
        format!("test $TIMBERLINE_UNIT = {bad} && echo 'too steep' >&2 && exit 4\n{PROGRAM}");
    stand.write("program.sh", &failing);
    let explained = stand.xtask(&["explain", "segmentation"], &[]);
    let words = String::from_utf8(explained.stdout).unwrap();
    assert!(words.contains("contents of program.sh, named in [segmentation], changed"), "{words}");
    let (code, units) = stand.run();
    assert_eq!(code, 3);
    assert_eq!(stages(&units), BTreeSet::from(AFTERWARDS), "nothing before it ran again");
    let failed = of(&units, "segmentation", Outcome::Failed);
    assert_eq!(failed.len(), 1);
    let error = failed[0].error.clone().unwrap();
    let expected = "program.sh` failed with exit status: 4; it said: too steep";
    assert!(failed[0].unit == bad && error.contains(expected), "{error}");
    assert!(failed[0].log[0].contains("stderr:\ntoo steep"), "{:?}", failed[0].log);
    assert_eq!(of(&units, "segmentation", Outcome::Done).len(), done.len() - 1);
    assert!(!of(&units, "crown-fit", Outcome::Done).is_empty(), "tiles far from it go on");
    assert!(of(&units, "crown-fit", Outcome::Blocked).iter().any(|unit| unit.unit == bad));

    stand.write("program.sh", PROGRAM);
    let (code, units) = stand.run();
    let again = of(&units, "segmentation", Outcome::Done).len();
    assert_eq!((code, again), (0, 0), "the first answers are still there");

    let tiles: Vec<&str> = done.iter().map(|unit| unit.unit.as_str()).collect();
    each_way_to_fail_costs_its_tile(&stand, &tiles);
}

/// What a program may do wrong, and what is said about it.
const WRONGS: [(&str, &str); 4] = [
    ("kill -9 $$", "program.sh` failed with signal: 9"),
    ("exec sleep 600", "was killed after 5 s; raise `command_time_limit_s`"),
    ("printf 'point,tree_id\n0,0\n' > \"$6.csv\"; exit 0", "out.csv has 1 rows, in.laz has"),
    (
        "points=$(od -An -tu8 -j247 -N8 \"$2\")
         awk -v n=\"$points\" \\
             'BEGIN { print \"point,tree_id\"; for (i = 0; i < n; i++) print i \",7\" }' > \"$6.csv\"
         exit 0",
        "out.csv, line 2: tree id 7",
    ),
];

fn each_way_to_fail_costs_its_tile(stand: &Stand, tiles: &[&str]) {
    let bad = tiles.iter().zip(WRONGS);
    let cases = bad.clone().map(|(tile, (wrong, _))| format!("{tile}) {wrong};;\n"));
    let script = format!("case $TIMBERLINE_UNIT in\n{}esac\n{PROGRAM}", cases.collect::<String>());
    stand.write("program.sh", &script);
    let (code, units) = stand.run();
    assert_eq!(code, 3);
    let failed = of(&units, "segmentation", Outcome::Failed);
    assert_eq!(failed.len(), WRONGS.len());
    for (tile, (_, expected)) in bad {
        let unit = failed.iter().find(|unit| unit.unit == *tile).unwrap();
        let error = unit.error.as_deref().unwrap();
        assert!(error.contains(expected), "{error}");
    }
    let done = of(&units, "segmentation", Outcome::Done);
    assert_eq!(done.len(), tiles.len() - WRONGS.len(), "the others have their answers");
}

#[test]
fn missing_programs_and_scripts_are_clear() {
    let stand = Stand::new("[\"no-such-program\", \"a\"]");
    let (code, units) = stand.run();
    assert_eq!(code, 3);
    let failed = of(&units, "segmentation", Outcome::Failed);
    let error = failed[0].error.clone().unwrap();
    let expected = "cannot start `no-such-program` (command `no-such-program a`)";
    assert!(error.contains(expected) && error.contains("install it"), "{error}");

    let stand = Stand::new("[\"/bin/sh\", \"no-such-script.sh\"]");
    let output = stand.xtask(&["run", stand.path("pipeline.toml").to_str().unwrap()], &[]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{said}");
    let expected = "`command` names `no-such-script.sh`: there is no such file";
    assert!(said.contains("pipeline.toml:") && said.contains(expected), "{said}");
}

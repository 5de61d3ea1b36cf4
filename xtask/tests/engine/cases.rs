//! The engine over a tiny chain: what runs, what does not, and what it says about it.

use crate::support::{PIPELINE, REWRITES_ITSELF, Stand, row_text, tile};
use std::collections::BTreeMap;
use std::path::Path;
use xtask::engine::runlog::{self, Event};

fn counts(pairs: &[(&str, u64)]) -> BTreeMap<String, u64> {
    pairs.iter().map(|(stage, count)| ((*stage).to_owned(), *count)).collect()
}

fn ran_once() -> Stand {
    let stand = Stand::new();
    let ran = stand.run(&[]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    assert_eq!(Stand::done(&ran), counts(&[("scan", 4), ("sum", 16), ("blur", 16), ("finish", 1)]));
    stand
}

/// The plan's line of a stage: units to run, and why.
fn plan(stand: &Stand, stage: &str, env: &[(&str, &str)]) -> (u64, String) {
    let pipeline = stand.path("pipeline.toml");
    let ran = stand.xtask(&["plan", pipeline.to_str().unwrap(), "--json"], env);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    let lines: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    let line = lines.as_array().unwrap().iter().find(|line| line["stage"] == stage).unwrap();
    (line["to_run"].as_u64().unwrap(), line["why"].to_string().replace("\\\"", "\""))
}

#[test]
fn a_second_run_does_nothing() {
    let stand = ran_once();
    let before = stand.products();
    let again = stand.run(&[]);
    assert_eq!((again.code, Stand::done(&again)), (0, BTreeMap::new()));
    assert_eq!(stand.products(), before);
}

#[test]
fn touching_a_file_without_changing_it_does_nothing() {
    let stand = ran_once();
    stand.write("row1.txt", &row_text(1));
    assert_eq!(Stand::done(&stand.run(&[])), BTreeMap::new());
}

#[test]
fn a_changed_parameter_is_named_with_its_line() {
    let stand = ran_once();
    stand.write("pipeline.toml", &PIPELINE.replace("factor = 2.0", "factor = 3.0"));
    let (to_run, why) = plan(&stand, "sum", &[]);
    assert_eq!(to_run, 16);
    assert!(
        why.contains("parameter `factor` 2.0 -> 3.0") && why.contains("pipeline.toml:5:1"),
        "{why}"
    );
    let (to_run, why) = plan(&stand, "blur", &[]);
    assert!(to_run == 16 && why.contains("follows `sum`: parameter `factor`"), "{why}");
    assert_eq!(plan(&stand, "scan", &[]).0, 0);
    let explained = stand.xtask(&["explain", "blur/tile:1_1"], &[]);
    for part in [
        "blur: 1 of 16 would run",
        "because sum/tile:0_0: parameter `factor` 2.0 -> 3.0",
        "downstream: finish",
    ] {
        assert!(explained.stdout.contains(part), "{part} in\n{}", explained.stdout);
    }
    assert_eq!(Stand::done(&stand.run(&[])), counts(&[("sum", 16), ("blur", 16), ("finish", 1)]));
}

#[test]
fn a_removed_parameter_is_named() {
    let stand = ran_once();
    stand.write("pipeline.toml", &PIPELINE.replace("offset_m = 0.5\n", ""));
    let (to_run, why) = plan(&stand, "sum", &[]);
    assert_eq!(to_run, 16);
    for part in ["parameter `offset_m` 0.5 -> 0.0", "default, not set in [sum]", "pipeline.toml:4"]
    {
        assert!(why.contains(part), "{part} in {why}");
    }
}

/// A stand whose stage `sum` reads a file, run once.
fn ran_with_script() -> Stand {
    let stand = Stand::new();
    stand.write("pipeline.toml", &format!("{PIPELINE}script = \"scripts/a.txt\"\n"));
    std::fs::create_dir(stand.path("scripts")).unwrap();
    stand.write("scripts/a.txt", "one");
    assert_eq!(stand.run(&[]).code, 0);
    stand
}

/// What units of `sum` said in the last run, by unit.
fn said(stand: &Stand) -> BTreeMap<String, Vec<String>> {
    let runs = stand.path(".timberline/runs");
    let id = runlog::list(&runs).pop().unwrap();
    let units = runlog::read(&runs, &id).unwrap().into_iter().filter_map(|event| match event {
        Event::Unit(unit) if unit.stage == "sum" => Some((unit.unit, unit.log)),
        _ => None,
    });
    units.collect()
}

#[test]
fn a_changed_script_runs_its_stage_and_what_follows() {
    let stand = ran_with_script();
    stand.write("scripts/a.txt", "one");
    assert_eq!(Stand::done(&stand.run(&[])), BTreeMap::new(), "touched, not changed");
    stand.write("scripts/a.txt", "two");
    assert_eq!(plan(&stand, "scan", &[]).0, 0);
    let (to_run, why) = plan(&stand, "sum", &[]);
    assert!(
        to_run == 16 && why.contains("contents of scripts/a.txt, named in [sum], changed"),
        "{why}"
    );
    let (_, why) = plan(&stand, "blur", &[]);
    assert!(why.contains("follows `sum`: contents of scripts/a.txt"), "{why}");
    assert_eq!(Stand::done(&stand.run(&[])), counts(&[("sum", 16), ("blur", 16), ("finish", 1)]));
    stand.write("pipeline.toml", PIPELINE);
    let (_, why) = plan(&stand, "sum", &[]);
    assert!(why.contains("parameter `script`"), "{why}");
}

/// Its key says what the script was, so what it may have read after that must not stay under it.
#[test]
fn a_script_that_changes_while_a_unit_runs_fails_the_unit() {
    let stand = ran_with_script();
    stand.write("scripts/a.txt", REWRITES_ITSELF);
    let ran = stand.run(&[]);
    assert_eq!((ran.code, Stand::done(&ran)), (1, BTreeMap::new()), "{}", ran.stderr);
    assert!(ran.stderr.contains("a.txt was changed meanwhile; run again"), "{}", ran.stderr);
    assert_eq!(Stand::done(&stand.run(&[])), counts(&[("sum", 16), ("blur", 16), ("finish", 1)]));
}

#[cfg(target_os = "linux")]
#[test]
fn a_script_that_cannot_be_read_is_a_fault_of_the_pipeline_file() {
    let stand = ran_with_script();
    let text = std::fs::read_to_string(stand.path("pipeline.toml")).unwrap();
    // Nobody, root included, can read its beginning.
    stand.write("pipeline.toml", &text.replace("scripts/a.txt", "/proc/self/mem"));
    let ran = stand.run(&[]);
    let expected = "`script` names `/proc/self/mem`: it cannot be read";
    assert!(ran.code == 2 && ran.stderr.contains(expected), "{}", ran.stderr);
}

#[test]
fn a_missing_script_is_a_fault_of_the_pipeline_file() {
    let stand = ran_with_script();
    std::fs::remove_file(stand.path("scripts/a.txt")).unwrap();
    let ran = stand.run(&[]);
    let expected = "pipeline.toml:7:1: `script` names `scripts/a.txt`: there is no such file\n    \
        relative paths count from";
    assert!(ran.code == 2 && ran.stderr.contains(expected), "{}", ran.stderr);
}

#[test]
fn what_programs_say_is_in_the_log_of_the_run() {
    let stand = ran_with_script();
    let all = said(&stand);
    assert_eq!(all.len(), 16);
    assert!(all.values().all(|said| said == &["the script says one"]), "{all:?}");
    stand.write("scripts/a.txt", "three");
    let pipeline = stand.path("pipeline.toml");
    let ran = stand.xtask(&["run", pipeline.to_str().unwrap()], &[("XTASK_TEST_FAIL", "tile:0_0")]);
    assert_eq!(ran.code, 3, "{}", ran.stderr);
    assert_eq!(said(&stand)["tile:0_0"], ["the script says three"], "also where it failed");
}

#[test]
fn a_limit_is_no_part_of_the_key() {
    let stand = ran_once();
    stand.write("pipeline.toml", &format!("{PIPELINE}limit_s = 5\n"));
    assert_eq!(Stand::done(&stand.run(&[])), BTreeMap::new());
}

#[test]
fn an_added_file_runs_its_own_tiles_and_their_neighbours() {
    let stand = ran_once();
    stand.write("extra.txt", "35.5 35.5 100\n");
    assert_eq!(plan(&stand, "scan", &[]), (1, "[[1,\"not made before\"]]".to_owned()));
    let (to_run, why) = plan(&stand, "sum", &[]);
    assert!(to_run == 1 && why.contains("follows `scan`: not made before"), "{why}");
    let explained = stand.xtask(&["explain", "sum/tile:3_3"], &[]).stdout;
    assert!(explained.contains("input added: shards of file:extra.txt"), "{explained}");
    let ran = stand.run(&[]);
    assert_eq!(Stand::done(&ran), counts(&[("scan", 1), ("sum", 1), ("blur", 4), ("finish", 1)]));
}

#[test]
fn a_removed_file_is_noticed() {
    let stand = ran_once();
    std::fs::remove_file(stand.path("row3.txt")).unwrap();
    // Tiles of row 3 are gone; those of row 2 lose neighbours.
    assert_eq!(Stand::done(&stand.run(&[])), counts(&[("blur", 4), ("finish", 1)]));
}

#[test]
fn a_corrupt_artefact_is_rebuilt_alone() {
    let stand = ran_once();
    let before = stand.products();
    let path = stand.artefact("sum", &format!("{}-", tile(2, 1)));
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[20] ^= 1;
    std::fs::write(&path, &bytes).unwrap();
    let (to_run, why) = plan(&stand, "sum", &[]);
    assert!(to_run == 1 && why.contains("corrupt at payload"), "{why}");
    assert_eq!(plan(&stand, "blur", &[]).0, 0);
    let checked = stand.xtask(&["doctor"], &[]);
    assert!(checked.code == 3 && checked.stdout.contains("1 corrupt"), "{}", checked.stdout);
    let ran = stand.run(&[]);
    assert_eq!(Stand::done(&ran), counts(&[("sum", 1)]));
    assert!(ran.stderr.contains("rebuilding sum/tile:2_1"), "{}", ran.stderr);
    assert_eq!(stand.products(), before);
}

#[test]
fn a_changed_output_is_written_again() {
    let stand = ran_once();
    let before = stand.products();
    stand.write(".timberline/outputs/total.txt", "0\n");
    assert_eq!(Stand::done(&stand.run(&[])), counts(&[("finish", 1)]));
    assert_eq!(stand.products(), before);
}

#[test]
fn a_raised_stage_version_is_named() {
    let stand = ran_once();
    let raised = [("XTASK_TEST_VERSION", "2")];
    let (to_run, why) = plan(&stand, "sum", &raised);
    assert!(to_run == 16 && why.contains("stage `sum` is now version 2, was 1"), "{why}");
    assert_eq!(
        Stand::done(&stand.run(&raised)),
        counts(&[("sum", 16), ("blur", 16), ("finish", 1)])
    );
    // The artefacts of version 1 are still there.
    assert_eq!(Stand::done(&stand.run(&[])), BTreeMap::new());
}

#[test]
fn a_failed_unit_stops_only_what_needs_it() {
    for fail in ["tile:0_0", "panic tile:0_0"] {
        let stand = Stand::new();
        let ran = stand.run(&[("XTASK_TEST_FAIL", fail)]);
        assert_eq!(ran.code, 3, "{}", ran.stderr);
        assert_eq!(
            Stand::done(&ran),
            counts(&[("scan", 4), ("sum", 15), ("blur", 12), ("finish", 1)])
        );
        assert!(ran.stderr.contains("on purpose"), "{}", ran.stderr);
        assert!(ran.stderr.contains("--only sum/tile:0_0"), "{}", ran.stderr);
        let pipeline = stand.path("pipeline.toml");
        let only = ["run", pipeline.to_str().unwrap(), "--json", "--only", "sum/tile:0_0"];
        assert_eq!(Stand::done(&stand.xtask(&only, &[])), counts(&[("sum", 1)]));
        assert_eq!(Stand::done(&stand.run(&[])), counts(&[("blur", 4), ("finish", 1)]));
    }
}

#[test]
fn fail_fast_stops_and_says_so() {
    let stand = Stand::new();
    let pipeline = stand.path("pipeline.toml");
    let args = ["run", pipeline.to_str().unwrap(), "--fail-fast", "--jobs", "1"];
    let ran = stand.xtask(&args, &[("XTASK_TEST_FAIL", "tile:0_1")]);
    assert_eq!(ran.code, 1, "{}", ran.stderr);
}

#[test]
fn a_bad_file_is_a_loss_and_the_rest_goes_on() {
    let stand = Stand::new();
    stand.write("bad.txt", "no points\n");
    stand.write("twin.txt", &row_text(2));
    let ran = stand.run(&[]);
    assert_eq!(ran.code, 3);
    assert!(ran.stderr.contains("left out: bad.txt: invalid float"), "{}", ran.stderr);
    assert!(
        ran.stderr.contains("left out: twin.txt: has the same contents as row2.txt"),
        "{}",
        ran.stderr
    );
    assert_eq!(Stand::done(&ran), counts(&[("scan", 4), ("sum", 16), ("blur", 16), ("finish", 1)]));
}

#[test]
fn from_until_and_unknown_names() {
    let stand = Stand::new();
    let pipeline = stand.path("pipeline.toml");
    let run = |more: &[&str]| {
        let mut args = vec!["run", pipeline.to_str().unwrap(), "--json"];
        args.extend(more);
        stand.xtask(&args, &[])
    };
    assert_eq!(Stand::done(&run(&["--until", "sum"])), counts(&[("scan", 4), ("sum", 16)]));
    assert_eq!(Stand::done(&run(&["--from", "blur"])), counts(&[("blur", 16), ("finish", 1)]));
    let unknown = run(&["--until", "blurr"]);
    assert!(
        unknown.code == 2 && unknown.stderr.contains("did you mean `blur`?"),
        "{}",
        unknown.stderr
    );
}

#[test]
fn all_configuration_errors_at_once() {
    let stand = Stand::new();
    let text = "nam = \"x\"\nstages = [\"scan\", \"sum\", \"blurr\"]\n[sum]\nfactor = 10\noffset = 1\n[blur]\n[finish]\nx = 1\n";
    stand.write("pipeline.toml", text);
    stand.write(
        "campaign.toml",
        "name = \"x\"\nplatform = \"als\"\ninputs = [\"*.txt\"]\nplot = 1\n",
    );
    let ran = stand.run(&[]);
    assert_eq!(ran.code, 2);
    for part in [
        "pipeline.toml:1:1: unknown key `nam`\n    did you mean `name`?",
        "pipeline.toml:2:26: there is no stage `blurr`\n    did you mean `blur`?",
        "pipeline.toml:4:10: `factor` is 10; it must be a number from 0.5 to 9.0 m (stage sum)",
        "pipeline.toml:5:1: unknown key `offset` (stage sum)\n    did you mean `offset_m`?",
        "stage `finish` has parameters but is not in `stages`",
        "campaign.toml:4:1: unknown key `plot`",
    ] {
        assert!(ran.stderr.contains(part), "{part}\nin\n{}", ran.stderr);
    }
}

#[test]
fn parameters_that_do_not_go_together() {
    let stand = Stand::new();
    stand.write("pipeline.toml", &PIPELINE.replace("2.0", "7").replace("0.5", "1"));
    let ran = stand.run(&[]);
    assert!(ran.code == 2 && ran.stderr.contains("pipeline.toml:4:"), "{}", ran.stderr);
    assert!(
        ran.stderr.contains("[sum] `factor` 7 does not go with `offset_m` 1"),
        "{}",
        ran.stderr
    );
}

#[test]
fn stages_out_of_order() {
    let stand = Stand::new();
    stand.write("pipeline.toml", "name = \"x\"\nstages = [\"scan\", \"blur\", \"sum\"]\n");
    let ran = stand.run(&[]);
    let expected =
        "stage `blur` reads `heights`, which no stage before it writes\n    stage `sum` writes it";
    assert!(ran.code == 2 && ran.stderr.contains(expected), "{}", ran.stderr);
}

#[test]
fn gc_keeps_what_is_used_and_what_is_pinned() {
    let stand = ran_once();
    let before = stand.products();
    assert!(stand.xtask(&["cache", "pin"], &[]).stdout.contains("pinned"));
    stand.write("pipeline.toml", &PIPELINE.replace("factor = 2.0", "factor = 3.0"));
    assert_eq!(stand.run(&[]).code, 0);
    assert!(stand.xtask(&["cache", "gc"], &[]).stdout.starts_with("0 artefacts"));
    let compared = stand.xtask(&["diff"], &[]).stdout;
    assert!(compared.contains("sum.factor: 2.0 -> 3.0"), "{compared}");
    stand.xtask(&["cache", "pin", "--remove"], &[]);
    let run: Vec<String> = xtask::engine::runlog::list(&stand.path(".timberline/runs"));
    stand.xtask(&["cache", "pin", &run[0], "--remove"], &[]);
    assert!(stand.xtask(&["cache", "gc"], &[]).stdout.starts_with("33 artefacts"));
    stand.write("pipeline.toml", PIPELINE);
    assert_eq!(Stand::done(&stand.run(&[])), counts(&[("sum", 16), ("blur", 16), ("finish", 1)]));
    let stale: Vec<_> =
        before.keys().filter(|path| !stand.products().contains_key(*path)).collect();
    assert!(stale.is_empty());
}

#[test]
fn no_two_units_share_a_key() {
    let stand = ran_once();
    let mut keys = std::collections::BTreeSet::new();
    for path in stand.products().keys().filter(|path| path.starts_with("store")) {
        let (_, entry) = xtask::engine::store::parse_name(path).unwrap();
        assert!(keys.insert(entry.key), "{}", path.display());
    }
}

/// What `inspect` prints about a file; it takes no campaign.
fn inspected(stand: &Stand, path: &Path) -> String {
    let args = ["inspect", path.to_str().unwrap()];
    let mut command = stand.command(&args, &[]);
    command.env("XTASK_TEST_ARGS", serde_json::to_string(&args).unwrap());
    crate::support::ended(command.spawn().unwrap()).stdout
}

#[test]
fn inspect_shows_what_is_inside() {
    let stand = ran_once();
    let path = stand.artefact("sum", &format!("{}-", tile(2, 1)));
    let shown = stand.xtask(&["status"], &[]).stdout;
    assert!(shown.contains("sum") && shown.contains("ended with exit code 0"), "{shown}");
    let shown = inspected(&stand, &path);
    for part in [
        "kind           heights",
        "tile:2_1",
        "points = 10",
        "factor = 2.0",
        "by scan",
        "height_m",
        "12.5000",
    ] {
        assert!(shown.contains(part), "{part} in\n{shown}");
    }
}

#[test]
fn inspect_shows_every_kind() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/artefact/golden");
    let stand = ran_once();
    let expected = |kind: &str| match kind {
        "stems" => ["stems: 2 rows", "base_source=\"LowestPoints\"", "runs: 2 rows"],
        "tree-cloud" => ["stem: 1 rows", "values: 40 rows", "extra.wood.values: 40 rows"],
        "consolidated" => ["consolidation: 1 rows", "points_left_alone=20", "values: 40 rows"],
        "skeletons" => ["raw.nodes: 2 rows", "consolidated.nodes: 1 rows", "radius_m=0.1"],
        "qsm" => ["metrics: 1 rows", "taper: 1 rows", "source=\"Inferred\""],
        "model-files" | "picture-files" => ["files: 2 rows", "name=\"qsm.csv\"", "bytes=11"],
        _ => ["stage", "unit", "key"],
    };
    for kind in timberline_artefact::kinds::all().iter().filter(|kind| kind.name != "shards") {
        let name = format!("{}-v{}.{}", kind.name, kind.version, kind.extension);
        let shown = inspected(&stand, &golden.join(name));
        assert!(shown.contains(&format!("kind           {} ", kind.name)), "{}", kind.name);
        for part in expected(kind.name) {
            assert!(shown.contains(part), "{part} in\n{shown}");
        }
    }
}

#[test]
fn inspect_draws_trees() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/artefact/golden");
    let stand = ran_once();
    for name in ["tree-cloud-v1.mcap", "consolidated-v1.mcap", "skeletons-v1.tmbr"] {
        let (path, target) = (golden.join(name), stand.path(&format!("{name}.png")));
        let args = ["inspect", path.to_str().unwrap(), "--png", target.to_str().unwrap()];
        let mut command = stand.command(&args, &[]);
        command.env("XTASK_TEST_ARGS", serde_json::to_string(&args).unwrap());
        let ended = crate::support::ended(command.spawn().unwrap());
        assert_eq!(ended.code, 0, "{}", ended.stderr);
        assert!(std::fs::read(&target).unwrap().starts_with(b"\x89PNG"), "{name}");
    }
}

#[test]
fn inspect_shows_an_older_version_as_the_present_one() {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates/artefact/golden");
    let stand = ran_once();
    let shown = inspected(&stand, &golden.join("trees-v1.tmbr"));
    for part in ["kind           trees (version 1, shown as version 3)", "position_method=\"L1\""] {
        assert!(shown.contains(part), "{part} in\n{shown}");
    }
    let shown = inspected(&stand, &golden.join("trees-v3.tmbr"));
    for part in [
        "kind           trees (version 3)",
        "rotation_deg=22.5",
        "fit_nodes",
        "origin=\"BelowCanopy\"",
    ] {
        assert!(shown.contains(part), "{part} in\n{shown}");
    }
}

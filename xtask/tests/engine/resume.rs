//! Kills, and several processes at once.

use crate::support::{Stand, ended};
use std::collections::BTreeMap;
use std::time::Duration;
use xtask::engine::runlog::{self, Event, Outcome};
use xtask::engine::workdir::leftovers;

const SLOW: [(&str, &str); 1] = [("XTASK_TEST_SLOW_MS", "40")];

/// How often every unit ran, over all runs.
fn times_run(stand: &Stand) -> BTreeMap<(String, String, String), usize> {
    let runs = stand.path(".timberline/runs");
    let mut times = BTreeMap::new();
    for id in runlog::list(&runs) {
        for event in runlog::read(&runs, &id).unwrap() {
            if let Event::Unit(unit) = event
                && unit.outcome == Outcome::Done
            {
                *times.entry((unit.stage, unit.unit, unit.key)).or_default() += 1;
            }
        }
    }
    times
}

fn command(stand: &Stand) -> std::process::Command {
    let pipeline = stand.path("pipeline.toml");
    stand.command(&["run", pipeline.to_str().unwrap(), "--json", "--jobs", "2"], &SLOW)
}

#[test]
fn killed_at_twenty_moments_it_ends_as_if_it_had_not_been() {
    let undisturbed = Stand::new();
    assert_eq!(undisturbed.run(&[]).code, 0);
    let stand = Stand::new();
    let mut random = 12_345u64;
    for _ in 0..20 {
        random =
            random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut child = command(&stand).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(20 + (random >> 33) % 130));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    let last = ended(command(&stand).spawn().unwrap());
    assert_eq!(last.code, 0, "{}", last.stderr);
    assert_eq!(stand.products(), undisturbed.products());
    assert_eq!(leftovers(&stand.path(".timberline")), Vec::<std::path::PathBuf>::new());
    let times = times_run(&stand);
    assert!(times.values().all(|times| *times == 1), "{times:?}");
    assert!(times.len() > 20, "the kills came too late to prove anything");
}

#[test]
fn processes_on_one_store_share_the_work() {
    let undisturbed = Stand::new();
    assert_eq!(undisturbed.run(&[]).code, 0);
    let stand = Stand::new();
    let children: Vec<_> = (0..3).map(|_| command(&stand).spawn().unwrap()).collect();
    for child in children {
        let ran = ended(child);
        assert_eq!(ran.code, 0, "{}", ran.stderr);
    }
    assert_eq!(stand.products(), undisturbed.products());
    let times = times_run(&stand);
    assert_eq!((times.len(), times.values().max()), (37, Some(&1)));
    assert_eq!(leftovers(&stand.path(".timberline")), Vec::<std::path::PathBuf>::new());
}

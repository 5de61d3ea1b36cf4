//! `diff`: two runs compared.

use super::open::Place;
use super::out::{self, Table};
use super::{DONE, Usage};
use crate::engine::progress::duration;
use crate::engine::runlog::{self, Event, FileRecord, StageRecord, StageSummary};
use anyhow::Result;
use serde::Serialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Arguments of `diff`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Earlier run [default: the last but one]
    #[arg(value_name = "RUN_A")]
    a: Option<String>,
    /// Later run [default: the last]
    #[arg(value_name = "RUN_B")]
    b: Option<String>,
    #[command(flatten)]
    place: Place,
    /// Print the answer as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Default)]
struct Run {
    stages: Vec<StageRecord>,
    files: Vec<FileRecord>,
    keys: BTreeMap<(String, String), String>,
    summaries: BTreeMap<String, StageSummary>,
}

/// What differs.
#[derive(Debug, Serialize)]
struct Differences {
    a: String,
    b: String,
    /// Settings and files, in words.
    settings: Vec<String>,
    stages: Vec<StageDifference>,
}

#[derive(Debug, Serialize)]
struct StageDifference {
    stage: String,
    same: usize,
    changed: usize,
    only_a: usize,
    only_b: usize,
    seconds: [f64; 2],
}

/// Runs the command.
///
/// # Errors
/// When a run does not exist.
pub fn run(args: &Args) -> Result<u8> {
    let runs = args.place.work_dir().runs();
    let known = runlog::list(&runs);
    let recent = |back: usize| known.len().checked_sub(back).and_then(|at| known.get(at)).cloned();
    let pick = |given: &Option<String>, back| {
        given
            .clone()
            .or_else(|| recent(back))
            .ok_or_else(|| Usage("there are fewer than two runs".to_owned()))
    };
    let (a, b) = (pick(&args.a, 2)?, pick(&args.b, 1)?);
    let (left, right) = (load(runlog::read(&runs, &a)?), load(runlog::read(&runs, &b)?));
    let found =
        Differences { a, b, settings: settings(&left, &right), stages: stages(&left, &right) };
    if args.json {
        out::json(&found)?;
    } else {
        print(&found);
    }
    Ok(DONE)
}

fn load(events: Vec<Event>) -> Run {
    let mut run = Run::default();
    for event in events {
        match event {
            Event::Start { stages, files, .. } => (run.stages, run.files) = (stages, files),
            Event::Unit(unit) => {
                run.keys.insert((unit.stage, unit.unit), unit.key);
            }
            Event::Stage(summary) => {
                run.summaries.insert(summary.stage.clone(), summary);
            }
            _ => {}
        }
    }
    run
}

fn settings(a: &Run, b: &Run) -> Vec<String> {
    let mut words = Vec::new();
    let by_name = |run: &Run| -> BTreeMap<String, StageRecord> {
        run.stages.iter().map(|stage| (stage.name.clone(), stage.clone())).collect()
    };
    let (left, right) = (by_name(a), by_name(b));
    for name in left.keys().chain(right.keys()).collect::<BTreeSet<_>>() {
        match (left.get(name), right.get(name)) {
            (Some(old), Some(new)) => {
                if old.version != new.version {
                    words.push(format!("{name}: version {} -> {}", old.version, new.version));
                }
                words.extend(params(name, &old.params, &new.params));
            }
            (Some(_), None) => words.push(format!("stage {name} only in the first")),
            _ => words.push(format!("stage {name} only in the second")),
        }
    }
    let hashes = |run: &Run| -> BTreeMap<String, String> {
        run.files.iter().map(|file| (file.name.clone(), file.hash.clone())).collect()
    };
    let (left, right) = (hashes(a), hashes(b));
    for name in left.keys().chain(right.keys()).collect::<BTreeSet<_>>() {
        match (left.get(name), right.get(name)) {
            (Some(old), Some(new)) if old != new => words.push(format!("file {name} changed")),
            (Some(_), None) => words.push(format!("file {name} only in the first")),
            (None, Some(_)) => words.push(format!("file {name} only in the second")),
            _ => {}
        }
    }
    words
}

fn params(stage: &str, old: &Value, new: &Value) -> Vec<String> {
    let none = serde_json::Map::new();
    let (old, new) = (old.as_object().unwrap_or(&none), new.as_object().unwrap_or(&none));
    let names: BTreeSet<&String> = old.keys().chain(new.keys()).collect();
    let show = |value: Option<&Value>| value.map_or("none".to_owned(), ToString::to_string);
    let differ = names.into_iter().filter(|name| old.get(*name) != new.get(*name));
    differ
        .map(|name| format!("{stage}.{name}: {} -> {}", show(old.get(name)), show(new.get(name))))
        .collect()
}

fn stages(a: &Run, b: &Run) -> Vec<StageDifference> {
    let mut names: Vec<&String> =
        a.stages.iter().chain(&b.stages).map(|stage| &stage.name).collect();
    let mut seen = BTreeSet::new();
    names.retain(|name| seen.insert(*name));
    let seconds =
        |run: &Run, name: &str| run.summaries.get(name).map_or(0.0, |summary| summary.seconds);
    names
        .into_iter()
        .map(|name| {
            let of = |run: &Run| -> BTreeMap<String, String> {
                let mine = run.keys.iter().filter(|((stage, _), _)| stage == name);
                mine.map(|((_, unit), key)| (unit.clone(), key.clone())).collect()
            };
            let (left, right) = (of(a), of(b));
            let same = left.iter().filter(|(unit, key)| right.get(*unit) == Some(key)).count();
            let both = left.keys().filter(|unit| right.contains_key(*unit)).count();
            StageDifference {
                stage: name.clone(),
                same,
                changed: both - same,
                only_a: left.len() - both,
                only_b: right.len() - both,
                seconds: [seconds(a, name), seconds(b, name)],
            }
        })
        .collect()
}

fn print(found: &Differences) {
    out::line(&format!("{} -> {}", found.a, found.b));
    if found.settings.is_empty() {
        out::line("parameters and files are the same");
    }
    found.settings.iter().for_each(|words| out::line(&format!("  {words}")));
    let mut table = Table::new(&[
        "stage",
        "same",
        "changed",
        "only first",
        "only second",
        "time first",
        "time second",
    ]);
    for stage in &found.stages {
        table.row([
            stage.stage.clone(),
            stage.same.to_string(),
            stage.changed.to_string(),
            stage.only_a.to_string(),
            stage.only_b.to_string(),
            duration(stage.seconds[0]),
            duration(stage.seconds[1]),
        ]);
    }
    out::line(&table.text());
}

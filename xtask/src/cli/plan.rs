//! `plan`.

use super::open::{Opened, Place};
use super::out::{self, Table};
use super::{DONE, Program};
use crate::engine::explain::{DryRun, Explained};
use crate::engine::progress::bytes;
use anyhow::Result;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Arguments of `plan`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Pipeline file [default: that of the last run]
    pipeline: Option<PathBuf>,
    #[command(flatten)]
    place: Place,
    /// Print the plan as JSON
    #[arg(long)]
    json: bool,
}

/// What a stage would do.
#[derive(Debug, Clone, Serialize)]
pub struct StageLine {
    /// Stage.
    pub stage: String,
    /// Its units.
    pub units: usize,
    /// Those in the store.
    pub up_to_date: usize,
    /// Those that would run.
    pub to_run: usize,
    /// Largest estimate of a unit that would run, bytes.
    pub memory_bytes: u64,
    /// Causes with the number of units of each, the commonest first.
    pub why: Vec<(usize, String)>,
    /// The stage that must run before the units are known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub units_known_after: Option<&'static str>,
}

/// Runs the command.
///
/// # Errors
/// Faults of the files.
pub fn run(program: &Program, args: &Args) -> Result<u8> {
    let opened = Opened::new(program, &args.place, args.pipeline.as_deref())?;
    let lines = lines(&opened)?;
    if args.json {
        out::json(&lines)?;
        return Ok(DONE);
    }
    for lost in &opened.survey.lost {
        out::talk(&format!("left out: {}: {}", lost.name, lost.error));
    }
    out::line(&table(&lines).text());
    if lines.iter().all(|line| line.to_run == 0) {
        out::talk("everything is up to date");
    }
    Ok(DONE)
}

/// The plan of all stages.
///
/// # Errors
/// What a stage says about its parameters.
pub fn lines(opened: &Opened) -> Result<Vec<StageLine>> {
    let dry =
        DryRun::new(&opened.pipeline, &opened.survey, &opened.store).map_err(anyhow::Error::msg)?;
    let line = |position: usize| {
        let units = &dry.stages[position];
        let stale = units.iter().filter(|plan| !plan.is_whole());
        let up_to_date = units.iter().filter(|plan| plan.is_whole()).count();
        StageLine {
            stage: opened.pipeline.stages[position].name().to_owned(),
            units: units.len(),
            up_to_date,
            to_run: units.len() - up_to_date,
            memory_bytes: stale.map(|plan| plan.memory_bytes).max().unwrap_or(0),
            why: causes(&dry.explain(position)),
            units_known_after: dry.units_known_after(position),
        }
    };
    Ok((0..dry.stages.len()).map(line).collect())
}

/// Causes in words with their numbers, the commonest first.
#[must_use]
pub fn causes(explained: &[Explained]) -> Vec<(usize, String)> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for unit in explained {
        let words = match &unit.root {
            Some(root) => format!("follows `{}`: {}", root.stage, root.words),
            None => unit.words.clone(),
        };
        *counts.entry(words).or_default() += 1;
    }
    let mut causes: Vec<(usize, String)> =
        counts.into_iter().map(|(words, count)| (count, words)).collect();
    causes.sort_by(|a, b| (b.0, &a.1).cmp(&(a.0, &b.1)));
    causes
}

fn table(lines: &[StageLine]) -> Table {
    let mut table =
        Table::new(&["stage", "units", "up to date", "to run", "memory", "why"]).with_text();
    for line in lines {
        let memory = if line.to_run > 0 { bytes(line.memory_bytes) } else { "-".to_owned() };
        let mut why = line.why.iter().map(|(count, words)| match line.why.len() {
            1 => words.clone(),
            _ => format!("{count}: {words}"),
        });
        let count = |count: usize| match line.units_known_after {
            Some(_) => "?".to_owned(),
            None => count.to_string(),
        };
        let unknown = |stage| format!("its trees are known once `{stage}` has run");
        table.row([
            line.stage.clone(),
            count(line.units),
            count(line.up_to_date),
            count(line.to_run),
            memory,
            line.units_known_after.map_or_else(|| why.next().unwrap_or_default(), unknown),
        ]);
        let empty = || std::iter::repeat_n(String::new(), 5);
        why.by_ref().take(3).for_each(|words| table.row(empty().chain([words])));
        let more = why.count();
        if more > 0 {
            table.row(
                empty().chain([format!("... {more} more causes; see explain {}", line.stage)]),
            );
        }
    }
    table
}

//! `status`.

use super::open::{Opened, Place};
use super::out::{self, Table};
use super::{DONE, Program};
use crate::engine::progress::{bytes, duration};
use crate::engine::runlog::{self, Event, Outcome};
use anyhow::Result;
use serde_json::json;
use std::path::PathBuf;

/// Arguments of `status`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Pipeline file [default: that of the last run]
    pipeline: Option<PathBuf>,
    #[command(flatten)]
    place: Place,
    /// Print the answer as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// Faults of the files.
pub fn run(program: &Program, args: &Args) -> Result<u8> {
    let opened = Opened::new(program, &args.place, args.pipeline.as_deref())?;
    let lines = super::plan::lines(&opened)?;
    let runs = runlog::list(&opened.work.runs());
    let last = runs
        .last()
        .map(|id| runlog::read(&opened.work.runs(), id).map(|events| (id, events)))
        .transpose()?;
    if args.json {
        let last = last.map(|(id, events)| json!({ "run": id, "events": events }));
        out::json(&json!({ "runs": runs.len(), "last": last, "stages": lines }))?;
        return Ok(DONE);
    }
    match &last {
        Some((id, events)) => print_last(id, events),
        None => out::line("no run yet"),
    }
    let mut table = Table::new(&["stage", "up to date", "of", "store"]);
    for line in &lines {
        let size = super::cache::folder_bytes(&opened.work.store().join(&line.stage));
        table.row([
            line.stage.clone(),
            line.up_to_date.to_string(),
            line.units.to_string(),
            bytes(size),
        ]);
    }
    out::line(&table.text());
    Ok(DONE)
}

fn print_last(id: &str, events: &[Event]) {
    let mut ended = "was killed before its end".to_owned();
    for event in events {
        match event {
            Event::Start { time, pipeline, .. } => {
                out::line(&format!("last run {id}: {} at {time}", pipeline.display()));
            }
            Event::End { seconds, exit_code, interrupted, .. } => {
                let how = if *interrupted { "interrupted" } else { "ended" };
                ended = format!("{how} with exit code {exit_code} after {}", duration(*seconds));
            }
            Event::LostFile { name, error } => out::line(&format!("  left out: {name}: {error}")),
            Event::Unit(unit) if unit.outcome == Outcome::Failed => {
                out::line(&format!(
                    "  failed: {}/{}: {}",
                    unit.stage,
                    unit.unit,
                    unit.error.as_deref().unwrap_or("")
                ));
            }
            _ => {}
        }
    }
    out::line(&format!("  {ended}"));
}

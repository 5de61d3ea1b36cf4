//! `explain`.

use super::open::{Opened, Place};
use super::out;
use super::run::stage_position;
use super::{DONE, Program, Usage};
use crate::config::PipelineStage;
use crate::engine::explain::{Cause, DryRun, Explained, difference_words};
use crate::engine::progress::units;
use anyhow::Result;
use serde_json::json;
use std::path::PathBuf;
use timberline_artefact::UnitId;

/// Units listed one by one; `--json` lists all.
const LISTED: usize = 8;

/// Arguments of `explain`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Stage, or one unit of it: `dtm`, `dtm/tile:3_-4`
    #[arg(value_name = "STAGE[/UNIT]")]
    target: String,
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
/// When the stage or the unit does not exist.
pub fn run(program: &Program, args: &Args) -> Result<u8> {
    let opened = Opened::new(program, &args.place, args.pipeline.as_deref())?;
    let (stage, unit) =
        args.target.split_once('/').map_or((args.target.as_str(), None), |(s, u)| (s, Some(u)));
    let position = stage_position(&opened.pipeline, stage)?;
    let unit: Option<UnitId> = unit.map(|unit| unit.parse().map_err(Usage)).transpose()?;
    let dry =
        DryRun::new(&opened.pipeline, &opened.survey, &opened.store).map_err(anyhow::Error::msg)?;
    if let Some(unit) = &unit
        && !dry.stages[position].iter().any(|plan| plan.unit() == unit)
    {
        return Err(Usage(format!("stage `{stage}` has no unit {unit}")).into());
    }
    let mut explained = dry.explain(position);
    explained.retain(|one| unit.as_ref().is_none_or(|unit| one.unit == *unit));
    let downstream = opened.pipeline.downstream(position);
    if args.json {
        out::json(&json!({ "stage": stage, "units": explained, "downstream": downstream }))?;
        return Ok(DONE);
    }
    let entry = &opened.pipeline.stages[position];
    let total = dry.stages[position].len();
    print(&opened, entry, unit.as_ref(), &explained, total);
    if !downstream.is_empty() && !explained.is_empty() {
        out::line(&format!("downstream: {}", downstream.join(", ")));
    }
    Ok(DONE)
}

fn print(
    opened: &Opened,
    stage: &PipelineStage,
    unit: Option<&UnitId>,
    explained: &[Explained],
    total: usize,
) {
    let name = stage.name();
    if explained.is_empty() {
        let what = unit.map_or_else(|| format!("all {}", units(total)), ToString::to_string);
        out::line(&format!("{name}: {what} up to date"));
        return;
    }
    out::line(&format!("{name}: {} of {total} would run", explained.len()));
    for (count, words) in super::plan::causes(explained) {
        out::line(&format!("  {}: {words}", units(count)));
    }
    for one in explained.iter().take(LISTED) {
        out::line(&format!("{name}/{}: {}", one.unit, one.words));
        if let Some(root) = &one.root {
            out::line(&format!("    because {}/{}: {}", root.stage, root.unit, root.words));
        }
        if let (Cause::Changed { differences }, Some(_)) = (&one.cause, unit) {
            for more in &differences[1..] {
                out::line(&format!(
                    "    also: {}",
                    difference_words(stage, &opened.pipeline.path, more)
                ));
            }
        }
    }
    if explained.len() > LISTED {
        out::line(&format!("... and {} more (--json lists all)", explained.len() - LISTED));
    }
}

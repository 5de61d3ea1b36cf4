//! `run`.

use super::open::{Opened, Place};
use super::out::{self, Table};
use super::{DONE, LOSSES, Program, Usage};
use crate::config::{Pipeline, PipelineStage, nearest};
use crate::engine::progress::{Progress, Style, bytes, duration, short};
use crate::engine::runlog::{Outcome, StageSummary};
use crate::engine::{Limits, Options, Report, Runner, Selection, memory};
use anyhow::Result;
use serde_json::json;
use std::path::PathBuf;

/// Share of the free memory that is used unless `--memory` says otherwise.
const MEMORY_SHARE: f64 = 0.7;
/// Budget where the system does not tell its free memory, bytes.
const MEMORY_FALLBACK: u64 = 4_000_000_000;
/// More failures than this are only counted on the screen; all are in the log.
const FAILURES_SHOWN: usize = 10;

/// Arguments of `run`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Everything is resumable: the same command goes on where it was stopped.")]
pub struct Args {
    /// Pipeline file [default: that of the last run]
    pub pipeline: Option<PathBuf>,
    #[command(flatten)]
    place: Place,
    /// Begin with this stage; what comes before must be in the store
    #[arg(long, value_name = "STAGE")]
    from: Option<String>,
    /// End with this stage
    #[arg(long, value_name = "STAGE")]
    until: Option<String>,
    /// Run this stage alone, or one unit of it, even if it is up to date: to replay a failure
    #[arg(long, value_name = "STAGE[/UNIT]", conflicts_with_all = ["from", "until"])]
    only: Option<String>,
    /// Go on after a failure with all that does not depend on it (this is the default)
    #[arg(long, conflicts_with = "fail_fast")]
    keep_going: bool,
    /// Stop at the first failure
    #[arg(long)]
    fail_fast: bool,
    /// Threads to use [default: one a processor]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    /// Memory to stay within, in GB [default: 70 % of what is free]
    #[arg(long, value_name = "GB")]
    memory: Option<f64>,
    /// Say nothing but what went wrong
    #[arg(long, short)]
    quiet: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// When the run as a whole is impossible.
pub fn run(program: &Program, args: &Args) -> Result<u8> {
    let opened = Opened::new(program, &args.place, args.pipeline.as_deref())?;
    let options = Options {
        limits: limits(args)?,
        selection: selection(args, &opened.pipeline)?,
        fail_fast: args.fail_fast && !args.keep_going,
    };
    let progress = Progress::new(if args.quiet { Style::Quiet } else { Style::Auto });
    greet(&opened, &options, &progress);
    if opened.survey.files.is_empty() {
        anyhow::bail!(
            "none of the {} files of the campaign can be used",
            opened.campaign.files.len()
        );
    }
    let runner = Runner {
        campaign: &opened.campaign,
        pipeline: &opened.pipeline,
        survey: &opened.survey,
        work: &opened.work,
        store: &opened.store,
        options: &options,
        progress: &progress,
        cancel: program.cancel,
    };
    let report = runner.run()?;
    if args.json {
        out::json(&as_json(&opened, &report))?;
    } else if !args.quiet {
        out::line(&table(&report.stages).text());
    }
    farewell(args, &opened, &report, &progress);
    Ok(report.exit_code)
}

fn limits(args: &Args) -> Result<Limits> {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = args.jobs.unwrap_or(processors);
    if jobs == 0 {
        return Err(Usage("--jobs must be at least 1".to_owned()).into());
    }
    let memory_bytes = match args.memory {
        Some(gigabytes) if gigabytes > 0.0 => (gigabytes * 1e9) as u64,
        Some(given) => {
            return Err(Usage(format!("--memory is {given}; it must be above 0 GB")).into());
        }
        None => memory::available_bytes()
            .map_or(MEMORY_FALLBACK, |free| (free as f64 * MEMORY_SHARE) as u64),
    };
    Ok(Limits { jobs, memory_bytes })
}

fn selection(args: &Args, pipeline: &Pipeline) -> Result<Selection> {
    let position = |name: &str| stage_position(pipeline, name);
    let only = match &args.only {
        None => None,
        Some(text) => {
            let (stage, unit) =
                text.split_once('/').map_or((text.as_str(), None), |(s, u)| (s, Some(u)));
            let unit = unit.map(|unit| unit.parse().map_err(Usage)).transpose()?;
            Some((position(stage)?, unit))
        }
    };
    Ok(Selection {
        first: args.from.as_deref().map(position).transpose()?.unwrap_or(0),
        last: args.until.as_deref().map(position).transpose()?,
        only,
    })
}

/// The position of a stage that the user named.
///
/// # Errors
/// [`Usage`] with the nearest name.
pub fn stage_position(pipeline: &Pipeline, name: &str) -> Result<usize> {
    pipeline.position(name).ok_or_else(|| {
        let names: Vec<&str> = pipeline.stages.iter().map(PipelineStage::name).collect();
        let near =
            nearest(name, names.iter().copied()).map(|near| format!("; did you mean `{near}`?"));
        let hint = near.unwrap_or_else(|| format!("; its stages are {}", names.join(", ")));
        Usage(format!("pipeline `{}` has no stage `{name}`{hint}", pipeline.name)).into()
    })
}

fn greet(opened: &Opened, options: &Options, progress: &Progress) {
    let points: u64 = opened.survey.files.iter().map(|file| file.facts.points).sum();
    progress.note(&format!(
        "{} over {}: {} files, {} points; {} threads, {} of memory",
        opened.pipeline.name,
        opened.campaign.file.name,
        opened.survey.files.len(),
        short(points as f64),
        options.limits.jobs,
        bytes(options.limits.memory_bytes),
    ));
    for lost in &opened.survey.lost {
        progress.warn(&format!("left out: {}: {}", lost.name, lost.error));
    }
}

fn farewell(args: &Args, opened: &Opened, report: &Report, progress: &Progress) {
    let place = args.place.flags();
    let pipeline = opened.pipeline.path.display();
    for failure in report.failures.iter().take(FAILURES_SHOWN) {
        let (stage, unit) = (&failure.stage, &failure.unit);
        progress.warn(&format!("{stage}/{unit}: {}", failure.error.as_deref().unwrap_or("failed")));
        if failure.outcome == Outcome::Failed {
            progress.warn(&format!(
                "    replay: cargo xtask run {pipeline} {place} --only {stage}/{unit}"
            ));
        }
    }
    if report.failures.len() > FAILURES_SHOWN {
        progress.warn(&format!(
            "... and {} more, all in the log",
            report.failures.len() - FAILURES_SHOWN
        ));
    }
    if let Some(stage) = idle(report) {
        progress.warn(&format!(
            "nothing to do in `{stage}`: the scans hold no point that can be used; {} says why",
            report.log.display()
        ));
    }
    if report.interrupted {
        progress.warn(&format!(
            "interrupted; what is finished is kept. Go on with: cargo xtask run {pipeline} {place}"
        ));
    }
    let verdict = match report.exit_code {
        DONE => "done",
        LOSSES => "finished with losses",
        _ => "failed",
    };
    progress.note(&format!("{verdict} in {}", duration(report.seconds)));
    progress.note(&format!("outputs: {}", opened.work.outputs().display()));
    progress.note(&format!("log:     {}", report.log.display()));
}

/// The stage that had no unit in a run that came to nothing, if all before it went well.
fn idle(report: &Report) -> Option<&str> {
    let ended = report.exit_code != DONE && !report.interrupted;
    let went_well = |stage: &StageSummary| {
        let bad = [Outcome::Failed, Outcome::Blocked, Outcome::NotRun];
        !stage.units.is_empty() && bad.iter().all(|outcome| stage.count(*outcome) == 0)
    };
    let first = report.stages.iter().find(|stage| !went_well(stage));
    first.filter(|stage| ended && stage.units.is_empty()).map(|stage| stage.stage.as_str())
}

/// The stages of a run as a table.
#[must_use]
pub fn table(stages: &[StageSummary]) -> Table {
    let mut table = Table::new(&[
        "stage",
        "done",
        "up to date",
        "failed",
        "blocked",
        "time",
        "points/s",
        "peak memory",
        "warnings",
    ]);
    for stage in stages {
        let count = |outcome| stage.count(outcome);
        let ran = count(Outcome::Done) + count(Outcome::Failed) > 0;
        let when_ran = |text: String| if ran { text } else { "-".to_owned() };
        table.row([
            stage.stage.clone(),
            count(Outcome::Done).to_string(),
            (count(Outcome::Cached) + count(Outcome::Reused)).to_string(),
            count(Outcome::Failed).to_string(),
            (count(Outcome::Blocked) + count(Outcome::NotRun)).to_string(),
            when_ran(duration(stage.seconds)),
            when_ran(stage.points_per_second().map_or("-".to_owned(), short)),
            when_ran(stage.peak_rss_bytes.map_or("-".to_owned(), bytes)),
            stage.warnings.to_string(),
        ]);
    }
    table
}

fn as_json(opened: &Opened, report: &Report) -> serde_json::Value {
    let lost =
        opened.survey.lost.iter().map(|lost| json!({ "name": lost.name, "error": lost.error }));
    json!({
        "run": report.id,
        "exit_code": report.exit_code,
        "interrupted": report.interrupted,
        "seconds": report.seconds,
        "stages": report.stages,
        "failures": report.failures,
        "lost_files": lost.collect::<Vec<_>>(),
        "outputs": opened.work.outputs(),
        "log": report.log,
    })
}

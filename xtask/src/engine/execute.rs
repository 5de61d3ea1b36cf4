//! Runs a pipeline over a campaign, stage by stage.

use super::lock::UnitLock;
use super::plan::{Made, Progressed, Standing, UnitPlan, plan_stage, targets};
use super::progress::Progress;
use super::runlog::{Event, FileRecord, Outcome, RunLog, StageRecord, StageSummary, UnitRecord};
use super::schedule::{self, Limits};
use super::store::{Found, Known, Store, verify};
use super::survey::Survey;
use super::workdir::WorkDir;
use super::{memory, panics};
use crate::config::{Campaign, Pipeline, PipelineStage};
use anyhow::Result;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};
use timberline_artefact::UnitId;
use timberline_artefact::stage::{Cancelled, Context, Inputs, StageError};

/// A corrupt input is rebuilt by going through the stages again; no store is that broken.
const MAX_PASSES: usize = 3;
/// How often the progress of a running unit is looked at.
const WATCH_EVERY: Duration = Duration::from_millis(500);

/// Which part of a pipeline to run.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// First stage to run; what comes before must be in the store.
    pub first: usize,
    /// Last stage to run; the pipeline's last if `None`.
    pub last: Option<usize>,
    /// Nothing but this stage, or one unit of it, and that even if the store has it.
    pub only: Option<(usize, Option<UnitId>)>,
}

impl Selection {
    fn last(&self, pipeline: &Pipeline) -> usize {
        let end = pipeline.stages.len() - 1;
        self.only.as_ref().map_or(self.last.unwrap_or(end), |(stage, _)| *stage)
    }

    fn is_active(&self, position: usize, unit: &UnitId) -> bool {
        match &self.only {
            Some((stage, only)) => {
                *stage == position && only.as_ref().is_none_or(|only| only == unit)
            }
            None => position >= self.first,
        }
    }
}

/// How to run.
#[derive(Debug, Clone)]
pub struct Options {
    /// Threads and memory.
    pub limits: Limits,
    /// Which part.
    pub selection: Selection,
    /// Stop at the first failure.
    pub fail_fast: bool,
}

/// What came of a run.
#[derive(Debug, Clone)]
pub struct Report {
    /// Name of the run.
    pub id: String,
    /// Its log.
    pub log: PathBuf,
    /// The stages.
    pub stages: Vec<StageSummary>,
    /// Units that failed.
    pub failures: Vec<UnitRecord>,
    /// Wall time in seconds.
    pub seconds: f64,
    /// Whether it was interrupted.
    pub interrupted: bool,
    /// 0 done, 1 failed, 3 finished with losses.
    pub exit_code: u8,
}

/// A run in the making.
pub struct Runner<'a> {
    /// The campaign.
    pub campaign: &'a Campaign,
    /// The pipeline.
    pub pipeline: &'a Pipeline,
    /// Its raw files.
    pub survey: &'a Survey,
    /// Its workspace, entered.
    pub work: &'a WorkDir,
    /// The store in it.
    pub store: &'a Store,
    /// How.
    pub options: &'a Options,
    /// What the user sees.
    pub progress: &'a Progress,
    /// Set from outside to end the run early.
    pub cancel: &'a AtomicBool,
}

/// What came of a unit.
struct Ended {
    outcome: Outcome,
    seconds: f64,
    known: Known,
    error: Option<String>,
    log: Vec<String>,
}

impl Ended {
    /// A unit that this run did not run.
    fn without_running(outcome: Outcome, known: Known, error: Option<String>) -> Self {
        Self { outcome, seconds: 0.0, known, error, log: Vec::new() }
    }
}

impl Runner<'_> {
    /// Runs.
    ///
    /// # Errors
    /// When the run as a whole is impossible; units that fail are in the report.
    pub fn run(&self) -> Result<Report> {
        let begun = Instant::now();
        let log = RunLog::begin(&self.work.runs())?;
        self.log_start(&log);
        let failed_fast = AtomicBool::new(false);
        let (mut stages, mut failures) = (Vec::new(), Vec::new());
        for pass in 1..=MAX_PASSES {
            let run = Pass {
                runner: self,
                log: &log,
                again: AtomicBool::new(false),
                failed_fast: &failed_fast,
            };
            (stages, failures) = run.stages()?;
            self.store.save();
            let again = run.again.into_inner() && pass < MAX_PASSES;
            if !again || self.stopped() {
                break;
            }
            self.progress.warn(
                "an artefact was found corrupt while it was read: rebuilding it and what failed",
            );
        }
        let interrupted = self.stopped() && !failed_fast.into_inner();
        let exit_code = self.exit_code(&stages, interrupted);
        let seconds = begun.elapsed().as_secs_f64();
        log.write(&Event::End { time: super::runlog::now(), seconds, exit_code, interrupted });
        let log_path = log.path().to_owned();
        Ok(Report { id: log.id, log: log_path, stages, failures, seconds, interrupted, exit_code })
    }

    fn stopped(&self) -> bool {
        self.cancel.load(Ordering::SeqCst)
    }

    fn log_start(&self, log: &RunLog) {
        let stage = |stage: &PipelineStage| StageRecord {
            name: stage.name().to_owned(),
            version: stage.stage.info().version,
            params: stage.params.clone(),
        };
        let files = self.survey.files.iter().map(|file| FileRecord {
            name: file.raw.name.clone(),
            bytes: file.bytes,
            hash: file.hash.clone(),
        });
        log.write(&Event::Start {
            time: super::runlog::now(),
            tool_version: env!("CARGO_PKG_VERSION").to_owned(),
            campaign: absolute(&self.campaign.folder),
            pipeline: absolute(&self.pipeline.path),
            jobs: self.options.limits.jobs,
            memory_bytes: self.options.limits.memory_bytes,
            stages: self.pipeline.stages.iter().map(stage).collect(),
            files: files.collect(),
        });
        for lost in &self.survey.lost {
            log.write(&Event::LostFile { name: lost.name.clone(), error: lost.error.clone() });
        }
    }

    fn exit_code(&self, stages: &[StageSummary], interrupted: bool) -> u8 {
        let bad = |stage: &StageSummary| {
            [Outcome::Failed, Outcome::Blocked, Outcome::NotRun].iter().any(|o| stage.count(*o) > 0)
        };
        let good = |stage: &StageSummary| {
            [Outcome::Done, Outcome::Cached, Outcome::Reused].iter().any(|o| stage.count(*o) > 0)
        };
        if interrupted || !stages.last().is_some_and(good) {
            1
        } else if stages.iter().any(bad) || !self.survey.lost.is_empty() {
            3
        } else {
            0
        }
    }
}

/// One way through the stages.
struct Pass<'a> {
    runner: &'a Runner<'a>,
    log: &'a RunLog,
    again: AtomicBool,
    failed_fast: &'a AtomicBool,
}

impl Pass<'_> {
    fn stages(&self) -> Result<(Vec<StageSummary>, Vec<UnitRecord>)> {
        let runner = self.runner;
        let (mut before, mut summaries, mut failures) = (Progressed::new(), Vec::new(), Vec::new());
        for position in 0..=runner.options.selection.last(runner.pipeline) {
            let plans = plan_stage(runner.pipeline, position, runner.survey, runner.store, &before)
                .map_err(anyhow::Error::msg)?;
            let (made, summary, mut failed) = self.stage(position, &plans);
            before.push(made);
            failures.append(&mut failed);
            summaries.push(summary);
        }
        Ok((summaries, failures))
    }

    fn stage(
        &self,
        position: usize,
        plans: &[UnitPlan],
    ) -> (BTreeMap<UnitId, Made>, StageSummary, Vec<UnitRecord>) {
        let stage = &self.runner.pipeline.stages[position];
        let to_run: Vec<&UnitPlan> =
            plans.iter().filter(|plan| self.must_run(position, plan)).collect();
        let kept = plans.iter().filter(|plan| plan.is_whole()).count().saturating_sub(to_run.len());
        self.announce(stage, &to_run, kept);
        let begun = Instant::now();
        memory::reset_peak();
        let ran = self.run_units(stage, &to_run);
        let mut summary = StageSummary {
            stage: stage.name().to_owned(),
            seconds: begun.elapsed().as_secs_f64(),
            ..StageSummary::default()
        };
        summary.peak_rss_bytes = memory::peak_bytes();
        let mut ran: BTreeMap<&UnitId, Ended> =
            to_run.iter().map(|plan| plan.unit()).zip(ran).collect();
        let (mut made, mut failed) = (BTreeMap::new(), Vec::new());
        for plan in plans {
            let ended = ran.remove(plan.unit()).or_else(|| self.not_run(position, plan));
            let Some(ended) = ended else {
                made.insert(plan.unit().clone(), made_of(plan, None));
                continue;
            };
            self.count(&mut summary, plan, &ended);
            made.insert(plan.unit().clone(), made_of(plan, Some(&ended)));
            if ended.error.is_some() {
                failed.push(record(plan, &ended));
            }
        }
        self.log.write(&Event::Stage(summary.clone()));
        self.runner.progress.end(&summary);
        self.tell_file_warnings(stage, plans, &made);
        self.runner.store.save();
        (made, summary, failed)
    }

    /// What was noticed about raw files (missing CRS, normalised heights) concerns the whole run.
    fn tell_file_warnings(
        &self,
        stage: &PipelineStage,
        plans: &[UnitPlan],
        made: &BTreeMap<UnitId, Made>,
    ) {
        let ready = |plan: &&UnitPlan| {
            let standing = made.get(plan.unit()).map(|made| made.standing);
            plan.raw.is_some() && standing == Some(Standing::Ready)
        };
        for plan in plans.iter().filter(ready) {
            let path = targets(self.runner.store, stage, plan).into_iter().next();
            let header = path.and_then(|path| timberline_artefact::read_header(&path).ok());
            for warning in header.iter().flat_map(|header| &header.warnings) {
                self.runner.progress.note(&format!("  {}: {}", warning.subject, warning.message));
            }
        }
    }

    fn must_run(&self, position: usize, plan: &UnitPlan) -> bool {
        let selection = &self.runner.options.selection;
        let wanted = selection.only.is_some() || !plan.is_whole();
        wanted
            && plan.absent.is_empty()
            && !plan.files_missing()
            && selection.is_active(position, plan.unit())
    }

    fn announce(&self, stage: &PipelineStage, to_run: &[&UnitPlan], kept: usize) {
        let progress = self.runner.progress;
        for plan in to_run {
            if let Found::Corrupt { path, error } = &plan.found {
                let error = error.strip_prefix(&format!("{}: ", path.display())).unwrap_or(error);
                progress.warn(&format!(
                    "{}: {error}; rebuilding {}/{}",
                    path.display(),
                    stage.name(),
                    plan.unit()
                ));
                self.log.write(&Event::Corrupt { path: path.clone(), error: error.to_owned() });
            }
            if !plan.losses.is_empty() {
                progress.warn(&format!(
                    "{}/{} goes on without {}",
                    stage.name(),
                    plan.unit(),
                    plan.losses.join(", ")
                ));
            }
            if plan.memory_bytes > self.runner.options.limits.memory_bytes {
                let (need, have) = (
                    super::progress::bytes(plan.memory_bytes),
                    super::progress::bytes(self.runner.options.limits.memory_bytes),
                );
                progress.warn(&format!(
                    "{}/{} may need {need}, more than the budget of {have}: it runs alone",
                    stage.name(),
                    plan.unit()
                ));
            }
        }
        progress.begin(stage.name(), to_run.len(), kept);
    }

    fn run_units(&self, stage: &PipelineStage, to_run: &[&UnitPlan]) -> Vec<Ended> {
        let limits = self.runner.options.limits;
        let done = schedule::run(
            to_run,
            limits,
            self.runner.cancel,
            |plan| plan.memory_bytes,
            |plan| {
                let ended = self.unit(stage, plan);
                self.log.write(&Event::Unit(record(plan, &ended)));
                self.runner.progress.unit(&plan.unit().to_string(), plan.points);
                ended
            },
        );
        let not_begun = || Ended::without_running(Outcome::NotRun, Known::default(), None);
        done.into_iter().map(|ended| ended.unwrap_or_else(not_begun)).collect()
    }

    /// A unit that this run does not run: in the store, or without what it reads.
    fn not_run(&self, position: usize, plan: &UnitPlan) -> Option<Ended> {
        let selection = &self.runner.options.selection;
        let ended = match &plan.found {
            Found::Whole(known) => Ended::without_running(Outcome::Cached, known.clone(), None),
            _ if !selection.is_active(position, plan.unit()) => return None,
            _ => {
                let absent = match plan.absent.is_empty() {
                    true => "anything that it reads".to_owned(),
                    false => plan.absent.join(", "),
                };
                let error = format!("not there: {absent}");
                Ended::without_running(Outcome::Blocked, Known::default(), Some(error))
            }
        };
        self.log.write(&Event::Unit(record(plan, &ended)));
        Some(ended)
    }

    fn count(&self, summary: &mut StageSummary, plan: &UnitPlan, ended: &Ended) {
        *summary.units.entry(ended.outcome).or_default() += 1;
        if ended.outcome == Outcome::Done {
            summary.points += plan.points;
            summary.warnings += ended.known.warnings;
        }
    }

    /// Runs one unit under its lock.
    fn unit(&self, stage: &PipelineStage, plan: &UnitPlan) -> Ended {
        let begun = Instant::now();
        let (runner, info) = (self.runner, stage.stage.info());
        let lock = UnitLock::acquire(&runner.work.lock(info.name, &plan.unit().file_stem()));
        let force = runner.options.selection.only.is_some();
        let failed = |error| (Outcome::Failed, Known::default(), Some(error));
        let found = || runner.store.find(&info, plan.unit(), &plan.task.key);
        let mut log = Vec::new();
        let (outcome, known, error) = match (&lock, force) {
            (Err(error), _) => failed(format!("no lock: {error}")),
            (Ok(_), false) if let Found::Whole(known) = found() => (Outcome::Reused, known, None),
            (Ok(_), _) => {
                let (result, said) = self.attempt(stage, plan);
                log = said;
                self.judge(stage, plan, result)
            }
        };
        Ended { outcome, seconds: begun.elapsed().as_secs_f64(), known, error, log }
    }

    fn judge(
        &self,
        stage: &PipelineStage,
        plan: &UnitPlan,
        result: Result<(), StageError>,
    ) -> (Outcome, Known, Option<String>) {
        let (runner, info) = (self.runner, stage.stage.info());
        let failed = |error| (Outcome::Failed, Known::default(), Some(error));
        match result {
            Ok(()) => match runner.store.find(&info, plan.unit(), &plan.task.key) {
                Found::Whole(known) => (Outcome::Done, known, None),
                Found::Missing => failed("its artefacts vanished".to_owned()),
                Found::Corrupt { error, .. } => failed(error),
            },
            Err(error)
                if runner.stopped() && chain(error.as_ref()).contains(&Cancelled.to_string()) =>
            {
                (Outcome::NotRun, Known::default(), None)
            }
            Err(error) => {
                self.look_for_corruption(plan);
                if runner.options.fail_fast {
                    self.failed_fast.store(true, Ordering::SeqCst);
                    runner.cancel.store(true, Ordering::SeqCst);
                }
                let text = chain(error.as_ref());
                runner.progress.warn(&format!("{}/{} failed: {text}", info.name, plan.unit()));
                failed(text)
            }
        }
    }

    /// Runs the stage; second, what was said for the log.
    fn attempt(
        &self,
        stage: &PipelineStage,
        plan: &UnitPlan,
    ) -> (Result<(), StageError>, Vec<String>) {
        let runner = self.runner;
        let inputs = Inputs::new(plan.unit().clone(), plan.raw.clone(), plan.files.clone());
        let outputs = runner.work.outputs();
        let context = Context::new(
            &plan.task,
            &runner.survey.campaign,
            runner.store.folder(),
            &outputs,
            runner.cancel,
        );
        let context = context.with_files(stage.files.clone());
        let task = || {
            let run = || stage.stage.run(&stage.params, &inputs, &context);
            watched(runner.progress, plan, || context.progress(), run)
        };
        let ran = catch_unwind(AssertUnwindSafe(task))
            .unwrap_or_else(|payload| Err(panics::describe(&*payload).into()));
        let log = context.take_log();
        let publish = || {
            check_named(plan)?;
            context.publish(stage.stage.info().outputs)?;
            Ok(())
        };
        (ran.and_then(|()| publish()), log)
    }

    /// Whether a unit failed because something it read was damaged after it was checked.
    fn look_for_corruption(&self, plan: &UnitPlan) {
        for file in &plan.files {
            if let Err(error) = verify(&file.path) {
                self.runner.store.doubt(&file.path);
                self.log.write(&Event::Corrupt { path: file.path.clone(), error });
                self.again.store(true, Ordering::SeqCst);
            }
        }
    }
}

/// The key was made from the files as they were before the unit ran.
fn check_named(plan: &UnitPlan) -> Result<(), StageError> {
    match plan.named.iter().find(|named| !named.is_unchanged()) {
        None => Ok(()),
        Some(named) => {
            Err(format!("{} was changed meanwhile; run again", named.path.display()).into())
        }
    }
}

impl UnitPlan {
    /// Whether nothing of what a campaign stage reads is there.
    fn files_missing(&self) -> bool {
        self.raw.is_none() && self.files.is_empty()
    }
}

fn made_of(plan: &UnitPlan, ended: Option<&Ended>) -> Made {
    let there = ended
        .filter(|ended| matches!(ended.outcome, Outcome::Done | Outcome::Cached | Outcome::Reused));
    Made {
        key: plan.task.key.clone(),
        standing: if there.is_some() { Standing::Ready } else { Standing::Absent },
        points: there.map_or(0, |ended| ended.known.points),
        parts: there.map(|ended| ended.known.parts.clone()).unwrap_or_default(),
        trees: there.map(|ended| ended.known.trees.clone()).unwrap_or_default(),
    }
}

fn record(plan: &UnitPlan, ended: &Ended) -> UnitRecord {
    let raw = plan.raw.iter().map(|raw| raw.path.clone());
    let inputs = raw.chain(plan.files.iter().map(|file| file.path.clone()));
    UnitRecord {
        stage: plan.task.stage.clone(),
        unit: plan.unit().to_string(),
        key: plan.task.key.clone(),
        outcome: ended.outcome,
        seconds: ended.seconds,
        points: plan.points,
        warnings: ended.known.warnings,
        error: ended.error.clone(),
        inputs: if ended.error.is_some() { inputs.collect() } else { Vec::new() },
        log: ended.log.clone(),
    }
}

/// Runs a task while another thread shows how far it is.
fn watched<R>(
    progress: &Progress,
    plan: &UnitPlan,
    worked_off: impl Fn() -> u64 + Sync,
    run: impl FnOnce() -> R,
) -> R {
    let (done, end) = (Mutex::new(false), Condvar::new());
    let unit = plan.unit().to_string();
    let watch = || {
        let mut ended = done.lock().unwrap_or_else(PoisonError::into_inner);
        while !*ended {
            let waited =
                end.wait_timeout(ended, WATCH_EVERY).unwrap_or_else(PoisonError::into_inner);
            ended = waited.0;
            if !*ended {
                progress.inside(&unit, worked_off() as f64 / plan.points.max(1) as f64);
            }
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(watch);
        // Whatever becomes of the task, also a panic, the watch must end.
        let _ending = Ending { done: &done, end: &end };
        run()
    })
}

struct Ending<'a> {
    done: &'a Mutex<bool>,
    end: &'a Condvar,
}

impl Drop for Ending<'_> {
    fn drop(&mut self) {
        *self.done.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.end.notify_all();
    }
}

fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// An error with its causes, those that only repeat it left out.
fn chain(error: &(dyn std::error::Error + 'static)) -> String {
    let mut text = error.to_string();
    let mut next = error.source();
    while let Some(cause) = next {
        let words = cause.to_string();
        if !text.contains(&words) {
            text = format!("{text}: {words}");
        }
        next = cause.source();
    }
    text
}

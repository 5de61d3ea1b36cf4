//! What the user sees while a run goes on: bars on a terminal, plain lines elsewhere. All on stderr.

use super::runlog::{Outcome, StageSummary};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::collections::BTreeMap;
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Plain lines come no more often than this within a stage.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// How much to say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Bars when stderr is a terminal, lines otherwise.
    Auto,
    /// Only what went wrong.
    Quiet,
}

/// The reporter of a run.
#[derive(Debug)]
pub struct Progress {
    style: Style,
    bars: bool,
    stage: Mutex<Option<Current>>,
}

#[derive(Debug)]
struct Current {
    name: String,
    total: usize,
    done: usize,
    points: u64,
    /// How far units are that run, as a share of their points.
    inside: BTreeMap<String, f64>,
    begun: Instant,
    last_line: Instant,
    bar: ProgressBar,
}

/// Steps of a bar for each unit, so that it moves while a long unit runs.
const STEPS: f64 = 1000.0;

impl Current {
    /// Units done, those that run in part.
    fn units(&self) -> f64 {
        self.done as f64 + self.inside.values().sum::<f64>()
    }

    fn words(&self) -> String {
        let seconds = self.begun.elapsed().as_secs_f64().max(1e-3);
        let counts = match self.total {
            1 => format!("{:.0} %", 100.0 * self.units().min(1.0)),
            total => format!("{}/{total}", self.done),
        };
        match self.points {
            0 => counts,
            points => format!("{counts}, {} points/s", short(points as f64 / seconds)),
        }
    }
}

impl Progress {
    /// A reporter.
    #[must_use]
    pub fn new(style: Style) -> Self {
        Self { style, bars: std::io::stderr().is_terminal(), stage: Mutex::new(None) }
    }

    /// A stage begins: so many units to run.
    pub fn begin(&self, name: &str, to_run: usize, cached: usize) {
        let bar = self.bar(name, to_run);
        let now = Instant::now();
        let current = Current {
            name: name.to_owned(),
            total: to_run,
            done: 0,
            points: 0,
            inside: BTreeMap::new(),
            begun: now,
            last_line: now,
            bar,
        };
        current.bar.set_message(current.words());
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = Some(current);
        if !self.bars && self.style == Style::Auto && to_run > 0 {
            let kept = if cached > 0 { format!(", {cached} up to date") } else { String::new() };
            self.note(&format!("{name}: {} to run{kept}", units(to_run)));
        }
    }

    fn bar(&self, name: &str, total: usize) -> ProgressBar {
        if !self.bars || self.style == Style::Quiet || total == 0 {
            return ProgressBar::hidden();
        }
        let bar = ProgressBar::with_draw_target(
            Some(total as u64 * STEPS as u64),
            ProgressDrawTarget::stderr(),
        );
        let template = "{prefix:>14} {bar:30} {msg}, {elapsed}, ETA {eta}";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_prefix(name.to_owned());
        bar.enable_steady_tick(Duration::from_millis(200));
        bar
    }

    /// A unit that runs has worked off this share of its points.
    pub fn inside(&self, unit: &str, share: f64) {
        self.change(|current| {
            current.inside.insert(unit.to_owned(), share.clamp(0.0, 0.99));
        });
    }

    /// A unit has ended.
    pub fn unit(&self, unit: &str, points: u64) {
        self.change(|current| {
            current.inside.remove(unit);
            current.done += 1;
            current.points += points;
        });
    }

    fn change(&self, change: impl FnOnce(&mut Current)) {
        let mut guard = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(current) = guard.as_mut() else { return };
        change(current);
        current.bar.set_message(current.words());
        current.bar.set_position((current.units() * STEPS) as u64);
        let silent = self.bars || self.style == Style::Quiet;
        let finished = current.done == current.total;
        if silent || finished || current.last_line.elapsed() < LINE_EVERY {
            return;
        }
        current.last_line = Instant::now();
        let (units, total) = (current.units(), current.total as f64);
        let left = match units > 0.0 {
            true => duration(current.begun.elapsed().as_secs_f64() / units * (total - units)),
            false => "unknown time".to_owned(),
        };
        let line = format!("{}: {}, about {left} left", current.name, current.words());
        drop(guard);
        self.note(&line);
    }

    /// A stage has ended.
    pub fn end(&self, summary: &StageSummary) {
        if let Some(current) = self.stage.lock().unwrap_or_else(PoisonError::into_inner).take() {
            current.bar.finish_and_clear();
        }
        if self.style == Style::Auto {
            self.note(&stage_line(summary));
        }
    }

    /// A line of talk.
    pub fn note(&self, text: &str) {
        if self.style == Style::Auto {
            self.print(text);
        }
    }

    /// A line that is shown even when quiet.
    pub fn warn(&self, text: &str) {
        self.print(text);
    }

    fn print(&self, text: &str) {
        let write = || {
            // Nobody can be told when stderr itself is gone.
            let _ = writeln!(std::io::stderr(), "{text}");
        };
        match self.stage.try_lock().ok().as_deref() {
            Some(Some(current)) => current.bar.suspend(write),
            _ => write(),
        }
    }
}

fn stage_line(summary: &StageSummary) -> String {
    let some = |outcome, word: &str| match summary.count(outcome) {
        0 => None,
        count => Some(format!("{count} {word}")),
    };
    let parts = [
        some(Outcome::Done, "done"),
        some(Outcome::Cached, "up to date"),
        some(Outcome::Reused, "made by another process"),
        some(Outcome::Failed, "FAILED"),
        some(Outcome::Blocked, "blocked"),
        some(Outcome::NotRun, "not run"),
    ];
    let units: Vec<String> = parts.into_iter().flatten().collect();
    let units = if units.is_empty() { "nothing to do".to_owned() } else { units.join(", ") };
    let time = match summary.count(Outcome::Done) {
        0 => String::new(),
        _ => format!(" in {}", duration(summary.seconds)),
    };
    format!("{}: {units}{time}", summary.stage)
}

/// `1 unit`, `3 units`.
#[must_use]
pub fn units(count: usize) -> String {
    if count == 1 { "1 unit".to_owned() } else { format!("{count} units") }
}

/// A count with a suffix: `1.2 M`.
#[must_use]
pub fn short(value: f64) -> String {
    match value {
        v if v >= 1e9 => format!("{:.1} G", v / 1e9),
        v if v >= 1e6 => format!("{:.1} M", v / 1e6),
        v if v >= 1e4 => format!("{:.0} k", v / 1e3),
        v => format!("{v:.0}"),
    }
}

/// Bytes: `1.5 GB`, `320 MB`.
#[must_use]
pub fn bytes(value: u64) -> String {
    match value as f64 {
        v if v >= 1e9 => format!("{:.1} GB", v / 1e9),
        v if v >= 1e6 => format!("{:.0} MB", v / 1e6),
        v if v >= 1e3 => format!("{:.0} kB", v / 1e3),
        v => format!("{v} B"),
    }
}

/// Seconds: `0.4 s`, `3 min 20 s`, `2 h 5 min`.
#[must_use]
pub fn duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..10 => format!("{seconds:.1} s"),
        10..60 => format!("{whole} s"),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_for_numbers() {
        assert_eq!(
            (duration(0.44), duration(200.0), duration(7500.0)),
            ("0.4 s".into(), "3 min 20 s".into(), "2 h 5 min".into())
        );
        assert_eq!(
            (bytes(1_500_000_000), bytes(999), short(1_234_567.0)),
            ("1.5 GB".into(), "999 B".into(), "1.2 M".into())
        );
    }

    #[test]
    fn a_stage_in_a_line() {
        let units = [(Outcome::Done, 3), (Outcome::Failed, 1)].into();
        let summary =
            StageSummary { stage: "dtm".into(), units, seconds: 1.0, ..StageSummary::default() };
        assert_eq!(stage_line(&summary), "dtm: 3 done, 1 FAILED in 1.0 s");
    }
}

//! `runs/<id>.jsonl`: what ran, when, how long, with what result. One JSON object a line.

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// What became of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Outcome {
    /// It ran.
    Done,
    /// The store had it.
    Cached,
    /// Another process made it meanwhile.
    Reused,
    /// It failed.
    Failed,
    /// Something it reads is missing because that failed.
    Blocked,
    /// The run was interrupted before it began.
    NotRun,
}

/// A stage as it was configured.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StageRecord {
    /// Name.
    pub name: String,
    /// Version.
    pub version: u32,
    /// Effective parameters.
    pub params: serde_json::Value,
}

/// A raw file as it was.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FileRecord {
    /// Name in the campaign.
    pub name: String,
    /// Size.
    pub bytes: u64,
    /// Hash of the contents.
    pub hash: String,
}

/// One unit of one stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UnitRecord {
    /// Stage.
    pub stage: String,
    /// Unit.
    pub unit: String,
    /// Key.
    pub key: String,
    /// What became of it.
    pub outcome: Outcome,
    /// Wall time.
    pub seconds: f64,
    /// Points read.
    pub points: u64,
    /// Number of warnings in the artefact.
    pub warnings: usize,
    /// Why it failed or was blocked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Files it read, given where it failed, so that it can be replayed.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub inputs: Vec<PathBuf>,
    /// What programs said that the unit called.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub log: Vec<String>,
}

/// A finished stage.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StageSummary {
    /// Stage.
    pub stage: String,
    /// Units by outcome.
    pub units: BTreeMap<Outcome, usize>,
    /// Wall time.
    pub seconds: f64,
    /// Points of the units that ran.
    pub points: u64,
    /// Largest resident memory while it ran, bytes.
    pub peak_rss_bytes: Option<u64>,
    /// Warnings in the artefacts that were made.
    pub warnings: usize,
}

impl StageSummary {
    /// Units of an outcome.
    #[must_use]
    pub fn count(&self, outcome: Outcome) -> usize {
        self.units.get(&outcome).copied().unwrap_or(0)
    }

    /// Points a second over the units that ran.
    #[must_use]
    pub fn points_per_second(&self) -> Option<f64> {
        (self.points > 0 && self.seconds > 0.0).then(|| self.points as f64 / self.seconds)
    }
}

/// A line of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// First line.
    Start {
        /// Time, UTC.
        time: String,
        /// Version of the program.
        tool_version: String,
        /// Campaign folder.
        campaign: PathBuf,
        /// Pipeline file.
        pipeline: PathBuf,
        /// Worker threads.
        jobs: usize,
        /// Memory budget, bytes.
        memory_bytes: u64,
        /// Stages and parameters.
        stages: Vec<StageRecord>,
        /// Raw files.
        files: Vec<FileRecord>,
    },
    /// A raw file that cannot be used.
    LostFile {
        /// Name in the campaign.
        name: String,
        /// Why.
        error: String,
    },
    /// An artefact that was found corrupt.
    Corrupt {
        /// File.
        path: PathBuf,
        /// What is wrong.
        error: String,
    },
    /// A unit.
    Unit(UnitRecord),
    /// A stage's end.
    Stage(StageSummary),
    /// Last line; missing when the process was killed.
    End {
        /// Time, UTC.
        time: String,
        /// Wall time of the run.
        seconds: f64,
        /// Exit code.
        exit_code: u8,
        /// Whether it was interrupted.
        interrupted: bool,
    },
}

/// The log being written.
#[derive(Debug)]
pub struct RunLog {
    /// Its name.
    pub id: String,
    path: PathBuf,
    file: Mutex<File>,
}

impl RunLog {
    /// Begins the log of a run in a folder.
    ///
    /// # Errors
    /// When the file cannot be made.
    pub fn begin(runs: &Path) -> Result<Self> {
        let id = format!("{}-{}", now().replace(['-', ':'], ""), std::process::id());
        let path = runs.join(format!("{id}.jsonl"));
        let open = OpenOptions::new().create_new(true).append(true).open(&path);
        let file = open.with_context(|| format!("cannot write {}", path.display()))?;
        Ok(Self { id, path, file: Mutex::new(file) })
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a line.
    pub fn write(&self, event: &Event) {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let line = serde_json::to_string(event).map_err(std::io::Error::other);
        let written = line.and_then(|line| file.write_all(format!("{line}\n").as_bytes()));
        if let Err(error) = written {
            tracing::warn!("{}: {error}", self.path.display());
        }
    }
}

/// Names of the runs in a folder, oldest first.
#[must_use]
pub fn list(runs: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(runs).into_iter().flatten().filter_map(Result::ok);
    let name = |entry: std::fs::DirEntry| {
        entry.file_name().to_str()?.strip_suffix(".jsonl").map(str::to_owned)
    };
    let mut names: Vec<String> = entries.filter_map(name).collect();
    names.sort();
    names
}

/// Reads a log. A last line that was cut off by a kill is passed over.
///
/// # Errors
/// When there is no such run.
pub fn read(runs: &Path, id: &str) -> Result<Vec<Event>> {
    let path = runs.join(format!("{id}.jsonl"));
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("there is no run `{id}` in {}", runs.display()))?;
    Ok(text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect())
}

/// The time as `2026-05-01T12:30:00Z`.
#[must_use]
#[expect(clippy::disallowed_methods, reason = "the run log is what may know the time")]
pub fn now() -> String {
    stamp(SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO).as_secs())
}

/// Seconds since 1970 as a date and time, by Hinnant's `civil_from_days`
/// (howardhinnant.github.io/date_algorithms.html).
fn stamp(seconds: u64) -> String {
    let (days, rest) = ((seconds / 86_400) as i64, seconds % 86_400);
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let doe = z.rem_euclid(146_097);
    let yoe = (doe - doe / 1460 + doe / 36_524 - doe / 146_096) / 365;
    let doy = doe - (365 * yoe + yoe / 4 - yoe / 100);
    let mp = (5 * doy + 2) / 153;
    let day = doy - (153 * mp + 2) / 5 + 1;
    let month = if mp < 10 { mp + 3 } else { mp - 9 };
    let year = yoe + era * 400 + i64::from(month <= 2);
    let (hour, minute, second) = (rest / 3600, rest / 60 % 60, rest % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates() {
        assert_eq!(stamp(0), "1970-01-01T00:00:00Z");
        assert_eq!(stamp(951_827_696), "2000-02-29T12:34:56Z");
        assert_eq!(stamp(4_107_542_399), "2100-02-28T23:59:59Z");
    }

    #[test]
    fn a_cut_off_line_is_passed_over() {
        let folder = tempfile::tempdir().unwrap();
        let log = RunLog::begin(folder.path()).unwrap();
        let event = Event::LostFile { name: "a.laz".into(), error: "empty".into() };
        log.write(&event);
        log.file.lock().unwrap().write_all(b"{\"event\":\"unit\",\"st").unwrap();
        assert_eq!(list(folder.path()), std::slice::from_ref(&log.id));
        assert_eq!(read(folder.path(), &log.id).unwrap(), [event]);
    }
}

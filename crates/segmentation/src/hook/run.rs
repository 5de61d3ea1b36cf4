//! Runs a program within its limits.

use super::family::Family;
use super::said::{Stream, short};
use super::{Failure, Program, give};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// What a program may take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Wall time.
    pub time: Duration,
    /// Resident memory of the program and all it starts, bytes. Held where the system tells it
    /// (Linux).
    pub memory_bytes: u64,
}

impl Limits {
    /// Limits in seconds and millions of bytes.
    #[must_use]
    pub fn new(time_s: u32, memory_mb: u32) -> Self {
        let time = Duration::from_secs(time_s.into());
        Self { time, memory_bytes: u64::from(memory_mb) * MB }
    }
}

/// How often a program is looked at: soon at first, for short ones.
const FIRST_LOOK: Duration = Duration::from_millis(2);
const LOOK_EVERY: Duration = Duration::from_millis(50);
const MB: u64 = 1_000_000;

/// Why a program was not left to end by itself.
enum Stop {
    Cancelled,
    Time,
    Memory(u64),
}

/// Runs a program until it has ended, with everything it started.
pub(super) fn run(
    program: &Program<'_>,
    cancelled: &dyn Fn() -> bool,
    log: &mut dyn FnMut(String),
) -> Result<(), Failure> {
    let begun = Instant::now();
    let mut family = Family::start(&mut command(program)).map_err(|source| Failure::Start {
        title: program.title.to_owned(),
        program: program.command.first().cloned().unwrap_or_default(),
        source,
    })?;
    let stdout = family.child().stdout.take().map(Stream::read);
    let stderr = family.child().stderr.take().map(Stream::read);
    let mut peak = 0;
    let watched = watch(&mut family, program.limits, cancelled, begun, &mut peak);
    let status = family.end();
    let [stdout, stderr] = [stdout, stderr].map(|stream| stream.map_or(String::new(), Stream::end));
    let failed = Failure::io(program.folder, "watch the program in");
    let (stop, status) = match (watched, status) {
        (Ok(stop), Ok(status)) => (stop, status),
        (Err(error), _) | (_, Err(error)) => return Err(failed(error)),
    };
    log(report(program, &status, begun.elapsed(), peak, [&stdout, &stderr]));
    judge(program, stop, status, short(&stderr))
}

fn command(program: &Program<'_>) -> Command {
    let mut words = program.command.iter();
    let mut command = Command::new(words.next().map_or("", String::as_str));
    command.args(words);
    command.arg("--points").arg(program.folder.join(give::POINTS));
    command.arg("--tops").arg(program.folder.join(give::TOPS));
    command.arg("--out").arg(program.folder.join("out"));
    command.envs(program.environment.iter().map(|(name, value)| (name, value)));
    command.current_dir(program.folder);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

/// Waits for the end of a program, or for a reason to end it.
fn watch(
    family: &mut Family,
    limits: Limits,
    cancelled: &dyn Fn() -> bool,
    begun: Instant,
    peak: &mut u64,
) -> std::io::Result<Option<Stop>> {
    let mut pause = FIRST_LOOK;
    loop {
        // Asked first, so that a program that has just ended still counts with what it took.
        let memory = family.memory_bytes().unwrap_or(0);
        *peak = memory.max(*peak);
        if family.has_ended()? {
            return Ok(None);
        }
        if cancelled() {
            return Ok(Some(Stop::Cancelled));
        }
        if memory > limits.memory_bytes {
            return Ok(Some(Stop::Memory(memory)));
        }
        let left = limits.time.saturating_sub(begun.elapsed());
        if left.is_zero() {
            return Ok(Some(Stop::Time));
        }
        std::thread::sleep(pause.min(left));
        pause = (pause * 2).min(LOOK_EVERY);
    }
}

fn judge(
    program: &Program<'_>,
    stop: Option<Stop>,
    status: ExitStatus,
    tail: String,
) -> Result<(), Failure> {
    let title = program.title.to_owned();
    let limits = program.limits;
    match stop {
        None if status.success() => Ok(()),
        None => Err(Failure::Status { title, status: status.to_string(), tail }),
        Some(Stop::Cancelled) => Err(Failure::Cancelled),
        Some(Stop::Time) => Err(Failure::Time { title, limit_s: limits.time.as_secs_f64(), tail }),
        Some(Stop::Memory(used)) => Err(Failure::Memory {
            title,
            used_mb: used.div_ceil(MB),
            limit_mb: limits.memory_bytes / MB,
            tail,
        }),
    }
}

/// What goes into the log of the run.
fn report(
    program: &Program<'_>,
    status: &ExitStatus,
    took: Duration,
    peak: u64,
    [stdout, stderr]: [&str; 2],
) -> String {
    let mut text = format!(
        "`{}` ended with {status} after {:.1} s, at most {} MB of memory",
        program.title,
        took.as_secs_f64(),
        peak.div_ceil(MB)
    );
    for (name, said) in [("stdout", stdout), ("stderr", stderr)] {
        if !said.is_empty() {
            text.push_str(&format!("\n{name}:\n{}", said.trim_end()));
        }
    }
    text
}

//! Other people's solvers, through `tests/oracle/solve.py`.
//!
//! The environment variable `TIMBERLINE_ORACLE` names a Python interpreter that has the packages of
//! `.ci/requirements.txt`.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test may stop at what it did not expect"
)]

use super::problems::Case;
use serde::Deserialize;
use std::path::Path;
use std::process::{Command, Stdio};

/// What a solver answered.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct Answer {
    pub(crate) seed: u64,
    pub(crate) status: String,
    pub(crate) objective: Option<f64>,
    pub(crate) bound: Option<f64>,
    pub(crate) nodes: f64,
    pub(crate) seconds: f64,
}

/// How to ask.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Asking {
    /// Seconds for one problem.
    pub(crate) limit_s: f64,
    /// Solve so often; the fastest counts.
    pub(crate) repeat: usize,
    /// Problems at a time.
    pub(crate) jobs: usize,
}

/// The interpreter.
pub(crate) fn python() -> Option<String> {
    std::env::var("TIMBERLINE_ORACLE").ok().filter(|name| !name.is_empty())
}

/// Lets a solver answer all cases, in their order.
pub(crate) fn ask(solver: &str, cases: &[Case], asking: Asking) -> Vec<Answer> {
    let python = python().expect("TIMBERLINE_ORACLE names no Python interpreter");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle/solve.py");
    let folder = tempfile::tempdir().unwrap();
    let problems = folder.path().join("problems.jsonl");
    let lines: Vec<String> = cases.iter().map(Case::json).collect();
    std::fs::write(&problems, lines.join("\n") + "\n").unwrap();
    let output = Command::new(python)
        .arg(script)
        .arg(solver)
        .arg(&problems)
        .args(["--limit", &asking.limit_s.to_string()])
        .args(["--repeat", &asking.repeat.to_string()])
        .args(["--jobs", &asking.jobs.to_string()])
        .stderr(Stdio::inherit())
        .output()
        .unwrap();
    assert!(output.status.success(), "{solver}: {}", output.status);
    let text = String::from_utf8(output.stdout).unwrap();
    let answers: Vec<Answer> =
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(answers.len(), cases.len(), "{solver} left problems out");
    answers
}

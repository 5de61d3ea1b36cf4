//! What can go wrong with a program and its answer.

use std::path::{Path, PathBuf};

/// Why a program's segmentation cannot be used. Every variant says what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// The system refused a file or a folder.
    #[error("{path}: cannot {action}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The points could not be written for the program.
    #[error("{path}: cannot write the points: {detail}")]
    Give {
        /// The file.
        path: PathBuf,
        /// Why.
        detail: String,
    },
    /// The program did not start.
    #[error(
        "cannot start `{program}` (command `{title}`): {source}; install it, or give its path from \
         the pipeline file's folder and make it executable"
    )]
    Start {
        /// The command as the user wrote it.
        title: String,
        /// What was to be started.
        program: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// It ended by itself, but not well.
    #[error("`{title}` failed with {status}{tail}")]
    Status {
        /// The command.
        title: String,
        /// Exit status or signal, in words.
        status: String,
        /// The end of what it wrote to stderr.
        tail: String,
    },
    /// It took too long and was killed.
    #[error(
        "`{title}` was killed after {limit_s} s; raise `command_time_limit_s` or give it smaller \
         tiles{tail}"
    )]
    Time {
        /// The command.
        title: String,
        /// The limit.
        limit_s: f64,
        /// The end of what it wrote to stderr.
        tail: String,
    },
    /// It took too much memory and was killed.
    #[error(
        "`{title}` was killed for using {used_mb} MB of memory, more than {limit_mb} MB; raise \
         `command_memory_limit_mb` or give it smaller tiles{tail}"
    )]
    Memory {
        /// The command.
        title: String,
        /// What it and its children used.
        used_mb: u64,
        /// The limit.
        limit_mb: u64,
        /// The end of what it wrote to stderr.
        tail: String,
    },
    /// The run is to end.
    #[error("stopped on request")]
    Cancelled,
    /// It left no answer.
    #[error(
        "the program left neither out.laz nor out.csv; it must write `<--out>.laz` or `<--out>.csv`"
    )]
    NoOutput,
    /// It left two answers.
    #[error("the program left both out.laz and out.csv; it must write one of them")]
    TwoOutputs,
    /// The answer is not in the form it should be.
    #[error("{file}: {detail}")]
    Unreadable {
        /// The file's name.
        file: &'static str,
        /// What is wrong, and what it should be.
        detail: String,
    },
    /// There are more or fewer points than in the question.
    #[error(
        "{file} has {found} {what}, in.laz has {expected} points; give every point a tree id, 0 for none"
    )]
    Count {
        /// The file's name.
        file: &'static str,
        /// What is counted: `rows`, `points`.
        what: &'static str,
        /// Number of points given.
        expected: u64,
        /// Number returned.
        found: u64,
    },
    /// A row or record is wrong.
    #[error("{file}, {place}: {detail}")]
    Record {
        /// The file's name.
        file: &'static str,
        /// Where: `line 7`, `record 12 (from 0)`.
        place: String,
        /// What is wrong, with the value, and what it should be.
        detail: String,
    },
}

impl Failure {
    /// Wraps a system error with the file and what was tried.
    pub(super) fn io(path: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, action, source }
    }

    /// A tree that does not exist.
    pub(super) fn foreign(file: &'static str, place: String, id: impl std::fmt::Display) -> Self {
        let detail = format!(
            "tree id {id} is not in tops.csv; only ids given there, and 0 for no tree, are allowed"
        );
        Self::Record { file, place, detail }
    }
}

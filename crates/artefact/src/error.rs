//! The crate's one error enum.

use std::path::PathBuf;

/// What can go wrong with an artefact. Every variant names the file and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused.
    #[error("{path}: cannot {action}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, as a verb: `read`, `write`, `rename`.
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The file is no artefact of this program.
    #[error("{path}: not a Timberline artefact ({found}); give a file from the store of a run")]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What its first bytes look like.
        found: String,
    },
    /// The bytes changed after they were written.
    #[error("{path}: corrupt at {place}: {detail}; the next run rebuilds it")]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// Which part: `header`, `payload`, `trailer`, `chunk 7`.
        place: String,
        /// What does not fit, with expected and found values.
        detail: String,
    },
    /// Another kind was asked for.
    #[error("{path}: holds `{found}`, expected `{expected}`")]
    WrongKind {
        /// The file.
        path: PathBuf,
        /// Kind asked for.
        expected: String,
        /// Kind found.
        found: String,
    },
    /// Written by another version of the program.
    #[error(
        "{path}: `{what}` version {found}, this program reads version {}; \
         run the pipeline again to rebuild it, or use the program version that wrote it",
        listed(supported)
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Kind or container.
        what: String,
        /// Version in the file.
        found: u32,
        /// Versions this program reads, ascending.
        supported: &'static [u32],
    },
    /// A value cannot be written as this kind.
    #[error("cannot encode `{kind}`: {detail}")]
    Encode {
        /// The kind.
        kind: &'static str,
        /// What does not fit.
        detail: String,
    },
    /// A stage asked for an input that it was not given.
    #[error("stage input `{kind}` of {unit} is missing; the stage must declare it")]
    MissingInput {
        /// Kind asked for.
        kind: String,
        /// The unit.
        unit: String,
    },
    /// A stage did not write exactly the kinds it declares.
    #[error("stage `{stage}` wrote {written:?} but declares {declared:?}")]
    Undeclared {
        /// The stage.
        stage: String,
        /// Kinds it declares, sorted.
        declared: Vec<&'static str>,
        /// Kinds it wrote, sorted.
        written: Vec<&'static str>,
    },
    /// Two artefacts that describe the same points do not have the same number of values.
    #[error("`{kind}` of {unit} has {found} values for {expected} points")]
    Misaligned {
        /// The kind of the column.
        kind: &'static str,
        /// The unit.
        unit: String,
        /// Number of points.
        expected: usize,
        /// Number of values.
        found: usize,
    },
    /// Columns that do not fit together.
    #[error(transparent)]
    Points(#[from] timberline_pointcloud::Error),
}

/// Versions in a row: `1`, `1 or 2`, `1, 2 or 3`.
fn listed(versions: &[u32]) -> String {
    let words: Vec<String> = versions.iter().map(u32::to_string).collect();
    match words.split_last() {
        Some((last, first)) if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => words.concat(),
    }
}

impl Error {
    /// Wraps a system error with the file and what was tried.
    pub fn io(path: &std::path::Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, action, source }
    }

    /// A corruption found at a place.
    #[must_use]
    pub fn corrupt(path: &std::path::Path, place: &str, detail: impl Into<String>) -> Self {
        Self::Corrupt { path: path.to_path_buf(), place: place.to_owned(), detail: detail.into() }
    }

    /// Whether rebuilding the file is the remedy (as opposed to the disk or the user being at fault).
    #[must_use]
    pub fn is_rebuildable(&self) -> bool {
        matches!(
            self,
            Self::Foreign { .. }
                | Self::Corrupt { .. }
                | Self::WrongKind { .. }
                | Self::Version { .. }
        )
    }
}

//! The crate's one error enum.

use std::path::{Path, PathBuf};

/// What can go wrong while writing results. Every variant names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused.
    #[error("{path}: cannot {action}: {source}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, as a verb.
        action: &'static str,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A table could not be written.
    #[error("{path}: cannot write the table: {source}")]
    Csv {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: csv::Error,
    },
    /// SQLite refused a GeoPackage or a scratch table.
    #[error("{path}: SQLite: {source}")]
    Sqlite {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: rusqlite::Error,
    },
    /// A raster could not be written.
    #[error("{path}: cannot write the raster: {source}")]
    Tiff {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: tiff::TiffError,
    },
    /// A point file could not be written.
    #[error("{path}: cannot write points: {source}")]
    Las {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: las::Error,
    },
    /// A coordinate does not fit into the 32 bits that LAS has for it.
    #[error(
        "{path}: coordinate {value} of axis {axis} is too far from the offset {offset} for a scale \
         of {scale}; write with a coarser scale"
    )]
    CoordinateRange {
        /// The file.
        path: PathBuf,
        /// `x`, `y` or `z`.
        axis: char,
        /// The coordinate in the units of the CRS.
        value: f64,
        /// Offset of the file.
        offset: f64,
        /// Scale of the file.
        scale: f64,
    },
    /// A value that the chosen LAS version has no room for.
    #[error(
        "{path}: {field} {value} does not fit LAS 1.{minor} point format {format} (at most {limit}); \
         write LAS 1.4"
    )]
    FieldRange {
        /// The file.
        path: PathBuf,
        /// Name of the field.
        field: &'static str,
        /// The value.
        value: u8,
        /// Largest value there is room for.
        limit: u8,
        /// Minor version.
        minor: u8,
        /// Point format.
        format: u8,
    },
    /// An extra dimension whose name LAS cannot hold.
    #[error("extra dimension `{name}` is longer than 32 bytes or empty")]
    DimensionName {
        /// The name.
        name: String,
    },
    /// Points that do not have the columns announced when the file was begun.
    #[error("{path}: extra dimension `{name}` is {found}, the file was begun with {expected}")]
    DimensionType {
        /// The file.
        path: PathBuf,
        /// The dimension.
        name: String,
        /// Type announced.
        expected: &'static str,
        /// Type found.
        found: &'static str,
    },
    /// A raster without cells, or with more than a file can hold.
    #[error("a raster of {columns} x {rows} cells cannot be written")]
    RasterSize {
        /// Columns.
        columns: u64,
        /// Rows.
        rows: u64,
    },
    /// A row in the scratch table is not what was put there.
    #[error("{path}: scratch row of tree {id} cannot be read back: {detail}")]
    Scratch {
        /// The file.
        path: PathBuf,
        /// The tree.
        id: u64,
        /// What does not fit.
        detail: String,
    },
    /// Two trees with one id.
    #[error("tree id {id} occurs twice; apexes closer than 0.1 m must not occur")]
    DuplicateTree {
        /// The id.
        id: u64,
    },
    /// A recording for viewers could not be made.
    #[error("the MCAP recording of a tree cannot be written: {0}")]
    Recording(String),
    /// An artefact could not be read or an output not be published.
    #[error(transparent)]
    Artefact(#[from] timberline_artefact::Error),
    /// Columns that do not fit together.
    #[error(transparent)]
    Points(#[from] timberline_pointcloud::Error),
}

impl Error {
    /// Wraps a system error with the file and what was tried.
    pub(crate) fn io(
        path: &Path,
        action: &'static str,
    ) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path = path.to_path_buf();
        move |source| Self::Io { path, action, source }
    }

    /// Wraps SQLite's error with the file.
    pub(crate) fn sqlite(path: &Path) -> impl Fn(rusqlite::Error) -> Self + use<> {
        let path = path.to_path_buf();
        move |source| Self::Sqlite { path: path.clone(), source }
    }

    /// Wraps the TIFF encoder's error with the file.
    pub(crate) fn tiff(path: &Path) -> impl Fn(tiff::TiffError) -> Self + use<> {
        let path = path.to_path_buf();
        move |source| Self::Tiff { path: path.clone(), source }
    }

    /// Wraps the LAS encoder's error with the file.
    pub(crate) fn las(path: &Path) -> impl Fn(las::Error) -> Self + use<> {
        let path = path.to_path_buf();
        move |source| Self::Las { path: path.clone(), source }
    }
}

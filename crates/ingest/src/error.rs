//! The crate's one error enum.

use std::path::{Path, PathBuf};

/// Why a file cannot be taken in. Every message names the place, the value found and a remedy;
/// [`Error::File`] adds the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file and what is wrong with it.
    #[error("{}: {cause}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        cause: Box<Error>,
    },
    /// The operating system refused.
    #[error("cannot read {place}: {source}; check that the file is complete and readable")]
    Io {
        /// What was being read.
        place: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Some other kind of file, told by its contents.
    #[error(
        "this is {found}, not a point cloud as LAS, LAZ, COPC, E57, PLY, PCD or text; convert it to \
         one of them, or leave it out of the campaign's inputs"
    )]
    Foreign {
        /// What the contents look like.
        found: String,
    },
    /// Something that cannot be right in a file of another format than LAS.
    #[error("{place}: {problem}; {remedy}")]
    Content {
        /// Where: a line, record or byte.
        place: String,
        /// What was found and what was expected.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A field of the public header block that cannot be right.
    #[error("header field `{field}` (byte {offset}) is {value}, expected {expected}; {remedy}")]
    Header {
        /// Name of the field in the LAS specification.
        field: &'static str,
        /// Where it stands in the file.
        offset: u64,
        /// The value found.
        value: String,
        /// What would do.
        expected: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A variable length record without which the points cannot be read.
    #[error("record `{record}` (byte {offset}): {problem}; {remedy}")]
    Record {
        /// User id and record id.
        record: String,
        /// Where its data stand in the file.
        offset: u64,
        /// What is wrong.
        problem: String,
        /// What to do.
        remedy: &'static str,
    },
    /// Points are missing or cannot be decompressed.
    #[error(
        "{place}: {problem}; {readable} of {expected} points can be read; get the file again from \
         its supplier, or set `damaged = \"keep\"` to use the points that can be read"
    )]
    Damaged {
        /// Where the first damage is.
        place: String,
        /// What is wrong there.
        problem: String,
        /// Number of points that can be read.
        readable: u64,
        /// Number of points the header promises.
        expected: u64,
    },
    /// All points lie where no point can be.
    #[error(
        "all {points} points lie beyond what coordinates can be (the header's bounds begin at \
         {:.0}, {:.0}, {:.0}; the limit is 67,108 km, in elevation 200 km); the scale or the offset \
         in the header (bytes 131 to 178) is wrong: repair it or get the file again",
        bounds[0], bounds[1], bounds[2]
    )]
    Nowhere {
        /// Number of points.
        points: u64,
        /// Smallest coordinates stated, in the units of the file.
        bounds: [f64; 3],
    },
    /// No point has coordinates that can be used (formats other than LAS).
    #[error(
        "none of {points} points has coordinates that can be used ({first}; the limit is 67,108 km, \
         in elevation 200 km); check which columns are x, y and z, and their unit"
    )]
    NoPlace {
        /// Number of points.
        points: u64,
        /// The first of them with its value.
        first: String,
    },
    /// Longitude and latitude.
    #[error(
        "the coordinate reference system `{name}` is {what}; reproject the file to a projected \
         system in metres or feet (for example its UTM zone) and add that file instead"
    )]
    NotProjected {
        /// Name of the system.
        name: String,
        /// `geographic (degrees)` or `geocentric`.
        what: &'static str,
    },
    /// A unit of length that is not known.
    #[error(
        "{place}: unit of length `{unit}` is not known; set `{param}` to metre, \
         international-foot or us-survey-foot"
    )]
    Unit {
        /// Where the unit is given.
        place: String,
        /// The unit as given.
        unit: String,
        /// The parameter that overrides it.
        param: &'static str,
    },
    /// The store's copy of the points is not what was written.
    #[error("shards of {tile}: {problem}; remove the artefact, the next run rebuilds it")]
    Shard {
        /// The tile.
        tile: String,
        /// What does not fit.
        problem: String,
    },
    /// Parameters that contradict each other.
    #[error("{0}")]
    Params(String),
    /// Columns that do not fit together.
    #[error(transparent)]
    Points(#[from] timberline_pointcloud::Error),
}

impl Error {
    /// Names the file an error is about (once).
    #[must_use]
    pub fn in_file(self, path: &Path) -> Self {
        match self {
            Self::File { .. } => self,
            cause => Self::File { path: path.to_path_buf(), cause: Box::new(cause) },
        }
    }

    /// Wraps a system error with what was being read.
    pub(crate) fn io(place: impl Into<String>) -> impl FnOnce(std::io::Error) -> Self {
        let place = place.into();
        move |source| Self::Io { place, source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_named_once() {
        let error = Error::Foreign { found: "a PNG image".into() }.in_file(Path::new("a.las"));
        let text = error.in_file(Path::new("b.las")).to_string();
        assert!(text.starts_with("a.las: this is a PNG image"), "{text}");
    }
}

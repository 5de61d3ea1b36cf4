//! The crate's one error enum.

use std::path::PathBuf;

/// What can go wrong while drawing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A picture could not be written.
    #[error("{path}: cannot write the picture: {source}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: image::ImageError,
    },
    /// A picture could not be turned into a file.
    #[error("the picture cannot be encoded: {0}")]
    Encode(image::ImageError),
    /// The font that comes with the program cannot be read.
    #[error("the built-in font cannot be read: {0}")]
    Font(#[from] ab_glyph::InvalidFont),
    /// There is nothing to draw.
    #[error("nothing to draw: {0}")]
    Empty(&'static str),
    /// An artefact could not be read or an output not be published.
    #[error(transparent)]
    Artefact(#[from] timberline_artefact::Error),
    /// A chart that could not be laid out.
    #[error("the chart cannot be drawn: {0}")]
    Chart(String),
}

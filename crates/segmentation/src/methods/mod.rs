//! The segmenters.

pub mod dalponte;
pub mod li;
pub mod ncut;
pub mod raster;
pub mod segments;
pub mod silva;
pub mod starsac;
pub mod surface;
pub mod watershed;

pub use li::{Li, LiParams};
pub use ncut::{Ncut, NcutParams};
pub use raster::{RasterSegmenter, Seed};
pub use segments::Segments;
pub use starsac::StarSac;

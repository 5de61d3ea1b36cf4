//! The segmenters.

pub mod dalponte;
pub mod raster;
pub mod silva;
pub mod starsac;
pub mod watershed;

pub use raster::{RasterSegmenter, Seed};
pub use starsac::StarSac;

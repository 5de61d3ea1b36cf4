//! The segmenters.

pub mod starsac;

pub use starsac::StarSac;

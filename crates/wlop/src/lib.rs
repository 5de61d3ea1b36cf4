//! Consolidation.

pub mod error;
pub mod operator;

pub use error::Error;

//! Consolidation.

pub mod consolidate;
mod eigen;
pub mod error;
pub mod local;
pub mod operator;
pub mod params;
mod restore;
pub mod stage;
pub mod stem;
pub mod surface;
pub mod thin;

pub use consolidate::{Consolidated, Effect, Skipped, Tree, consolidate};
pub use error::Error;
pub use params::{ConsolidationParams, Method};

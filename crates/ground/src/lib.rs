//! Ground classification, the Hardy multiquadric terrain model and heights above ground.

pub mod cells;
pub mod classify;
pub mod coverage;
pub mod dense;
pub mod error;
pub mod hardy;
pub mod loo;
pub mod nodes;
pub mod params;
pub mod patch;
mod projection;
pub mod ptd;
pub mod quadtree;
mod rim;
pub mod stage;
pub mod surface;
pub mod tin;
pub mod tuning;

pub use classify::{Label, classify};
pub use error::Error;
pub use hardy::{Hardy, Kernel, Sample, Trend};
pub use nodes::Nodes;
pub use params::{DtmParams, GroundParams, Returns, Source, Tuning};
pub use surface::Surface;

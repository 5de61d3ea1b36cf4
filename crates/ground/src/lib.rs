//! Ground classification, the Hardy multiquadric terrain model and heights above ground.

pub mod dense;
pub mod error;
pub mod hardy;
pub mod loo;
pub mod nodes;
pub mod params;
pub mod patch;
mod projection;
pub mod quadtree;
pub mod surface;
pub mod tuning;

pub use error::Error;
pub use hardy::{Hardy, Kernel, Sample, Trend};
pub use nodes::Nodes;
pub use params::{DtmParams, Tuning};
pub use surface::Surface;

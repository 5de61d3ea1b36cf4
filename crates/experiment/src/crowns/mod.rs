//! Positions of trees from their crowns: methods compared.

pub mod cluster;
pub mod compare;
pub mod dataset;
pub mod plan;
mod plot;
pub mod segment;

pub use cluster::{Cluster, Extent};
pub use compare::{Comparison, Outcome, Row, compare};
pub use dataset::{DatasetParams, Growth, SegmentErrors, generate};
pub use plan::{Bounds, Family, Setting};

//! Positions of trees from their crowns: methods compared.

pub mod cluster;
pub mod dataset;
mod plot;
pub mod segment;

pub use cluster::{Cluster, Extent};
pub use dataset::{DatasetParams, SegmentErrors, Tops, generate};

//! Trees in terrestrial scans: where stems stand, and which points are whose.
//!
//! * [`slices`] cuts the lower stem space into horizontal slices and their points into clusters,
//!   [`disc`] finds a stem's cross-section in a cluster, [`chain`] follows cross-sections from slice
//!   to slice to a stem, [`grounded`] leaves out steep branches.
//! * [`voxels`] thins a plot to the voxels of a lattice that is fixed in the world, [`graph`] links
//!   them to their neighbours, [`paths`] gives every voxel to the stem with the cheapest way to it.
//! * [`space`] puts these together; [`wood`] tells wood from leaves.
//!
//! Nothing here depends on the order of points, on tiles, or on where the world's origin lies.

pub mod chain;
pub mod disc;
pub mod error;
pub mod graph;
pub mod grounded;
mod joined;
pub mod params;
pub mod paths;
pub mod shown_ground;
pub mod slices;
pub mod space;
pub mod stage;
pub mod voxels;
pub mod wood;

pub use chain::StemAxis;
pub use disc::Disc;
pub use error::Error;
pub use params::{StemsParams, TreeCloudParams};
pub use space::{Space, Tree, trees};
pub use voxels::Voxels;

//! Cylinder models of trees (quantitative structure models): robust fits along every branch that has
//! the points, radii that taper, diameters, volumes and distances.
//!
//! A skeleton says how a tree branches; the points as scanned say how thick it is. [`model_tree`] takes
//! the skeleton apart into branches ([`branches`]), cuts them into sections ([`sections`]), gives every
//! point to a section ([`assign`]) and fits a cylinder to each ([`mod@fit`], [`measure`]). Radii along a
//! branch never rise towards the tip ([`radii`], [`monotone`]); where nothing can be measured, they
//! follow the tree's own pipe model ([`pipe`]). Every cylinder says what its radius rests on and how
//! uncertain it is. [`choose`] decides between two skeletons of one tree.
//!
//! ```
//! use timberline_qsm::{Params, SkeletonNode, TreePoints, model_tree};
//! // A post of 20 cm in diameter, 3 m high.
//! let points: Vec<[f64; 3]> = (0..3000)
//!     .map(|i| {
//!         let (sin, cos) = libm::sincos(f64::from(i) * 2.4);
//!         [0.1 * cos, 0.1 * sin, f64::from(i) * 1e-3]
//!     })
//!     .collect();
//! let node = |z, parent| SkeletonNode { position_m: [0.03, 0.0, z], parent, radius_m: 0.2 };
//! let skeleton = [node(0.0, None), node(1.5, Some(0)), node(3.0, Some(1))];
//! let tree = TreePoints { points_m: &points, wood: None, base_m: [0.0; 3], dbh_m: None };
//! let found = model_tree(&tree, &skeleton, &Params::default())?;
//! let dbh = found.metrics.dbh.ok_or("no diameter")?;
//! assert!((dbh.diameter_m - 0.2).abs() < 0.004);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod assign;
pub mod axis;
pub mod bound;
pub mod branches;
pub mod build;
pub mod choice;
pub mod dbh;
pub mod distances;
mod error;
pub mod fit;
pub mod hull;
pub mod measure;
pub mod metrics;
mod model;
pub mod monotone;
mod params;
pub mod pipe;
pub mod points;
pub mod prune;
pub mod radii;
pub mod sections;
pub mod stage;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use choice::{Choice, choose, model_tree};
pub use error::Error;
pub use model::{
    Model, ModelBranch, ModelCylinder, ModelledTree, RadiusSource, SkeletonNode, TreePoints,
};
pub use params::{Method, Params};

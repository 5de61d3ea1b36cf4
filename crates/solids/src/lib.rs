//! Cylinders, triangle meshes and tubes: exact distances, volumes, surfaces.
//!
//! This crate touches no file and knows no forest. Positions are `[f64; 3]` in metres, in any one frame.
//!
//! * [`Cylinder`], [`CylinderIndex`], [`MeshIndex`]: exact distances, also to very many.
//! * [`tubes`]: smooth closed tubes along branches; [`closed`]: one closed surface around all of them.
//! * [`sampling`]: positions spread evenly over surfaces.
//! * [`DistanceSummary`]: many distances in five numbers.
//!
//! ```
//! use timberline_solids::{Cylinder, CylinderIndex};
//! let post = Cylinder { start_m: [0.0; 3], end_m: [0.0, 0.0, 2.0], radius_m: 0.25 };
//! assert_eq!(post.distance_m([1.0, 0.0, 1.0]), 0.75);
//! assert_eq!(CylinderIndex::new(&[post]).nearest([0.0, 0.0, 3.0]), Some((0, 1.0)));
//! ```

mod bvh;
pub mod closed;
mod cylinder;
mod cylinder_index;
mod mesh;
mod mesh_index;
pub mod sampling;
mod summary;
pub mod tubes;
pub mod vector;

pub use cylinder::{Cylinder, Ends, free_ends};
pub use cylinder_index::CylinderIndex;
pub use mesh::Mesh;
pub use mesh_index::{MeshIndex, nearest_on};
pub use summary::{DistanceSummary, quantile_sorted};

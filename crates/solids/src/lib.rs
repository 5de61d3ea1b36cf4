//! Cylinders, triangle meshes and tubes: exact distances, volumes, surfaces.
//!
//! This crate touches no file and knows no forest. Positions are `[f64; 3]` in metres, in any one frame.
//!
//! ```
//! use timberline_solids::{Cylinder, CylinderIndex};
//! let post = Cylinder { start_m: [0.0; 3], end_m: [0.0, 0.0, 2.0], radius_m: 0.25 };
//! assert_eq!(post.distance_m([1.0, 0.0, 1.0]), 0.75);
//! assert_eq!(CylinderIndex::new(&[post]).nearest([0.0, 0.0, 3.0]), Some((0, 1.0)));
//! ```

mod bvh;
mod cylinder;
mod cylinder_index;
mod summary;
pub mod vector;

pub use cylinder::{Cylinder, Ends, free_ends};
pub use cylinder_index::CylinderIndex;
pub use summary::{DistanceSummary, quantile_sorted};

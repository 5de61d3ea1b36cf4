//! A tree's position by a surface over its crown.
//!
//! After Polewski et al., L1-norm fitting of elliptic paraboloids with prior information for
//! enhanced coniferous tree localization in ALS point clouds. The crown is thinned to the highest
//! point of each planimetric cell ([`thin`]); a [`Method`] finds the position. [`L1`] is the one to
//! use; [`L2`], [`HullCentroid`], [`HighestPoint`] and [`StarSac`] are there to be compared with.
//!
//! Every optimum comes with a bound that no other surface beats ([`Certificate`]), and what is
//! remarkable about a crown is told ([`Flag`]): most degenerate input is "solved" by any solver
//! without complaint.
//!
//! ```
//! use timberline_crowns::surface::{L1, Method, Paraboloid, Prior, Problem, Shape};
//! let shape =
//!     Shape { centre: [0.3, -0.2], apex_z_m: 21.0, semiaxes_m: [1.1, 0.9], azimuth: 0.4 };
//! let truth = Paraboloid::from_shape(&shape);
//! let cells: Vec<[f64; 3]> = (0..64)
//!     .map(|i| (f64::from(i % 8) * 0.5 - 1.75, f64::from(i / 8) * 0.5 - 1.75))
//!     .map(|(x, y)| [x, y, truth.z(x, y)])
//!     .collect();
//! let prior = Prior { centre: [0.0, 0.0], half_width_m: 0.5 };
//! let fit = L1 { omega: 0.5, ..L1::default() }.fit(&Problem::new(&cells).with_prior(prior))?;
//! assert!((fit.position[0] - 0.3).abs() < 1e-6 && (fit.position[1] + 0.2).abs() < 1e-6);
//! assert!(fit.flags.is_empty());
//! # Ok::<(), timberline_crowns::Error>(())
//! ```

mod baseline;
mod bounds;
mod clarabel;
mod dense;
mod dual;
mod engine;
mod extent;
mod formulate;
mod interior;
mod l1;
mod l2;
mod method;
mod paraboloid;
mod problem;
mod program;
mod rank;
#[cfg(test)]
mod samples;
mod scale;
mod search;
mod thinning;
mod uncertainty;
mod vertex;

pub use baseline::{HighestPoint, HullCentroid, StarSac};
pub use bounds::AxisBounds;
pub use engine::Engine;
pub use l1::L1;
pub use l2::{Axes, L2};
pub use method::{Certificate, Fit, Flag, Method, Surface};
pub use paraboloid::{Paraboloid, Shape};
pub use problem::{Prior, Problem};
pub use thinning::thin;
pub use uncertainty::Uncertainty;

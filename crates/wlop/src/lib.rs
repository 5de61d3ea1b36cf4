//! Consolidation: the points of one tree moved onto the surface that they suggest.
//!
//! * [`operator`] is weighted locally optimal projection (Huang et al. 2009; Lipman et al. 2007) for any
//!   points and radii.
//! * [`local`] finds the spacing of points and the radius of the branch around every point, and from
//!   them the radius of the operator; [`stem`] tells stem from rest; [`thin`] chooses what is kept.
//! * [`consolidate`](consolidate()) does all of it, measures by [`surface`] what was gained, and puts points
//!   back where the surface would move away from them.
//! * [`stage`] makes it a stage of a pipeline; nothing else here touches an artefact.
//!
//! Results are the same byte for byte whatever the order of points and the number of threads. DBH and
//! radii of trunks are to be fitted to the points as they were.
//!
//! ```
//! use timberline_wlop::{ConsolidationParams, Skipped, Tree, consolidate};
//! let points = [[0.0, 0.0, 0.0], [0.1, 0.0, 1.0], [0.0, 0.1, 2.0]];
//! let tree = Tree { points_m: &points, base_m: [0.0; 3], dbh_m: None };
//! let done = consolidate(&tree, &ConsolidationParams::default())?;
//! assert_eq!(done.skipped, Some(Skipped::FewPoints { found: 3, least: 200 }));
//! # Ok::<(), timberline_wlop::Error>(())
//! ```

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

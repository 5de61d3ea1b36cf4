//! Branching skeletons of single trees.
//!
//! * [`skeleton`](skeleton()) makes one from points by either method of [`SkeletonParams`].
//! * [`levels`] is the default: sections between level sets of the distance from the base, each as
//!   long as its branch is thick, centred by robust circles where points lie on an arc.
//! * [`adtree`] are the steps and constants of AdTree (Du et al. 2019), radii included.
//! * [`graph`] and [`paths`] are what both stand on: Delaunay, nearest neighbours, the exact
//!   Euclidean spanning tree, shortest paths.
//! * [`stage`] makes a stage of a pipeline; nothing else here touches an artefact.
//!
//! Points may come in any order and may repeat; inside they are in one order along a space-filling
//! curve, rounded to a micrometre relative to whole metres. The same points therefore give the same
//! skeleton bit for bit, shuffled, moved by whole metres, or with another number of threads.
//!
//! ```
//! use timberline_skeleton::{SkeletonParams, skeleton};
//! let pole: Vec<[f64; 3]> = (0..600)
//!     .map(|i| {
//!         let (turn, height) = (f64::from(i) * 0.7, f64::from(i) * 0.005);
//!         [0.1 * libm::cos(turn), 0.1 * libm::sin(turn), height]
//!     })
//!     .collect();
//! let found = skeleton(&pole, None, None, &SkeletonParams::default())?;
//! assert_eq!(found.skeleton.branches(), 1);
//! assert!(found.skeleton.nodes.iter().all(|node| node.position_m[0].abs() < 0.03));
//! # Ok::<(), timberline_skeleton::Error>(())
//! ```

pub mod adtree;
mod base;
pub mod cloud;
pub mod error;
pub mod graph;
mod kdtree;
pub mod levels;
pub mod model;
pub mod params;
pub mod paths;
mod radii;
pub mod stage;
mod vector;

pub use error::Error;
pub use model::{GraphKind, Node, Outcome, Report, Skeleton};
pub use params::{Edges, Method, SkeletonParams, Tree};

use cloud::Cloud;

/// The skeleton of one tree.
///
/// `points` are positions in one frame, m, in any order; those with a coordinate that is no finite
/// number are left out and counted. `wood` is how likely each is on wood, 0 to 1. `base_m` is where
/// the stem's axis meets the ground, in the frame of the points; without it the tree begins at its
/// lowest point.
///
/// # Errors
/// [`Error::NoPoints`], [`Error::OnePosition`], [`Error::TooMany`], [`Error::WoodCount`],
/// [`Error::Base`] and [`Error::Parameter`].
pub fn skeleton(
    points: &[[f64; 3]],
    wood: Option<&[f32]>,
    base_m: Option<[f64; 3]>,
    params: &SkeletonParams,
) -> Result<Outcome, Error> {
    if let Some(wrong) = params.check().into_iter().next() {
        return Err(Error::Parameter(wrong));
    }
    if let Some(base) = base_m.filter(|base| base.iter().any(|value| !value.is_finite())) {
        return Err(Error::Base(base));
    }
    let cloud = Cloud::new(points, wood)?;
    let base = base_m.map(|base| cloud.from_given(base));
    Ok(match params.method {
        Method::Levels => levels::skeleton(&cloud, base, params, points.len()),
        Method::Adtree => adtree::skeleton(&cloud, params, points.len()),
    })
}

//! Treetops: candidates for trees, straight from the points, without a canopy height model.
//!
//! Two methods. By **evidence** (the default): a candidate is a point with nothing just above it
//! ([`Params::candidate_radius_m`], [`Params::candidate_gap_m`]), so trees below other crowns have
//! candidates too; what lies around it in rings and bands of elevation ([`mod@evidence`]) gives the
//! probability that it is the top of a tree ([`timberline_boosting`]), and of candidates close to one another the
//! better stands.
//!
//! By **window**: a point is a treetop when no point of its window outranks it. Points are ranked by
//! height above ground or by elevation ([`RankBy`]), equal ones by the canonical order of points, so
//! that every tie is decided the same way in every tile, frame and order of input. The window is a
//! square or a circle of fixed size, or a circle that grows with the height of the point
//! ([`WindowKind`]), and a top must stand out from the crown surface around it (`min_prominence_m`,
//! see [`prominence`]).
//!
//! With either, points without neighbours in space do not take part (`support_points`).
//!
//! * [`Params::default`]: by evidence.
//! * [`Params::by_window`]: window by height, prominence and support, tuned on stands with known trees.
//! * [`Params::paper`]: the 1.5 m square on first returns of Tittmann et al. 2011.
//! * [`Params::fixed_circle`]: what lidR's `lmf(ws)` does (all returns, at least 2 m, diameter `ws`).
//!
//! ```
//! use timberline_pointcloud::{Frame, Point, PointCloud};
//! use timberline_treetops::{Input, Params, find};
//! let mut cloud = PointCloud::new(Frame::new([500_000, 5_000_000, 0]));
//! for (x, z) in [(500_000.0, 12.0), (500_001.0, 14.0), (500_002.0, 11.5), (500_009.0, 9.0)] {
//!     cloud.push_world([x, 5_000_000.0, z], &Point::default());
//! }
//! let height_m: Vec<f32> = cloud.z.iter().map(|&z| z as f32).collect();
//! let tops = find(&Input::new(&cloud, &height_m), &Params::fixed_circle(5.0))?;
//! assert_eq!(tops.iter().map(|top| top.index).collect::<Vec<_>>(), [1, 3]);
//! # Ok::<(), timberline_treetops::Error>(())
//! ```

mod apart;
mod candidates;
mod cells;
mod detect;
mod error;
pub mod evidence;
mod input;
mod maxima;
mod model;
mod params;
pub mod prominence;
pub mod stage;
mod window;

pub use candidates::Candidate;
pub use detect::{Treetop, candidates, find};
pub use error::Error;
pub use input::Input;
pub use params::{Method, Params, RankBy, Returns, WindowKind};

//! Treetops: local maxima of the point cloud, without a canopy height model.
//!
//! A point is a treetop when no point of its window outranks it. Points are ranked by height above
//! ground or by elevation ([`RankBy`]), equal ones by the canonical order of points, so that every
//! tie is decided the same way in every tile, frame and order of input. The window is a square or a
//! circle of fixed size, or a circle that grows with the height of the point ([`WindowKind`]).
//! Two more conditions keep the number of tops right where points are dense or noisy: points without
//! neighbours in space do not take part at all (`support_points`), and a top must stand out from the
//! crown surface around it (`min_prominence_m`, see [`prominence`]).
//!
//! * [`Params::paper`]: the 1.5 m square on first returns of Tittmann et al. 2011.
//! * [`Params::fixed_circle`]: what lidR's `lmf(ws)` does (all returns, at least 2 m, diameter `ws`).
//! * [`Params::default`]: window by height, prominence and support, tuned on stands with known trees.
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

mod cells;
mod detect;
mod error;
mod input;
mod maxima;
mod params;
pub mod prominence;
pub mod stage;
mod window;

pub use detect::{Treetop, find};
pub use error::Error;
pub use input::Input;
pub use params::{Params, RankBy, Returns, WindowKind};

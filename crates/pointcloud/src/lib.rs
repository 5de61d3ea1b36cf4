//! Points in columns, frames, bounds, grids and neighbour search.
//!
//! This crate touches no file and knows no forest. It fixes how positions are represented so that
//! every result downstream is independent of how a campaign is cut into tiles:
//!
//! * World positions lie on a lattice of 0.1 mm ([`frame::TICK_M`]); [`frame::quantise`] puts them there.
//! * A [`Frame`] has an origin of whole metres, so converting a lattice position to a local one and
//!   back is exact in `f64`, and so is the difference of two local positions, *whatever the frame*.
//! * [`order::canonical_order`] is one total order of points in the world: any subset of a campaign
//!   comes in the same sequence, however it was gathered.
//!
//! ```
//! use timberline_pointcloud::{Frame, Point, PointCloud};
//! let mut cloud = PointCloud::new(Frame::new([481_200, 3_813_000, 0]));
//! cloud.push_world([481_278.25, 3_813_010.75, 23.75], &Point::default());
//! assert_eq!(cloud.local(0), [78.25, 10.75, 23.75]);
//! assert_eq!(cloud.world(0), [481_278.25, 3_813_010.75, 23.75]);
//! ```

pub mod bounds;
pub mod closing;
pub mod cloud;
pub mod column;
pub mod error;
pub mod frame;
pub mod grid;
pub mod gridding;
pub mod nearest;
pub mod order;
pub mod sites;
pub mod tiling;
pub mod window;

pub use bounds::{Bounds3, Rect};
pub use cloud::{Point, PointCloud};
pub use column::Column;
pub use error::Error;
pub use frame::Frame;
pub use grid::{Grid2, Grid3};
pub use nearest::{Nearest2, Nearest3};
pub use sites::Footprint;
pub use tiling::{TileGrid, TileId};
pub use window::Window;

//! Ground classification, the Hardy multiquadric terrain model and heights above ground.
//!
//! * [`classify`](classify()) finds ground points block by block: the supplier's classes where they
//!   cover the area, otherwise a coarse-to-fine TIN densification ([`ptd`]) that holds on slopes of 45°.
//! * [`Surface`] interpolates them by multiquadric patches ([`hardy`]) on a world-fixed quadtree
//!   ([`quadtree`]), blended by a partition of unity; offset and smoothing of the kernel are chosen by
//!   leave-one-out errors ([`loo`], [`tuning`]).
//! * [`stage`] makes both stages of a pipeline; nothing else here touches an artefact.
//!
//! Blocks, squares and raster cells lie on lattices fixed in the world and only differences of
//! positions are computed with, so every result is the same bit for bit whatever the tiles, the
//! frame, the order of points and the number of threads. faer is confined to [`dense`], which says
//! what that means on different processors; spade to [`tin`].
//!
//! ```
//! use timberline_ground::{DtmParams, Nodes, Surface};
//! use timberline_pointcloud::Rect;
//! let slope = (0..400).map(|i| {
//!     let (x, y) = (f64::from(i % 20), f64::from(i / 20));
//!     [x, y, 700.0 + 0.5 * x]
//! });
//! let rect = Rect { min: [0.0, 0.0], max: [20.0, 20.0] };
//! let params = DtmParams::default();
//! let surface = Surface::build(&Nodes::new(slope, params.merge_m), rect, &params)?;
//! assert!((surface.at([7.3, 4.1]) - 703.65).abs() < 1e-6);
//! # Ok::<(), timberline_ground::Error>(())
//! ```

pub mod cells;
pub mod classify;
pub mod dense;
pub mod error;
pub mod hardy;
pub mod loo;
pub mod nodes;
pub mod params;
pub mod patch;
mod projection;
pub mod ptd;
pub mod quadtree;
mod rim;
pub mod stage;
pub mod surface;
mod thin;
pub mod tin;
pub mod tuning;

pub use classify::{Label, classify};
pub use error::Error;
pub use hardy::{Hardy, Kernel, Sample, Trend};
pub use nodes::Nodes;
pub use params::{DtmParams, GroundParams, Returns, Source, Tuning};
pub use surface::Surface;

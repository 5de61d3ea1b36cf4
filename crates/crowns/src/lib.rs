//! Crown models: consensus fits around treetops and L1 paraboloids over segments.
//!
//! * [`starsac`]: a surface around every treetop before anything is segmented.
//! * [`surface`]: the crown's position by an L1 paraboloid over the points of one tree.
//! * [`footprint`], [`base`], [`edge`]: the crown's outline, its lower end, and whether it is whole.
//! * [`stage`]: the stages `crown-models` and `crown-fit`.
//!
//! Everything works on positions relative to a tree's apex, and on grids fixed in the world, so a
//! crown is the same in whatever tile or frame its points were read.

pub mod base;
pub mod edge;
pub mod error;
pub mod footprint;
pub mod params;
pub mod stage;
pub mod starsac;
pub mod surface;
pub mod window;

pub use error::Error;
pub use params::{CrownFitParams, CrownModelParams};
pub use window::Window;

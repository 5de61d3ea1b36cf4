//! Crown models: consensus fits around treetops and L1 paraboloids over segments.
//!
//! * [`starsac`]: a surface around every treetop before anything is segmented.
//! * [`surface`]: the crown's position by an L1 paraboloid over the points of one tree.
//! * [`footprint`], [`base`], [`edge`]: the crown's outline, its lower end, and whether it is whole.
//! * [`stage`]: the stages `crown-models`, `detection` and `crown-fit`.
//!
//! Everything works on positions relative to a tree's apex, and on grids fixed in the world, so a
//! crown is the same in whatever tile or frame its points were read.
//!
//! ```
//! use timberline_crowns::{CrownModelParams, Window, starsac::fit_window};
//! // Echoes on a cone that falls 2 m per metre, relative to its apex.
//! let echo = |i: u32| (i, [0.05 * f64::from(i), 0.0, -0.1 * f64::from(i)], true);
//! let window = Window::new((1..60).map(echo));
//! let outcome = fit_window(&window, &CrownModelParams::default(), 7);
//! let crown = outcome.accepted().ok_or("rejected")?;
//! assert!((crown.model.depth(1.0) - 2.0).abs() < 1e-9);
//! assert_eq!((crown.grade(), crown.outliers), (59, 0));
//! # Ok::<(), &str>(())
//! ```

pub mod base;
pub mod detection;
pub mod edge;
pub mod error;
pub mod footprint;
pub mod params;
pub mod stage;
pub mod starsac;
pub mod surface;
pub mod top;
pub mod window;

pub use error::Error;
pub use params::{CrownFitParams, CrownModelParams, DetectionParams};
pub use top::Top;
pub use window::Window;

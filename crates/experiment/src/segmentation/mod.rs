//! Segmenters compared, on stands whose every point is known.
//!
//! A stand is grown and scanned ([`plot`]), its trees are found by the library functions of the
//! airborne chain ([`chain`]), every segmenter gives the points their trees ([`method`](mod@method)), and trees
//! and points are compared with the truth ([`judge`](mod@judge), [`summary`]).
//!
//! ```
//! use timberline_experiment::segmentation::{Chain, Experiment, StandKind, compare, methods};
//! let small = Experiment {
//!     stands: vec![StandKind::OpenConifer],
//!     densities_per_m2: vec![4.0],
//!     judged_edge_m: 40.0,
//!     ..Experiment::default()
//! };
//! let outcomes = compare(&small, &Chain::default(), &methods()[..1], &|| ())?;
//! assert!(outcomes[0].summary.all.f_score() > Some(0.5));
//! # Ok::<(), timberline_experiment::Error>(())
//! ```

pub mod chain;
pub mod compare;
pub mod judge;
pub mod method;
pub mod outline;
pub mod plan;
pub mod plot;
pub mod real;
pub mod summary;
pub mod text;

pub use chain::Chain;
pub use compare::{Outcome, Pooled, compare, pool};
pub use judge::{FoundRow, Hit, Judged, TrueRow, judge};
pub use method::{FoundTree, Method, Segmented, method, methods};
pub use plan::{Case, Experiment, StandKind};
pub use plot::{Plot, TrueTree};
pub use real::{BoxRow, BoxedScan, Clip, ClipRow};
pub use summary::Summary;

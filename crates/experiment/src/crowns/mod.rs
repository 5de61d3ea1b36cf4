//! Positions of trees from their crowns: methods compared.
//!
//! ```
//! use timberline_experiment::crowns::{DatasetParams, Family, Setting, assess, generate};
//! let clusters = generate(&DatasetParams::spruce(), 10, 1)?;
//! let settings = [Family::HullCentroid, Family::HighestPoint].map(Setting::plain);
//! let found = assess("I", clusters, &settings, &[0.5], &|| ())?;
//! assert!(found.rows[0].median_m < 2.0 && found.rows[1].trees == 10);
//! # Ok::<(), timberline_experiment::Error>(())
//! ```

pub mod assess;
pub mod cluster;
pub mod compare;
pub mod dataset;
pub mod paper;
pub mod plan;
mod plot;
pub mod segment;
pub mod text;

pub use assess::{Assessed, Experiment, Facts, assess};
pub use cluster::{Cluster, Extent};
pub use compare::{Comparison, Outcome, Row, compare};
pub use dataset::{DatasetParams, Growth, SegmentErrors, generate};
pub use plan::{Bounds, Family, Setting};

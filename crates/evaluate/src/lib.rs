//! Accuracy against known truth.
//!
//! Pure functions over slices: matching of detected to reference trees ([`matching`]), recall,
//! precision and errors of the matched ([`trees`]), error statistics of any measured quantity such
//! as a terrain model ([`stats`]), crown boxes ([`boxes`]) and point labels ([`labels`]); [`report`]
//! gathers them in a structure that serialises and prints as a table. Files are the caller's affair.
//!
//! Tree models: distances between points and models ([`distances`]), false and missing branches and
//! volumes ([`branches`]), stems found and their diameters ([`stems`]); [`models`] assesses all of a
//! plot's trees by them.
//!
//! All positions and lengths are metres, in any one frame. No result depends on the order of input.
//!
//! ```
//! use timberline_evaluate::{MatchParams, Tree, assess_trees};
//! let tree = |id, x, height_m| Tree { id, at_m: [x, 0.0], height_m, ..Tree::default() };
//! let reference = [tree(1, 0.0, 20.0), tree(2, 5.0, 12.0)];
//! let detected = [tree(1, 0.5, 19.6), tree(2, 9.0, 11.0)];
//! let found = assess_trees(&reference, &detected, &MatchParams::default(), &[10.0, 15.0])?;
//! assert_eq!((found.all.recall(), found.all.precision()), (Some(0.5), Some(0.5)));
//! assert!((found.height_m.bias + 0.4).abs() < 1e-9);
//! # Ok::<(), timberline_evaluate::Error>(())
//! ```

mod assignment;
pub mod boxes;
pub mod branches;
pub mod distances;
mod error;
pub mod labels;
pub mod matching;
pub mod models;
pub mod report;
pub mod stats;
pub mod stems;
pub mod trees;

pub use boxes::{BoxAccuracy, match_boxes};
pub use branches::{Branch, BranchAccuracy, BranchParams, Volumes, assess_branches};
pub use distances::{BothWays, CylinderModel, Hausdorff};
pub use error::Error;
pub use labels::{LabelAccuracy, assess_labels};
pub use matching::{MatchParams, MatchRule, Matching, Pair, match_trees};
pub use models::{ModelParams, Piece, PlotAccuracy, TreeModel, assess_models};
pub use report::Report;
pub use stats::ErrorStats;
pub use stems::{Stem, StemAccuracy, assess_stems};
pub use trees::{Accuracy, Layer, Tree, TreeAccuracy, assess_trees, layers};

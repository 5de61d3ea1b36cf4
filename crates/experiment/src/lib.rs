//! The papers' experiments, repeated on data whose truth is known.
//!
//! * [`crowns`]: how far from the stem each method of fitting a crown puts a tree (Polewski et al.,
//!   L1-norm fitting of elliptic paraboloids with prior information for enhanced coniferous tree
//!   localization in ALS point clouds, section 6): datasets, sweeps over the parameters, tables.
//! * [`segmentation`]: how many trees of stands of five kinds the airborne chain finds, from thin to
//!   dense scans, and how well each segmenter gives points their trees.
//! * [`consolidation`]: how far models of trees from terrestrial scans lie from the points, with and
//!   without consolidation.
//!
//! Nothing here touches a file or draws: results are structures, tables are text. The same
//! parameters give the same bytes whatever the number of threads.

pub mod consolidation;
pub mod crowns;
pub mod detection;
mod error;
pub mod segmentation;

pub use error::Error;

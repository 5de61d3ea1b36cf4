//! Gives every point its tree.
//!
//! A tree's points are those of its crown: the surface a crown model describes, and what lies
//! below it within the crown's radius. Points are asked one by one which crown claims them best
//! ([`claim`]), so the answer depends on the crowns around a point and on nothing else: not on the
//! tile, nor on the sequence of points or trees.
//!
//! What users of a tree id expect, and get: a point of the ground, of herbs and shrubs below
//! `min_height_m`, and of everything above or beyond the crowns has 0; a point of the canopy has
//! the tree whose surface it lies on, also where crowns touch; a point below the canopy (inner
//! branches, stems, understorey without a top of its own) has the tree above it.

pub mod claim;
pub mod error;
pub mod params;
pub mod segmenter;
pub mod stage;

pub use claim::{Claim, Crown, label};
pub use error::Error;
pub use params::{Membership, SegmentationParams};
pub use segmenter::{Marker, Segmenter, View};

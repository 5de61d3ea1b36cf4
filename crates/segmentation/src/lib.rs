//! Gives every point its tree.
//!
//! Which trees there are is known before; a [`Segmenter`] says how far each reaches. There are
//! several ([`SegmentMethod`]), all behind one trait and none dependent on how the points are cut
//! into tiles or in which sequence they and the trees come: [`StarSac`] asks the crown models
//! around a point, and nothing else; the others work in squares fixed in the world ([`blocks`]).
//! A program of the user's can take their place ([`hook`]).
//!
//! What a tree id means: points of the ground, of herbs and shrubs below `min_height_m`, and those
//! beyond all crowns have 0; a point of the canopy has the tree whose surface it lies on, also where
//! crowns touch; a point below the canopy (inner branches, stems, understorey without a top of its
//! own) has the tree above it, unless `membership = "surface"` leaves it out. A point above the crowns
//! has none by crown models, and by the other methods the tree it stands out of. A program decides
//! for itself, within the reach of a tree.

pub mod blocks;
pub mod chm;
pub mod claim;
pub mod error;
pub mod hook;
pub mod methods;
pub mod params;
pub mod segmenter;
pub mod stage;
pub mod surface;

pub use blocks::segment_in_blocks;
pub use chm::{Chm, PitFree};
pub use claim::{Claim, Crown, label};
pub use error::Error;
pub use methods::{Li, LiParams, Ncut, NcutParams, RasterSegmenter, Seed, Segments, StarSac};
pub use params::{Membership, SegmentMethod, SegmentationParams, TreeLabelsParams};
pub use segmenter::{Marker, Piece, Segmenter, View, segmenter};
pub use surface::surface_scores;

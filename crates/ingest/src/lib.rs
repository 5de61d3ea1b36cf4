//! Reads LAS, LAZ and COPC files into tiles on a world-aligned grid.
//!
//! Nothing a file says is believed before it has been checked: a damaged, hostile or foreign file
//! ends in an [`Error`] that names the place and a remedy, never in a panic, an endless loop or an
//! allocation that the file's size does not justify. Memory does not grow with the size of a file.
//!
//! * [`LasFile`] reads LAS 1.0 to 1.4, point formats 0 to 10, LAZ and COPC as batches of points in
//!   metres; [`survey`] reads headers only and proposes a tile edge.
//! * [`scatter`](scatter::scatter) buckets a file's points by tile in one pass,
//!   [`gather`](gather::gather) puts a tile together from the buckets of all files, leaves points out
//!   by rule and counts them.
//! * [`stage`] makes stages of the two.

pub mod crs;
pub mod epsg;
pub mod error;
pub mod extra;
pub mod file;
pub mod format;
pub mod gather;
pub mod header;
pub mod notes;
pub mod params;
pub mod points;
pub mod rules;
pub mod scatter;
pub mod shard;
pub mod source;
pub mod stage;
pub mod survey;
pub mod vlr;

mod contain;
mod decode;
mod geokeys;
mod gps_time;
mod laszip;
mod observe;
mod segment;
mod sniff;
#[cfg(test)]
mod testing;
mod voxels;
mod wkt;

pub use crs::UnitChoice;
pub use error::Error;
pub use file::LasFile;
pub use header::Header;
pub use notes::Notes;
pub use params::{Damaged, LengthUnit, Overlap, ScatterParams, TilesParams};
pub use points::Damage;

//! Reads LAS, LAZ, COPC, E57, PLY, PCD and text files into tiles on a world-aligned grid.
//!
//! Nothing a file says is believed before it has been checked: a damaged, hostile or foreign file
//! ends in an [`Error`] that names the place and a remedy, never in a panic, an endless loop or an
//! allocation that the file's size does not justify. Memory does not grow with the size of a file.
//!
//! * [`scan::open`] tells the format of a file by its contents and gives batches of points in metres
//!   ([`Scan`]): LAS 1.0 to 1.4 with point formats 0 to 10, LAZ and COPC ([`LasFile`]); E57; PLY;
//!   PCD; text (XYZ, TXT, ASC, PTS, CSV). [`survey`] tells what files are and proposes a tile edge.
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
pub mod scan;
pub mod scatter;
pub mod shard;
pub mod source;
pub mod stage;
pub mod survey;
pub mod vlr;

mod assemble;
mod attributes;
mod blocks;
mod contain;
mod counted;
mod cover;
mod damages;
mod decode;
mod e57;
mod geokeys;
mod gps_time;
mod laszip;
mod marking;
mod observe;
mod outliers;
mod pcd;
mod ply;
mod records;
mod segment;
mod sniff;
mod table;
#[cfg(test)]
mod testing;
mod text;
mod thin;
mod voxels;
mod wkt;

pub use crs::UnitChoice;
pub use error::Error;
pub use file::LasFile;
pub use header::Header;
pub use notes::Notes;
pub use params::{Damaged, LengthUnit, Overlap, ScatterParams, TilesParams};
pub use points::Damage;
pub use scan::Scan;

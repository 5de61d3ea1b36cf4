//! What stages read and write, and the contract they keep.
//!
//! This crate knows no algorithm. It knows how a result becomes a file ([`container`] for tables,
//! [`mcap_file`] for everything somebody may want to look at), what every kind of file holds
//! ([`kinds`], one file a kind, each with its version), how a file is published so that a
//! half-written one can never be taken for a whole one ([`publish`]), and what a stage is
//! ([`stage`]). [`gather()`] reads a tile together with its surroundings.
//!
//! Every artefact carries a [`Header`] that can be read without knowing its payload.

pub mod alone;
pub mod codec;
pub mod container;
pub mod crs;
pub mod error;
pub mod folder;
pub mod gather;
pub mod header;
pub mod kinds;
pub mod mcap_file;
pub mod open;
pub mod publish;
pub mod raster;
pub mod stage;
pub mod tree_id;

pub use crs::Crs;
pub use error::Error;
pub use folder::OutputFolder;
pub use gather::{Aligned, Surroundings, gather};
pub use header::{Facts, Header, InputRef, TreeUnit, UnitId, UnitKind, Warning};
pub use kinds::Kind;
pub use open::{Opened, read, read_header};
pub use raster::Raster;
pub use tree_id::tree_id;

//! One file per kind of artefact: its wire form, its version, and when to raise it.
//!
//! Raise a kind's `VERSION` whenever the meaning or the bytes of its payload change; add a golden
//! file of the new version under `golden/` (`cargo test -p timberline-artefact -- --ignored
//! write_golden_files` makes it) and keep the old one. What the old payload held becomes a struct
//! of its own, as in [`trees`], that turns into the present one; named in `table_kind!`, its version
//! stays readable. A version that is not named there is refused by name.

pub mod consolidated;
pub mod crown_models;
pub mod detections;
pub mod ground_model;
pub mod ground_points;
pub mod heights;
pub mod labels;
pub mod outputs;
pub mod points;
pub mod qsm;
pub mod shards;
pub mod skeletons;
pub mod stems;
pub mod tree_cloud;
pub mod tree_files;
pub mod trees;
pub mod treetops;

use crate::container::ContainerWriter;
use crate::mcap_file::McapReader;
use crate::{Error, Header, Opened, codec};
use serde::{Serialize, de::DeserializeOwned};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

pub use consolidated::{Consolidated, Consolidation};
pub use crown_models::{CrownModel, CrownModels, CrownShape, CrownStatus};
pub use detections::{Detection, Detections, Origin};
pub use ground_model::{GroundModel, HardyPatch};
pub use ground_points::GroundPoints;
pub use heights::Heights;
pub use labels::Labels;
pub use outputs::{OutputFile, Outputs};
pub use points::PointTile;
pub use qsm::{
    ConsolidationEffect, Dbh, Distances, Qsm, QsmBranch, QsmCylinder, RadiusSource, TaperStep,
    TreeMetrics,
};
pub use shards::Shards;
pub use skeletons::{Skeleton, SkeletonNode, Skeletons};
pub use stems::{BaseSource, Stem, Stems, VoxelRun};
pub use tree_cloud::TreeCloud;
pub use tree_files::{ModelFiles, PictureFiles, TreeFile};
pub use trees::{PositionMethod, Tree, TreeFlag, Trees};
pub use treetops::{Treetop, Treetops};

/// A kind of artefact.
pub trait Kind: Sized {
    /// Its name in headers, pipelines and messages.
    const NAME: &'static str;
    /// Version of its payload, as it is written.
    const VERSION: u32;
    /// Versions that can be read: the present one and those that are migrated to it.
    const READABLE: &'static [u32] = &[Self::VERSION];
    /// Ending of its files, without the dot.
    const EXTENSION: &'static str;
    /// What it is, in a line.
    const SUMMARY: &'static str;

    /// Writes the whole file.
    ///
    /// # Errors
    /// [`Error::Encode`] or the file's error.
    fn encode(&self, header: &Header, out: &mut File) -> Result<(), Error>;

    /// Reads the payload of a file whose header announces this kind in a readable version.
    ///
    /// # Errors
    /// [`Error::Corrupt`].
    fn decode(path: &Path, opened: &mut Opened) -> Result<Self, Error>;
}

/// Ending of table artefacts.
pub const TABLE_EXTENSION: &str = "tmbr";

/// Writes a table: bincode in a container.
fn encode_table<T: Serialize>(
    kind: &'static str,
    value: &T,
    header: &Header,
    out: &mut File,
) -> Result<(), Error> {
    let fail = |detail: String| Error::Encode { kind, detail };
    let payload = codec::encode(value).map_err(fail)?;
    let io = |error: std::io::Error| Error::Encode { kind, detail: error.to_string() };
    let mut writer = ContainerWriter::new(BufWriter::new(out)).map_err(io)?;
    writer.write_all(&payload).map_err(io)?;
    writer.finish(&header.to_json()?).map(drop).map_err(io)
}

/// A metadata record of an MCAP artefact.
fn record_json<T: Serialize>(kind: &'static str, value: &T) -> Result<String, Error> {
    serde_json::to_string(value).map_err(|e| Error::Encode { kind, detail: e.to_string() })
}

/// Reads what [`record_json`] wrote.
fn read_record<T: DeserializeOwned>(
    path: &Path,
    reader: &McapReader,
    name: &str,
) -> Result<T, Error> {
    serde_json::from_str(&reader.record(name)?)
        .map_err(|error| Error::corrupt(path, name, error.to_string()))
}

/// Reads a table.
fn decode_table<T: DeserializeOwned>(path: &Path, opened: &mut Opened) -> Result<T, Error> {
    match opened {
        Opened::Container(reader) => codec::decode(&reader.payload()?)
            .map_err(|detail| Error::corrupt(path, "payload", detail)),
        Opened::Mcap(_) => Err(Error::corrupt(path, "payload", "a table inside an MCAP file")),
    }
}

/// Implements [`Kind`] for a table. Older versions are given with their wire forms, which must turn
/// `Into` the present one: `table_kind!(Trees, "trees", 2, "...", 1 => v1::Trees)`.
macro_rules! table_kind {
    (
        $type:ty, $name:literal, $version:literal, $summary:literal
        $(, $old:literal => $wire:ty)*
    ) => {
        impl $crate::Kind for $type {
            const NAME: &'static str = $name;
            const VERSION: u32 = $version;
            const READABLE: &'static [u32] = &[$($old,)* $version];
            const EXTENSION: &'static str = $crate::kinds::TABLE_EXTENSION;
            const SUMMARY: &'static str = $summary;

            fn encode(
                &self,
                header: &$crate::Header,
                out: &mut std::fs::File,
            ) -> Result<(), $crate::Error> {
                $crate::kinds::encode_table($name, self, header, out)
            }

            fn decode(
                path: &std::path::Path,
                opened: &mut $crate::Opened,
            ) -> Result<Self, $crate::Error> {
                match opened.header().kind_version {
                    $($old => $crate::kinds::decode_table::<$wire>(path, opened).map(Into::into),)*
                    _ => $crate::kinds::decode_table(path, opened),
                }
            }
        }
    };
}
pub(crate) use table_kind;

/// What is fixed about a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KindInfo {
    /// See [`Kind::NAME`].
    pub name: &'static str,
    /// See [`Kind::VERSION`].
    pub version: u32,
    /// See [`Kind::EXTENSION`].
    pub extension: &'static str,
    /// See [`Kind::SUMMARY`].
    pub summary: &'static str,
}

/// Every kind, in the order of the pipeline.
#[must_use]
pub fn all() -> Vec<KindInfo> {
    fn row<K: Kind>() -> KindInfo {
        KindInfo {
            name: K::NAME,
            version: K::VERSION,
            extension: K::EXTENSION,
            summary: K::SUMMARY,
        }
    }
    vec![
        row::<Shards>(),
        row::<PointTile>(),
        row::<GroundPoints>(),
        row::<GroundModel>(),
        row::<Heights>(),
        row::<Treetops>(),
        row::<CrownModels>(),
        row::<Detections>(),
        row::<Labels>(),
        row::<Trees>(),
        row::<Stems>(),
        row::<TreeCloud>(),
        row::<Consolidated>(),
        row::<Skeletons>(),
        row::<Qsm>(),
        row::<ModelFiles>(),
        row::<PictureFiles>(),
        row::<Outputs>(),
    ]
}

/// A kind by its name.
#[must_use]
pub fn info(name: &str) -> Option<KindInfo> {
    all().into_iter().find(|kind| kind.name == name)
}

//! The points of one tree, as MCAP. Raise the version when the record, the columns or their meaning
//! change, also when [`Stem`] changes.

use super::points::{decode_cloud, encode_cloud};
use super::{Kind, Stem};
use crate::{Error, Header, Opened};
use std::fs::File;
use std::path::Path;
use timberline_pointcloud::PointCloud;

/// Name of the metadata record with the tree.
const TREE_RECORD: &str = "timberline.tree";

/// Points of one tree in canonical order, in a frame near its base.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeCloud {
    /// The tree.
    pub stem: Stem,
    /// The points; the extra column [`TreeCloud::WOOD`] tells wood from leaves.
    pub cloud: PointCloud,
}

impl TreeCloud {
    /// Extra column, `f32`: how likely the point is on wood, 0 to 1.
    pub const WOOD: &'static str = "wood";
}

impl Kind for TreeCloud {
    const NAME: &'static str = "tree-cloud";
    const VERSION: u32 = 1;
    const EXTENSION: &'static str = "mcap";
    const SUMMARY: &'static str = "the points of one tree, to be opened in any MCAP viewer";

    fn encode(&self, header: &Header, out: &mut File) -> Result<(), Error> {
        let tree = super::record_json(Self::NAME, &WireStem::from(self.stem))?;
        encode_cloud(Self::NAME, &self.cloud, header, &[(TREE_RECORD, tree)], out)
    }

    fn decode(path: &Path, opened: &mut Opened) -> Result<Self, Error> {
        let reader = opened.mcap(path)?;
        let wire: WireStem = super::read_record(path, reader, TREE_RECORD)?;
        Ok(Self { stem: wire.into(), cloud: decode_cloud(path, reader)? })
    }
}

/// [`Stem`] in JSON, which knows no NaN.
#[derive(serde::Serialize, serde::Deserialize)]
struct WireStem {
    tree_id: u64,
    base_m: [f64; 3],
    base_source: super::BaseSource,
    dbh_m: Option<f64>,
    bounds: timberline_pointcloud::Bounds3,
}

impl From<Stem> for WireStem {
    fn from(stem: Stem) -> Self {
        let Stem { tree_id, base_m, base_source, dbh_m, bounds } = stem;
        let dbh_m = Some(dbh_m).filter(|dbh| dbh.is_finite());
        Self { tree_id, base_m, base_source, dbh_m, bounds }
    }
}

impl From<WireStem> for Stem {
    fn from(wire: WireStem) -> Self {
        let WireStem { tree_id, base_m, base_source, dbh_m, bounds } = wire;
        Self { tree_id, base_m, base_source, dbh_m: dbh_m.unwrap_or(f64::NAN), bounds }
    }
}

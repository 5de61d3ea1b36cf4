//! The consolidated points of one tree, as MCAP. Raise the version when the record, the columns or
//! their meaning change.

use super::Kind;
use super::points::{decode_cloud, encode_cloud};
use crate::{Error, Header, Opened};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::Path;
use timberline_pointcloud::PointCloud;

/// Name of the metadata record with what consolidation did.
const RECORD: &str = "timberline.consolidation";

/// Points of one tree after consolidation, in the frame of its cloud, in canonical order.
#[derive(Debug, Clone, PartialEq)]
pub struct Consolidated {
    /// What consolidation did.
    pub consolidation: Consolidation,
    /// The points, at positions off the 0.1 mm lattice; the extra column [`Consolidated::STEM`]
    /// tells those of the stem. No points where consolidation was skipped.
    pub cloud: PointCloud,
}

/// What consolidation did to a cloud.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Consolidation {
    /// Why it was skipped, if it was.
    pub skipped: Option<String>,
    /// Distinct points before.
    pub points_before: u64,
    /// Points after.
    pub points_after: u64,
    /// Points among these that lie where they lay.
    pub points_left_alone: u64,
    /// Median thickness of the cloud across its local surface before, m. This and what follows is 0
    /// where the tree was skipped before it was measured.
    pub thickness_before_m: f64,
    /// The same after, m.
    pub thickness_after_m: f64,
    /// Mean distance from a point before to the surface through the other points before, m.
    pub distance_before_m: f64,
    /// Mean distance from a point before to the surface through the points after, m: not above the
    /// former where consolidation did no harm.
    pub mean_shift_m: f64,
}

impl Consolidated {
    /// Extra column, `u8`: 1 for points that were consolidated as part of the stem.
    pub const STEM: &'static str = "stem";
}

impl Kind for Consolidated {
    const NAME: &'static str = "consolidated";
    const VERSION: u32 = 1;
    const EXTENSION: &'static str = "mcap";
    const SUMMARY: &'static str = "the consolidated points of one tree";

    fn encode(&self, header: &Header, out: &mut File) -> Result<(), Error> {
        let record = super::record_json(Self::NAME, &self.consolidation)?;
        encode_cloud(Self::NAME, &self.cloud, header, &[(RECORD, record)], out)
    }

    fn decode(path: &Path, opened: &mut Opened) -> Result<Self, Error> {
        let reader = opened.mcap(path)?;
        let consolidation = super::read_record(path, reader, RECORD)?;
        Ok(Self { consolidation, cloud: decode_cloud(path, reader)? })
    }
}

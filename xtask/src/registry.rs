//! The stages this program knows. The only place where they are named together.

use serde_json::Value;
use std::sync::Arc;
use timberline_artefact::stage::{DynStage, erase};
use timberline_crowns::stage::{CrownFitStage, CrownModelStage, DetectionStage};
use timberline_export::stage::{ExportStage, TreeModelsStage, TreeTablesStage};
use timberline_ground::stage::{DtmStage, GroundStage};
use timberline_ingest::stage::{Scatter, Tiles};
use timberline_qsm::stage::CylindersStage;
use timberline_report::stage::{MapStage, PlotMapStage, TreePicturesStage};
use timberline_segmentation::stage::{SegmentationStage, TreeLabelsStage};
use timberline_skeleton::stage::SkeletonStage;
use timberline_stems::stage::{StemsStage, TreeCloudStage};
use timberline_treetops::stage::TreetopsStage;
use timberline_wlop::stage::ConsolidationStage;

/// A stage without its types.
pub type AnyStage = Arc<dyn DynStage>;

/// The kind of input references that stand for a raw file.
pub const RAW: &str = "raw";
/// The kind of input references that stand for the tile grid.
pub const GRID: &str = "grid";
/// The kind of input references that stand for a CRS given in the campaign file.
pub const CRS: &str = "crs";
/// The kind of input references that stand for a file named in the pipeline file.
pub const NAMED: &str = "named";

/// A list of stages.
#[derive(Clone, Default)]
pub struct Registry {
    stages: Vec<AnyStage>,
}

impl Registry {
    /// A registry of the given stages.
    #[must_use]
    pub fn new(stages: Vec<Box<dyn DynStage>>) -> Self {
        Self { stages: stages.into_iter().map(Arc::from).collect() }
    }

    /// The stages Timberline ships, in the order of the data's way through them.
    #[must_use]
    pub fn shipped() -> Self {
        Self::new(vec![
            erase::<Scatter>(),
            erase::<Tiles>(),
            erase::<GroundStage>(),
            erase::<DtmStage>(),
            erase::<TreetopsStage>(),
            erase::<CrownModelStage>(),
            erase::<DetectionStage>(),
            erase::<SegmentationStage>(),
            erase::<CrownFitStage>(),
            erase::<StemsStage>(),
            erase::<TreeLabelsStage>(),
            erase::<TreeCloudStage>(),
            erase::<ConsolidationStage>(),
            erase::<SkeletonStage>(),
            erase::<CylindersStage>(),
            erase::<TreeModelsStage>(),
            erase::<TreePicturesStage>(),
            erase::<TreeTablesStage>(),
            erase::<PlotMapStage>(),
            erase::<ExportStage>(),
            erase::<MapStage>(),
        ])
    }

    /// All stages.
    pub fn stages(&self) -> impl Iterator<Item = &AnyStage> {
        self.stages.iter()
    }

    /// A stage by name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<AnyStage> {
        self.stages.iter().find(|stage| stage.info().name == name).cloned()
    }
}

/// Effective parameters of a stage: those given, defaults for the others.
///
/// # Errors
/// What is wrong with them, one sentence each.
pub fn effective(stage: &AnyStage, given: &Value) -> Result<Value, Vec<String>> {
    let params = stage.effective(given).map_err(|error| vec![error])?;
    match stage.check(&params) {
        Ok(faults) if faults.is_empty() => Ok(params),
        Ok(faults) => Err(faults),
        Err(error) => Err(vec![error]),
    }
}

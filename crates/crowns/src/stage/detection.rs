//! The stage `detection`.

use crate::params::DetectionParams;
use timberline_artefact::UnitKind;
use timberline_artefact::kinds::{CrownModels, CrownStatus, Detection, Detections, Origin};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};

/// The trees among the candidates.
#[derive(Debug, Clone, Copy)]
pub struct DetectionStage;

impl Params for DetectionParams {}

const INPUTS: &[InputSpec] = &[InputSpec::own("crown-models")];

impl Stage for DetectionStage {
    type Params = DetectionParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "detection",
            version: 1,
            summary: "The trees among the candidates",
            unit: UnitKind::Tile,
            inputs: INPUTS,
            outputs: &["detections"],
        }
    }

    fn run(
        _params: &Self::Params,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let (header, CrownModels { models }) = inputs.own::<CrownModels>()?;
        let tree = |model| Detection { model, score: 1.0, origin: Origin::Surface };
        let trees: Vec<Detection> = models.into_iter().map(tree).collect();
        let standing =
            trees.iter().filter(|tree| tree.model.status == CrownStatus::Accepted).count();
        let facts = timberline_artefact::Facts::located_like(&header.facts);
        let facts = facts.count("trees", trees.len()).count("accepted", standing);
        context.emit(&Detections { trees }, facts)?;
        Ok(())
    }
}

//! The stage `segmentation`: the only place here that reads and writes artefacts.

use crate::{Claim, Crown, SegmentationParams, label};
use timberline_artefact::kinds::{CrownModel, CrownShape, CrownStatus, Detections, Labels};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Aligned, UnitKind, gather};
use timberline_pointcloud::Frame;

/// The tree of every point by the crown models around it.
#[derive(Debug, Clone, Copy)]
pub struct SegmentationStage;

impl Params for SegmentationParams {}

const INPUTS: &[InputSpec] =
    &[InputSpec::own("points"), InputSpec::own("heights"), InputSpec::halo("detections")];

impl Stage for SegmentationStage {
    type Params = SegmentationParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "segmentation",
            version: 2,
            summary: "The tree of every point: the crown on or below whose surface it lies",
            unit: UnitKind::Tile,
            inputs: INPUTS,
            outputs: &["labels"],
        }
    }

    fn halo_m(params: &Self::Params) -> f64 {
        params.reach_m
    }

    fn run(
        params: &Self::Params,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let own = gather(inputs, 0.0, &[Aligned::Height])?;
        let mut crowns = Vec::new();
        for detections in inputs.each::<Detections>() {
            let (_, _, Detections { trees }) = detections?;
            crowns.extend(trees.iter().filter_map(|tree| crown(&tree.model, &own.cloud.frame)));
        }
        context.check_cancelled()?;
        let cloud = &own.cloud;
        let claims = label([&cloud.x, &cloud.y, &cloud.z], &own.height_m, &crowns, params)?;
        context.advance(own.own_len as u64);
        let claims = own.own_values(&claims);
        let labelled = claims.iter().filter(|claim| claim.id != 0).count();
        let labels = labels(&claims);
        context
            .emit(&labels, own.located.count("points", own.own_len).count("labelled", labelled))?;
        Ok(())
    }
}

/// The crown of a model that stands.
fn crown(model: &CrownModel, frame: &Frame) -> Option<Crown> {
    (model.status == CrownStatus::Accepted).then(|| Crown {
        id: model.id,
        apex: frame.local_from_world(model.apex_m),
        coefficients: model.coefficients(),
        radius_m: model.radius_m,
        tolerance_m: model.tolerance_m,
        oblique: model.shape == CrownShape::Mixed,
    })
}

fn labels(claims: &[Claim]) -> Labels {
    Labels {
        tree_id: claims.iter().map(|claim| claim.id).collect(),
        score: claims.iter().map(|claim| claim.score).collect(),
    }
}

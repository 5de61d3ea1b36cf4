//! The stage `crown-models`.

use super::{BATCH, GRID_CELL_M, top_of};
use crate::params::CrownModelParams;
use crate::starsac::{self, Outcome, Rejection, Shape};
use rayon::prelude::*;
use timberline_artefact::kinds::{
    CrownModel, CrownModels, CrownShape, CrownStatus, Treetop, Treetops,
};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Aligned, Surroundings, UnitKind, gather};
use timberline_pointcloud::Grid2;

/// A crown surface around every treetop.
#[derive(Debug, Clone, Copy)]
pub struct CrownModelStage;

impl Params for CrownModelParams {
    fn check(&self) -> Vec<String> {
        self.faults()
    }
}

const MODEL_INPUTS: &[InputSpec] =
    &[InputSpec::halo("points"), InputSpec::halo("heights"), InputSpec::own("treetops")];

impl Stage for CrownModelStage {
    type Params = CrownModelParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "crown-models",
            version: 3,
            summary: "A crown surface around every treetop by sample consensus (StarSac, Tittmann et al. 2011)",
            unit: UnitKind::Tile,
            inputs: MODEL_INPUTS,
            outputs: &["crown-models"],
        }
    }

    fn halo_m(params: &Self::Params) -> f64 {
        0.5 * params.window_m
    }

    fn run(
        params: &Self::Params,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let near = gather(inputs, Self::halo_m(params), &[Aligned::Height])?;
        let (_, Treetops { tops }) = inputs.own()?;
        let grid = Grid2::new(&near.cloud.x, &near.cloud.y, GRID_CELL_M)?;
        let mut models = Vec::with_capacity(tops.len());
        for batch in tops.chunks(BATCH) {
            context.check_cancelled()?;
            models.par_extend(batch.par_iter().map(|top| model_of(top, &near, &grid, params)));
        }
        context.advance(near.own_len as u64);
        models.iter().for_each(|model| warn_rejected(model, context));
        let stands = |model: &&CrownModel| model.status == CrownStatus::Accepted;
        let accepted = models.iter().filter(stands).count();
        let facts = near.located.count("models", models.len()).count("accepted", accepted);
        context.emit(&CrownModels { models }, facts)?;
        Ok(())
    }
}

fn model_of(
    top: &Treetop,
    near: &Surroundings,
    grid: &Grid2,
    params: &CrownModelParams,
) -> CrownModel {
    let window = top_of(top).window(&near.cloud, &near.height_m, grid, params);
    wire(top, params, &starsac::fit_window(&window, params, top.id))
}

/// The outcome of a window as a row of the artefact.
fn wire(top: &Treetop, params: &CrownModelParams, outcome: &Outcome) -> CrownModel {
    let status = match outcome.rejection {
        None => CrownStatus::Accepted,
        Some(Rejection::TooFewPoints) => CrownStatus::TooFewPoints,
        Some(Rejection::TooManyOutliers) => CrownStatus::TooManyOutliers,
        Some(Rejection::NoModel) => CrownStatus::NoModel,
    };
    let blank = CrownModel {
        id: top.id,
        apex_m: top.apex_m,
        height_m: top.height_m,
        tolerance_m: params.tolerance_m,
        status,
        ..CrownModel::default()
    };
    let Some(crown) = &outcome.crown else { return blank };
    let (b1, b2) = (crown.model.b1, crown.model.b2);
    let (shape, parameters) = match crown.model.shape {
        Shape::Paraboloid => (CrownShape::Paraboloid, [-b2, 0.0]),
        Shape::Cone => (CrownShape::Cone, [1.0 / (b1 * b1), 0.0]),
        Shape::Blend => (CrownShape::Blend, [b2, 0.0]),
        Shape::TwoParameter => (CrownShape::Mixed, [b1, b2]),
    };
    CrownModel {
        shape,
        parameters,
        radius_m: crown.radius_m,
        inliers: crown.grade(),
        outliers: crown.outliers,
        residual_m: crown.mean_residual_m,
        ..blank
    }
}

fn warn_rejected(model: &CrownModel, context: &Context<'_>) {
    let reason = match model.status {
        CrownStatus::Accepted => return,
        CrownStatus::TooFewPoints => Rejection::TooFewPoints,
        CrownStatus::TooManyOutliers => Rejection::TooManyOutliers,
        CrownStatus::NoModel => Rejection::NoModel,
    };
    let (inliers, outliers) = (model.inliers, model.outliers);
    let message = format!("no crown: {} ({inliers} inliers, {outliers} outliers)", reason.reason());
    context.warn(format!("candidate {}", model.id), message);
}

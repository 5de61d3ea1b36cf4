//! The stage `detection`.

use super::top_of;
use crate::detection::{Candidate, Candidates};
use crate::params::DetectionParams;
use timberline_artefact::kinds::{
    CrownModel, CrownModels, CrownStatus, Detection, Detections, Origin, Treetop, Treetops,
};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Facts, Kind, UnitId, UnitKind};

/// The trees among the candidates.
#[derive(Debug, Clone, Copy)]
pub struct DetectionStage;

impl Params for DetectionParams {}

const INPUTS: &[InputSpec] = &[InputSpec::halo(Treetops::NAME), InputSpec::halo(CrownModels::NAME)];

impl Stage for DetectionStage {
    type Params = DetectionParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "detection",
            version: 1,
            summary: "The trees among the candidates: by the points around each, its crown model and its rivals",
            unit: UnitKind::Tile,
            inputs: INPUTS,
            outputs: &[Detections::NAME],
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
        let (header, CrownModels { models }) = inputs.own::<CrownModels>()?;
        let (_, Treetops { tops }) = inputs.own::<Treetops>()?;
        let candidates = Candidates::new(gather(inputs)?, params.reach_m)?;
        context.check_cancelled()?;
        let chosen = candidates.trees(params.min_score);
        let mut trees = Vec::new();
        for (model, top) in models.into_iter().zip(&tops) {
            if let Ok(place) = chosen.binary_search_by_key(&model.id, |(id, _)| *id) {
                let origin = if top.cover_m > 0.0 { Origin::BelowCanopy } else { Origin::Surface };
                trees.push(Detection { model, score: chosen[place].1, origin });
            }
        }
        let facts = facts(Facts::located_like(&header.facts), tops.len(), &trees);
        context.emit(&Detections { trees }, facts)?;
        Ok(())
    }
}

fn facts(located: Facts, candidates: usize, trees: &[Detection]) -> Facts {
    let standing = |tree: &&Detection| tree.model.status == CrownStatus::Accepted;
    let below = |tree: &&Detection| tree.origin == Origin::BelowCanopy;
    located
        .count("candidates", candidates)
        .count("trees", trees.len())
        .count("accepted", trees.iter().filter(standing).count())
        .count("below-canopy", trees.iter().filter(below).count())
}

/// The candidates of the tile and of its surroundings.
fn gather(inputs: &Inputs) -> Result<Vec<Candidate>, StageError> {
    let mut all = Vec::new();
    for models in inputs.each::<CrownModels>() {
        let (unit, _, CrownModels { models }) = models?;
        let UnitId::Tile(tile) = unit else { continue };
        let Treetops { tops } = inputs.of_tile(tile)?;
        all.extend(models.iter().zip(&tops).map(|(model, top)| candidate(model, top)));
    }
    Ok(all)
}

/// Treetops and models of a tile are both sorted by id, one for one.
fn candidate(model: &CrownModel, top: &Treetop) -> Candidate {
    let stands = model.status == CrownStatus::Accepted;
    Candidate {
        coefficients: if stands { model.coefficients() } else { [0.0; 2] },
        radius_m: if stands { model.radius_m } else { 0.0 },
        inliers: model.inliers,
        outliers: model.outliers,
        residual: model.residual_m / model.tolerance_m,
        ..top_of(top).candidate()
    }
}

//! The stage `treetops`: a tile's points and heights to the treetops whose apex lies in it.

use crate::{Input, Params, find};
use timberline_artefact::kinds::{GroundPoints, Heights, PointTile, Treetop, Treetops};
use timberline_artefact::stage::{Context, InputSpec, Inputs, Stage, StageError, StageInfo};
use timberline_artefact::{Aligned, Kind, Surroundings, UnitKind, gather, tree_id};

/// Treetops as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct TreetopsStage;

impl timberline_artefact::stage::Params for Params {
    fn check(&self) -> Vec<String> {
        Self::check(self)
    }
}

const INPUTS: &[InputSpec] = &[
    InputSpec::halo(PointTile::NAME),
    InputSpec::halo(GroundPoints::NAME),
    InputSpec::halo(Heights::NAME),
];

impl Stage for TreetopsStage {
    type Params = Params;

    fn info() -> StageInfo {
        StageInfo {
            name: "treetops",
            version: 2,
            summary: "candidates for trees by the points around them, also below other crowns; or local maxima (Tittmann et al. 2011)",
            unit: UnitKind::Tile,
            inputs: INPUTS,
            outputs: &[Treetops::NAME],
        }
    }

    fn halo_m(params: &Params) -> f64 {
        params.halo_m()
    }

    fn run(params: &Params, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let all = gather(inputs, params.halo_m(), &[Aligned::Height, Aligned::Ground])?;
        context.check_cancelled()?;
        let tops = own_tops(&all, params)?;
        context.advance(all.own_len as u64);
        let facts = all.located.clone().count("treetops", tops.tops.len());
        context.emit(&tops, facts)?;
        Ok(())
    }
}

/// The treetops of the tile's own points, sorted by id.
fn own_tops(all: &Surroundings, params: &Params) -> Result<Treetops, crate::Error> {
    let input = Input { cloud: &all.cloud, height_m: &all.height_m, ground: Some(&all.is_ground) };
    let found = find(&input, params)?;
    let own = |top: &crate::Treetop| {
        all.own[top.index as usize].map(|point| Treetop {
            id: tree_id(top.world_m[0], top.world_m[1]),
            point,
            apex_m: top.world_m,
            height_m: top.height_m,
            window_m: top.window_m,
            prominence_m: top.prominence_m,
            score: top.score as f32,
            cover_m: top.cover_m as f32,
        })
    };
    let mut tops: Vec<Treetop> = found.iter().filter_map(own).collect();
    tops.sort_unstable_by_key(|top| top.id);
    Ok(Treetops { tops })
}

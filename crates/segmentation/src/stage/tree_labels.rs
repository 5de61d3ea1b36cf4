//! The stage `tree-labels`: the tree of every point of a terrestrial scan, from the space that the
//! stems have, or by a program of the user's.

use super::program::{Hooked, claims_by_program};
use crate::{Claim, Crown, Marker, TreeLabelsParams};
use std::collections::BTreeMap;
use timberline_artefact::kinds::{GroundPoints, Heights, Labels, PointTile, Stem, Stems, VoxelRun};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, NamedFile, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Facts, Kind, Surroundings, TreeUnit, UnitKind, gather};
use timberline_pointcloud::frame::ticks_from_world;
use timberline_pointcloud::{Bounds3, Frame, Rect};

/// The tree of every point of a terrestrial scan as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct TreeLabelsStage;

const INPUTS: &[InputSpec] = &[
    InputSpec::halo(PointTile::NAME),
    InputSpec::halo(GroundPoints::NAME),
    InputSpec::halo(Heights::NAME),
    InputSpec::all(Stems::NAME),
];

impl Params for TreeLabelsParams {}

impl Stage for TreeLabelsStage {
    type Params = TreeLabelsParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "tree-labels",
            version: 1,
            summary: "the tree of every point of a terrestrial scan: see `command`",
            unit: UnitKind::Tile,
            inputs: INPUTS,
            outputs: &[Labels::NAME],
        }
    }

    fn halo_m(params: &TreeLabelsParams) -> f64 {
        if params.command.is_empty() { 0.0 } else { params.command_halo_m }
    }

    fn files(params: &TreeLabelsParams) -> Vec<NamedFile> {
        super::files_of(&params.command)
    }

    fn memory_bytes(params: &TreeLabelsParams, points: u64) -> u64 {
        let program = super::memory_of_program(&params.command, params.command_memory_limit_mb);
        points * super::BYTES_PER_POINT + program
    }

    fn run(
        params: &TreeLabelsParams,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let stems = stems(inputs)?;
        let (all, claims) = match params.command.is_empty() {
            true => {
                let all = gather(inputs, 0.0, &[])?;
                let claims = claims(&all, &stems);
                (all, claims)
            }
            false => {
                let hooked = Hooked {
                    command: &params.command,
                    halo_m: params.command_halo_m,
                    reach_m: params.reach_m,
                    time_limit_s: params.command_time_limit_s,
                    memory_limit_mb: params.command_memory_limit_mb,
                };
                claims_by_program(&hooked, inputs, context, |rect, frame| {
                    Ok(markers(&stems, rect, frame))
                })?
            }
        };
        context.advance(all.own_len as u64);
        let trees = trees(&all, &claims);
        let claims = all.own_values(&claims);
        let labelled = claims.iter().filter(|claim| claim.id != 0).count();
        let facts =
            Facts { trees, ..all.located }.count("points", all.own_len).count("labelled", labelled);
        context.emit(&super::labels(&claims), facts)?;
        Ok(())
    }
}

fn stems(inputs: &Inputs) -> Result<Stems, StageError> {
    let mut all = inputs.each::<Stems>();
    let missing = || timberline_artefact::Error::MissingInput {
        kind: Stems::NAME.to_owned(),
        unit: inputs.unit().to_string(),
    };
    let (_, _, stems) = all.next().ok_or_else(missing)??;
    Ok(stems)
}

/// The tree whose space every point lies in.
fn claims(all: &Surroundings, stems: &Stems) -> Vec<Claim> {
    let edge = ticks_from_world(stems.voxel_m).max(1);
    let claim = |index: usize| {
        let world = all.cloud.world(index);
        let [x, y, z] = world.map(|value| ticks_from_world(value).div_euclid(edge) as i32);
        match run_at(&stems.runs, [x, y], z).and_then(|run| stems.stems.get(run.stem as usize)) {
            Some(stem) => Claim { id: stem.tree_id, score: Labels::ON_SURFACE },
            None => Claim::default(),
        }
    };
    (0..all.cloud.len()).map(claim).collect()
}

/// The run that holds a voxel.
fn run_at(runs: &[VoxelRun], column: [i32; 2], z: i32) -> Option<&VoxelRun> {
    let after = runs.partition_point(|run| (run.column, run.bottom) <= (column, z));
    let run = runs.get(after.checked_sub(1)?)?;
    (run.column == column && z < run.bottom + run.len as i32).then_some(run)
}

/// The trees whose space comes into a rectangle of the world, for a program.
fn markers(stems: &Stems, rect: &Rect, frame: &Frame) -> Vec<Marker> {
    let near = |stem: &&Stem| stem.bounds.rect().touches(rect);
    let marker = |stem: &Stem| {
        let [x, y, z] = stem.base_m;
        let top = stem.bounds.max[2].max(z);
        let crown = Crown {
            id: stem.tree_id,
            apex: frame.local_from_world([x, y, top]),
            coefficients: [0.0; 2],
            radius_m: 0.0,
            tolerance_m: 0.0,
            oblique: false,
        };
        Marker { crown, height_m: top - z, score: 1.0 }
    };
    let mut markers: Vec<Marker> = stems.stems.iter().filter(near).map(marker).collect();
    crate::blocks::sort_markers(&mut markers);
    markers
}

/// The trees with points in the tile: how many, and where.
fn trees(all: &Surroundings, claims: &[Claim]) -> Vec<TreeUnit> {
    let mut trees: BTreeMap<u64, TreeUnit> = BTreeMap::new();
    for (index, claim) in claims.iter().enumerate() {
        if claim.id == 0 || all.own[index].is_none() {
            continue;
        }
        let none = TreeUnit { tree_id: claim.id, points: 0, bounds: Bounds3::EMPTY };
        let tree = trees.entry(claim.id).or_insert(none);
        tree.points += 1;
        tree.bounds.include(all.cloud.world(index));
    }
    trees.into_values().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_holds_its_voxels_only() {
        let run = |column, bottom, len, stem| VoxelRun { column, bottom, len, stem };
        let runs = [run([0, 0], -3, 2, 1), run([0, 0], 5, 4, 2), run([1, 7], 0, 1, 3)];
        let stem = |column, z| run_at(&runs, column, z).map(|run| run.stem);
        let column = |z| stem([0, 0], z);
        assert_eq!(
            [-4, -3, -2, -1, 4, 5, 8, 9].map(column),
            [None, Some(1), Some(1), None, None, Some(2), Some(2), None]
        );
        assert_eq!((stem([1, 7], 0), stem([1, 6], 0)), (Some(3), None));
    }
}

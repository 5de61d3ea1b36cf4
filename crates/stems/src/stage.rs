//! The stages `stems` (a plot to its trees and their space) and `tree-cloud` (the points of one tree).

mod tree_cloud;

use crate::shown_ground::shows_ground;
use crate::slices::{SlicePoint, slices_of};
use crate::space::{Space, foot_m, trees};
use crate::voxels::Sample;
use crate::{Error, StemsParams, Voxels};
use timberline_artefact::kinds::{
    BaseSource, GroundPoints, Heights, PointTile, Stem, Stems, VoxelRun,
};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Facts, Kind, UnitKind, tree_id};
use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::{Bounds3, Frame, TileId};

pub use tree_cloud::TreeCloudStage;

/// Finding stems as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct StemsStage;

const INPUTS: &[InputSpec] = &[
    InputSpec::all(PointTile::NAME),
    InputSpec::all(GroundPoints::NAME),
    InputSpec::all(Heights::NAME),
];

impl Params for StemsParams {
    fn check(&self) -> Vec<String> {
        self.check()
    }
}

impl Stage for StemsStage {
    type Params = StemsParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "stems",
            version: 2,
            summary: "stems from circles on slices, and the space of each tree by comparative \
                      shortest paths (Tao et al. 2015)",
            unit: UnitKind::Campaign,
            inputs: INPUTS,
            outputs: &[Stems::NAME],
        }
    }

    fn memory_bytes(_: &StemsParams, points: u64) -> u64 {
        const BYTES_PER_POINT: u64 = 120;
        points * BYTES_PER_POINT
    }

    fn run(params: &StemsParams, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let (voxels, located) = voxels(inputs, params, context)?;
        let has_ground = shows_ground(&voxels, params.ground_share);
        let mut bounds = Bounds3::EMPTY;
        voxels.all.iter().for_each(|voxel| bounds.include(voxel.centroid_m()));
        let frame = if voxels.all.is_empty() { Frame::default() } else { Frame::near(bounds.min) };
        let foot_m = (!has_ground).then(|| foot_m(&voxels));
        let points = slice_points(inputs, &frame, foot_m, params, context)?;
        context.check_cancelled()?;
        let space = trees(&voxels, &points, &frame, has_ground, params)?;
        if !has_ground {
            let message = "the scan shows no ground: heights count from the lowest points";
            context.warn("campaign", message);
        }
        let stems = stems(&voxels, &space)?;
        let owned = space.owner.iter().filter(|owner| **owner != u32::MAX).count();
        let facts = Facts { frame: None, bounds: Some(bounds), ..located }
            .count("trees", stems.stems.len())
            .count("voxels", voxels.all.len())
            .count("voxels-of-trees", owned)
            .count("ground", usize::from(has_ground));
        context.emit(&stems, facts)?;
        Ok(())
    }
}

/// All points of the campaign, thinned, tile by tile; second, where the campaign lies.
fn voxels(
    inputs: &Inputs,
    params: &StemsParams,
    context: &Context<'_>,
) -> Result<(Voxels, Facts), StageError> {
    let mut voxels = Voxels::new(params.voxel_m);
    let mut located = Facts::default();
    for tile in inputs.tiles_of(PointTile::NAME) {
        context.check_cancelled()?;
        let part = Part::read(inputs, tile)?;
        let sample = |index: usize| Sample {
            world_m: part.points.cloud.world(index),
            height_m: part.heights.height_m.get(index).copied().unwrap_or(f32::NAN),
            is_ground: part.ground.ground.binary_search(&(index as u32)).is_ok(),
        };
        voxels.add((0..part.points.cloud.len()).map(sample));
        context.advance(part.points.cloud.len() as u64 / 2);
        located = part.located;
    }
    Ok((voxels.finish()?, Facts { bounds: None, ..located }))
}

/// One tile's artefacts.
struct Part {
    points: PointTile,
    heights: Heights,
    ground: GroundPoints,
    located: Facts,
}

impl Part {
    fn read(inputs: &Inputs, tile: TileId) -> Result<Self, timberline_artefact::Error> {
        let path = inputs.tile_path(PointTile::NAME, tile)?;
        let (header, points) = timberline_artefact::read::<PointTile>(path)?;
        Ok(Self {
            points,
            heights: inputs.of_tile(tile)?,
            ground: inputs.of_tile(tile)?,
            located: Facts::located_like(&header.facts),
        })
    }
}

/// The points within the heights of the search, in `frame`. Heights count from `foot_m`, if given.
fn slice_points(
    inputs: &Inputs,
    frame: &Frame,
    foot_m: Option<f64>,
    params: &StemsParams,
    context: &Context<'_>,
) -> Result<Vec<SlicePoint>, StageError> {
    let mut points = Vec::new();
    for tile in inputs.tiles_of(PointTile::NAME) {
        context.check_cancelled()?;
        let part = Part::read(inputs, tile)?;
        for index in 0..part.points.cloud.len() {
            let world = part.points.cloud.world(index);
            let known = part.heights.height_m.get(index).copied().unwrap_or(f32::NAN);
            let height_m = foot_m.map_or(f64::from(known), |foot| world[2] - foot);
            if !slices_of(height_m, params).is_empty() {
                let [x, y, z] = frame.local_from_world(world).map(quantise);
                points.push(SlicePoint { x, y, z, height_m });
            }
        }
        context.advance(part.points.cloud.len() as u64 / 2);
    }
    Ok(points)
}

/// Trees and voxels as they are stored, trees sorted by id.
fn stems(voxels: &Voxels, space: &Space) -> Result<Stems, Error> {
    let mut bounds = vec![Bounds3::EMPTY; space.trees.len()];
    for (voxel, owner) in voxels.all.iter().zip(&space.owner) {
        if let Some(bounds) = bounds.get_mut(*owner as usize) {
            bounds.include(voxel.centroid_m());
        }
    }
    let stem = |place: usize| {
        let tree = &space.trees[place];
        let base_source =
            if tree.on_ground { BaseSource::Ground } else { BaseSource::LowestPoints };
        Stem {
            tree_id: tree_id(tree.base_m[0], tree.base_m[1]),
            base_m: tree.base_m.map(quantise),
            base_source,
            dbh_m: tree.dbh_m.unwrap_or(f64::NAN),
            bounds: bounds[place],
        }
    };
    let mut order: Vec<(Stem, usize)> =
        (0..space.trees.len()).map(|place| (stem(place), place)).collect();
    order.sort_by_key(|(stem, place)| (stem.tree_id, *place));
    // Twins from one stool may share the 0.1 m that an id tells apart.
    for next in 1..order.len() {
        let after = order[next - 1].0.tree_id + 1;
        order[next].0.tree_id = order[next].0.tree_id.max(after);
    }
    let mut rank = vec![u32::MAX; space.trees.len()];
    (0..).zip(&order).for_each(|(new, (_, place))| rank[*place] = new);
    Ok(Stems {
        stems: order.into_iter().map(|(stem, _)| stem).collect(),
        voxel_m: voxels.edge_m(),
        runs: runs(voxels, &space.owner, &rank),
    })
}

/// Voxels of trees, those above each other joined.
fn runs(voxels: &Voxels, owner: &[u32], rank: &[u32]) -> Vec<VoxelRun> {
    let mut runs: Vec<VoxelRun> = Vec::new();
    for (voxel, owner) in voxels.all.iter().zip(owner) {
        let Some(&stem) = rank.get(*owner as usize) else { continue };
        let [column @ .., bottom] = voxel.index;
        match runs.last_mut() {
            Some(run)
                if (run.column, run.stem) == (column, stem)
                    && run.bottom + run.len as i32 == bottom =>
            {
                run.len += 1;
            }
            _ => runs.push(VoxelRun { column, bottom, len: 1, stem }),
        }
    }
    runs
}

//! The stage `tree-cloud`.

use crate::{Error, TreeCloudParams, wood};
use timberline_artefact::kinds::{Labels, PointTile, Stem, Stems, TreeCloud};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Facts, Kind, UnitKind};
use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::{Column, Frame, PointCloud};

/// Putting the points of one tree together as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct TreeCloudStage;

const INPUTS: &[InputSpec] =
    &[InputSpec::own(PointTile::NAME), InputSpec::own(Labels::NAME), InputSpec::own(Stems::NAME)];

impl Params for TreeCloudParams {}

impl Stage for TreeCloudStage {
    type Params = TreeCloudParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "tree-cloud",
            version: 2,
            summary: "the points of one tree, and how likely each is on wood",
            unit: UnitKind::Tree,
            inputs: INPUTS,
            outputs: &[TreeCloud::NAME],
        }
    }

    fn run(
        params: &TreeCloudParams,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let stem = stem(inputs, context)?;
        let (cloud, located) = gather(inputs, &stem, context)?;
        if cloud.len() < params.smallest_points as usize {
            let needed = params.smallest_points as usize;
            return Err(Error::TooFewPoints { what: "points", found: cloud.len(), needed }.into());
        }
        let mut cloud = in_whole_ticks(cloud.in_canonical_order());
        let positions: Vec<[f64; 3]> = (0..cloud.len()).map(|i| cloud.local(i)).collect();
        context.check_cancelled()?;
        let wood = wood::likelihood(&positions, params.wood_spacings)?;
        cloud.extra.insert(TreeCloud::WOOD.to_owned(), Column::F32(wood));
        context.advance(cloud.len() as u64);
        let local = cloud.bounds();
        let world = |corner| cloud.frame.world_from_local(corner);
        let bounds =
            timberline_pointcloud::Bounds3 { min: world(local.min), max: world(local.max) };
        let facts = Facts { frame: Some(cloud.frame), bounds: Some(bounds), ..located };
        let facts = facts.count("points", cloud.len());
        context.emit(&TreeCloud { stem, cloud }, facts)?;
        Ok(())
    }
}

fn stem(inputs: &Inputs, context: &Context<'_>) -> Result<Stem, StageError> {
    let missing = || timberline_artefact::Error::MissingInput {
        kind: Stems::NAME.to_owned(),
        unit: context.unit().to_string(),
    };
    let tree = inputs.unit().tree().ok_or_else(missing)?;
    for stems in inputs.each::<Stems>() {
        let (_, _, Stems { stems, .. }) = stems?;
        if let Some(stem) = stems.into_iter().find(|stem| stem.tree_id == tree) {
            return Ok(stem);
        }
    }
    Err(missing().into())
}

/// Positions in the frame as whole ticks, without what is lost of them far from the world's origin: the
/// same bits, and so the same choices among neighbours equally far, wherever the tree stands.
fn in_whole_ticks(mut cloud: PointCloud) -> PointCloud {
    for axis in [&mut cloud.x, &mut cloud.y, &mut cloud.z] {
        axis.iter_mut().for_each(|value| *value = quantise(*value));
    }
    cloud
}

/// The points with the tree's label, in a frame near its base.
fn gather(
    inputs: &Inputs,
    stem: &Stem,
    context: &Context<'_>,
) -> Result<(PointCloud, Facts), StageError> {
    let mut all = PointCloud::new(Frame::near(stem.base_m));
    let mut located = Facts::default();
    for tile in inputs.tiles_of(PointTile::NAME) {
        context.check_cancelled()?;
        let labels: Labels = inputs.of_tile(tile)?;
        let own: Vec<u32> = (0..labels.tree_id.len() as u32)
            .filter(|&index| labels.tree_id[index as usize] == stem.tree_id)
            .collect();
        if own.is_empty() {
            continue;
        }
        let path = inputs.tile_path(PointTile::NAME, tile)?;
        let (header, PointTile { cloud }) = timberline_artefact::read::<PointTile>(path)?;
        located = Facts::located_like(&header.facts);
        all.append(&cloud.select(&own))?;
    }
    Ok((all, Facts { grid: None, ..located }))
}

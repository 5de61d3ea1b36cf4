//! The stage `skeleton`: a tree's points, raw and consolidated, to its skeletons.

use crate::{Outcome, SkeletonParams, skeleton};
use timberline_artefact::kinds::{Consolidated, Skeletons, TreeCloud};
use timberline_artefact::kinds::{Skeleton as Wire, SkeletonNode};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Facts, Kind, UnitKind};
use timberline_pointcloud::PointCloud;

/// The skeletons of one tree.
#[derive(Debug, Clone, Copy)]
pub struct SkeletonStage;

impl Params for SkeletonParams {
    fn check(&self) -> Vec<String> {
        Self::check(self)
    }
}

const INPUTS: &[InputSpec] = &[InputSpec::own(TreeCloud::NAME), InputSpec::own(Consolidated::NAME)];

impl Stage for SkeletonStage {
    type Params = SkeletonParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "skeleton",
            version: 2,
            summary: "the branching axes of a tree by level sets of the distance from its base, or as AdTree makes them (Du et al. 2019)",
            unit: UnitKind::Tree,
            inputs: INPUTS,
            outputs: &[Skeletons::NAME],
        }
    }

    fn memory_bytes(_params: &SkeletonParams, points: u64) -> u64 {
        points * BYTES_PER_POINT
    }

    fn run(
        params: &SkeletonParams,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let (header, tree) = inputs.own::<TreeCloud>()?;
        let base = tree.cloud.frame.local_from_world(tree.stem.base_m);
        let wood = wood(&tree.cloud);
        let raw = skeleton(&positions(&tree.cloud), wood.as_deref(), Some(base), params)?;
        context.check_cancelled()?;
        warn(context, tree.stem.tree_id, &raw);
        let (_, consolidated) = inputs.own::<Consolidated>()?;
        let consolidated = if consolidated.cloud.is_empty() {
            None
        } else {
            Some(skeleton(&positions(&consolidated.cloud), None, Some(base), params)?)
        };
        context.advance(tree.cloud.len() as u64);
        let facts = Facts::located_like(&header.facts)
            .count("nodes", raw.skeleton.nodes.len())
            .count("branches", raw.skeleton.branches())
            .count("points-cut-off", raw.report.cut_off as usize);
        let consolidated = consolidated.map(|outcome| wire(&outcome));
        context.emit(&Skeletons { raw: wire(&raw), consolidated }, facts)?;
        Ok(())
    }
}

/// Peak memory: the example `skeletons` takes 437 MB for a million points; AdTree's triangulation more.
const BYTES_PER_POINT: u64 = 1000;

fn warn(context: &Context<'_>, tree_id: u64, outcome: &Outcome) {
    let report = &outcome.report;
    if report.cut_off > 0 {
        let message = format!(
            "{} of {} points in {} pieces lie beyond gaps too wide to bridge and have no branch",
            report.cut_off, report.points, report.pieces_cut_off
        );
        context.warn(format!("tree {tree_id}"), message);
    }
}

fn positions(cloud: &PointCloud) -> Vec<[f64; 3]> {
    (0..cloud.len()).map(|index| cloud.local(index)).collect()
}

/// The likelihood of wood where the cloud has it.
fn wood(cloud: &PointCloud) -> Option<Vec<f32>> {
    let column = cloud.extra.get(TreeCloud::WOOD)?;
    Some((0..cloud.len()).map(|index| column.value(index) as f32).collect())
}

fn wire(outcome: &Outcome) -> Wire {
    let node = |node: &crate::Node| SkeletonNode {
        position_m: node.position_m,
        parent: node.parent,
        radius_m: node.radius_m,
        points: node.points,
    };
    Wire { nodes: outcome.skeleton.nodes.iter().map(node).collect() }
}

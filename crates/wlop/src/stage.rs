//! The stage `consolidation`: the points of a tree to its consolidated points.

use crate::{Consolidated, ConsolidationParams, Tree, consolidate};
use timberline_artefact::kinds::{self, Consolidation, TreeCloud};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Facts, Kind, UnitKind};
use timberline_pointcloud::{Column, PointCloud};

/// Consolidation as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct ConsolidationStage;

const INPUTS: &[InputSpec] = &[InputSpec::own(TreeCloud::NAME)];

impl Params for ConsolidationParams {
    fn check(&self) -> Vec<String> {
        Self::check(self)
    }
}

impl Stage for ConsolidationStage {
    type Params = ConsolidationParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "consolidation",
            version: 2,
            summary: "points of a tree moved onto its surface: weighted locally optimal projection (Huang et al. 2009)",
            unit: UnitKind::Tree,
            inputs: INPUTS,
            outputs: &[kinds::Consolidated::NAME],
        }
    }

    fn memory_bytes(_params: &ConsolidationParams, points: u64) -> u64 {
        /// Columns twice, neighbours, and a lattice for each of some classes of radii. The example
        /// `consolidation` takes 740 bytes a point for a million points, the columns of the artefact not
        /// included.
        const BYTES_PER_POINT: u64 = 1000;
        points * BYTES_PER_POINT
    }

    fn run(
        params: &ConsolidationParams,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let (header, tree) = inputs.own::<TreeCloud>()?;
        context.check_cancelled()?;
        let points_m: Vec<[f64; 3]> = (0..tree.cloud.len()).map(|i| tree.cloud.local(i)).collect();
        let base_m = tree.cloud.frame.local_from_world(tree.stem.base_m);
        let dbh_m = Some(tree.stem.dbh_m).filter(|dbh| dbh.is_finite());
        let done = consolidate(&Tree { points_m: &points_m, base_m, dbh_m }, params)?;
        tell(&done, tree.stem.tree_id, context);
        context.advance(tree.cloud.len() as u64);
        let facts = Facts::located_like(&header.facts)
            .count("points", done.positions_m.len())
            .count("skipped", usize::from(done.skipped.is_some()));
        let cloud = moved(&tree.cloud, &done);
        context.emit(&kinds::Consolidated { consolidation: record(&done), cloud }, facts)?;
        Ok(())
    }
}

/// Warns of a tree that was skipped, unless nobody asked for it, and of a result that lies farther
/// from the points than these from each other.
fn tell(done: &Consolidated, tree_id: u64, context: &Context<'_>) {
    let subject = format!("tree {tree_id}");
    let effect = &done.effect;
    match &done.skipped {
        Some(crate::Skipped::NotAsked) => {}
        Some(why) => context.warn(subject, format!("not consolidated: {why}")),
        None if effect.distance_after_m > effect.distance_before_m => context.warn(
            subject,
            format!(
                "consolidation moved the surface away from the points: mean distance {:.2} mm \
                 instead of {:.2} mm",
                1e3 * effect.distance_after_m,
                1e3 * effect.distance_before_m
            ),
        ),
        None => {}
    }
}

fn record(done: &Consolidated) -> Consolidation {
    let effect = &done.effect;
    Consolidation {
        skipped: done.skipped.as_ref().map(ToString::to_string),
        points_before: effect.points_before as u64,
        points_after: effect.points_after as u64,
        points_left_alone: effect.points_left_alone as u64,
        thickness_before_m: effect.thickness_before_m,
        thickness_after_m: effect.thickness_after_m,
        distance_before_m: effect.distance_before_m,
        mean_shift_m: effect.distance_after_m,
    }
}

/// The points with their attributes at their new positions, in canonical order.
fn moved(cloud: &PointCloud, done: &Consolidated) -> PointCloud {
    let mut moved = cloud.select(&done.origins);
    for (i, at) in done.positions_m.iter().enumerate() {
        (moved.x[i], moved.y[i], moved.z[i]) = (at[0], at[1], at[2]);
    }
    let stem = done.stem.iter().map(|stem| u8::from(*stem)).collect();
    moved.extra.insert(kinds::Consolidated::STEM.to_owned(), Column::U8(stem));
    moved.in_canonical_order()
}

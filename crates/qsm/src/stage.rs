//! The stage `cylinders`: a tree's points and skeletons to its cylinder model.

use crate::dbh::{Dbh, TaperStep};
use crate::metrics::{Metrics, order_table};
use crate::{Choice, Model, ModelledTree, Params, RadiusSource, SkeletonNode, TreePoints, choose};
use timberline_artefact::kinds;
use timberline_artefact::kinds::{Consolidated, Qsm, Skeletons, TreeCloud};
use timberline_artefact::stage::{Context, InputSpec, Inputs, Stage, StageError, StageInfo};
use timberline_artefact::{Facts, Kind, UnitKind};
use timberline_pointcloud::PointCloud;
use timberline_solids::DistanceSummary;

/// The cylinder model of one tree.
#[derive(Debug, Clone, Copy)]
pub struct CylindersStage;

impl timberline_artefact::stage::Params for Params {
    fn check(&self) -> Vec<String> {
        Self::check(self)
    }
}

const INPUTS: &[InputSpec] = &[
    InputSpec::own(TreeCloud::NAME),
    InputSpec::own(Consolidated::NAME),
    InputSpec::own(Skeletons::NAME),
];

impl Stage for CylindersStage {
    type Params = Params;

    fn info() -> StageInfo {
        StageInfo {
            name: "cylinders",
            version: 2,
            summary: "cylinders fitted along branches, radii by isotonic regression and a pipe model, diameters and volumes",
            unit: UnitKind::Tree,
            inputs: INPUTS,
            outputs: &[Qsm::NAME],
        }
    }

    fn memory_bytes(_: &Params, points: u64) -> u64 {
        // Measured with a tree of a million points: its skeleton and model together took 496 MB.
        const BYTES_PER_POINT: u64 = 500;
        points * BYTES_PER_POINT
    }

    fn run(params: &Params, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let (header, TreeCloud { stem, cloud }) = inputs.own()?;
        let (_, skeletons) = inputs.own::<Skeletons>()?;
        let (_, consolidated) = inputs.own::<Consolidated>()?;
        let positions: Vec<[f64; 3]> = (0..cloud.len()).map(|index| cloud.local(index)).collect();
        let wood = wood(&cloud);
        let tree = TreePoints {
            points_m: &positions,
            wood: wood.as_deref(),
            base_m: cloud.frame.local_from_world(stem.base_m),
            dbh_m: Some(stem.dbh_m),
        };
        let raw = nodes(&skeletons.raw);
        let other = skeletons.consolidated.as_ref().map(nodes);
        context.check_cancelled()?;
        let mut choice = choose(&tree, &raw, other.as_deref(), params)?;
        if let Some(skipped) = consolidated.consolidation.skipped.filter(|_| other.is_none()) {
            choice.reason = format!("consolidation was skipped: {skipped}");
        }
        context.advance(cloud.len() as u64);
        warn(context, stem.tree_id, &choice.tree);
        let facts = facts(Facts::located_like(&header.facts), &choice);
        context.emit(&wire(&stem, choice), facts)?;
        Ok(())
    }
}

/// How likely each point is on wood, where the cloud has it.
fn wood(cloud: &PointCloud) -> Option<Vec<f32>> {
    let column = cloud.extra.get(TreeCloud::WOOD)?;
    Some((0..cloud.len()).map(|index| column.value(index) as f32).collect())
}

fn nodes(skeleton: &kinds::Skeleton) -> Vec<SkeletonNode> {
    let node = |node: &kinds::SkeletonNode| SkeletonNode {
        position_m: node.position_m,
        parent: node.parent,
        radius_m: node.radius_m,
    };
    skeleton.nodes.iter().map(node).collect()
}

/// Says what a reader of the model should know.
fn warn(context: &Context<'_>, tree_id: u64, tree: &ModelledTree) {
    let subject = || format!("tree {tree_id}");
    if tree.not_finite > 0 {
        let message = format!("{} points are not finite and were left out", tree.not_finite);
        context.warn(subject(), message);
    }
    let measured = tree.model.stem().iter().any(|c| c.source == RadiusSource::Measured);
    match &tree.metrics.dbh {
        None if !measured => context.warn(
            subject(),
            "nothing of the stem could be measured: no diameter at breast height".to_owned(),
        ),
        None => {
            context
                .warn(subject(), "the stem does not reach breast height: no diameter".to_owned());
        }
        Some(Dbh { source: RadiusSource::Interpolated, diameter_m, sd_m, .. }) => {
            let (diameter, sd) = (diameter_m * 100.0, sd_m * 100.0);
            let message = format!(
                "the stem could not be measured at breast height; {diameter:.1} cm +- {sd:.1} cm from the stem above or below"
            );
            context.warn(subject(), message);
        }
        Some(_) => {}
    }
}

fn facts(located: Facts, choice: &Choice) -> Facts {
    let model = &choice.tree.model;
    let from = |source| model.cylinders.iter().filter(|c| c.source == source).count();
    let orders = order_table(model).len();
    located
        .count("branches", model.branches.len())
        .count("branch-orders", orders)
        .count("cylinders", model.cylinders.len())
        .count("cylinders-measured", from(RadiusSource::Measured))
        .count("cylinders-interpolated", from(RadiusSource::Interpolated))
        .count("cylinders-inferred", from(RadiusSource::Inferred))
        .count("cylinders-unseen", choice.tree.unseen_cylinders)
        .count("consolidated", usize::from(choice.consolidated))
        .count("points-not-finite", choice.tree.not_finite)
}

fn wire(stem: &kinds::Stem, choice: Choice) -> Qsm {
    let Choice { tree, consolidated, reason, raw_mean_m, consolidated_mean_m } = choice;
    let (cylinders, branches) = wire_model(&tree.model);
    Qsm {
        tree_id: stem.tree_id,
        base_m: stem.base_m,
        base_source: stem.base_source,
        cylinders,
        branches,
        metrics: wire_metrics(tree.metrics),
        cloud_to_model: wire_distances(&tree.cloud_to_model),
        model_to_cloud: wire_distances(&tree.model_to_cloud),
        consolidation: kinds::ConsolidationEffect {
            used: consolidated,
            reason,
            raw_mean_m,
            consolidated_mean_m,
        },
    }
}

fn wire_model(model: &Model) -> (Vec<kinds::QsmCylinder>, Vec<kinds::QsmBranch>) {
    let cylinder = |c: &crate::ModelCylinder| kinds::QsmCylinder {
        start_m: c.solid.start_m,
        end_m: c.solid.end_m,
        radius_m: c.solid.radius_m,
        radius_sd_m: c.radius_sd_m,
        source: wire_source(c.source),
        arc_coverage: c.arc_coverage as f32,
        points: c.points,
        parent: c.parent,
        branch: c.branch,
    };
    let branch = |b: &crate::ModelBranch| kinds::QsmBranch {
        parent: b.parent,
        order: b.order,
        first: b.first,
        len: b.len,
    };
    (model.cylinders.iter().map(cylinder).collect(), model.branches.iter().map(branch).collect())
}

fn wire_metrics(metrics: Metrics) -> kinds::TreeMetrics {
    let dbh = |dbh: Dbh| kinds::Dbh {
        diameter_m: dbh.diameter_m,
        sd_m: dbh.sd_m,
        arc_coverage: dbh.arc_coverage as f32,
        points: dbh.points,
        source: wire_source(dbh.source),
    };
    let step = |step: TaperStep| kinds::TaperStep {
        height_m: step.height_m,
        diameter_m: step.diameter_m,
        source: wire_source(step.source),
    };
    kinds::TreeMetrics {
        dbh: metrics.dbh.map(dbh),
        height_m: metrics.height_m,
        crown_base_m: metrics.crown_base_m,
        crown_area_m2: metrics.crown_area_m2,
        crown_diameter_m: metrics.crown_diameter_m,
        stem_volume_m3: metrics.stem_volume_m3,
        thick_volume_m3: metrics.thick_volume_m3,
        thin_volume_m3: metrics.thin_volume_m3,
        surface_m2: metrics.surface_m2,
        length_m: metrics.length_m,
        taper: metrics.taper.into_iter().map(step).collect(),
    }
}

fn wire_source(source: RadiusSource) -> kinds::RadiusSource {
    match source {
        RadiusSource::Measured => kinds::RadiusSource::Measured,
        RadiusSource::Interpolated => kinds::RadiusSource::Interpolated,
        RadiusSource::Inferred => kinds::RadiusSource::Inferred,
    }
}

fn wire_distances(distances: &DistanceSummary) -> kinds::Distances {
    let DistanceSummary { count, mean_m, rms_m, p95_m, max_m } = *distances;
    kinds::Distances { count, mean_m, rms_m, p95_m, max_m }
}

//! The stage `crown-fit`.

use super::position::place;
use super::{BATCH, GRID_CELL_M};
use crate::params::CrownFitParams;
use crate::{Error, base, edge, footprint};
use rayon::prelude::*;
use timberline_artefact::kinds::{
    CrownStatus, Detection, Detections, PositionMethod, Tree, TreeFlag, Trees,
};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Aligned, Facts, Surroundings, UnitKind, gather};
use timberline_pointcloud::Grid2;
use timberline_pointcloud::frame::quantise;

/// Position, outline and the final table of the trees.
#[derive(Debug, Clone, Copy)]
pub struct CrownFitStage;

impl Params for CrownFitParams {
    fn check(&self) -> Vec<String> {
        self.faults()
    }
}

const FIT_INPUTS: &[InputSpec] = &[
    InputSpec::halo("points"),
    InputSpec::halo("heights"),
    InputSpec::halo("labels"),
    InputSpec::own("detections"),
];

impl Stage for CrownFitStage {
    type Params = CrownFitParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "crown-fit",
            version: 3,
            summary: "Position by an L1 paraboloid (Polewski et al.) or another method, outline and table of every tree",
            unit: UnitKind::Tile,
            inputs: FIT_INPUTS,
            outputs: &["trees"],
        }
    }

    fn halo_m(params: &Self::Params) -> f64 {
        params.reach_m + edge::MARGIN_M
    }

    fn run(
        params: &Self::Params,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let columns = [Aligned::Height, Aligned::Label];
        let near = gather(inputs, Self::halo_m(params), &columns)?;
        let (_, Detections { trees: found }) = inputs.own()?;
        check_reach(&found, params.reach_m)?;
        let grid = Grid2::new(&near.cloud.x, &near.cloud.y, GRID_CELL_M)?;
        let members = members(&near, &found);
        let mut trees = Vec::with_capacity(found.len());
        let work: Vec<_> = found.iter().zip(&members).collect();
        for batch in work.chunks(BATCH) {
            context.check_cancelled()?;
            let row = |(found, points): &(&Detection, &Vec<u32>)| {
                tree_of(found, points, &near, &grid, params, context)
            };
            trees.par_extend(batch.par_iter().map(row));
        }
        context.advance(near.own_len as u64);
        let facts = facts(near.located, &trees);
        context.emit(&Trees { trees }, facts)?;
        Ok(())
    }
}

fn check_reach(found: &[Detection], reach_m: f64) -> Result<(), Error> {
    match found.iter().map(|tree| &tree.model).find(|model| model.radius_m > reach_m) {
        None => Ok(()),
        Some(far) => Err(Error::Reach { tree: far.id, radius_m: far.radius_m, reach_m }),
    }
}

fn facts(located: Facts, trees: &[Tree]) -> Facts {
    let fitted = |tree: &&Tree| tree.position_method != PositionMethod::HighestPoint;
    let accepted = |tree: &&Tree| tree.status == CrownStatus::Accepted;
    located
        .count("trees", trees.len())
        .count("accepted", trees.iter().filter(accepted).count())
        .count("fitted", trees.iter().filter(fitted).count())
}

/// The points labelled with each tree, in the order of the trees.
fn members(near: &Surroundings, found: &[Detection]) -> Vec<Vec<u32>> {
    let mut members = vec![Vec::new(); found.len()];
    for (point, id) in near.tree_id.iter().enumerate().filter(|(_, id)| **id != 0) {
        if let Ok(place) = found.binary_search_by_key(id, |tree| tree.model.id) {
            members[place].push(point as u32);
        }
    }
    members
}

fn tree_of(
    found: &Detection,
    points: &[u32],
    near: &Surroundings,
    grid: &Grid2,
    params: &CrownFitParams,
    context: &Context<'_>,
) -> Tree {
    let (cloud, model) = (&near.cloud, &found.model);
    let apex = cloud.frame.local_from_world(model.apex_m);
    let mut tree = Tree { points: points.len() as u32, ..blank_row(found) };
    let mut flags = Vec::new();
    if model.status != CrownStatus::Accepted {
        flags.push(TreeFlag::ModelRejected);
    }
    if edge::at_survey_edge([&cloud.x, &cloud.y], grid, [apex[0], apex[1]], model.radius_m) {
        flags.push(TreeFlag::AtSurveyEdge);
    }
    if !points.is_empty() {
        let placed = place(&mut tree, points, near, params);
        flags.extend(placed.flags);
        if let Some(message) = placed.warning {
            context.warn(format!("tree {}", model.id), message);
        }
        add_outline(&mut tree, points, near, params);
    }
    tree.flags = flags.iter().fold(0, |bits, flag| bits | flag.bit());
    tree
}

/// A row with what the detection and its crown model say.
fn blank_row(Detection { model, score, origin }: &Detection) -> Tree {
    Tree {
        score: *score,
        origin: *origin,
        id: model.id,
        apex_m: model.apex_m,
        ground_m: quantise(model.apex_m[2] - model.height_m),
        height_m: model.height_m,
        position_m: [model.apex_m[0], model.apex_m[1]],
        shape: model.shape,
        parameters: model.parameters,
        status: model.status,
        crown_radius_m: model.radius_m,
        inliers: model.inliers,
        outliers: model.outliers,
        crown_base_m: f64::NAN,
        ..Tree::without_fit()
    }
}

/// Crown polygon, its size, and the crown's base.
fn add_outline(tree: &mut Tree, points: &[u32], near: &Surroundings, params: &CrownFitParams) {
    let height = |i: u32| f64::from(near.height_m[i as usize]);
    let apex = near.cloud.frame.local_from_world(tree.apex_m);
    let above = params.polygon_above * tree.height_m;
    let offset = |&i: &u32| {
        let [x, y, _] = near.cloud.local(i as usize);
        [x - apex[0], y - apex[1]]
    };
    let found = footprint::footprint(points.iter().filter(|&&i| height(i) >= above).map(offset));
    tree.crown_area_m2 = found.area_m2;
    tree.crown_diameter_max_m = found.max_diameter_m;
    tree.crown_diameter_mean_m = found.mean_diameter_m;
    if found.corners.len() > 2 {
        let world = |c: &[f64; 2]| [0, 1].map(|axis| quantise(tree.apex_m[axis] + c[axis]));
        tree.crown_m = found.corners.iter().map(world).collect();
    }
    let heights: Vec<f64> = points.iter().map(|&i| height(i)).collect();
    tree.crown_base_m = base::crown_base(&heights, params.base_density).unwrap_or(f64::NAN);
}

//! The stages `crown-models` and `crown-fit`: the only place here that reads and writes artefacts.

use crate::params::{CrownFitParams, CrownModelParams, Returns};
use crate::starsac::{self, Outcome, Rejection, Shape};
use crate::surface::{AxisBounds, Fit, Flag, L1, Method, Prior, Problem, Uncertainty, thin};
use crate::{Error, Window, base, edge, footprint};
use rayon::prelude::*;
use timberline_artefact::kinds::{
    CrownModel, CrownModels, CrownShape, CrownStatus, PositionMethod, Tree, TreeFlag, Trees,
    Treetop, Treetops,
};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Aligned, Facts, Surroundings, UnitKind, gather};
use timberline_pointcloud::Grid2;
use timberline_pointcloud::frame::quantise;

/// Trees fitted between two looks at whether to stop.
const BATCH: usize = 256;

/// Edge of the search grid's cells, m: a window spans a few.
const GRID_CELL_M: f64 = 2.0;

/// Score of a label above which its point is on the crown's surface.
const ON_SURFACE: f32 = 0.5;

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
            version: 1,
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
    let cloud = &near.cloud;
    let first_only = params.returns == Returns::First;
    let accept = |i: usize| {
        let wanted = !first_only || cloud.return_number[i] <= 1;
        wanted.then(|| f64::from(near.height_m[i]) >= params.min_height_m)
    };
    let apex = cloud.frame.local_from_world(top.apex_m);
    let half_width = params.half_width_m(top.height_m);
    let window = Window::gather([&cloud.x, &cloud.y, &cloud.z], grid, apex, half_width, accept);
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
    context.warn(format!("tree {}", model.id), message);
}

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
    InputSpec::own("crown-models"),
];

impl Stage for CrownFitStage {
    type Params = CrownFitParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "crown-fit",
            version: 1,
            summary: "Position by an L1 paraboloid (Polewski et al.), outline and table of every tree",
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
        let (_, CrownModels { models }) = inputs.own()?;
        check_reach(&models, params.reach_m)?;
        let grid = Grid2::new(&near.cloud.x, &near.cloud.y, GRID_CELL_M)?;
        let members = members(&near, &models);
        let mut trees = Vec::with_capacity(models.len());
        let work: Vec<_> = models.iter().zip(&members).collect();
        for batch in work.chunks(BATCH) {
            context.check_cancelled()?;
            let row = |(model, points): &(&CrownModel, &Vec<u32>)| {
                tree_of(model, points, &near, &grid, params, context)
            };
            let rows: Result<Vec<Tree>, Error> = batch.par_iter().map(row).collect();
            trees.extend(rows?);
        }
        context.advance(near.own_len as u64);
        let facts = facts(near.located, &trees);
        context.emit(&Trees { trees }, facts)?;
        Ok(())
    }
}

fn check_reach(models: &[CrownModel], reach_m: f64) -> Result<(), Error> {
    match models.iter().find(|model| model.radius_m > reach_m) {
        None => Ok(()),
        Some(far) => Err(Error::Reach { tree: far.id, radius_m: far.radius_m, reach_m }),
    }
}

fn facts(located: Facts, trees: &[Tree]) -> Facts {
    let fitted = |tree: &&Tree| tree.position_method == PositionMethod::L1;
    let accepted = |tree: &&Tree| tree.status == CrownStatus::Accepted;
    located
        .count("trees", trees.len())
        .count("accepted", trees.iter().filter(accepted).count())
        .count("fitted", trees.iter().filter(fitted).count())
}

/// The points labelled with each model's tree, in the order of the models.
fn members(near: &Surroundings, models: &[CrownModel]) -> Vec<Vec<u32>> {
    let mut members = vec![Vec::new(); models.len()];
    for (point, id) in near.tree_id.iter().enumerate().filter(|(_, id)| **id != 0) {
        if let Ok(place) = models.binary_search_by_key(id, |model| model.id) {
            members[place].push(point as u32);
        }
    }
    members
}

fn tree_of(
    model: &CrownModel,
    points: &[u32],
    near: &Surroundings,
    grid: &Grid2,
    params: &CrownFitParams,
    context: &Context<'_>,
) -> Result<Tree, Error> {
    let cloud = &near.cloud;
    let apex = cloud.frame.local_from_world(model.apex_m);
    let mut tree = Tree {
        points: points.len() as u32,
        position_m: [model.apex_m[0], model.apex_m[1]],
        ..blank_row(model)
    };
    let mut flags = Vec::new();
    if model.status != CrownStatus::Accepted {
        flags.push(TreeFlag::ModelRejected);
    }
    if edge::at_survey_edge([&cloud.x, &cloud.y], grid, [apex[0], apex[1]], model.radius_m) {
        flags.push(TreeFlag::AtSurveyEdge);
    }
    if !points.is_empty() {
        match position(model, points, near, params) {
            Ok(found) => add_fit(&mut tree, &found, &mut flags, context),
            Err(error @ Error::CellSize(_)) => return Err(error),
            Err(error) => {
                flags.push(TreeFlag::Underdetermined);
                warn_unfitted(model.id, &error.to_string(), context);
            }
        }
        add_outline(&mut tree, points, near, params);
    }
    tree.flags = flags.iter().fold(0, |bits, flag| bits | flag.bit());
    Ok(tree)
}

/// A row with what the crown model says.
fn blank_row(model: &CrownModel) -> Tree {
    Tree {
        id: model.id,
        apex_m: model.apex_m,
        ground_m: quantise(model.apex_m[2] - model.height_m),
        height_m: model.height_m,
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

/// Fits the points on the tree's surface, relative to its apex.
fn position(
    model: &CrownModel,
    points: &[u32],
    near: &Surroundings,
    params: &CrownFitParams,
) -> Result<(Fit, Option<Uncertainty>, usize), Error> {
    let on_surface = points.iter().filter(|&&i| near.score[i as usize] > ON_SURFACE);
    let world = on_surface.map(|&i| near.cloud.world(i as usize));
    let cells = thin(world, model.apex_m, params.cell_m)?;
    let bounds = AxisBounds::Exact {
        smallest_m: params.smallest_axis_m,
        largest_m: params.largest_axis_m,
    };
    let prior = Prior { centre: [0.0; 2], half_width_m: params.prior_half_width_m };
    let problem = Problem::new(&cells).with_prior(prior);
    let method = L1 { bounds, ..L1::default() };
    let found = method.fit(&problem)?;
    let uncertainty = method.uncertainty(&problem, &found)?;
    Ok((found, uncertainty, cells.len()))
}

fn warn_unfitted(id: u64, reason: &str, context: &Context<'_>) {
    context.warn(format!("tree {id}"), format!("no crown fit, highest point kept: {reason}"));
}

fn add_fit(
    tree: &mut Tree,
    (found, uncertainty, cells): &(Fit, Option<Uncertainty>, usize),
    flags: &mut Vec<TreeFlag>,
    context: &Context<'_>,
) {
    flags.extend(found.flags.iter().map(|flag| wire_flag(*flag)));
    let (Some(surface), Some(certificate)) = (&found.surface, &found.certificate) else {
        let reason = format!("{cells} cells do not determine a surface");
        return warn_unfitted(tree.id, &reason, context);
    };
    if let Some(shape) = surface.paraboloid().and_then(|paraboloid| paraboloid.shape()) {
        tree.semi_axes_m = shape.semiaxes_m;
    }
    tree.fit_residual_m = certificate.mean_residual_m();
    tree.position_standard_error_m = uncertainty.map_or(f64::NAN, |found| found.standard_error_m);
    if !found.flags.contains(&Flag::CentreOutsideData) {
        tree.position_method = PositionMethod::L1;
        tree.position_m = [0, 1].map(|axis| quantise(tree.apex_m[axis] + found.position[axis]));
    }
}

fn wire_flag(flag: Flag) -> TreeFlag {
    match flag {
        Flag::Underdetermined => TreeFlag::Underdetermined,
        Flag::NoRedundancy => TreeFlag::NoRedundancy,
        Flag::ShapeBoundActive => TreeFlag::ShapeBoundActive,
        Flag::PriorActive => TreeFlag::PriorActive,
        Flag::CentreOutsideData => TreeFlag::CentreOutsideData,
        Flag::OneSided => TreeFlag::OneSided,
        Flag::ImbalanceActive => TreeFlag::ImbalanceActive,
        Flag::NotElliptic => TreeFlag::NotElliptic,
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

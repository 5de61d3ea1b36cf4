//! All models of one tree.

use super::{Assessed, Case, Figures, Mode, Row, Source, Thinned};
use crate::Error;
use timberline_qsm::{ModelledTree, SkeletonNode, TreePoints, choose, model_tree};
use timberline_skeleton::{Method, SkeletonParams};
use timberline_wlop::{Consolidated, ConsolidationParams, Tree, consolidate};

/// Makes all models of one tree, as the stages `consolidation`, `skeleton` and `cylinders` do.
///
/// A model that cannot be made is a row that says why.
///
/// # Errors
/// When the points cannot be consolidated.
pub fn assess(case: &Case) -> Result<Assessed, Error> {
    let tree = Tree { points_m: &case.points_m, base_m: case.base_m, dbh_m: case.dbh_m };
    let paper = consolidate(&tree, &ConsolidationParams::paper())?;
    let default = consolidate(&tree, &ConsolidationParams::default())?;
    let rows = Mode::ALL.map(|mode| rows(case, mode, &paper, &default));
    Ok(Assessed {
        name: case.name.clone(),
        points: case.points_m.len(),
        thinned: [&paper, &default].map(thinned),
        rows: rows.into_iter().flatten().collect(),
    })
}

fn thinned(done: &Consolidated) -> Option<Thinned> {
    let effect = &done.effect;
    let (before_m, after_m) = (effect.thickness_before_m, effect.thickness_after_m);
    (before_m > 0.0).then_some(Thinned {
        points: effect.points_after,
        thickness_before_m: before_m,
        thickness_after_m: after_m,
    })
}

/// A skeleton, or why there is none.
type Skeleton = Result<Vec<SkeletonNode>, String>;

fn rows(case: &Case, mode: Mode, paper: &Consolidated, default: &Consolidated) -> Vec<Row> {
    let scanned = skeleton(&case.points_m, case.wood.as_deref(), case, mode);
    let of = |done: &Consolidated| match &done.skipped {
        Some(why) => Err(format!("skipped: {why}")),
        None => skeleton(&done.positions_m, None, case, mode),
    };
    let default = of(default);
    let mut rows: Vec<Row> =
        [(Source::Scanned, &scanned), (Source::Paper, &of(paper)), (Source::Default, &default)]
            .map(|(source, nodes)| modelled(case, mode, source, nodes))
            .into();
    if mode == Mode::Default {
        rows.push(kept(case, &scanned, &default));
    }
    rows
}

fn skeleton(points_m: &[[f64; 3]], wood: Option<&[f32]>, case: &Case, mode: Mode) -> Skeleton {
    let method = match mode {
        Mode::Adtree => Method::Adtree,
        Mode::Default => Method::Levels,
    };
    let params = SkeletonParams { method, ..SkeletonParams::default() };
    let found = timberline_skeleton::skeleton(points_m, wood, Some(case.base_m), &params)
        .map_err(|error| error.to_string())?;
    let node = |node: &timberline_skeleton::Node| SkeletonNode {
        position_m: node.position_m,
        parent: node.parent,
        radius_m: node.radius_m,
    };
    Ok(found.skeleton.nodes.iter().map(node).collect())
}

fn points(case: &Case) -> TreePoints<'_> {
    let Case { points_m, wood, base_m, dbh_m, .. } = case;
    TreePoints { points_m, wood: wood.as_deref(), base_m: *base_m, dbh_m: *dbh_m }
}

fn params(mode: Mode) -> timberline_qsm::Params {
    match mode {
        Mode::Adtree => timberline_qsm::Params::adtree(),
        Mode::Default => timberline_qsm::Params::default(),
    }
}

fn modelled(case: &Case, mode: Mode, source: Source, nodes: &Skeleton) -> Row {
    let made = nodes.as_ref().map_err(Clone::clone).and_then(|nodes| {
        model_tree(&points(case), nodes, &params(mode)).map_err(|error| error.to_string())
    });
    match made {
        Ok(tree) => Row { mode, source, figures: Some(figures(&tree)), remark: String::new() },
        Err(remark) => Row { mode, source, figures: None, remark },
    }
}

/// What the stage `cylinders` keeps.
fn kept(case: &Case, scanned: &Skeleton, default: &Skeleton) -> Row {
    let row = |figures, remark| Row { mode: Mode::Default, source: Source::Kept, figures, remark };
    let scanned = match scanned {
        Ok(nodes) => nodes,
        Err(why) => return row(None, why.clone()),
    };
    let consolidated = default.as_ref().ok().map(Vec::as_slice);
    match choose(&points(case), scanned, consolidated, &params(Mode::Default)) {
        Ok(choice) if choice.consolidated => {
            row(Some(figures(&choice.tree)), "consolidated".to_owned())
        }
        Ok(choice) => {
            let why = default.as_ref().err().unwrap_or(&choice.reason);
            row(Some(figures(&choice.tree)), format!("scanned: {why}"))
        }
        Err(error) => row(None, error.to_string()),
    }
}

fn figures(tree: &ModelledTree) -> Figures {
    Figures {
        cloud_to_model: tree.cloud_to_model,
        model_to_cloud: tree.model_to_cloud,
        dbh_m: tree.metrics.dbh.as_ref().map(|dbh| dbh.diameter_m),
        branches: tree.model.branches.len(),
        cylinders: tree.model.cylinders.len(),
    }
}

//! One tree from one skeleton, or from the better of two.

use crate::bound::Bound;
use crate::build::{Built, build};
use crate::distances::{cloud_to_model, model_to_cloud, unseen_cylinders};
use crate::measure::Owned;
use crate::metrics::metrics;
use crate::points::Points;
use crate::{Error, ModelledTree, Params, SkeletonNode, TreePoints};

/// A tree with what consolidation brought to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// The tree from the skeleton that was kept.
    pub tree: ModelledTree,
    /// Whether that is the one from consolidated points.
    pub consolidated: bool,
    /// Why it is not, if not.
    pub reason: String,
    /// Mean distance from the points to the model from the points as scanned, m.
    pub raw_mean_m: f64,
    /// Mean distance from the points to the model from consolidated points, m; NaN if not made.
    pub consolidated_mean_m: f64,
}

/// Models a tree along a skeleton.
///
/// # Errors
/// What is wrong with parameters, points or skeleton.
pub fn model_tree(
    tree: &TreePoints<'_>,
    skeleton: &[SkeletonNode],
    params: &Params,
) -> Result<ModelledTree, Error> {
    check(params)?;
    modelled(&Points::new(tree)?, tree, skeleton, params)
}

/// Models a tree along the skeleton from the points as scanned and, where there is one, along that
/// from consolidated points, and keeps the second if the mean distance from the points to its model is
/// not larger. Radii rest on the points as scanned with either.
///
/// # Errors
/// As [`model_tree`]; a consolidated skeleton that cannot be used is a reason, not an error.
pub fn choose(
    tree: &TreePoints<'_>,
    raw: &[SkeletonNode],
    consolidated: Option<&[SkeletonNode]>,
    params: &Params,
) -> Result<Choice, Error> {
    check(params)?;
    let points = Points::new(tree)?;
    let from_raw = modelled(&points, tree, raw, params)?;
    let raw_mean_m = from_raw.cloud_to_model.mean_m;
    let kept = |reason: String, consolidated_mean_m: f64, tree: ModelledTree| Choice {
        tree,
        consolidated: false,
        reason,
        raw_mean_m,
        consolidated_mean_m,
    };
    let Some(consolidated) = consolidated else {
        return Ok(kept("there is no consolidated skeleton".to_owned(), f64::NAN, from_raw));
    };
    let other = match modelled(&points, tree, consolidated, params) {
        Ok(other) => other,
        Err(error) => return Ok(kept(format!("consolidated: {error}"), f64::NAN, from_raw)),
    };
    let mean_m = other.cloud_to_model.mean_m;
    if mean_m > raw_mean_m {
        let (from, to) = (raw_mean_m * 1e3, mean_m * 1e3);
        let reason = format!("the mean distance would rise from {from:.2} to {to:.2} mm");
        return Ok(kept(reason, mean_m, from_raw));
    }
    Ok(Choice {
        tree: other,
        consolidated: true,
        reason: String::new(),
        raw_mean_m,
        consolidated_mean_m: mean_m,
    })
}

fn check(params: &Params) -> Result<(), Error> {
    let wrong = params.check();
    if wrong.is_empty() { Ok(()) } else { Err(Error::Params(wrong)) }
}

fn modelled(
    points: &Points,
    tree: &TreePoints<'_>,
    skeleton: &[SkeletonNode],
    params: &Params,
) -> Result<ModelledTree, Error> {
    let bound = Bound::of(tree, params.breast_height_m);
    let Built { model, owner, noise_m, pipe } = build(points, skeleton, bound.as_ref(), params)?;
    let wood = points.wood.as_deref();
    let owned = Owned::new(&points.points_m, wood, &owner, model.cylinders.len());
    let metrics = metrics(&model, &points.points_m, &owned, tree.base_m, noise_m, params);
    Ok(ModelledTree {
        cloud_to_model: cloud_to_model(&points.points_m, &model),
        model_to_cloud: model_to_cloud(&points.points_m, &owner, &model)?,
        unseen_cylinders: unseen_cylinders(&owner, &model),
        model,
        metrics,
        noise_m,
        pipe,
        not_finite: points.not_finite,
    })
}

//! StarSac: a crown surface around every treetop by sample consensus.
//!
//! After Tittmann, Shafii, Hartsough and Hamann 2011, Tree detection and delineation from LiDAR
//! point clouds using RANSAC. Three ways to fit, all on the same [`Window`]: the paper's drawn
//! one-parameter models, the exact optimum of the paper's score, and a two-parameter model that is
//! scored together with its extent.

mod consensus;
mod extent;
mod lad;
mod model;
mod two_parameter;

pub use consensus::{Consensus, draws, exact, sampled};
pub use extent::{Extent, Scoring};
pub use lad::{Row, refine as least_absolute_deviations};
pub use model::{Interval, Model, Shape};
pub use two_parameter::{Effort, search as search_two_parameter, through_two};

use crate::Window;
use crate::params::{CrownModelParams, Method, OutlierScope, RadiusRule, ShapeChoice};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde::{Deserialize, Serialize};

/// Why a treetop has no accepted crown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rejection {
    /// Fewer points in the window or on the surface than inliers asked for.
    TooFewPoints,
    /// No surface opens downward through any point tried.
    NoModel,
    /// Too many outliers per inlier.
    TooManyOutliers,
}

impl Rejection {
    /// The reason in words, for warnings and tables.
    #[must_use]
    pub fn reason(self) -> &'static str {
        match self {
            Self::TooFewPoints => "too few points on a crown around the treetop",
            Self::NoModel => "no surface opens downward from the treetop",
            Self::TooManyOutliers => "too many points off the crown's surface",
        }
    }
}

/// A surface fitted to a window.
#[derive(Debug, Clone, PartialEq)]
pub struct CrownModel {
    /// The surface.
    pub model: Model,
    /// Crown radius, m.
    pub radius_m: f64,
    /// The inliers within the radius, as places in the window, ascending.
    pub inliers: Vec<u32>,
    /// Number of outliers, within the radius or in the window as the parameters say.
    pub outliers: u32,
    /// Mean distance of the inliers from the surface ([`Model::distance`]), m.
    pub mean_residual_m: f64,
}

impl CrownModel {
    /// The paper's measure of quality: the number of inliers.
    #[must_use]
    pub fn grade(&self) -> u32 {
        self.inliers.len() as u32
    }

    /// Outliers per inlier; infinite without inliers.
    #[must_use]
    pub fn outlier_ratio(&self) -> f64 {
        f64::from(self.outliers) / f64::from(self.grade())
    }
}

/// What came of a window: a model, or why there is none to be trusted (or both: a model that was
/// rejected for its quality is still told).
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The model, unless none could be fitted.
    pub crown: Option<CrownModel>,
    /// Why the crown is not accepted; `None` when it is.
    pub rejection: Option<Rejection>,
}

impl Outcome {
    fn none(rejection: Rejection) -> Self {
        Self { crown: None, rejection: Some(rejection) }
    }

    /// The crown if it was accepted.
    #[must_use]
    pub fn accepted(&self) -> Option<&CrownModel> {
        self.crown.as_ref().filter(|_| self.rejection.is_none())
    }
}

/// Fits the crown in a window. `seed` is all that randomness depends on: the tree's id.
#[must_use]
pub fn fit_window(window: &Window, params: &CrownModelParams, seed: u64) -> Outcome {
    if window.eligible() < params.min_inliers.max(2) as usize {
        return Outcome::none(Rejection::TooFewPoints);
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let found = match params.method {
        Method::TwoParameter => two_parameter_crown(window, params, &mut random),
        Method::Exact | Method::Sampled => one_parameter_crown(window, params, &mut random),
    };
    match found {
        None => Outcome::none(Rejection::NoModel),
        Some(crown) => {
            let rejection = judge(&crown, params);
            Outcome { crown: Some(crown), rejection }
        }
    }
}

fn judge(crown: &CrownModel, params: &CrownModelParams) -> Option<Rejection> {
    if crown.grade() < params.min_inliers {
        Some(Rejection::TooFewPoints)
    } else if crown.outlier_ratio() > params.max_outlier_ratio {
        Some(Rejection::TooManyOutliers)
    } else {
        None
    }
}

fn scoring(params: &CrownModelParams) -> Scoring {
    Scoring { tolerance_m: params.tolerance_m, outlier_cost: params.outlier_cost }
}

fn two_parameter_crown(
    window: &Window,
    params: &CrownModelParams,
    random: &mut ChaCha8Rng,
) -> Option<CrownModel> {
    let effort = Effort {
        draws: draws(params.confidence, params.inlier_share, 2),
        scored_points: params.scored_points as usize,
    };
    let (model, extent) = search_two_parameter(window, &scoring(params), effort, random)?;
    Some(with_extent(window, params, model, extent.points))
}

fn one_parameter_crown(
    window: &Window,
    params: &CrownModelParams,
    random: &mut ChaCha8Rng,
) -> Option<CrownModel> {
    let shapes: &[Shape] = match params.shape {
        ShapeChoice::Paraboloid => &[Shape::Paraboloid],
        ShapeChoice::Cone => &[Shape::Cone],
        ShapeChoice::Blend => &[Shape::Blend],
        ShapeChoice::Best => &[Shape::Paraboloid, Shape::Cone, Shape::Blend],
    };
    let trials = draws(params.confidence, params.inlier_share, 1);
    let fit = |&shape: &Shape| match params.method {
        Method::Sampled => sampled(shape, window, params.tolerance_m, trials, random),
        _ => exact(shape, window, params.tolerance_m),
    };
    let best = shapes.iter().map(fit).fold(None, Consensus::better)?;
    let points = points_within(window, params, &best.model)?;
    Some(with_extent(window, params, best.model, points))
}

/// How many of the window's points the radius rule takes in.
fn points_within(window: &Window, params: &CrownModelParams, model: &Model) -> Option<usize> {
    let inlier = |&i: &usize| model.residual(window.r[i], window.h[i]).abs() < params.tolerance_m;
    let inliers: Vec<usize> = (0..window.len()).filter(inlier).collect();
    match params.radius_rule {
        RadiusRule::Farthest => inliers.last().map(|&last| last + 1),
        RadiusRule::Quantile => {
            let rank = (params.radius_quantile * inliers.len() as f64).ceil() as usize;
            inliers.get(rank.max(1) - 1).map(|&last| last + 1)
        }
        RadiusRule::Contiguous => {
            scoring(params).extent(model, window, 0.0).map(|extent| extent.points)
        }
    }
}

/// The crown of a surface cut off after `points` of the window's points.
fn with_extent(
    window: &Window,
    params: &CrownModelParams,
    model: Model,
    points: usize,
) -> CrownModel {
    let radius_m = points.checked_sub(1).map_or(0.0, |last| window.r[last]);
    let mut inliers = Vec::new();
    let mut sum = 0.0;
    for place in 0..points {
        let residual = model.distance(window.r[place], window.h[place]).abs();
        if residual < params.tolerance_m {
            inliers.push(place as u32);
            sum += residual;
        }
    }
    let among = match params.outlier_scope {
        OutlierScope::Window => window.len(),
        OutlierScope::Radius => points,
    };
    let outliers = (among - inliers.len()) as u32;
    let mean_residual_m = if inliers.is_empty() { 0.0 } else { sum / inliers.len() as f64 };
    CrownModel { model, radius_m, inliers, outliers, mean_residual_m }
}

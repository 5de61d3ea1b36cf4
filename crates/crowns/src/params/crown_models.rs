//! Parameters of the stage `crown-models`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a crown model is sought.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// h = b1 r + b2 r², MSAC with extent, L1 refinement.
    TwoParameter,
    /// A one-parameter model with the largest consensus there is (deterministic).
    Exact,
    /// A one-parameter model through randomly drawn points, as Tittmann et al. 2011 describe.
    Sampled,
}

/// Which one-parameter model the methods `exact` and `sampled` fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ShapeChoice {
    /// h = -a r².
    Paraboloid,
    /// h = r / sqrt(a).
    Cone,
    /// h = α r² + (1 - α) r.
    Blend,
    /// Whichever of the three has the largest consensus.
    Best,
}

/// Which echoes a crown model looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Returns {
    /// First returns (and those of files that do not say): the canopy's surface.
    First,
    /// All returns.
    All,
}

/// How the crown radius follows from the inliers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RadiusRule {
    /// Distance of the farthest inlier in the window (Tittmann et al. 2011).
    Farthest,
    /// Quantile `radius_quantile` of the inliers' distances.
    Quantile,
    /// Distance at which, going out, outliers begin to outweigh inliers (weighted by
    /// `outlier_cost`).
    Contiguous,
}

/// Which points count as outliers when a model is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OutlierScope {
    /// All of the window (Tittmann et al. 2011).
    Window,
    /// Those within the crown radius.
    Radius,
}

/// What is further above the apex of a tree below other crowns belongs to those, m.
const COVER_GAP_M: f64 = 2.0;

/// Parameters of the stage `crown-models`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CrownModelParams {
    /// How a model is sought.
    #[schemars(extend("x-source" = "Tittmann et al. 2011, section 3; two-parameter: this program"))]
    pub method: Method,
    /// The model of the methods `exact` and `sampled`.
    #[schemars(extend("x-source" = "Tittmann et al. 2011, eqs 6 to 8"))]
    pub shape: ShapeChoice,
    /// Edge of the square window around each treetop; half of it bounds what a crown can be.
    #[schemars(range(min = 1.0, max = 60.0), extend("x-unit" = "m", "x-source" = "Tittmann et al. 2011, section 3"))]
    pub window_m: f64,
    /// Half width of the window per metre of tree height, where that is less than `window_m` / 2;
    /// 0 for windows of one size, as in the paper.
    #[schemars(range(min = 0.0, max = 5.0), extend("x-unit" = "1", "x-source" = "this program: crowns are rarely wider than tall"))]
    pub window_per_height: f64,
    /// Which echoes are looked at around treetops over which nothing hangs. Below other crowns it is
    /// all of them, but for those far above the apex.
    #[schemars(extend("x-source" = "this program"))]
    pub returns: Returns,
    /// Points lower than this above the ground are in no crown.
    #[schemars(range(min = 0.0, max = 30.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub min_height_m: f64,
    /// Points nearer to the surface than this are inliers: at right angles to the surface for the
    /// method `two-parameter`, vertically for the paper's models.
    #[schemars(range(min = 0.01, max = 10.0), extend("x-unit" = "m", "x-source" = "Tittmann et al. 2011, section 3 (epsilon)"))]
    pub tolerance_m: f64,
    /// Probability that at least one draw is of inliers only.
    #[schemars(range(min = 0.5, max = 0.999_999), extend("x-unit" = "1", "x-source" = "Tittmann et al. 2011, eq 5"))]
    pub confidence: f64,
    /// Share of a window's points expected to be inliers; with `confidence` it gives the number of
    /// draws.
    #[schemars(range(min = 0.02, max = 1.0), extend("x-unit" = "1", "x-source" = "Tittmann et al. 2011, eq 5 (c/N)"))]
    pub inlier_share: f64,
    /// Points on which the draws of the method `two-parameter` are scored; denser windows are
    /// thinned to as many.
    #[schemars(range(min = 50, max = 1_000_000), extend("x-unit" = "points", "x-source" = "this program"))]
    pub scored_points: u32,
    /// How the radius follows from the inliers of a one-parameter model (`two-parameter` finds
    /// model and radius together, as `contiguous`).
    #[schemars(extend("x-source" = "Tittmann et al. 2011, section 3: farthest"))]
    pub radius_rule: RadiusRule,
    /// Quantile for `radius_rule = "quantile"`.
    #[schemars(range(min = 0.1, max = 1.0), extend("x-unit" = "1", "x-source" = "this program"))]
    pub radius_quantile: f64,
    /// What an outlier within the radius costs, an inlier gaining at most 1: at c, the crown ends
    /// where fewer than c / (1 + c) of the points are on its surface.
    #[schemars(range(min = 0.01, max = 10.0), extend("x-unit" = "1", "x-source" = "this program"))]
    pub outlier_cost: f64,
    /// Which points count as outliers when a model is judged.
    #[schemars(extend("x-source" = "Tittmann et al. 2011, section 3: window"))]
    pub outlier_scope: OutlierScope,
    /// A model with fewer inliers is rejected.
    #[schemars(range(min = 1, max = 100_000), extend("x-unit" = "points", "x-source" = "Tittmann et al. 2011, section 3 (grade)"))]
    pub min_inliers: u32,
    /// A model with more outliers per inlier is rejected.
    #[schemars(range(min = 0.0, max = 1.0e9), extend("x-unit" = "1", "x-source" = "Tittmann et al. 2011, section 3"))]
    pub max_outlier_ratio: f64,
}

impl Default for CrownModelParams {
    fn default() -> Self {
        Self {
            method: Method::TwoParameter,
            shape: ShapeChoice::Best,
            window_m: 20.0,
            window_per_height: 0.5,
            returns: Returns::First,
            min_height_m: 1.0,
            tolerance_m: 0.6,
            confidence: 0.99,
            inlier_share: 0.2,
            scored_points: 800,
            radius_rule: RadiusRule::Contiguous,
            radius_quantile: 0.95,
            outlier_cost: 0.35,
            outlier_scope: OutlierScope::Radius,
            min_inliers: 4,
            max_outlier_ratio: 2.0,
        }
    }
}

impl CrownModelParams {
    /// The settings of Tittmann et al. 2011: fixed windows, drawn one-parameter models, farthest
    /// inlier as radius, every other point of the window an outlier.
    #[must_use]
    pub fn paper(shape: ShapeChoice) -> Self {
        Self {
            method: Method::Sampled,
            shape,
            window_per_height: 0.0,
            returns: Returns::All,
            radius_rule: RadiusRule::Farthest,
            outlier_scope: OutlierScope::Window,
            max_outlier_ratio: 10.0,
            tolerance_m: 0.8,
            ..Self::default()
        }
    }

    /// Whether a point is looked at by the model of a tree over which something hangs
    /// (`cover_m` above 0), or nothing: below other crowns all echoes count, and what is far above
    /// the apex is of those crowns. `dz_m` is the point's elevation above the apex.
    #[must_use]
    pub fn is_seen(&self, is_first: bool, dz_m: f64, cover_m: f64) -> bool {
        if cover_m > 0.0 { dz_m <= COVER_GAP_M } else { is_first || self.returns == Returns::All }
    }

    /// Half width of the window around a tree of the given height, m.
    #[must_use]
    pub fn half_width_m(&self, tree_height_m: f64) -> f64 {
        let full = 0.5 * self.window_m;
        if self.window_per_height > 0.0 {
            full.min(self.window_per_height * tree_height_m.max(1.0))
        } else {
            full
        }
    }

    /// The largest radius a model can have: half the window's diagonal, m.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        0.5 * self.window_m * std::f64::consts::SQRT_2
    }

    /// What ranges of single fields do not catch.
    #[must_use]
    pub fn faults(&self) -> Vec<String> {
        let mut faults = Vec::new();
        if self.tolerance_m >= 0.5 * self.window_m {
            faults.push(format!(
                "tolerance_m {} is not small against window_m {}",
                self.tolerance_m, self.window_m
            ));
        }
        faults
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_shrink_with_the_tree() {
        let params = CrownModelParams::default();
        assert_eq!(params.half_width_m(8.0), 4.0);
        assert_eq!(params.half_width_m(40.0), 10.0);
        assert_eq!(CrownModelParams::paper(ShapeChoice::Cone).half_width_m(3.0), 10.0);
    }

    #[test]
    fn defaults_are_sound() {
        assert!(CrownModelParams::default().faults().is_empty());
    }
}

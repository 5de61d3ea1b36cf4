//! Crown models around the treetops of a tile. Raise the version when the fields or their
//! meaning change, and that of `detections`.

use super::table_kind;
use serde::{Deserialize, Serialize};

/// Crown models of the treetops of a tile, sorted by id: one for every treetop, also the rejected.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CrownModels {
    /// The models.
    pub models: Vec<CrownModel>,
}

/// Form of a crown surface: depth h below the apex as a function of the horizontal distance r.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum CrownShape {
    /// h = -a r^2.
    Paraboloid,
    /// h = r / sqrt(a).
    Cone,
    /// h = alpha r^2 + (1 - alpha) r.
    Blend,
    /// h = b1 r + b2 r^2; the only one whose residuals are at right angles to the surface (the
    /// vertical residual times the cosine of the slope), all others being vertical.
    #[default]
    Mixed,
}

/// Whether a model stands, and if not, why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum CrownStatus {
    /// The model stands.
    #[default]
    Accepted,
    /// Too few points in the window or on the surface.
    TooFewPoints,
    /// Outliers outnumber inliers by more than the allowed ratio.
    TooManyOutliers,
    /// No point gives an admissible model.
    NoModel,
}

/// One crown model.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct CrownModel {
    /// Tree id.
    pub id: u64,
    /// World position of the apex, metres.
    pub apex_m: [f64; 3],
    /// Height of the apex above ground, metres.
    pub height_m: f64,
    /// Form.
    pub shape: CrownShape,
    /// Parameters: `[a, 0]`, `[alpha, 0]` or `[b1, b2]`.
    pub parameters: [f64; 2],
    /// Crown radius, metres.
    pub radius_m: f64,
    /// Grade: number of inliers.
    pub inliers: u32,
    /// Number of outliers, in the window or within the radius as the stage's parameters say.
    pub outliers: u32,
    /// Residuals within this are inliers, metres.
    pub tolerance_m: f64,
    /// Mean absolute residual of the inliers, metres.
    pub residual_m: f64,
    /// Whether the model stands.
    pub status: CrownStatus,
}

impl CrownModel {
    /// The coefficients of h = b1 r + b2 r^2, as which every form can be written.
    #[must_use]
    pub fn coefficients(&self) -> [f64; 2] {
        let [first, second] = self.parameters;
        match self.shape {
            CrownShape::Paraboloid => [0.0, -first],
            CrownShape::Cone => [1.0 / first.sqrt(), 0.0],
            CrownShape::Blend => [1.0 - first, first],
            CrownShape::Mixed => [first, second],
        }
    }
}

table_kind!(CrownModels, "crown-models", 1, "consensus crown models around the treetops of a tile");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_has_two_coefficients() {
        let of = |shape, parameters| CrownModel { shape, parameters, ..CrownModel::default() };
        assert_eq!(of(CrownShape::Paraboloid, [-0.5, 0.0]).coefficients(), [0.0, 0.5]);
        assert_eq!(of(CrownShape::Cone, [0.25, 0.0]).coefficients(), [2.0, 0.0]);
        assert_eq!(of(CrownShape::Blend, [0.25, 0.0]).coefficients(), [0.75, 0.25]);
        assert_eq!(of(CrownShape::Mixed, [0.3, 0.1]).coefficients(), [0.3, 0.1]);
    }
}

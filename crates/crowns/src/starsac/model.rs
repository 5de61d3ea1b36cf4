//! The crown models: depth below the apex as a function of the distance from its axis.

use serde::{Deserialize, Serialize};

/// The family a model belongs to. All have their peak at the apex and are written as
/// `h = b1 r + b2 r²` with h the depth below the apex and r the horizontal distance, in metres.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shape {
    /// h = -a r² with a < 0 (Tittmann et al. 2011, section 3): b1 = 0, b2 = -a.
    Paraboloid,
    /// h = r / sqrt(a) with a > 0: b1 = 1 / sqrt(a), b2 = 0.
    Cone,
    /// The "shape-shifter" h = α r² + (1 - α) r with α from 0 to 1: b1 = 1 - α, b2 = α. It has no
    /// scale (α = 0 is a cone of slope 1) and is meant for metres.
    Blend,
    /// Both coefficients free and not negative: holds the other three.
    TwoParameter,
}

/// A crown's surface around its apex.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// The family.
    pub shape: Shape,
    /// Depth per metre of distance; not negative.
    pub b1: f64,
    /// Depth per square metre of distance, 1/m; not negative.
    pub b2: f64,
}

impl Model {
    /// Depth of the surface below the apex at a distance from the axis, m.
    #[must_use]
    pub fn depth(&self, r: f64) -> f64 {
        r * (self.b1 + self.b2 * r)
    }

    /// How far a point lies below the surface, m; negative above it.
    #[must_use]
    pub fn residual(&self, r: f64, h: f64) -> f64 {
        h - self.depth(r)
    }

    /// The measure in which a point is near the surface or not, m; negative above it.
    ///
    /// The paper's models measure vertically. On the flank of a conifer, falling 5 m per metre, an
    /// echo that is off by the width of its footprint is then metres off: the two-parameter model
    /// measures at right angles to the surface (to first order), so that one tolerance fits steep
    /// and flat crowns alike.
    #[must_use]
    pub fn distance(&self, r: f64, h: f64) -> f64 {
        match self.shape {
            Shape::TwoParameter => self.residual(r, h) * self.obliquity(r),
            _ => self.residual(r, h),
        }
    }

    /// Cosine of the surface's slope at a distance from the axis.
    #[must_use]
    pub fn obliquity(&self, r: f64) -> f64 {
        let slope = self.b1 + 2.0 * self.b2 * r;
        1.0 / (1.0 + slope * slope).sqrt()
    }
}

/// The parameter values for which a point is an inlier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interval {
    /// None.
    Never,
    /// All.
    Always,
    /// Those strictly between.
    Between(f64, f64),
}

/// Distances and their distance from 1 below which a division would only amplify rounding, m.
const TINY: f64 = 1e-9;

/// The families of one parameter, which one point determines (k = 1 in Tittmann et al. 2011).
///
/// Their parameter here is the coefficient that grows with steepness: -a of the paraboloid,
/// 1 / sqrt(a) of the cone, α of the blend. Consensus is the same as in the paper's parameters.
impl Shape {
    /// The model of this family for a parameter. A two-parameter model has none: its `b1` alone.
    #[must_use]
    pub fn model(self, parameter: f64) -> Model {
        let (b1, b2) = match self {
            Self::Paraboloid => (0.0, parameter),
            Self::Cone | Self::TwoParameter => (parameter, 0.0),
            Self::Blend => (1.0 - parameter, parameter),
        };
        Model { shape: self, b1, b2 }
    }

    /// The factor f and the constant g of `h = g + f * parameter` at a distance.
    fn linear(self, r: f64) -> (f64, f64) {
        match self {
            Self::Paraboloid => (r * r, 0.0),
            Self::Cone | Self::TwoParameter => (r, 0.0),
            Self::Blend => (r * (r - 1.0), r),
        }
    }

    /// The values the parameter may have: an open or closed range.
    fn allows(self, parameter: f64) -> bool {
        match self {
            Self::Blend => (0.0..=1.0).contains(&parameter),
            _ => parameter > 0.0 && parameter.is_finite(),
        }
    }

    /// The parameter for which the surface passes through a point, if it is one of the family:
    /// the surface must open downward, so a point above the apex (h <= 0) defines neither cone
    /// nor paraboloid, which the paper's squares would hide.
    #[must_use]
    pub fn through(self, r: f64, h: f64) -> Option<f64> {
        let (factor, constant) = self.linear(r);
        if !h.is_finite() || factor.abs() < TINY {
            return None;
        }
        Some((h - constant) / factor).filter(|&parameter| self.allows(parameter))
    }

    /// The parameters that leave the point less than `tolerance_m` from the surface.
    #[must_use]
    pub fn consensus_interval(self, r: f64, h: f64, tolerance_m: f64) -> Interval {
        let (factor, constant) = self.linear(r);
        let rest = h - constant;
        if !h.is_finite() {
            return Interval::Never;
        }
        if factor.abs() < TINY {
            return if rest.abs() < tolerance_m { Interval::Always } else { Interval::Never };
        }
        let (a, b) = ((rest - tolerance_m) / factor, (rest + tolerance_m) / factor);
        let upper_end = if self == Self::Blend { 1.0 } else { f64::INFINITY };
        let (low, high) = (a.min(b).max(0.0), a.max(b).min(upper_end));
        if low < high { Interval::Between(low, high) } else { Interval::Never }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_formulas_of_the_paper() {
        // Paraboloid: a = -h / r^2; cone: a = r^2 / h^2; blend: alpha = (h - r) / (r (r - 1)).
        let (r, h) = (2.0, 3.0);
        assert_eq!(Shape::Paraboloid.through(r, h), Some(h / (r * r)));
        assert_eq!(Shape::Cone.through(r, h), Some(1.0 / (r * r / (h * h)).sqrt()));
        assert_eq!(Shape::Blend.through(r, h), Some((h - r) / (r * (r - 1.0))));
    }

    #[test]
    fn a_point_above_the_apex_defines_no_cone() {
        for shape in [Shape::Cone, Shape::Paraboloid] {
            assert_eq!(shape.through(2.0, -3.0), None);
            assert_eq!(shape.through(2.0, 0.0), None);
            assert_eq!(shape.through(0.0, 1.0), None);
        }
    }

    #[test]
    fn the_blend_is_undefined_at_zero_and_one() {
        assert_eq!(Shape::Blend.through(1.0, 1.0), None);
        assert_eq!(Shape::Blend.through(0.0, 0.0), None);
        assert_eq!(Shape::Blend.through(2.0, 9.0), None, "alpha above 1");
        assert_eq!(Shape::Blend.consensus_interval(1.0, 1.1, 0.2), Interval::Always);
        assert_eq!(Shape::Blend.consensus_interval(1.0, 1.3, 0.2), Interval::Never);
    }

    proptest! {
        #[test]
        fn interval_and_residual_agree(
            r in 0.0f64..8.0, h in -2.0f64..20.0, tolerance in 0.05f64..1.0, parameter in 0.01f64..1.0,
            which in 0usize..3,
        ) {
            let shape = [Shape::Paraboloid, Shape::Cone, Shape::Blend][which];
            let residual = shape.model(parameter).residual(r, h).abs();
            prop_assume!((residual - tolerance).abs() > 1e-9);
            let inside = match shape.consensus_interval(r, h, tolerance) {
                Interval::Never => false,
                Interval::Always => true,
                Interval::Between(low, high) => parameter > low && parameter < high,
            };
            prop_assert_eq!(inside, residual < tolerance);
        }

        #[test]
        fn a_model_passes_through_the_point_that_defined_it(r in 0.01f64..8.0, h in -2.0f64..20.0, which in 0usize..3) {
            let shape = [Shape::Paraboloid, Shape::Cone, Shape::Blend][which];
            if let Some(parameter) = shape.through(r, h) {
                prop_assert!(shape.model(parameter).residual(r, h).abs() < 1e-6);
            }
        }
    }
}

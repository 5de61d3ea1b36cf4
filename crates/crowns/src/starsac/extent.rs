//! How far out a crown goes: the score of a surface together with its radius.

use super::model::Model;
use crate::Window;

/// What decides about inliers and extent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scoring {
    /// A point nearer to the surface than this is an inlier, m.
    pub tolerance_m: f64,
    /// What an outlier within the radius costs; an inlier on the surface gains 1.
    pub outlier_cost: f64,
}

/// A surface cut off at the radius at which its score is largest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Sum over the points within the radius.
    pub score: f64,
    /// Number of points of the window within the radius.
    pub points: usize,
}

/// What a point at a distance from the surface is worth, by the loss of MSAC (Torr and Zisserman 2000): an inlier
/// gains 1 - (distance / tolerance)², an outlier costs a constant.
fn gain(distance: f64, inverse_tolerance: f64, outlier_cost: f64) -> f64 {
    let scaled = distance * inverse_tolerance;
    let square = scaled * scaled;
    if square < 1.0 { 1.0 - square } else { -outlier_cost }
}

impl Scoring {
    /// The best extent of a surface, or `None` when it cannot exceed `at_least`.
    ///
    /// Points come sorted by distance, so the best radius is that of the largest prefix sum: the
    /// crown ends where, going out, outliers begin to outweigh inliers for good.
    #[must_use]
    pub fn extent(&self, model: &Model, window: &Window, at_least: f64) -> Option<Extent> {
        const STRIDE: usize = 64;
        let inverse = 1.0 / self.tolerance_m;
        let (mut sum, mut best) = (0.0, Extent { score: 0.0, points: 0 });
        let chunks = window.r.chunks(STRIDE).zip(window.h.chunks(STRIDE));
        for (k, (rs, hs)) in chunks.enumerate() {
            // Even if all that is left were on the surface.
            if sum + (window.len() - k * STRIDE) as f64 <= at_least.max(best.score) {
                break;
            }
            for (j, (&r, &h)) in rs.iter().zip(hs).enumerate() {
                sum += gain(model.distance(r, h), inverse, self.outlier_cost);
                if sum > best.score {
                    best = Extent { score: sum, points: k * STRIDE + j + 1 };
                }
            }
        }
        (best.score > at_least).then_some(best)
    }

    /// Whether a point at a distance from the surface is an inlier.
    #[must_use]
    pub fn is_inlier(&self, distance: f64) -> bool {
        distance.abs() < self.tolerance_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::starsac::Shape;
    use proptest::prelude::*;

    const SCORING: Scoring = Scoring { tolerance_m: 0.5, outlier_cost: 1.0 };

    #[test]
    fn the_crown_ends_where_outliers_begin() {
        let on = (1..20).map(|i| (i, [0.1 * f64::from(i), 0.0, -0.2 * f64::from(i)], true));
        let off = (20..60).map(|i| (i, [0.1 * f64::from(i), 0.0, 0.0], true));
        let window = Window::new(on.chain(off));
        let extent = SCORING.extent(&Shape::Cone.model(2.0), &window, 0.0).unwrap();
        assert_eq!(extent.points, 19);
        assert!((extent.score - 19.0).abs() < 1e-9);
        assert_eq!(SCORING.extent(&Shape::Cone.model(2.0), &window, 19.5), None);
    }

    proptest! {
        #[test]
        fn the_shortcut_changes_nothing(
            points in prop::collection::vec((0.0f64..6.0, 0.0f64..9.0), 0..400), b1 in 0.0f64..3.0, floor in 0.0f64..40.0,
        ) {
            let window = Window::new(points.iter().enumerate().map(|(i, p)| (i as u32, [p.0, 0.0, -p.1], true)));
            let model = Shape::Cone.model(b1);
            let (mut sum, mut best) = (0.0, Extent { score: 0.0, points: 0 });
            for i in 0..window.len() {
                sum += gain(model.distance(window.r[i], window.h[i]), 2.0, 1.0);
                if sum > best.score { best = Extent { score: sum, points: i + 1 }; }
            }
            prop_assert_eq!(SCORING.extent(&model, &window, floor), (best.score > floor).then_some(best));
        }
    }
}

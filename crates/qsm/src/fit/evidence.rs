//! What speaks for a cylinder.

use super::refine::{Cylinder, residual};
use super::{Fit, Sample};
use std::f64::consts::PI;

/// A point is on the surface within this many standard deviations ...
const ON_SURFACE: f64 = 3.0;
/// ... and inside the wood from this many on.
const INSIDE: f64 = 4.0;
/// Neighbouring points on the circumference farther apart than this have a gap between them: the
/// spacing of seven points all around.
const WIDEST_GAP: f64 = 2.0 * PI / 7.0;

/// Counts points on and in a cylinder and corrects its radius.
#[must_use]
pub fn judge(samples: &[Sample], cylinder: &Cylinder) -> Fit {
    let [x, y, slope_x, slope_y, radius] = cylinder.parameters;
    let (mut on, mut inside, mut all, mut angles) = (0.0, 0.0, 0.0, Vec::new());
    for sample in samples {
        let e = residual(&cylinder.parameters, sample).0 / cylinder.scale_m;
        all += sample.weight;
        if e.abs() <= ON_SURFACE {
            on += sample.weight;
            let [px, py] = sample.across_m;
            let (t_x, t_y) = (sample.along_m * slope_x, sample.along_m * slope_y);
            angles.push(libm::atan2(py - y - t_y, px - x - t_x));
        } else if e < -INSIDE {
            inside += sample.weight;
        }
    }
    let radius_m = unbiased(radius, cylinder.noise_m);
    Fit {
        offset_m: [x, y],
        slope: [slope_x, slope_y],
        radius_m,
        radius_sd_m: cylinder.sd[4],
        offset_sd_m: cylinder.sd[0].max(cylinder.sd[1]),
        noise_m: cylinder.noise_m,
        points: angles.len() as u32,
        arc_coverage: arc_coverage(&mut angles),
        inside_share: if on > 0.0 { inside / on } else { f64::INFINITY },
        surface_share: if all > 0.0 { on / all } else { 0.0 },
    }
}

/// Takes the essential bias off a radius: noise s makes the radius of a geometric fit too large by
/// s^2 / 2r (Al-Sharadqah and Chernov 2009, section 7). What is below the noise stays positive.
#[must_use]
pub fn unbiased(radius_m: f64, noise_m: f64) -> f64 {
    let bias_m = noise_m * noise_m / (2.0 * radius_m);
    radius_m - bias_m.min(0.5 * radius_m)
}

/// Part of the circumference that has points, 0 to 1: all but the gaps wider than a seventh.
#[must_use]
pub fn arc_coverage(angles: &mut [f64]) -> f64 {
    angles.sort_unstable_by(f64::total_cmp);
    let (Some(first), Some(last)) = (angles.first(), angles.last()) else {
        return 0.0;
    };
    let around = first + 2.0 * PI - last;
    let between = angles.windows(2).map(|pair| pair[1] - pair[0]);
    let gaps: f64 = between.chain([around]).filter(|gap| *gap > WIDEST_GAP).sum();
    (1.0 - gaps / (2.0 * PI)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arcs_are_measured_across_the_turn() {
        let arc = |from: f64, to: f64, count: i32| {
            let step = (to - from) / f64::from(count - 1);
            let mut angles: Vec<f64> = (0..count)
                .map(|i| libm::remainder((from + step * f64::from(i)) * PI / 180.0, 2.0 * PI))
                .collect();
            arc_coverage(&mut angles) * 360.0
        };
        assert!((arc(0.0, 90.0, 10) - 90.0).abs() < 1e-9);
        assert!((arc(150.0, 270.0, 10) - 120.0).abs() < 1e-9, "across 180 degrees");
        assert!((arc(0.0, 315.0, 8) - 360.0).abs() < 1e-9, "eight points all around");
        assert_eq!(arc_coverage(&mut []), 0.0);
        assert_eq!(arc_coverage(&mut [1.0]), 0.0);
    }
}

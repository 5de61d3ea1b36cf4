//! A cylinder through the points of a short piece of a branch.
//!
//! Circles through three points and the algebraic fit of Al-Sharadqah and Chernov 2009 give starts
//! ([`candidates`]); the one that most points agree with is refined by Levenberg-Marquardt with
//! Tukey's redescending weights, axis and direction included ([`refine`]). There is no least arc: the
//! standard error of the radius, from the Hessian, says how good a fit is.

pub mod candidates;
pub mod evidence;
pub mod refine;

/// A point seen along the axis that was expected: across it and along it, from the middle of the piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Position across the expected axis, m.
    pub across_m: [f64; 2],
    /// Position along the expected axis, m.
    pub along_m: f64,
    /// Weight before anything is known about the fit, 0 to 1: how likely the point is on wood.
    pub weight: f64,
}

/// What is known about the points before the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// Radius, m. It sets the window in which points may agree with a circle, not the result.
    pub radius_m: f64,
    /// Standard deviation of points across the surface: ranging noise, footprint, bark; m.
    pub noise_m: f64,
    /// What that standard deviation is worth, in residuals: degrees of freedom of its prior.
    pub noise_weight: f64,
}

/// The cylinder found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Where the axis is at `along_m = 0`, m.
    pub offset_m: [f64; 2],
    /// How far the axis moves across per metre along, m/m.
    pub slope: [f64; 2],
    /// Radius, m, corrected for the essential bias of circle fits.
    pub radius_m: f64,
    /// Standard error of the radius, m.
    pub radius_sd_m: f64,
    /// Standard error of the offset, m: the larger of the two.
    pub offset_sd_m: f64,
    /// Standard deviation of the points across the surface, m.
    pub noise_m: f64,
    /// Number of points on the surface.
    pub points: u32,
    /// Part of the circumference that has points, 0 to 1.
    pub arc_coverage: f64,
    /// Weight of the points inside the cylinder over that of those on its surface. Wood is opaque:
    /// a surface has few points behind it.
    pub inside_share: f64,
    /// Weight of the points on the surface over that of all points given, 0 to 1.
    pub surface_share: f64,
}

/// Fewest points that can tell a radius with an error: one more than a cylinder has parameters.
pub const FEWEST_POINTS: usize = 6;

/// Fits a cylinder. None when there are fewer than [`FEWEST_POINTS`] or no circle through them.
///
/// The result depends on the order of the samples only within rounding; callers sort.
#[must_use]
pub fn fit(samples: &[Sample], expected: &Expected) -> Option<Fit> {
    if samples.len() < FEWEST_POINTS {
        return None;
    }
    let start = candidates::best(samples, expected)?;
    let cylinder = refine::refine(samples, start, expected)?;
    Some(evidence::judge(samples, &cylinder))
}

#[cfg(test)]
mod tests;

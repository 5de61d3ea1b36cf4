//! What the surroundings of every point allow: the spacing of points and the radius of the branch.

use crate::eigen::symmetric;
use crate::operator::{RADII_M, scatters};
use crate::{ConsolidationParams, Error};
use rayon::prelude::*;
use timberline_pointcloud::Nearest3;

/// Neighbours that tell the spacing.
const NEIGHBOURS: usize = 8;

/// Spacing of points around every point, m: the edge of the square that each would have on a
/// surface, from the area of the circle that holds the eight nearest; the median over
/// these. Points must be distinct; 0 for a single one.
///
/// # Errors
/// [`Error::Neighbours`].
pub fn spacings(points: &[[f64; 3]]) -> Result<Vec<f64>, Error> {
    let tree = Nearest3::new(points)?;
    let near: Vec<(f64, Vec<u32>)> = points
        .par_iter()
        .map(|point| {
            let found = tree.nearest(point, NEIGHBOURS + 1);
            let squared_m2 = found.last().map_or(0.0, |last| last.squared_m2);
            let count = found.len().saturating_sub(1).max(1) as f64;
            let spacing_m = (squared_m2 * std::f64::consts::PI / count).sqrt();
            (spacing_m, found.iter().map(|n| n.index as u32).collect())
        })
        .collect();
    let median = |(_, indices): &(f64, Vec<u32>)| {
        let mut around: Vec<f64> = indices.iter().map(|&i| near[i as usize].0).collect();
        around.sort_unstable_by(f64::total_cmp);
        around.get(around.len() / 2).copied().unwrap_or(0.0)
    };
    Ok(near.par_iter().map(median).collect())
}

/// Radius of the branch around every point as far as it can be seen within about `scale_m`, m.
///
/// With weights exp(-(d/scale)²) the scatter of points on a thin cylinder of radius R is R²/2 across
/// its axis, also when only half of it was scanned; on a plane it is scale²/2 both ways. So the root
/// of twice the middle eigenvalue is R for thin branches, and near the scale for what is wider.
#[must_use]
pub fn branch_radii(points: &[[f64; 3]], scale_m: &[f64]) -> Vec<f64> {
    let h_m: Vec<f64> = scale_m.iter().map(|s| (4.0 * s).clamp(RADII_M[0], RADII_M[1])).collect();
    let middle = |scatter: &[f32; 6]| {
        let (values, _) = symmetric(scatter.map(f64::from));
        (2.0 * values[1].max(0.0)).sqrt()
    };
    scatters(points, &h_m, 0.5).par_iter().map(middle).collect()
}

/// Radius h of every point, m; 0 where the branch allows none and the point is left alone.
///
/// # Errors
/// [`Error::Neighbours`].
pub fn radii(points: &[[f64; 3]], params: &ConsolidationParams) -> Result<Radii, Error> {
    let spacing_m = spacings(points)?;
    let wanted: Vec<f64> = spacing_m.iter().map(|s| s * params.radius_spacings).collect();
    let branch_m = branch_radii(points, &wanted);
    let rule = |i: usize| {
        let h = wanted[i].min(branch_m[i] * params.branch_radius_share);
        let enough = h >= spacing_m[i] * params.min_radius_spacings;
        if enough && (RADII_M[0]..=RADII_M[1]).contains(&h) { h } else { 0.0 }
    };
    let h_m = (0..points.len()).map(rule).collect();
    Ok(Radii { h_m, spacing_m, branch_m })
}

/// What [`radii`] found, by point.
#[derive(Debug, Clone, PartialEq)]
pub struct Radii {
    /// Support radius h, m; 0 where the point is to be left alone.
    pub h_m: Vec<f64>,
    /// Spacing of points, m.
    pub spacing_m: Vec<f64>,
    /// Radius of the branch as far as it can be seen, m.
    pub branch_m: Vec<f64>,
}

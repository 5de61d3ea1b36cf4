//! What takes no surface: the highest cell, the middle of the outline; and the consensus models.

use super::Problem;
use super::method::{Certificate, Fit, Flag, Method, Surface, unfitted};
use super::problem::{Cell, highest};
use crate::{CrownModelParams, Error, Window, footprint, starsac};

/// The highest cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HighestPoint;

impl Method for HighestPoint {
    fn name(&self) -> String {
        "highest point".to_owned()
    }

    fn fit(&self, problem: &Problem<'_>) -> Result<Fit, Error> {
        Ok(unfitted(highest(&problem.check()?), Vec::new()))
    }
}

/// The centroid of the convex hull of the cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HullCentroid;

impl Method for HullCentroid {
    fn name(&self) -> String {
        "hull centroid".to_owned()
    }

    fn fit(&self, problem: &Problem<'_>) -> Result<Fit, Error> {
        let cells = problem.check()?;
        let hull = footprint::footprint(cells.iter().map(|&[x, y, ..]| [x, y])).corners;
        Ok(match centroid(&hull) {
            Some(centroid) => unfitted(centroid, Vec::new()),
            None => unfitted(highest(&cells), vec![Flag::Underdetermined]),
        })
    }
}

/// Centroid of a polygon's area; `None` where it has none.
fn centroid(corners: &[[f64; 2]]) -> Option<[f64; 2]> {
    let first = *corners.first()?;
    let offset = |corner: [f64; 2]| [corner[0] - first[0], corner[1] - first[1]];
    let (mut area, mut moment) = (0.0, [0.0; 2]);
    for pair in corners.windows(2) {
        let ([ax, ay], [bx, by]) = (offset(pair[0]), offset(pair[1]));
        let cross = ax * by - ay * bx;
        area += cross;
        moment[0] += cross * (ax + bx);
        moment[1] += cross * (ay + by);
    }
    let centre = [0, 1].map(|axis| first[axis] + moment[axis] / (3.0 * area));
    (area > 0.0).then_some(centre)
}

/// The crown models of Tittmann et al. 2011 (StarSac) over the cells, with their peak at the highest
/// one: the position is that of [`HighestPoint`], the surface is not a paraboloid.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StarSac {
    /// How the model is sought.
    pub params: CrownModelParams,
}

impl Method for StarSac {
    fn name(&self) -> String {
        "StarSac".to_owned()
    }

    fn fit(&self, problem: &Problem<'_>) -> Result<Fit, Error> {
        let cells = problem.check()?;
        let centre = highest(&cells);
        let apex_z_m = cells.iter().map(|cell| cell[2]).fold(f64::NEG_INFINITY, f64::max);
        let from_apex = |(index, cell): (usize, &Cell)| {
            let position = [cell[0] - centre[0], cell[1] - centre[1], cell[2] - apex_z_m];
            (index as u32, position, true)
        };
        let window = Window::new(cells.iter().enumerate().map(from_apex));
        let outcome = starsac::fit_window(&window, &self.params, cells.len() as u64);
        let Some(crown) = outcome.accepted() else {
            return Ok(unfitted(centre, vec![Flag::Underdetermined]));
        };
        let surface = Surface::Revolved { centre, apex_z_m, model: crown.model };
        let certificate = Certificate {
            objective_m: cells.iter().map(|&[x, y, z, w]| w * (surface.z(x, y) - z).abs()).sum(),
            lower_bound_m: 0.0,
            weight: cells.iter().map(|cell| cell[3]).sum(),
            nodes: 1,
            iterations: 1,
        };
        let certificate = Some(certificate);
        Ok(Fit { position: centre, surface: Some(surface), certificate, flags: Vec::new() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_of_a_triangle() {
        let cells = [[0.0, 0.0, 1.0], [3.0, 0.0, 5.0], [0.0, 3.0, 2.0], [1.0, 1.0, 9.0]];
        let problem = Problem::new(&cells);
        let [x, y] = HullCentroid.fit(&problem).unwrap().position;
        assert!((x - 1.0).abs() < 1e-12 && (y - 1.0).abs() < 1e-12);
        assert_eq!(HighestPoint.fit(&problem).unwrap().position, [1.0, 1.0]);
        let line = HullCentroid.fit(&Problem::new(&cells[..2])).unwrap();
        assert_eq!((line.position, line.flags), ([3.0, 0.0], vec![Flag::Underdetermined]));
    }
}

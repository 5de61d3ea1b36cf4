//! Least squares: the usual way, as a baseline.

use super::dense::least_squares;
use super::method::{Certificate, Fit, Flag, Method, Surface, flags_of_centre, unfitted};
use super::problem::{Cell, highest};
use super::program::Row;
use super::rank::{determines, elliptic_row, equal_row};
use super::scale::Scale;
use super::{Paraboloid, Problem};
use crate::Error;

/// Which axes a least squares surface has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Axes {
    /// Equal ones.
    #[default]
    Equal,
    /// Two free ones.
    Free,
}

/// The quadric of least squares, without bounds and without a prior: it need not be an elliptic
/// paraboloid ([`Flag::NotElliptic`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct L2 {
    /// Equal axes or free ones.
    pub axes: Axes,
}

impl Method for L2 {
    fn name(&self) -> String {
        match self.axes {
            Axes::Equal => "L2, equal axes".to_owned(),
            Axes::Free => "L2, free axes".to_owned(),
        }
    }

    fn fit(&self, problem: &Problem<'_>) -> Result<Fit, Error> {
        let cells = problem.check()?;
        let scale = Scale::of(&cells);
        let (phi, unknowns) = match self.axes {
            Axes::Equal => {
                let phi = solve(&cells, &scale, equal_row);
                (phi.map(|[p0, p3, p4, p5]| [p0, p0, 0.0, p3, p4, p5]), 4)
            }
            Axes::Free => (solve(&cells, &scale, elliptic_row), 6),
        };
        let Some(phi) = phi else {
            return Ok(unfitted(highest(&cells), vec![Flag::Underdetermined]));
        };
        let paraboloid = Paraboloid { phi }.in_metres(&scale);
        Ok(conclude(&cells, paraboloid, unknowns))
    }
}

/// Coefficients in scaled units.
fn solve<const K: usize>(
    cells: &[Cell],
    scale: &Scale,
    row: fn(f64, f64) -> [f64; K],
) -> Option<[f64; K]> {
    if !determines(cells, row) {
        return None;
    }
    let rows: Vec<Row<K>> =
        scale.apply(cells).iter().map(|&[x, y, z, w]| Row { d: row(x, y), z, w }).collect();
    least_squares(&rows)
}

fn conclude(cells: &[Cell], paraboloid: Paraboloid, unknowns: usize) -> Fit {
    let square = |&[x, y, z, w]: &Cell| w * (paraboloid.z(x, y) - z) * (paraboloid.z(x, y) - z);
    let certificate = Certificate {
        objective_m: cells.iter().map(square).sum(),
        lower_bound_m: 0.0,
        weight: cells.iter().map(|cell| cell[3]).sum(),
        nodes: 1,
        iterations: 1,
    };
    let (position, mut flags) = match paraboloid.shape() {
        Some(shape) => (shape.centre, flags_of_centre(cells, shape.centre, None)),
        None => (highest(cells), vec![Flag::NotElliptic]),
    };
    flags.extend((cells.len() == unknowns).then_some(Flag::NoRedundancy));
    flags.sort_unstable();
    let surface = Some(Surface::Paraboloid(paraboloid));
    Fit { position, surface, certificate: Some(certificate), flags }
}

//! A tree's position by an L1 paraboloid over its crown's surface.
//!
//! After Polewski et al., L1-norm fitting of elliptic paraboloids with prior information for
//! enhanced coniferous tree localization in ALS point clouds. The crown is thinned to the highest
//! point of each planimetric cell ([`thin`]), a [`Solver`] minimises the sum of absolute vertical
//! residuals under bounds on the shape and a box for the centre, and [`fit`] wraps that with the
//! checks no solver does: most degenerate input is "solved" without complaint.
//!
//! [`EqualAxis`] is the model with equal axes, a linear program. A solver of the elliptic model
//! needs only another implementation of [`Solver`].

mod equal_axis;
mod paraboloid;
mod rank;
mod scale;
mod thinning;
mod uncertainty;

pub use equal_axis::EqualAxis;
pub use paraboloid::{Paraboloid, Shape};
pub use thinning::thin;

use crate::Error;

/// Box for the centre: the position prior (Polewski et al., constraint C5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Middle of the box, m.
    pub centre: [f64; 2],
    /// Half its edge, m; 0 fixes the centre.
    pub half_width_m: f64,
}

/// Bounds on the semiaxes of the paraboloid (its radii one metre below the apex), m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisBounds {
    /// Largest semiaxis; keeps the surface from being flat (C4 with mu = 2 / largest²).
    pub largest_m: f64,
    /// Smallest semiaxis.
    pub smallest_m: f64,
}

/// What is to be fitted. Positions are in any one frame; near the crown is best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Problem<'a> {
    /// Cells of the thinned crown: centre x, y and highest z, m. Each weighs 1.
    pub cells: &'a [[f64; 3]],
    /// Bounds on the shape.
    pub axes: AxisBounds,
    /// Box for the centre, if there is a prior.
    pub prior: Option<Prior>,
}

/// What a solver found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// The surface.
    pub paraboloid: Paraboloid,
    /// Sum of absolute vertical residuals, m.
    pub objective_m: f64,
    /// Upper bound of how much better any other surface could be, m: the duality gap.
    pub gap_m: f64,
    /// Iterations of the solver.
    pub iterations: u32,
    /// A bound on the shape holds with equality.
    pub shape_bound_active: bool,
}

/// A method for one family of surfaces.
pub trait Solver {
    /// Number of unknowns of the family.
    fn unknowns(&self) -> usize;

    /// The row of the design matrix at a position: the first [`Self::unknowns`] values count.
    fn row(&self, x: f64, y: f64) -> [f64; 6];

    /// Solves a problem that [`fit`] has checked.
    ///
    /// # Errors
    /// [`Error::Solver`] when the solver does not reach an optimum.
    fn solve(&self, problem: &Problem<'_>) -> Result<Solution, Error>;
}

/// What is remarkable about a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Flag {
    /// Too few cells, or all on a line or a circle: no surface, the position is the highest cell's.
    Underdetermined,
    /// As many cells as unknowns: the fit says nothing about its own quality.
    NoRedundancy,
    /// A bound on the shape holds with equality: flat, hollow or needle-like crown.
    ShapeBoundActive,
    /// The centre lies on the edge of the prior box.
    PriorActive,
    /// The centre is farther from the middle of the cells than any cell.
    CentreOutsideData,
    /// The cells leave a gap of more than 150 degrees around the centre.
    OneSided,
}

impl Flag {
    /// The flag's name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Underdetermined => "underdetermined",
            Self::NoRedundancy => "no-redundancy",
            Self::ShapeBoundActive => "shape-bound-active",
            Self::PriorActive => "prior-active",
            Self::CentreOutsideData => "centre-outside-data",
            Self::OneSided => "one-sided",
        }
    }
}

/// The result for one crown.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The tree's position in the frame of the problem, m.
    pub position: [f64; 2],
    /// Standard error of the position, both axes together, m; see [`fit`]. `None` without a surface
    /// or without more cells than unknowns.
    pub standard_error_m: Option<f64>,
    /// The solver's result; `None` when the crown does not determine a surface.
    pub solution: Option<Solution>,
    /// What is remarkable, sorted.
    pub flags: Vec<Flag>,
}

/// Largest gap in azimuth around the centre that still counts as seen from all sides, rad.
const MAX_AZIMUTH_GAP: f64 = 150.0 * std::f64::consts::PI / 180.0;

/// Distance from the edge of the prior box below which the centre lies on it, m.
const ON_THE_EDGE_M: f64 = 1e-5;

/// Fits a crown's surface and position.
///
/// The standard error is the asymptotic one of L1 regression (Koenker and Bassett 1978), carried
/// over to the centre; it knows nothing of the prior box, so with [`Flag::PriorActive`] it is that
/// of the free centre.
///
/// # Errors
/// Input that means nothing: coordinates that are not finite, no cells, bounds no surface can
/// meet, a negative prior box; and [`Error::Solver`] when the solver gives up. A crown that does
/// not determine a surface is no error, see [`Flag::Underdetermined`].
pub fn fit(problem: &Problem<'_>, solver: &impl Solver) -> Result<Fit, Error> {
    let highest = check(problem)?;
    if rank::rank(problem.cells, solver) < solver.unknowns() {
        let flags = vec![Flag::Underdetermined];
        return Ok(Fit { position: highest, standard_error_m: None, solution: None, flags });
    }
    let solution = solver.solve(problem)?;
    let position = solution.paraboloid.centre();
    let mut flags = Vec::new();
    let mut flag = |holds: bool, flag: Flag| flags.extend(holds.then_some(flag));
    flag(problem.cells.len() == solver.unknowns(), Flag::NoRedundancy);
    flag(solution.shape_bound_active, Flag::ShapeBoundActive);
    flag(problem.prior.is_some_and(|prior| on_the_edge(&prior, position)), Flag::PriorActive);
    flag(outside(problem.cells, position), Flag::CentreOutsideData);
    flag(largest_azimuth_gap(problem.cells, position) > MAX_AZIMUTH_GAP, Flag::OneSided);
    let standard_error_m = uncertainty::standard_error(problem.cells, &solution.paraboloid, solver);
    Ok(Fit { position, standard_error_m, solution: Some(solution), flags })
}

/// Checks a problem's numbers and returns the position of its highest cell (the first of equals).
fn check(problem: &Problem<'_>) -> Result<[f64; 2], Error> {
    let AxisBounds { largest_m: largest, smallest_m: smallest } = problem.axes;
    if !(smallest > 0.0 && smallest < largest && largest.is_finite()) {
        return Err(Error::AxisBounds { smallest, largest });
    }
    if let Some(prior) = problem.prior {
        let sound = prior.centre.iter().all(|value| value.is_finite());
        if !(sound && prior.half_width_m >= 0.0 && prior.half_width_m.is_finite()) {
            return Err(Error::PriorWidth(prior.half_width_m));
        }
    }
    for (index, cell) in problem.cells.iter().enumerate() {
        for (&value, axis) in cell.iter().zip(['x', 'y', 'z']) {
            if !value.is_finite() {
                return Err(Error::NotFinite { index, axis, value });
            }
        }
    }
    let higher = |best: &[f64; 3], cell: &[f64; 3]| if cell[2] > best[2] { *cell } else { *best };
    let first = problem.cells.first().ok_or(Error::NoCells)?;
    let [x, y, _] = problem.cells.iter().fold(*first, |best, cell| higher(&best, cell));
    Ok([x, y])
}

fn on_the_edge(prior: &Prior, position: [f64; 2]) -> bool {
    (0..2).any(|axis| {
        (position[axis] - prior.centre[axis]).abs() > prior.half_width_m - ON_THE_EDGE_M
    })
}

fn outside(cells: &[[f64; 3]], position: [f64; 2]) -> bool {
    let [x, y, _] = scale::mean(cells);
    let squared = |to: [f64; 2]| (to[0] - x) * (to[0] - x) + (to[1] - y) * (to[1] - y);
    let farthest = cells.iter().map(|cell| squared([cell[0], cell[1]])).fold(0.0, f64::max);
    squared(position) > farthest
}

/// The widest angle around a position without a cell, rad. A cell at the position itself has no
/// direction.
fn largest_azimuth_gap(cells: &[[f64; 3]], position: [f64; 2]) -> f64 {
    let offset = |cell: &[f64; 3]| [cell[0] - position[0], cell[1] - position[1]];
    let mut azimuths: Vec<f64> = cells
        .iter()
        .map(offset)
        .filter(|[dx, dy]| dx.abs().max(dy.abs()) > ON_THE_EDGE_M)
        .map(|[dx, dy]| libm::atan2(dy, dx))
        .collect();
    azimuths.sort_unstable_by(f64::total_cmp);
    let (Some(first), Some(last)) = (azimuths.first(), azimuths.last()) else {
        return 2.0 * std::f64::consts::PI;
    };
    let across = first + 2.0 * std::f64::consts::PI - last;
    azimuths.windows(2).map(|pair| pair[1] - pair[0]).fold(across, f64::max)
}

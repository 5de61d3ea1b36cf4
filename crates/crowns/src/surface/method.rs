//! The one trait of all methods and what they return.

use super::problem::{Cell, Prior};
use super::scale;
use super::{Paraboloid, Problem};
use crate::Error;
use crate::starsac::Model;

/// A way from the cells of a crown to the position of its tree.
pub trait Method: Sync {
    /// Name in tables, with the parameters that matter.
    fn name(&self) -> String;

    /// Fits one crown.
    ///
    /// # Errors
    /// Input that means nothing: numbers that are not finite, no cell of positive weight, bounds no
    /// surface can meet, a negative prior box; and [`Error::Solver`] when a solver gives up. A crown
    /// that does not determine a surface is no error, see [`Flag::Underdetermined`].
    fn fit(&self, problem: &Problem<'_>) -> Result<Fit, Error>;
}

/// The result for one crown.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// The tree's position in the frame of the problem, m: that of the highest cell where the
    /// crown does not determine a surface with an apex.
    pub position: [f64; 2],
    /// The surface, if the method has one.
    pub surface: Option<Surface>,
    /// How good the surface is and how good any could be.
    pub certificate: Option<Certificate>,
    /// What is remarkable, sorted.
    pub flags: Vec<Flag>,
}

/// A fitted surface, in the frame of the problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Surface {
    /// An elliptic paraboloid; of least squares perhaps another quadric.
    Paraboloid(Paraboloid),
    /// A crown model turned about a vertical axis.
    Revolved {
        /// Position of the apex, m.
        centre: [f64; 2],
        /// Height of the apex, m.
        apex_z_m: f64,
        /// Depth below the apex by distance from the axis.
        model: Model,
    },
}

impl Surface {
    /// Height of the surface at a position, m.
    #[must_use]
    pub fn z(&self, x: f64, y: f64) -> f64 {
        match self {
            Self::Paraboloid(paraboloid) => paraboloid.z(x, y),
            Self::Revolved { centre, apex_z_m, model } => {
                let (dx, dy) = (x - centre[0], y - centre[1]);
                apex_z_m - model.depth((dx * dx + dy * dy).sqrt())
            }
        }
    }

    /// The paraboloid, if it is one.
    #[must_use]
    pub fn paraboloid(&self) -> Option<&Paraboloid> {
        match self {
            Self::Paraboloid(paraboloid) => Some(paraboloid),
            Self::Revolved { .. } => None,
        }
    }
}

/// The value of a fit and a bound that nothing beats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Certificate {
    /// Weighted sum of the absolute vertical residuals, m; of their squares (m²) for least squares.
    pub objective_m: f64,
    /// No surface that satisfies all constraints has a smaller objective. Least squares and
    /// consensus models have none (0).
    pub lower_bound_m: f64,
    /// Sum of the weights: objective over weight is the mean residual.
    pub weight: f64,
    /// Convex programs that were solved: more than one where the prior box is active.
    pub nodes: u32,
    /// Iterations of the solvers in all of them.
    pub iterations: u32,
}

/// A mean residual that is as good as none, m: below it a relative gap means nothing.
const NO_RESIDUAL_M: f64 = 1e-6;

impl Certificate {
    /// By which share of the objective another surface could be better at the most.
    #[must_use]
    pub fn relative_gap(&self) -> f64 {
        let size = self.objective_m.max(NO_RESIDUAL_M * self.weight);
        ((self.objective_m - self.lower_bound_m) / size).max(0.0)
    }

    /// Mean absolute residual, m.
    #[must_use]
    pub fn mean_residual_m(&self) -> f64 {
        self.objective_m / self.weight
    }
}

/// What is remarkable about a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Flag {
    /// Too few cells, or all on a line or a conic: no surface, the position is the highest cell's.
    Underdetermined,
    /// As many cells as unknowns: the fit says nothing about its own quality.
    NoRedundancy,
    /// A bound on the axes holds with equality: flat, hollow or needle-like crown.
    ShapeBoundActive,
    /// The axes differ as much as omega allows.
    ImbalanceActive,
    /// The centre lies on the edge of the prior box.
    PriorActive,
    /// The centre is farther from the middle of the cells than any cell.
    CentreOutsideData,
    /// The cells leave a gap of more than 150 degrees around the centre.
    OneSided,
    /// The surface is no elliptic paraboloid that opens downward; the position is the highest cell's.
    NotElliptic,
}

impl Flag {
    /// All flags, sorted.
    pub const ALL: [Self; 8] = [
        Self::Underdetermined,
        Self::NoRedundancy,
        Self::ShapeBoundActive,
        Self::ImbalanceActive,
        Self::PriorActive,
        Self::CentreOutsideData,
        Self::OneSided,
        Self::NotElliptic,
    ];

    /// The flag's name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Underdetermined => "underdetermined",
            Self::NoRedundancy => "no-redundancy",
            Self::ShapeBoundActive => "shape-bound-active",
            Self::ImbalanceActive => "imbalance-active",
            Self::PriorActive => "prior-active",
            Self::CentreOutsideData => "centre-outside-data",
            Self::OneSided => "one-sided",
            Self::NotElliptic => "not-elliptic",
        }
    }
}

/// Largest gap in azimuth around the centre that still counts as seen from all sides, rad.
const MAX_AZIMUTH_GAP: f64 = 150.0 * std::f64::consts::PI / 180.0;

/// Distance from the edge of the prior box below which the centre lies on it, m.
const ON_THE_EDGE_M: f64 = 1e-5;

/// A position without a surface.
pub(super) fn unfitted(position: [f64; 2], flags: Vec<Flag>) -> Fit {
    Fit { position, surface: None, certificate: None, flags }
}

/// Flags that follow from where the centre lies among the cells, unsorted.
pub(super) fn flags_of_centre(
    cells: &[Cell],
    centre: [f64; 2],
    prior: Option<&Prior>,
) -> Vec<Flag> {
    let mut flags = Vec::new();
    let mut flag = |holds: bool, flag: Flag| flags.extend(holds.then_some(flag));
    flag(prior.is_some_and(|prior| on_the_edge(prior, centre)), Flag::PriorActive);
    flag(outside(cells, centre), Flag::CentreOutsideData);
    flag(largest_azimuth_gap(cells, centre) > MAX_AZIMUTH_GAP, Flag::OneSided);
    flags
}

fn on_the_edge(prior: &Prior, position: [f64; 2]) -> bool {
    (0..2).any(|axis| {
        (position[axis] - prior.centre[axis]).abs() > prior.half_width_m - ON_THE_EDGE_M
    })
}

fn outside(cells: &[Cell], position: [f64; 2]) -> bool {
    let [x, y, _] = scale::mean(cells);
    let squared = |to: [f64; 2]| (to[0] - x) * (to[0] - x) + (to[1] - y) * (to[1] - y);
    let farthest = cells.iter().map(|cell| squared([cell[0], cell[1]])).fold(0.0, f64::max);
    squared(position) > farthest
}

/// The widest angle around a position without a cell, rad. A cell at the position itself has no
/// direction.
fn largest_azimuth_gap(cells: &[Cell], position: [f64; 2]) -> f64 {
    let offset = |cell: &Cell| [cell[0] - position[0], cell[1] - position[1]];
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

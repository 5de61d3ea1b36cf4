//! The L1 elliptic paraboloid of Polewski et al.

use super::bounds::{AxisBounds, Limits};
use super::engine::Engine;
use super::formulate::{self, POINT};
use super::method::{Certificate, Fit, Flag, Method, Surface, flags_of_centre, unfitted};
use super::problem::{Cell, Prior, highest};
use super::program::Optimum;
use super::rank::{determines, elliptic_row, equal_row};
use super::scale::{Apex, Scaled};
use super::{Paraboloid, Problem, search};
use crate::Error;

/// The elliptic paraboloid with the smallest weighted sum of absolute vertical residuals, under
/// bounds on its shape and, if there is a prior, with its centre in a box: after Polewski et al., L1-norm
/// fitting of elliptic paraboloids with prior information for enhanced coniferous tree localization
/// in ALS point clouds.
///
/// Without an active prior the problem is convex (a linear program for equal axes, one with
/// second-order cones otherwise) and has no other optimum. With two free axes and an active prior it
/// is not; then all of its optima are searched, with a certificate ([`Certificate::relative_gap`]).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct L1 {
    /// Largest imbalance of the axes: |(phi0 - phi1, phi2)| <= -omega (phi0 + phi1), constraint C3.
    /// 0 makes the axes equal, 1 leaves them free within `bounds`.
    pub omega: f64,
    /// Bounds on the semiaxes.
    pub bounds: AxisBounds,
    /// Who solves the convex programs.
    pub engine: Engine,
}

/// A surface and how it was found, in scaled units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Found {
    pub(super) surface: Apex,
    pub(super) objective: f64,
    pub(super) lower_bound: f64,
    pub(super) nodes: u32,
    pub(super) iterations: u32,
}

impl Found {
    pub(super) fn of<const K: usize>(scaled: &Scaled, optimum: &Optimum<K>, surface: Apex) -> Self {
        let surface = Apex { curvature: scaled.limits.project(surface.curvature), ..surface };
        Self {
            surface,
            objective: scaled.objective(&surface),
            lower_bound: optimum.lower_bound,
            nodes: 1,
            iterations: optimum.iterations,
        }
    }
}

impl Method for L1 {
    fn name(&self) -> String {
        let bounds = match self.bounds {
            AxisBounds::Exact { .. } => "",
            AxisBounds::Paper { .. } => ", paper's mu",
        };
        format!("L1, omega {}{bounds}", self.omega)
    }

    fn fit(&self, problem: &Problem<'_>) -> Result<Fit, Error> {
        let limits = Limits::new(self.bounds, self.omega)?;
        let cells = problem.check()?;
        if !self.is_determined(&cells) {
            return Ok(unfitted(highest(&cells), vec![Flag::Underdetermined]));
        }
        let scaled = Scaled::new(&cells, limits);
        let found = self.solve(&scaled, problem.prior.as_ref())?;
        Ok(self.conclude(&cells, &scaled, &found, problem.prior.as_ref()))
    }
}

impl L1 {
    fn is_determined(&self, cells: &[Cell]) -> bool {
        if self.omega == 0.0 {
            determines(cells, equal_row)
        } else {
            determines(cells, elliptic_row)
        }
    }

    /// Unknowns of the surface.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        if self.omega == 0.0 { 4 } else { 6 }
    }

    pub(super) fn solve(&self, scaled: &Scaled, prior: Option<&Prior>) -> Result<Found, Error> {
        let corners = prior.map(|prior| scaled.corners(prior));
        if let Some([low, high]) = corners
            && (0..2).all(|axis| high[axis] - low[axis] < POINT)
        {
            let centre = [0, 1].map(|axis| 0.5 * (low[axis] + high[axis]));
            return self.solve_fixed(scaled, centre);
        }
        if self.omega == 0.0 {
            return self.solve_equal(scaled, corners);
        }
        let program = formulate::elliptic(&scaled.cells, &scaled.limits);
        let optimum = self.engine.solve(&program)?;
        let free = Found::of(scaled, &optimum, Apex::from_phi(optimum.x));
        let inside = |[low, high]: [[f64; 2]; 2]| {
            (0..2).all(|axis| (low[axis]..=high[axis]).contains(&free.surface.centre[axis]))
        };
        match corners {
            Some(corners) if !inside(corners) => {
                search::boundary(self.engine, scaled, corners, &free)
            }
            _ => Ok(free),
        }
    }

    fn solve_equal(&self, scaled: &Scaled, corners: Option<[[f64; 2]; 2]>) -> Result<Found, Error> {
        let program = formulate::equal(&scaled.cells, &scaled.limits, corners);
        let optimum = self.engine.solve(&program)?;
        let mut surface = formulate::equal_apex(optimum.x);
        if let Some([low, high]) = corners {
            let clamped = |axis: usize| surface.centre[axis].clamp(low[axis], high[axis]);
            surface.centre = [clamped(0), clamped(1)];
        }
        Ok(Found::of(scaled, &optimum, surface))
    }

    /// The best surface about a fixed centre.
    pub(super) fn solve_fixed(&self, scaled: &Scaled, centre: [f64; 2]) -> Result<Found, Error> {
        let (cells, limits) = (&scaled.cells, &scaled.limits);
        if self.omega == 0.0 {
            let optimum = self.engine.solve(&formulate::equal_fixed(cells, limits, centre))?;
            let [phi0, top] = optimum.x;
            let surface = Apex { curvature: [phi0, phi0, 0.0], centre, top };
            return Ok(Found::of(scaled, &optimum, surface));
        }
        let optimum = self.engine.solve(&formulate::elliptic_fixed(cells, limits, centre))?;
        let [p0, p1, p2, top] = optimum.x;
        Ok(Found::of(scaled, &optimum, Apex { curvature: [p0, p1, p2], centre, top }))
    }

    fn conclude(
        &self,
        cells: &[Cell],
        scaled: &Scaled,
        found: &Found,
        prior: Option<&Prior>,
    ) -> Fit {
        let surface = scaled.in_metres(&found.surface);
        let position = prior.map_or(surface.centre, |prior| prior.nearest(surface.centre));
        let height_m = scaled.scale.height_m;
        let certificate = Certificate {
            objective_m: found.objective * height_m,
            lower_bound_m: found.lower_bound.clamp(0.0, found.objective) * height_m,
            weight: cells.iter().map(|cell| cell[3]).sum(),
            nodes: found.nodes,
            iterations: found.iterations,
        };
        let mut flags = flags_of_centre(cells, position, prior);
        let [axes, imbalance] = scaled.limits.active(found.surface.curvature);
        flags.extend((cells.len() == self.unknowns()).then_some(Flag::NoRedundancy));
        flags.extend(axes.then_some(Flag::ShapeBoundActive));
        flags.extend(imbalance.then_some(Flag::ImbalanceActive));
        flags.sort_unstable();
        let surface = Paraboloid::from_apex(surface.curvature, position, surface.top);
        Fit {
            position,
            surface: Some(Surface::Paraboloid(surface)),
            certificate: Some(certificate),
            flags,
        }
    }
}

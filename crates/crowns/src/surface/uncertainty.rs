//! How well the cells determine the centre.

use super::dense::{Cholesky, add_outer, dot};
use super::method::{Fit, Surface};
use super::problem::{Cell, Problem};
use super::rank::{elliptic_row, equal_row};
use super::scale::Scale;
use super::{L1, Paraboloid};
use crate::Error;

/// How well the cells determine a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertainty {
    /// Standard error, both axes together, m; NaN without more cells than unknowns.
    ///
    /// The covariance of an L1 estimate is tau² (D'D)^-1 with tau = 1 / (2 f(0)), f the density of
    /// the residuals (Koenker and Bassett 1978, theorem 4.2); f(0) is estimated from the median of
    /// their sizes, leaving out as many as there are unknowns, which are zero by construction. The
    /// error of the centre follows by its derivatives. It knows nothing of the prior box: where that
    /// is active it is the error of the free centre.
    pub standard_error_m: f64,
}

/// Share of the residuals within which their density at zero is measured: wide enough to be
/// stable, narrow enough to leave out the tails.
const CENTRAL: f64 = 0.5;

impl L1 {
    /// How well a crown determines the position that [`super::Method::fit`] found; `None` for a fit
    /// without a surface.
    ///
    /// # Errors
    /// As for the fit.
    pub fn uncertainty(
        &self,
        problem: &Problem<'_>,
        fit: &Fit,
    ) -> Result<Option<Uncertainty>, Error> {
        let Some(surface) = fit.surface.as_ref().and_then(Surface::paraboloid) else {
            return Ok(None);
        };
        let cells = problem.check()?;
        let error = if self.omega == 0.0 {
            // phi0 stands for both curvatures.
            let join = |g: [f64; 5]| [g[0] + g[1], g[3], g[4], 0.0];
            standard_error(&cells, surface, equal_row, join)
        } else {
            standard_error(&cells, surface, elliptic_row, |[a, b, c, d, e]| [a, b, c, d, e, 0.0])
        };
        Ok(Some(Uncertainty { standard_error_m: error.unwrap_or(f64::NAN) }))
    }
}

fn standard_error<const K: usize>(
    cells: &[Cell],
    surface: &Paraboloid,
    row: fn(f64, f64) -> [f64; K],
    gradient: fn([f64; 5]) -> [f64; K],
) -> Option<f64> {
    let mut sizes: Vec<f64> = cells.iter().map(|c| (surface.z(c[0], c[1]) - c[2]).abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let sizes = sizes.get(K..).filter(|rest| !rest.is_empty())?;
    let rank = ((CENTRAL * sizes.len() as f64).ceil() as usize).clamp(1, sizes.len());
    // Density: a share of `rank / len` within +- size; tau = 1 / (2 density) in metres of height.
    let tau = sizes[rank - 1] * sizes.len() as f64 / rank as f64;
    let scale = Scale::of(cells);
    let mut gram = [[0.0; K]; K];
    scale.apply(cells).iter().for_each(|c| add_outer(&mut gram, &row(c[0], c[1]), c[3]));
    let factor = Cholesky::new(&gram)?;
    let variance = gradients(surface, &scale).map(|by_phi| {
        let by_unknown = gradient(by_phi);
        dot(&by_unknown, &factor.solve(&by_unknown))
    });
    let error = tau * (variance[0] + variance[1]).max(0.0).sqrt() * scale.length_m;
    error.is_finite().then_some(error)
}

/// Derivatives of the centre (in units of the scale's length) by phi0 to phi4 in units of length and
/// metres of height: of M c = -(phi3, phi4) with M = [[2 phi0, phi2], [phi2, 2 phi1]].
fn gradients(surface: &Paraboloid, scale: &Scale) -> [[f64; 5]; 2] {
    let l = scale.length_m;
    let [p0, p1, p2] = [0, 1, 2].map(|k| surface.phi[k] * l * l);
    let centre = surface.centre();
    let [x, y] = [0, 1].map(|axis| (centre[axis] - scale.centre[axis]) / l);
    let det = 4.0 * p0 * p1 - p2 * p2;
    let inverse = [[2.0 * p1 / det, -p2 / det], [-p2 / det, 2.0 * p0 / det]];
    inverse.map(|[a, b]| [-2.0 * a * x, -2.0 * b * y, -(a * y + b * x), -a, -b])
}

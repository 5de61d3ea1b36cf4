//! How well the cells determine the centre.

use super::bounds::Limits;
use super::dense::{Cholesky, add_outer, dot};
use super::extent::Rays;
use super::method::{Fit, Surface};
use super::problem::{Cell, Problem};
use super::rank::{elliptic_row, equal_row};
use super::scale::{Scale, Scaled};
use super::{L1, Paraboloid};
use crate::Error;

/// How well the cells determine a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Uncertainty {
    /// How far a centre can be from the position while the best surface about it has an objective at
    /// most 0.1 % above the optimum, m: solvers that stop at such a gap may return any of these
    /// centres. The largest distance in eight directions, within the prior box, to about 1 %; at most
    /// ten times the size of the crown, and 0 for surfaces that fit exactly.
    pub extent_m: f64,
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

/// The asymptotic covariance of the centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Asymptotic {
    /// 1 / (2 f(0)) of the residuals, m.
    pub(super) tau_m: f64,
    /// Covariance divided by tau², in (crown size / m)².
    pub(super) covariance: [[f64; 2]; 2],
}

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
        let scaled = Scaled::new(&cells, Limits::new(self.bounds, self.omega)?);
        let asymptotic = if self.omega == 0.0 {
            // phi0 stands for both curvatures.
            let join = |g: [f64; 5]| [g[0] + g[1], g[3], g[4], 0.0];
            asymptotic(&cells, &scaled, surface, equal_row, join)
        } else {
            asymptotic(&cells, &scaled, surface, elliptic_row, |[a, b, c, d, e]| {
                [a, b, c, d, e, 0.0]
            })
        };
        let corners = problem.prior.as_ref().map(|prior| scaled.corners(prior));
        let centre = scaled.position(fit.position);
        let extent = Rays { method: self, scaled: &scaled, centre, corners }.extent(asymptotic)?;
        let length_m = scaled.scale.length_m;
        let error = |Asymptotic { tau_m, covariance: c }: Asymptotic| {
            tau_m * (c[0][0] + c[1][1]).max(0.0).sqrt() * length_m
        };
        Ok(Some(Uncertainty {
            extent_m: extent * length_m,
            standard_error_m: asymptotic.map_or(f64::NAN, error),
        }))
    }
}

fn asymptotic<const K: usize>(
    cells: &[Cell],
    scaled: &Scaled,
    surface: &Paraboloid,
    row: fn(f64, f64) -> [f64; K],
    gradient: fn([f64; 5]) -> [f64; K],
) -> Option<Asymptotic> {
    let size = |cell: &Cell| (surface.z(cell[0], cell[1]) - cell[2]).abs();
    let mut sizes: Vec<f64> = cells.iter().map(size).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let sizes = sizes.get(K..).filter(|rest| !rest.is_empty())?;
    let rank = ((CENTRAL * sizes.len() as f64).ceil() as usize).clamp(1, sizes.len());
    // Density: a share of `rank / len` within +- size; tau = 1 / (2 density) in metres of height.
    let tau_m = sizes[rank - 1] * sizes.len() as f64 / rank as f64;
    let mut gram = [[0.0; K]; K];
    scaled.cells.iter().for_each(|c| add_outer(&mut gram, &row(c[0], c[1]), c[3]));
    let factor = Cholesky::new(&gram)?;
    let by_unknown = gradients(surface, &scaled.scale).map(gradient);
    let solved = by_unknown.map(|by| factor.solve(&by));
    let covariance = by_unknown.map(|by| solved.map(|solved| dot(&by, &solved)));
    covariance.iter().flatten().all(|c| c.is_finite()).then_some(Asymptotic { tau_m, covariance })
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

#[cfg(test)]
mod tests {
    use super::super::{Engine, Method, Shape};
    use super::*;

    /// 9 by 9 cells over a paraboloid, with a pattern of residuals, moved by `shift`.
    fn cells(residual: f64, shift: f64) -> Vec<[f64; 3]> {
        let shape =
            Shape { centre: [0.1, -0.2], apex_z_m: 9.0, semiaxes_m: [1.0; 2], azimuth: 0.0 };
        let truth = Paraboloid::from_shape(&shape);
        let at = |i: u32| {
            let (x, y) = (f64::from(i % 9) * 0.5 - 2.0, f64::from(i / 9) * 0.5 - 2.0);
            let sway = f64::from((i * 37 + 11) % 17) / 8.0 - 1.0;
            [x + shift, y - shift, truth.z(x, y) + residual * sway]
        };
        (0..81).map(at).collect()
    }

    fn uncertainty(method: &L1, cells: &[[f64; 3]]) -> Uncertainty {
        let problem = Problem::new(cells);
        let fit = method.fit(&problem).unwrap();
        method.uncertainty(&problem, &fit).unwrap().unwrap()
    }

    #[test]
    fn an_exact_surface_has_an_exact_centre() {
        let Uncertainty { extent_m, standard_error_m } =
            uncertainty(&L1::default(), &cells(0.0, 0.0));
        assert!(extent_m == 0.0 && standard_error_m < 1e-12);
    }

    #[test]
    fn rougher_crowns_are_known_less_well_wherever_they_stand() {
        for method in [L1::default(), L1 { omega: 0.3, ..L1::default() }] {
            let smooth = uncertainty(&method, &cells(0.1, 0.0));
            let rough = uncertainty(&method, &cells(0.3, 0.0));
            let moved = uncertainty(&method, &cells(0.3, 64.0));
            assert!(smooth.extent_m > 1e-4 && rough.extent_m > 2.0 * smooth.extent_m);
            assert!(rough.standard_error_m > 2.0 * smooth.standard_error_m);
            assert!((moved.extent_m - rough.extent_m).abs() < 1e-6);
        }
    }

    #[test]
    fn both_engines_see_the_same_extent() {
        let cells = cells(0.3, 0.0);
        for omega in [0.0, 0.3] {
            let [a, b] = [Engine::Dedicated, Engine::Clarabel]
                .map(|engine| uncertainty(&L1 { omega, engine, ..L1::default() }, &cells).extent_m);
            assert!((a - b).abs() < 0.02 * a, "{a} {b}");
        }
    }
}

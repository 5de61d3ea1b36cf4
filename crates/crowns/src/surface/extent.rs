//! How far the centre can move before the surface fits noticeably worse.

use super::Engine;
use super::formulate;
use super::l1::L1;
use super::program::Program;
use super::scale::Scaled;
use super::uncertainty::Asymptotic;
use super::vertex::{Scratch, Vertex, solve_near};
use crate::Error;

/// Rise of the objective, relative to the optimum, that counts as noticeable: gaps of this size
/// are common defaults of solvers.
const RISE: f64 = 1e-3;

/// Rays from the centre.
const RAYS: usize = 8;

/// Farthest distance that is looked at, in units of the crown's size: beyond it centres differ by less
/// and less.
const FARTHEST: f64 = 10.0;

/// Accuracy, relative, at which the search along a ray ends, with a derivative and without. One more
/// step without a check follows, which leaves less than 1 %.
const NEAR: [f64; 2] = [0.05, 0.02];

/// Halvings and steps that are never needed (about 2).
const MAX_STEPS: u32 = 40;

/// Optimal objectives that are this small, relative to the heights, are rounding.
const EXACT: f64 = 1e-11;

/// The search for the extent of good centres, in scaled units.
pub(super) struct Rays<'a> {
    pub(super) method: &'a L1,
    pub(super) scaled: &'a Scaled,
    pub(super) centre: [f64; 2],
    /// The prior box.
    pub(super) corners: Option<[[f64; 2]; 2]>,
}

/// The best objective about a fixed centre, and its derivative along the ray if that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Profile {
    objective: f64,
    slope: Option<f64>,
}

/// A ray: its unit vector and how far it may be followed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ray {
    direction: [f64; 2],
    most: f64,
}

impl Rays<'_> {
    /// The largest distance at which the best surface is worse than the optimum by [`RISE`].
    ///
    /// The rays are equally spaced where the standard error is a circle: where the centre is much
    /// better determined one way than the other, most rays go the other way. Good centres around the
    /// optimum form a convex set for equal axes (the projective image of one), so that the objective
    /// rises along each ray.
    pub(super) fn extent(&self, asymptotic: Option<Asymptotic>) -> Result<f64, Error> {
        let mut profiler = Profiler::new(self);
        let ray = Ray { direction: [0.0; 2], most: 0.0 };
        let base = profiler.at(&ray, 0.0)?.objective;
        let heights: f64 = self.scaled.cells.iter().map(|cell| cell[3] * cell[2].abs()).sum();
        if base <= EXACT * heights {
            return Ok(0.0);
        }
        let metric = asymptotic.map_or([[1.0, 0.0], [0.0, 1.0]], |a| root(a.covariance));
        let rise_m = RISE * base * self.scaled.scale.height_m;
        // For normal residuals the objective rises by (distance / error)² tau / 2.
        let mut guess = asymptotic.map_or(0.05, |a| (2.0 * a.tau_m * rise_m).sqrt());
        let mut extent = 0.0f64;
        for index in 0..RAYS {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * index as f64 / RAYS as f64);
            let [dx, dy] = metric.map(|[a, b]| a * cos + b * sin);
            let length = (dx * dx + dy * dy).sqrt();
            if length.is_nan() || length <= 0.0 {
                continue;
            }
            let ray = self.ray([dx / length, dy / length]);
            let distance = profiler.reach(&ray, base, guess * length)?;
            if distance < ray.most {
                guess = distance / length;
            }
            extent = extent.max(distance);
        }
        Ok(extent)
    }

    fn ray(&self, direction: [f64; 2]) -> Ray {
        let mut most = FARTHEST;
        for axis in 0..2 {
            let (from, rate) = (self.centre[axis], direction[axis]);
            if let Some([low, high]) = self.corners
                && rate != 0.0
            {
                let edge = if rate > 0.0 { high[axis] } else { low[axis] };
                most = most.min(((edge - from) / rate).max(0.0));
            }
        }
        Ray { direction, most }
    }
}

/// Solves for one centre after the other.
struct Profiler<'a> {
    rays: &'a Rays<'a>,
    /// Equal axes: the program, changed in place.
    program: Program<2>,
    last: Option<Vertex<2>>,
    scratch: Scratch,
}

impl<'a> Profiler<'a> {
    fn new(rays: &'a Rays<'a>) -> Self {
        let Scaled { cells, limits, .. } = rays.scaled;
        let program = formulate::equal_fixed(cells, limits, rays.centre);
        Self { rays, program, last: None, scratch: Scratch::default() }
    }

    /// The best surface about the centre at a distance along a ray.
    fn at(&mut self, ray: &Ray, distance: f64) -> Result<Profile, Error> {
        let Rays { method, scaled, centre, .. } = *self.rays;
        let at = [0, 1].map(|axis| centre[axis] + distance * ray.direction[axis]);
        if method.omega > 0.0 {
            let program = formulate::elliptic_fixed(&scaled.cells, &scaled.limits, at);
            let objective = method.engine.relax(&program)?.objective;
            return Ok(Profile { objective, slope: None });
        }
        if method.engine == Engine::Dedicated
            && let Some(profile) = self.equal_at(ray, at)
        {
            return Ok(profile);
        }
        let program = formulate::equal_fixed(&scaled.cells, &scaled.limits, at);
        Ok(Profile { objective: method.engine.solve(&program)?.objective, slope: None })
    }

    fn equal_at(&mut self, ray: &Ray, [cx, cy]: [f64; 2]) -> Option<Profile> {
        let cells = &self.rays.scaled.cells;
        for (row, cell) in self.program.rows.iter_mut().zip(cells) {
            let (dx, dy) = (cell[0] - cx, cell[1] - cy);
            row.d[0] = dx * dx + dy * dy;
        }
        let [ux, uy] = ray.direction;
        let change = |row: usize, x: &[f64; 2]| {
            -2.0 * x[0] * (ux * (cells[row][0] - cx) + uy * (cells[row][1] - cy))
        };
        let last = solve_near(&self.program, self.last.as_ref(), &mut self.scratch, change)?;
        self.last = Some(last);
        Some(Profile { objective: last.objective, slope: Some(last.slope) })
    }

    /// The distance at which the objective has risen by [`RISE`], from a guess.
    ///
    /// Newton's method, or the secant where there is no derivative, for the root of the rise, which
    /// is nearly straight where the rise is nearly quadratic; within a bracket.
    fn reach(&mut self, ray: &Ray, base: f64, guess: f64) -> Result<f64, Error> {
        let target = (RISE * base).sqrt();
        let (mut low, mut high) = (0.0, None);
        let mut last = [0.0; 2];
        let mut at = guess.min(ray.most);
        for _ in 0..MAX_STEPS {
            if at <= low {
                break;
            }
            let profile = self.at(ray, at)?;
            let root = (profile.objective - base).max(0.0).sqrt();
            let secant = (root - last[1]) / (at - last[0]);
            let rate = profile.slope.filter(|s| *s > 0.0).map_or(secant, |s| 0.5 * s / root);
            let next = at + (target - root) / rate.max(f64::MIN_POSITIVE);
            last = [at, root];
            let near = NEAR[usize::from(profile.slope.is_none())];
            if (root - target).abs() <= near * target {
                return Ok(next.clamp(low, high.unwrap_or(ray.most)));
            }
            if root < target {
                if at >= ray.most {
                    return Ok(ray.most);
                }
                low = at;
            } else {
                high = Some(at);
            }
            at = match high {
                Some(high) if next > low && next < high => next,
                Some(high) => 0.5 * (low + high),
                None => next.clamp(1.2 * at, 4.0 * at).min(ray.most),
            };
        }
        Ok(high.unwrap_or(ray.most))
    }
}

/// The symmetric root of a symmetric positive semidefinite matrix.
fn root([[a, b], [_, d]]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let determinant = (a * d - b * b).max(0.0).sqrt();
    let trace = (a + d + 2.0 * determinant).sqrt();
    [[a + determinant, b], [b, d + determinant]].map(|row| row.map(|value| value / trace))
}

#[cfg(test)]
mod tests {
    use super::super::bounds::AxisBounds;
    use super::super::samples;
    use super::*;

    fn method(omega: f64) -> L1 {
        let bounds = AxisBounds::Exact { smallest_m: 0.2, largest_m: 4.0 };
        L1 { omega, bounds, engine: Engine::Dedicated }
    }

    fn rise(method: &L1, scaled: &Scaled, base: f64, at: [f64; 2]) -> f64 {
        method.solve_fixed(scaled, at).unwrap().objective / base - 1.0
    }

    #[test]
    fn at_the_extent_the_objective_is_a_thousandth_higher() {
        for (seed, omega) in (0..40).flat_map(|seed| [(seed, 0.0), (seed, 0.4)]) {
            let method = method(omega);
            let scaled = samples::crown(seed, method.bounds, omega);
            let found = method.solve(&scaled, None).unwrap();
            let rays = Rays {
                method: &method,
                scaled: &scaled,
                centre: found.surface.centre,
                corners: None,
            };
            let mut profiler = Profiler::new(&rays);
            for azimuth in [0.3, 2.0, 4.0] {
                let (sin, cos) = libm::sincos(azimuth);
                let ray = rays.ray([cos, sin]);
                let distance = profiler.reach(&ray, found.objective, 0.05).unwrap();
                let at = [0, 1].map(|axis| rays.centre[axis] + distance * ray.direction[axis]);
                let rise = rise(&method, &scaled, found.objective, at);
                let error = (rise / RISE - 1.0).abs();
                assert!(distance == FARTHEST || error < 0.02, "{seed}: {rise} at {distance}");
            }
        }
    }

    #[test]
    fn a_prior_box_ends_the_rays() {
        let method = method(0.0);
        let scaled = samples::crown(4, method.bounds, 0.0);
        let [x, y] = method.solve(&scaled, None).unwrap().surface.centre;
        let extent = |half: f64| {
            let corners = Some([[x - half, y - half], [x + half, y + half]]);
            Rays { method: &method, scaled: &scaled, centre: [x, y], corners }.extent(None).unwrap()
        };
        assert!(extent(0.0) == 0.0);
        assert!((extent(1e-4) - 1e-4 * 2f64.sqrt()).abs() < 1e-12);
        assert!(extent(0.5) > 0.01 && extent(0.5) == extent(5.0));
    }

    #[test]
    fn the_rays_follow_what_is_known_badly() {
        assert_eq!(root([[4.0, 0.0], [0.0, 9.0]]), [[2.0, 0.0], [0.0, 3.0]]);
        let [[a, b], [c, d]] = root([[2.0, 0.6], [0.6, 1.0]]);
        let square = [a * a + b * c, a * b + b * d, c * c + d * d];
        assert!(square.iter().zip([2.0, 0.6, 1.0]).all(|(s, e)| (s - e).abs() < 1e-12));
    }
}

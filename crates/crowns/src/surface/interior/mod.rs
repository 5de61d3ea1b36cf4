//! The dedicated engine for programs with second-order cones: a primal-dual interior point method
//! with the predictor and corrector of Mehrotra 1992 and the scaling of Nesterov and Todd 1997, made
//! for few unknowns: whatever the number of cells, every step solves one system of K equations.
//!
//! With p - q = D x - z, p, q >= 0, slacks kappa = G x + h of the cones and multipliers y, s it seeks
//! D'y = G's, p (w - y) = q (w + y) = mu and kappa o s = mu e for mu towards 0.

mod polish;
mod scaling;
mod step;

use super::dense::{Cholesky, add_outer, dot};
use super::dual::Dual;
use super::program::{Optimum, Program};
use crate::Error;
use scaling::{Vec4, determinant, inverse, product};
use step::Step;

/// Gap between primal and dual, relative to the objective, that ends the iteration.
const GAP: f64 = 1e-10;
/// The same where it is not clear at that gap which residuals are nought.
const LAST_GAP: f64 = 1e-14;
/// Steps it may take to get there.
const MAX_LAST_ITERATIONS: u32 = 4;
/// The same relative to the heights, for surfaces that fit exactly.
const GAP_OF_HEIGHTS: f64 = 1e-13;
/// Residue of the equations that is as good as none.
const RESIDUE: f64 = 1e-9;
/// Gap that is good enough where rounding ends the iteration early.
const ACCEPTABLE_GAP: f64 = 1e-8;
/// Far more than are ever needed (about 12).
const MAX_ITERATIONS: u32 = 60;
/// Share of the way to the boundary that a step takes.
const STEP: f64 = 0.99;

/// What belongs to one cell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Lane {
    /// Parts of the residual above and below, and the multiplier.
    p: f64,
    q: f64,
    y: f64,
    /// Residual D x - z.
    r: f64,
    /// 1 / (p / (w - y) + q / (w + y)).
    theta: f64,
}

/// What belongs to one cone.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Link {
    kappa: Vec4,
    s: Vec4,
    /// G x + h - kappa.
    residue: Vec4,
}

/// A point of the iteration.
struct State<'a, const K: usize> {
    program: &'a Program<K>,
    /// Sum of all weights.
    weight: f64,
    x: [f64; K],
    lanes: Vec<Lane>,
    links: Vec<Link>,
    /// D'y - G's.
    dual_residue: [f64; K],
    objective: f64,
    /// Sum of all products that are to vanish.
    gap: f64,
}

/// The optimum to the last digits.
pub(super) fn solve<const K: usize>(program: &Program<K>) -> Result<Optimum<K>, Error> {
    let mut state = State::start(program);
    let mut iterations = state.iterate(GAP, MAX_ITERATIONS);
    if !polish::polish(&mut state) {
        // Not yet clear which residuals are nought and which cones are active.
        iterations += state.iterate(LAST_GAP, MAX_LAST_ITERATIONS);
        polish::polish(&mut state);
    }
    state.finish(iterations, ACCEPTABLE_GAP)
}

/// A surface and a bound that are near enough to one another for branch and bound.
pub(super) fn relax<const K: usize>(program: &Program<K>) -> Result<Optimum<K>, Error> {
    let mut state = State::start(program);
    let iterations = state.iterate(ACCEPTABLE_GAP, MAX_ITERATIONS);
    state.finish(iterations, 10.0 * ACCEPTABLE_GAP)
}

impl<'a, const K: usize> State<'a, K> {
    /// A well-centred point with residuals of least squares.
    fn start(program: &'a Program<K>) -> Self {
        let x = program.start.unwrap_or_else(|| ridge(program));
        let weight: f64 = program.rows.iter().map(|row| row.w).sum();
        let mean = (program.objective(&x) / weight).max(1e-3);
        let lanes = program.rows.iter().map(|row| {
            let r = dot(&row.d, &x) - row.z;
            let mu = mean * row.w;
            let y = r * row.w * row.w / (mu + (mu * mu + r * r * row.w * row.w).sqrt());
            let small = mu / (row.w + y.abs());
            let (p, q) = if r > 0.0 { (r + small, small) } else { (small, small - r) };
            Lane { p, q, y, r, theta: 0.0 }
        });
        let links = program.cones.iter().map(|cone| {
            let mut kappa = cone.at(&x);
            kappa[cone.dim..].fill(0.0);
            let tail = (kappa[0] * kappa[0] - determinant(&kappa)).max(0.0).sqrt();
            kappa[0] = kappa[0].max(tail + 0.1 * (kappa[0].abs() + tail) + 0.1);
            Link { kappa, s: inverse(&kappa, mean * weight / K as f64), residue: [0.0; 4] }
        });
        Self {
            program,
            weight,
            x,
            lanes: lanes.collect(),
            links: links.collect(),
            dual_residue: [0.0; K],
            objective: f64::INFINITY,
            gap: f64::INFINITY,
        }
    }

    /// Goes on until primal and dual agree to a relative gap; returns the number of steps.
    fn iterate(&mut self, gap: f64, most: u32) -> u32 {
        let heights = GAP_OF_HEIGHTS * self.program.magnitude();
        for iterations in 0..most {
            self.measure();
            if self.gap <= gap * self.objective + heights && self.residue() <= RESIDUE {
                return iterations;
            }
            let Some(step) = Step::of(self) else { return iterations };
            let lengths = self.advance(&step);
            if lengths[0].max(lengths[1]) < 1e-6 {
                self.measure();
                return iterations + 1;
            }
        }
        self.measure();
        most
    }

    /// Brings residuals, residues, objective and gap up to date.
    fn measure(&mut self) {
        let (mut objective, mut gap, mut dual) = (0.0, 0.0, [0.0; K]);
        for (row, lane) in self.program.rows.iter().zip(&mut self.lanes) {
            lane.r = dot(&row.d, &self.x) - row.z;
            objective += row.w * lane.r.abs();
            let (a, b) = (row.w - lane.y, row.w + lane.y);
            gap += lane.p * a + lane.q * b;
            lane.theta = a * b / (lane.p * b + lane.q * a);
            dual.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum += d * lane.y);
        }
        for (cone, link) in self.program.cones.iter().zip(&mut self.links) {
            let at = cone.at(&self.x);
            for i in 0..cone.dim {
                link.residue[i] = at[i] - link.kappa[i];
            }
            gap += product(&link.kappa, &link.s);
            let moved = cone.transposed(&link.s);
            dual.iter_mut().zip(moved).for_each(|(sum, part)| *sum -= part);
        }
        (self.objective, self.gap, self.dual_residue) = (objective, gap, dual);
    }

    /// The largest residue of any equation, relative to what it is made of.
    fn residue(&self) -> f64 {
        let of = |value: f64, size: f64| value.abs() / (1.0 + size);
        let dual = self.dual_residue.iter().map(|rho| of(*rho, self.weight));
        let cones = self
            .links
            .iter()
            .flat_map(|link| link.residue.iter().map(|residue| of(*residue, link.kappa[0])));
        let parts = self.lanes.iter().map(|lane| of(lane.r - lane.p + lane.q, lane.r.abs()));
        dual.chain(cones).chain(parts).fold(0.0, f64::max)
    }

    /// Number of products that are to vanish.
    fn degree(&self) -> f64 {
        (2 * self.lanes.len() + self.links.len()) as f64
    }

    /// Goes along a step; returns the lengths of the primal and of the dual part.
    fn advance(&mut self, step: &Step<K>) -> [f64; 2] {
        let [primal, dual] = step.longest(self).map(|length| (STEP * length).min(1.0));
        self.x.iter_mut().zip(step.x).for_each(|(x, dx)| *x += primal * dx);
        for (lane, d) in self.lanes.iter_mut().zip(&step.lanes) {
            lane.p += primal * d.p;
            lane.q += primal * d.q;
            lane.y += dual * d.y;
        }
        for (link, d) in self.links.iter_mut().zip(&step.links) {
            for i in 0..4 {
                link.kappa[i] += primal * d.kappa[i];
                link.s[i] += dual * d.s[i];
            }
        }
        [primal, dual]
    }

    fn finish(mut self, iterations: u32, acceptable: f64) -> Result<Optimum<K>, Error> {
        self.measure();
        let y = self.lanes.iter().map(|lane| lane.y).collect();
        let s = self.links.iter().map(|link| link.s).collect();
        let lower_bound = Dual { y, s }.bound(self.program, self.objective);
        let size = self.objective + GAP_OF_HEIGHTS / GAP * self.program.magnitude();
        let feasible = self.links.iter().all(|link| {
            link.residue.iter().all(|residue| residue.abs() <= 1e-7 * (1.0 + link.kappa[0]))
        });
        if feasible && self.objective - lower_bound <= acceptable * size {
            let objective = self.objective;
            return Ok(Optimum { x: self.x, objective, lower_bound, iterations });
        }
        let gap = (self.objective - lower_bound) / size;
        Err(Error::Solver { status: format!("a relative gap of {gap:e}"), iterations })
    }
}

/// Least squares, with a little of the identity where the rows do not determine all unknowns.
fn ridge<const K: usize>(program: &Program<K>) -> [f64; K] {
    let (mut gram, mut rhs) = ([[0.0; K]; K], [0.0; K]);
    for row in &program.rows {
        add_outer(&mut gram, &row.d, row.w);
        rhs.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum += row.w * row.z * d);
    }
    let mean = (0..K).map(|k| gram[k][k]).sum::<f64>() / K as f64;
    (0..K).for_each(|k| gram[k][k] += 1e-6 * mean);
    Cholesky::new(&gram).map_or([0.0; K], |factor| factor.solve(&rhs))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::bounds::AxisBounds;
    use crate::surface::formulate;
    use crate::surface::samples::crown;
    use crate::surface::scale::Scaled;

    fn check<const K: usize>(program: &Program<K>, about: &str) -> u32 {
        let ours = solve(program).unwrap_or_else(|error| panic!("{about}: {error}"));
        let theirs = crate::surface::clarabel::solve(program).unwrap();
        let difference = (ours.objective - theirs.objective) / theirs.objective;
        assert!(difference.abs() < 1e-7, "{about}: {ours:?} {theirs:?}");
        let gap = (ours.objective - ours.lower_bound) / ours.objective;
        assert!((-1e-10..1e-8).contains(&gap), "{about}: gap {gap:e} {ours:?}");
        ours.iterations
    }

    #[test]
    fn it_agrees_with_the_reference_on_every_form() {
        let exact = AxisBounds::default();
        let paper = AxisBounds::Paper { largest_m: 3.0 };
        let (mut most, mut total) = (0, 0);
        for seed in 0..150 {
            for (bounds, omega) in [(exact, 0.05), (exact, 0.5), (exact, 1.0), (paper, 0.2)] {
                let Scaled { cells, limits, .. } = crown(seed, bounds, omega);
                let about = format!("seed {seed} omega {omega} {bounds:?}");
                let centre = [0.3, -0.2];
                let iterations = [
                    check(&formulate::elliptic(&cells, &limits), &about),
                    check(&formulate::elliptic_fixed(&cells, &limits, centre), &about),
                    check(&formulate::equal(&cells, &limits, None), &about),
                    check(&formulate::equal(&cells, &limits, Some([[0.1; 2], [0.2; 2]])), &about),
                    check(&formulate::equal_fixed(&cells, &limits, centre), &about),
                ];
                total += iterations.iter().sum::<u32>();
                most = iterations.into_iter().fold(most, u32::max);
            }
        }
        println!("iterations: mean {}, most {most}", f64::from(total) / (150.0 * 20.0));
        assert!(most < 40);
    }
}

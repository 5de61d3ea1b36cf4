//! The last digits: Newton's method on the conditions of optimality, once the iteration has told
//! which residuals are nought and which cones are active.
//!
//! Where the optimum is a corner this solves its equations; where it lies on a curved cone the
//! centre would otherwise only be as good as the root of the gap.

use super::scaling::{Vec4, determinant, product};
use super::{Lane, Link, State};
use crate::surface::dense::dot;
use crate::surface::program::{Cone, Row};

/// Unknowns of the largest system: K = 8 and as many multipliers.
const SIZE: usize = 16;
/// Steps of Newton's method; it converges quadratically.
const STEPS: usize = 4;
/// Change of the unknowns, relative, below which it has converged.
const CONVERGED: f64 = 1e-13;
/// By how much the objective may rise, relative: rounding.
const RISE: f64 = 1e-10;

/// What is taken to be active at the optimum.
struct Active {
    /// Rows whose residual is nought.
    rows: Vec<usize>,
    /// Cones on whose boundary the slack is, with the factor from the mirrored slack to s.
    cones: Vec<(usize, f64)>,
}

/// Moves a state that has nearly converged to the optimum nearby; returns whether it did.
pub(super) fn polish<const K: usize>(state: &mut State<'_, K>) -> bool {
    let mut active = Active::of(state);
    let count = active.rows.len() + active.cones.len();
    if count > K || (active.cones.is_empty() && count < K) {
        return false;
    }
    let mut x = state.x;
    let mut y: Vec<f64> = active.rows.iter().map(|&i| state.lanes[i].y).collect();
    let mut change = f64::INFINITY;
    for _ in 0..STEPS {
        let mut system = System::new(state, &active, &x, &y);
        let Some(step) = system.solve(K + count) else { return false };
        change = 0.0;
        for (x, dx) in x.iter_mut().zip(&step) {
            *x += dx;
            change = change.max(dx.abs() / (1.0 + x.abs()));
        }
        let multipliers = y.iter_mut().chain(active.cones.iter_mut().map(|(_, factor)| factor));
        multipliers.zip(&step[K..]).for_each(|(value, d)| *value += d);
        if change < CONVERGED {
            break;
        }
    }
    change < 1e-9 && accept(state, &active, &x, &y)
}

impl Active {
    /// By strict complementarity: of two numbers whose product vanishes, the one that does not.
    fn of<const K: usize>(state: &State<'_, K>) -> Self {
        let size = (state.objective / state.weight).max(1e-9);
        let zero =
            |(row, lane): (&Row<K>, &Lane)| lane.r.abs() / size < (row.w - lane.y.abs()) / row.w;
        let pairs = state.program.rows.iter().zip(&state.lanes).enumerate();
        let rows = pairs.filter(|(_, pair)| zero(*pair)).map(|(index, _)| index).collect();
        let on = |link: &Link| {
            let tail = (link.kappa[0] * link.kappa[0] - determinant(&link.kappa)).max(0.0).sqrt();
            link.s[0] / state.weight > link.kappa[0] - tail
        };
        let factor = |(index, link): (usize, &Link)| {
            let half_line = state.program.cones[index].dim == 1;
            (index, if half_line { link.s[0] } else { link.s[0] / link.kappa[0] })
        };
        let cones = state.links.iter().enumerate().filter(|(_, link)| on(link)).map(factor);
        let cones = cones.collect();
        Self { rows, cones }
    }
}

fn mirrored([head, a, b, c]: Vec4) -> Vec4 {
    [head, -a, -b, -c]
}

/// What vanishes on the boundary of a cone, and its gradient: the head of a half line, else half
/// the determinant.
fn boundary<const K: usize>(cone: &Cone<K>, x: &[f64; K]) -> (f64, [f64; K]) {
    let kappa = slack(cone, x);
    if cone.dim == 1 {
        return (kappa[0], cone.rows[0]);
    }
    (0.5 * product(&kappa, &mirrored(kappa)), cone.transposed(&mirrored(kappa)))
}

fn slack<const K: usize>(cone: &Cone<K>, x: &[f64; K]) -> Vec4 {
    let mut kappa = cone.at(x);
    kappa[cone.dim..].fill(0.0);
    kappa
}

/// Linearised conditions of optimality.
struct System {
    matrix: [[f64; SIZE + 1]; SIZE],
}

impl System {
    /// Unknowns are the changes of x, of the y of the active rows, of the factors of the cones.
    fn new<const K: usize>(state: &State<'_, K>, active: &Active, x: &[f64; K], y: &[f64]) -> Self {
        let mut system = Self { matrix: [[0.0; SIZE + 1]; SIZE] };
        let mut gradient = [0.0; K];
        for (row, lane) in state.program.rows.iter().zip(&state.lanes) {
            let force = row.w.copysign(lane.r);
            gradient.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum += force * d);
        }
        for (place, (&i, &y)) in active.rows.iter().zip(y).enumerate() {
            let row = &state.program.rows[i];
            let force = y - row.w.copysign(state.lanes[i].r);
            gradient.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum += force * d);
            system.border(K + place, &row.d, dot(&row.d, x) - row.z);
        }
        for (place, &(k, factor)) in active.cones.iter().enumerate() {
            let cone = &state.program.cones[k];
            let (value, normal) = boundary(cone, x);
            gradient.iter_mut().zip(&normal).for_each(|(sum, part)| *sum -= factor * part);
            let place = K + active.rows.len() + place;
            system.border(place, &normal.map(|value| -value), -value);
            if cone.dim > 1 {
                system.curve(cone, factor);
            }
        }
        (0..K).for_each(|k| system.matrix[k][SIZE] = -gradient[k]);
        system
    }

    /// The curvature of a cone's boundary.
    fn curve<const K: usize>(&mut self, cone: &Cone<K>, factor: f64) {
        for (i, row) in cone.rows.iter().enumerate().take(cone.dim) {
            let sign = if i == 0 { -factor } else { factor };
            for a in 0..K {
                (0..K).for_each(|b| self.matrix[a][b] += sign * row[a] * row[b]);
            }
        }
    }

    /// A row and the same column, with the value that is to vanish.
    fn border<const K: usize>(&mut self, at: usize, row: &[f64; K], value: f64) {
        for (k, entry) in row.iter().enumerate() {
            self.matrix[at][k] = *entry;
            self.matrix[k][at] = *entry;
        }
        self.matrix[at][SIZE] = -value;
    }

    /// Solves the leading equations by elimination with row pivoting.
    fn solve(&mut self, size: usize) -> Option<[f64; SIZE]> {
        let m = &mut self.matrix;
        for k in 0..size {
            let larger =
                |best: usize, i: usize| if m[i][k].abs() > m[best][k].abs() { i } else { best };
            let pivot = (k..size).fold(k, larger);
            m.swap(k, pivot);
            if m[k][k].abs() < 1e-14 {
                return None;
            }
            let top = m[k];
            for row in &mut m[k + 1..size] {
                let factor = row[k] / top[k];
                if factor != 0.0 {
                    (k..=SIZE).for_each(|j| row[j] -= factor * top[j]);
                }
            }
        }
        let mut x = [0.0; SIZE];
        for k in (0..size).rev() {
            let known: f64 = (k + 1..size).map(|j| m[k][j] * x[j]).sum();
            x[k] = (m[k][SIZE] - known) / m[k][k];
        }
        Some(x)
    }
}

/// Takes the new point over if it is feasible, its multipliers are, and it is not worse.
fn accept<const K: usize>(
    state: &mut State<'_, K>,
    active: &Active,
    x: &[f64; K],
    y: &[f64],
) -> bool {
    let program = state.program;
    let dual_is_sound = active.cones.iter().all(|(_, factor)| *factor >= 0.0)
        && active.rows.iter().zip(y).all(|(&i, y)| y.abs() <= program.rows[i].w);
    let inside = |(k, cone): (usize, &Cone<K>)| {
        let kappa = slack(cone, x);
        let tail = (kappa[1] * kappa[1] + kappa[2] * kappa[2] + kappa[3] * kappa[3]).sqrt();
        let on = active.cones.iter().any(|(index, _)| *index == k);
        on || kappa[0] >= tail
    };
    let feasible = program.cones.iter().enumerate().all(inside);
    if !(dual_is_sound && feasible && program.objective(x) <= state.objective * (1.0 + RISE)) {
        return false;
    }
    state.x = *x;
    for (row, lane) in program.rows.iter().zip(&mut state.lanes) {
        lane.y = row.w.copysign(lane.r);
    }
    active.rows.iter().zip(y).for_each(|(&i, y)| state.lanes[i].y = *y);
    for (cone, link) in program.cones.iter().zip(&mut state.links) {
        (link.kappa, link.s) = (slack(cone, x), [0.0; 4]);
    }
    for &(k, factor) in &active.cones {
        let cone = &program.cones[k];
        let kappa = slack(cone, x);
        let direction = if cone.dim == 1 { [1.0, 0.0, 0.0, 0.0] } else { mirrored(kappa) };
        state.links[k].s = direction.map(|value| factor * value);
    }
    true
}

//! The convex programs of the surface models, in scaled units.

use super::bounds::Limits;
use super::problem::Cell;
use super::program::{Cone, Program, Row};
use super::scale::Apex;

/// Half width of a box, in units of the crown's size, below which its centre is fixed.
pub(super) const POINT: f64 = 1e-9;

/// Unknowns phi0 (= phi1), phi3, phi4, phi5: equal axes, with the box for the centre as
/// -2 phi0 low <= phi3 <= -2 phi0 high and so for phi4 (Polewski et al., constraint C5).
pub(super) fn equal(cells: &[Cell], limits: &Limits, prior: Option<[[f64; 2]; 2]>) -> Program<4> {
    let rows = cells.iter().map(|&[x, y, z, w]| Row { d: [x * x + y * y, x, y, 1.0], z, w });
    let mut cones = equal_bounds(limits, [1.0, 0.0, 0.0, 0.0]);
    if let Some([low, high]) = prior {
        for axis in 0..2 {
            let row = |at: f64, sign: f64| {
                let mut row = [2.0 * at * sign, 0.0, 0.0, 0.0];
                row[1 + axis] = sign;
                row
            };
            cones.push(Cone::linear(row(low[axis], 1.0), 0.0));
            cones.push(Cone::linear(row(high[axis], -1.0), 0.0));
        }
    }
    Program::new(rows.collect(), cones)
}

pub(super) fn equal_apex([p0, p3, p4, p5]: [f64; 4]) -> Apex {
    Apex::from_phi([p0, p0, 0.0, p3, p4, p5])
}

/// Unknowns phi0 (= phi1) and the top: equal axes about a fixed centre.
pub(super) fn equal_fixed(cells: &[Cell], limits: &Limits, centre: [f64; 2]) -> Program<2> {
    let row = |&[x, y, z, w]: &Cell| {
        let (dx, dy) = (x - centre[0], y - centre[1]);
        Row { d: [dx * dx + dy * dy, 1.0], z, w }
    };
    Program::new(cells.iter().map(row).collect(), equal_bounds(limits, [1.0, 0.0]))
}

/// Bounds on phi0 where the axes are equal.
fn equal_bounds<const K: usize>(limits: &Limits, phi0: [f64; K]) -> Vec<Cone<K>> {
    let [low, high] = limits.equal_axes();
    let mut cones = vec![Cone::linear(phi0.map(|value| -value), -0.5 * low)];
    if high.is_finite() {
        cones.push(Cone::linear(phi0, 0.5 * high));
    }
    cones
}

/// Unknowns phi0 to phi5.
pub(super) fn elliptic(cells: &[Cell], limits: &Limits) -> Program<6> {
    let row = |&[x, y, z, w]: &Cell| Row { d: [x * x, y * y, x * y, x, y, 1.0], z, w };
    let form =
        ShapeForm { phi0: unit(0), phi1: unit(1), phi2: unit(2), share: [0.0; 6], whole: 1.0 };
    Program::new(cells.iter().map(row).collect(), form.cones(limits))
}

/// Unknowns phi0, phi1, phi2 and the top, about a fixed centre.
pub(super) fn elliptic_fixed(cells: &[Cell], limits: &Limits, centre: [f64; 2]) -> Program<4> {
    let row = |&[x, y, z, w]: &Cell| {
        let (dx, dy) = (x - centre[0], y - centre[1]);
        Row { d: [dx * dx, dy * dy, dx * dy, 1.0], z, w }
    };
    let form =
        ShapeForm { phi0: unit(0), phi1: unit(1), phi2: unit(2), share: [0.0; 4], whole: 1.0 };
    Program::new(cells.iter().map(row).collect(), form.cones(limits))
}

pub(super) fn unit<const K: usize>(at: usize) -> [f64; K] {
    std::array::from_fn(|k| if k == at { 1.0 } else { 0.0 })
}

/// Where the coefficients of a shape are among the unknowns, and of which share of the whole it
/// is: `share * x + whole`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ShapeForm<const K: usize> {
    pub(super) phi0: [f64; K],
    pub(super) phi1: [f64; K],
    pub(super) phi2: [f64; K],
    pub(super) share: [f64; K],
    pub(super) whole: f64,
}

impl<const K: usize> ShapeForm<K> {
    /// C3 and C4, or C3 and the exact bounds on the axes.
    pub(super) fn cones(&self, limits: &Limits) -> Vec<Cone<K>> {
        let combine = |a: f64, b: f64| std::array::from_fn(|k| a * self.phi0[k] + b * self.phi1[k]);
        let trace: [f64; K] = combine(-1.0, -1.0);
        let tail = [combine(1.0, -1.0), self.phi2];
        let with_share = |sign: f64, factor: f64| -> ([f64; K], f64) {
            let row = std::array::from_fn(|k| sign * trace[k] + factor * self.share[k]);
            (row, factor * self.whole)
        };
        let mut cones = Vec::with_capacity(3);
        if limits.omega < 1.0 {
            cones.push(Cone::second_order(trace.map(|value| limits.omega * value), 0.0, tail));
        }
        if limits.mu > 0.0 {
            let third = self.share.map(|value| limits.mu * value);
            let cone = Cone::second_order(trace, 0.0, tail);
            cones.push(cone.with_tail(third, limits.mu * self.whole));
        } else {
            let (head, shift) = with_share(1.0, -limits.least);
            cones.push(Cone::second_order(head, shift, tail));
            let (head, shift) = with_share(-1.0, limits.most);
            cones.push(Cone::second_order(head, shift, tail));
        }
        cones
    }
}

//! The position prior with two free axes, to certified global optimality.
//!
//! The box for the centre (Polewski et al., constraint C5) is the only part of the problem that is not
//! convex. Along the straight line, in the coefficients, from a surface with its centre inside the
//! box to the free optimum outside, the objective falls and the centre moves continuously: so an
//! optimum has its centre on the boundary of the box, and its four edges can be searched one by one.
//! Edges that every allowed surface could leave inwards are left out; on the others the convex hull
//! of all surfaces ([`Piece::program`]) is refined by branch and bound.

use super::bounds::Limits;
use super::dense::gram_spread;
use super::engine::Engine;
use super::formulate::{ShapeForm, unit};
use super::l1::Found;
use super::problem::Cell;
use super::program::{Cone, Optimum, Program, Row};
use super::scale::{Apex, Scaled};
use crate::Error;

/// Gap, relative to the objective, at which the search ends: two searches agree to 1e-7.
const GAP: f64 = 5e-8;
/// The same relative to the heights, for surfaces that fit exactly.
const GAP_OF_HEIGHTS: f64 = 1e-12;
/// Pieces after which the search ends in any case, with the gap that is left.
const MAX_NODES: u32 = 4000;
/// A piece is divided no nearer to its end than this share of its width.
const LEAST_SHARE: f64 = 0.2;

/// An edge of the box in scaled units: a segment along one axis, at one place of the other.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Edge {
    /// The axis along which it runs.
    axis: usize,
    /// Where it is on the other axis.
    place: f64,
    /// On that axis, the direction out of the box.
    outward: f64,
    /// Its ends on its own axis.
    ends: [f64; 2],
}

/// Surfaces with their centre on a part of an edge and a ratio P_nt / P_tt in a range.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    edge: usize,
    /// Range of the centre along the edge.
    along: [f64; 2],
    /// Range of the ratio (n across the edge, t along it).
    ratio: [f64; 2],
    /// No surface of the piece is better.
    bound: f64,
    /// Where the best surface of its hull is, along the edge and in ratio.
    at: [f64; 2],
}

/// What is the same for all pieces of an edge.
struct Side {
    edge: Edge,
    /// Cells by their position along and across the edge.
    cells: Vec<Cell>,
    /// Largest sizes of the unknowns; see [`Program::spread`].
    spread: [f64; 8],
    /// Shape of the free optimum along, across and mixed, and its place along the edge.
    free: ([f64; 3], f64),
}

struct Search<'a> {
    engine: Engine,
    scaled: &'a Scaled,
    sides: Vec<Side>,
    /// Largest size of the ratio that the limits allow.
    ratio: f64,
    best: Found,
    open: Vec<Piece>,
}

/// The best surface with its centre on the boundary of a box whose inside does not hold that of the
/// `free` optimum.
pub(super) fn boundary(
    engine: Engine,
    scaled: &Scaled,
    corners: [[f64; 2]; 2],
    free: &Found,
) -> Result<Found, Error> {
    let imbalance = scaled.limits.largest_imbalance();
    let edges = edges(corners);
    let stays = |edge: &&Edge| !leaves_inwards(edge, &free.surface, imbalance);
    let mut kept: Vec<Edge> = edges.iter().filter(stays).copied().collect();
    if kept.is_empty() {
        kept = edges.to_vec();
    }
    let mut search = Search {
        engine,
        scaled,
        sides: kept.iter().map(|edge| Side::new(*edge, &scaled.cells, &free.surface)).collect(),
        ratio: imbalance / (1.0 - imbalance * imbalance).sqrt(),
        best: Found { objective: f64::INFINITY, ..*free },
        open: Vec::new(),
    };
    search.run()?;
    Ok(search.best)
}

fn edges([low, high]: [[f64; 2]; 2]) -> [Edge; 4] {
    let edge = |axis: usize, outward: f64| {
        let place = if outward < 0.0 { low[1 - axis] } else { high[1 - axis] };
        Edge { axis, place, outward, ends: [low[axis], high[axis]] }
    };
    [edge(0, -1.0), edge(0, 1.0), edge(1, -1.0), edge(1, 1.0)]
}

/// Whether from every allowed surface with its centre on the edge the way to the free optimum
/// leads into the box.
///
/// With the centre at c it begins in the direction P^-1 q, q = P* (c* - c). As P^-1 turns and
/// stretches no more than omega allows, its part along the outward normal n has the sign of n q where
/// |n q| > omega |q|; n q + omega |q| is convex along the edge, so its ends decide.
fn leaves_inwards(edge: &Edge, free: &Apex, omega: f64) -> bool {
    let [p0, p1, p2] = free.curvature;
    edge.ends.iter().all(|end| {
        let mut centre = [0.0; 2];
        (centre[edge.axis], centre[1 - edge.axis]) = (*end, edge.place);
        let [dx, dy] = [0, 1].map(|axis| free.centre[axis] - centre[axis]);
        let q = [-p0 * dx - 0.5 * p2 * dy, -0.5 * p2 * dx - p1 * dy];
        let length = (q[0] * q[0] + q[1] * q[1]).sqrt();
        edge.outward * q[1 - edge.axis] <= -omega * length
    })
}

impl Side {
    fn new(edge: Edge, cells: &[Cell], free: &Apex) -> Self {
        let turned =
            |cell: &Cell| [cell[edge.axis], cell[1 - edge.axis] - edge.place, cell[2], cell[3]];
        let cells: Vec<Cell> = cells.iter().map(turned).collect();
        let row = |&[x, y, z, w]: &Cell| Row { d: [x * x, y * y, x * y, x, y, 1.0], z, w };
        let rows: Vec<Row<6>> = cells.iter().map(row).collect();
        let [s0, s1, .., s5] = gram_spread(&rows);
        // The two shapes of a hull have curvatures of one sign, and |phi2| <= |phi0 + phi1|.
        let s2 = s0 + s1;
        let [p0, p1, p2] = free.curvature;
        let shape = if edge.axis == 0 { [p0, p1, p2] } else { [p1, p0, p2] };
        let spread = [s0, s1, s2, s0, s1, s2, s5, f64::INFINITY];
        Self { edge, cells, spread, free: (shape, free.centre[edge.axis]) }
    }

    /// Mean of what a shape about a place on the edge leaves of the heights.
    fn mean_top(&self, [p0, p1, p2]: [f64; 3], at: f64) -> f64 {
        let (mut sum, mut weight) = (0.0, 0.0);
        for &[x, y, z, w] in &self.cells {
            let dx = x - at;
            sum += w * (z - p0 * dx * dx - p1 * y * y - p2 * dx * y);
            weight += w;
        }
        sum / weight
    }

    /// A surface along and across the edge as one along the axes.
    fn unturned(&self, [along, across, mixed]: [f64; 3], at: f64, top: f64) -> Apex {
        if self.edge.axis == 0 {
            Apex { curvature: [along, across, mixed], centre: [at, self.edge.place], top }
        } else {
            Apex { curvature: [across, along, mixed], centre: [self.edge.place, at], top }
        }
    }
}

impl Piece {
    /// The convex hull of all surfaces of the piece.
    ///
    /// The centre (t, 0) enters by b = 2 P c only, which is linear in P where t is fixed and linear in t
    /// where P is. The hull of {(P, b)} over a segment is therefore made of two shapes, one for each
    /// end: P = P1 + P2, b = 2 P1 c1 + 2 P2 c2, with P1 in lambda times and P2 in 1 - lambda times the
    /// set of allowed shapes. Unknowns: phi0, phi1, phi2 of both, the constant, lambda.
    fn program(&self, side: &Side, limits: &Limits, ratio: f64) -> Program<8> {
        let [t1, t2] = self.along;
        let row = |&[x, y, z, w]: &Cell| {
            let shape = |t: f64| [x * x - 2.0 * t * x, y * y, x * y - t * y];
            let ([a, b, c], [d, e, f]) = (shape(t1), shape(t2));
            Row { d: [a, b, c, d, e, f, 1.0, 0.0], z, w }
        };
        let share = unit::<8>(7);
        let mut cones = Vec::with_capacity(12);
        for (first, sign, whole) in [(0, 1.0, 0.0), (3, -1.0, 1.0)] {
            let form = ShapeForm {
                phi0: unit(first),
                phi1: unit(first + 1),
                phi2: unit(first + 2),
                share: share.map(|value| sign * value),
                whole,
            };
            cones.extend(form.cones(limits));
            // The limits on the shape imply the outermost ratios, those on its axes a share above 0.
            for (limit, sign) in self.ratio.into_iter().zip([1.0, -1.0]) {
                if limit.abs() < ratio {
                    cones.push(ratio_cone(first, limit, sign));
                }
            }
            if limits.mu > 0.0 {
                cones.push(Cone::linear(form.share, whole));
            }
        }
        let mut cap = [f64::INFINITY; 8];
        cap[7] = 1.0;
        let rows = side.cells.iter().map(row).collect();
        Program { rows, cones, spread: side.spread, cap, start: Some(self.start(side)) }
    }

    /// The free optimum brought well into the piece.
    fn start(&self, side: &Side) -> [f64; 8] {
        let within = |value: f64, [low, high]: [f64; 2]| {
            let margin = LEAST_SHARE * (high - low);
            value.clamp(low + margin, high - margin)
        };
        let ([p0, p1, p2], place) = side.free;
        let shape = [p0, p1, 2.0 * p0 * within(0.5 * p2 / p0, self.ratio)];
        let at = within(place, self.along);
        let [t1, t2] = self.along;
        let share = (t2 - at) / (t2 - t1);
        let constant = side.mean_top(shape, at) + shape[0] * at * at;
        let [a, b, c] = shape.map(|value| share * value);
        let [d, e, f] = shape.map(|value| (1.0 - share) * value);
        [a, b, c, d, e, f, constant, share]
    }

    /// The two parts of a piece, divided where the best surface of its hull is.
    fn divided(&self, widths: [f64; 2]) -> [Self; 2] {
        let relative = |range: [f64; 2], width: f64| (range[1] - range[0]) / width;
        let by_ratio = relative(self.ratio, widths[1]) > relative(self.along, widths[0]);
        let ([low, high], at) =
            if by_ratio { (self.ratio, self.at[1]) } else { (self.along, self.at[0]) };
        let share = ((at - low) / (high - low)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        let middle = low + share * (high - low);
        [[low, middle], [middle, high]].map(|range| {
            if by_ratio { Self { ratio: range, ..*self } } else { Self { along: range, ..*self } }
        })
    }
}

/// P_nt >= limit P_tt (`sign` 1) or the reverse (-1), with P_tt = -phi0, P_nt = -phi2 / 2.
fn ratio_cone(first: usize, limit: f64, sign: f64) -> Cone<8> {
    let mut row = [0.0; 8];
    (row[first], row[first + 2]) = (sign * limit, -0.5 * sign);
    Cone::linear(row, 0.0)
}

impl Search<'_> {
    fn run(&mut self) -> Result<(), Error> {
        for edge in 0..self.sides.len() {
            let along = self.sides[edge].edge.ends;
            let ratio = [-self.ratio, self.ratio];
            self.look(Piece { edge, along, ratio, bound: 0.0, at: [0.0; 2] })?;
        }
        while let Some(next) = self.most_promising() {
            let piece = self.open.swap_remove(next);
            let [low, high] = self.sides[piece.edge].edge.ends;
            for part in piece.divided([high - low, 2.0 * self.ratio]) {
                self.look(part)?;
            }
        }
        let bounds = self.open.iter().map(|piece| piece.bound);
        self.best.lower_bound = bounds.fold(self.best.objective, f64::min);
        Ok(())
    }

    /// The open piece of the lowest bound, unless the search is at its end.
    fn most_promising(&self) -> Option<usize> {
        let lower = |best: Option<usize>, index: usize| match best {
            Some(best) if self.open[best].bound <= self.open[index].bound => Some(best),
            _ => Some(index),
        };
        let next = (0..self.open.len()).fold(None, lower)?;
        let heights: f64 = self.scaled.cells.iter().map(|cell| cell[3] * cell[2].abs()).sum();
        let tolerance = GAP * self.best.objective + GAP_OF_HEIGHTS * heights;
        let done = self.best.objective - self.open[next].bound <= tolerance;
        (!done && self.best.nodes < MAX_NODES).then_some(next)
    }

    /// Bounds a piece and takes from it a surface whose centre is in it.
    fn look(&mut self, piece: Piece) -> Result<(), Error> {
        let side = &self.sides[piece.edge];
        let optimum = self.engine.relax(&piece.program(side, &self.scaled.limits, self.ratio))?;
        self.best.nodes += 1;
        self.best.iterations += optimum.iterations;
        let (surface, at) = self.surface(&piece, &optimum);
        let objective = self.scaled.objective(&surface);
        if objective < self.best.objective {
            (self.best.surface, self.best.objective) = (surface, objective);
        }
        let bound = optimum.lower_bound.max(piece.bound);
        self.open.push(Piece { bound, at, ..piece });
        Ok(())
    }

    /// The shape of the hull's best surface, about the centre on the edge that its b implies along
    /// it, at the best height.
    fn surface(&self, piece: &Piece, optimum: &Optimum<8>) -> (Apex, [f64; 2]) {
        let side = &self.sides[piece.edge];
        let [a0, a1, a2, b0, b1, b2, ..] = optimum.x;
        let shape = [a0 + b0, a1 + b1, a2 + b2];
        let [t1, t2] = piece.along;
        let at = ((a0 * t1 + b0 * t2) / shape[0]).clamp(t1, t2);
        let mut surface = side.unturned(self.scaled.limits.project(shape), at, 0.0);
        surface.top = self.scaled.best_top(&surface);
        (surface, [at, 0.5 * shape[2] / shape[0]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::bounds::AxisBounds;
    use crate::surface::l1::L1;
    use crate::surface::samples::crown;
    use crate::surface::{Prior, formulate};

    fn free(scaled: &Scaled) -> Found {
        let program = formulate::elliptic(&scaled.cells, &scaled.limits);
        let optimum = Engine::Dedicated.solve(&program).unwrap();
        Found::of(scaled, &optimum, Apex::from_phi(optimum.x))
    }

    #[test]
    fn no_centre_in_the_box_is_better() {
        let (mut nodes, mut count) = (Vec::new(), 0);
        for seed in 0..60 {
            let omega = [0.05, 0.2, 0.5, 0.9][(seed % 4) as usize];
            let scaled = crown(seed, AxisBounds::default(), omega);
            let half_width_m = [0.1, 0.5, 1.0][(seed % 3) as usize];
            let prior = Prior { centre: [0.3, -0.1], half_width_m };
            let method = L1 { omega, ..L1::default() };
            let found = method.solve(&scaled, Some(&prior)).unwrap();
            let corners = scaled.corners(&prior);
            let gap = (found.objective - found.lower_bound) / found.objective;
            assert!((-1e-9..1e-6).contains(&gap), "seed {seed}: {found:?}");
            assert!(found.lower_bound >= free(&scaled).lower_bound * (1.0 - 1e-7));
            for i in 0..=6 {
                for j in 0..=6 {
                    let at = |axis: usize, k: i32| {
                        let [low, high] = [corners[0][axis], corners[1][axis]];
                        low + (high - low) * f64::from(k) / 6.0
                    };
                    let there = method.solve_fixed(&scaled, [at(0, i), at(1, j)]).unwrap();
                    assert!(there.objective >= found.lower_bound * (1.0 - 1e-9), "seed {seed}");
                }
            }
            nodes.push(found.nodes);
            count += u32::from(found.nodes > 1);
        }
        nodes.sort_unstable();
        println!("{count} searched, nodes median {}, most {}", nodes[30], nodes[59]);
        assert!(count > 30 && nodes[59] < 200);
    }

    #[test]
    fn edges_are_left_out_only_where_no_surface_is_best() {
        let mut out = 0;
        for seed in 0..30 {
            let scaled = crown(seed, AxisBounds::default(), 0.3);
            let corners = [[-0.1, -0.1], [0.05, 0.05]];
            let free = free(&scaled);
            let inside =
                (0..2).all(|k| (corners[0][k]..corners[1][k]).contains(&free.surface.centre[k]));
            if inside {
                continue;
            }
            let found = boundary(Engine::Dedicated, &scaled, corners, &free).unwrap();
            for edge in edges(corners) {
                if leaves_inwards(&edge, &free.surface, scaled.limits.largest_imbalance()) {
                    out += 1;
                    let at = found.surface.centre[1 - edge.axis];
                    let end = found.surface.centre[edge.axis];
                    let corner = edge.ends.iter().any(|e| (e - end).abs() < 1e-9);
                    assert!((at - edge.place).abs() > 1e-9 || corner, "seed {seed} {edge:?}");
                }
            }
        }
        assert!(out > 20, "{out}");
    }
}

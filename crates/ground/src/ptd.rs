//! Progressive TIN densification, from coarse to fine.
//!
//! Axelsson 2000 (DEM generation from laser scanner data using adaptive TIN models): the ground
//! begins as a sparse triangulation of low points and takes in, again and again, points close to a
//! triangle by distance along its normal and by the angle to its nearest corner. Here
//!
//! * the first triangulation has one vertex in 32 m; every further level halves the cell in which
//!   the lowest acceptable point is taken, while distance and angle shrink. A coarse triangulation
//!   follows any slope, so no threshold has to admit the slope itself, which is what makes the
//!   method work at 45°;
//! * after every step vertices that stick out of the plane of their neighbours are taken back:
//!   vegetation taken for ground where a coarse cell had none, and low outliers;
//! * at the end, what stands a hand above its neighbours (low vegetation) is trimmed.
//!
//! All coordinates are relative to the block's corner and points come in one order, so that the
//! result is a function of the points alone.

use crate::Error;
use crate::cells::{lowest_per_cell, without_pits};
use crate::params::GroundParams;
use crate::rim::rim;
use crate::tin::Tin;
use std::borrow::Cow;

/// Steps at every level.
const STEPS: usize = 3;
/// Steps at the last level.
const LAST_STEPS: usize = 4;
/// Rounds of the final trim; each takes at most the highest vertex of a neighbourhood.
const TRIM_ROUNDS: usize = 5;
/// Cell of the last level, metres: a step takes at most one point from each.
const FINEST_LEVEL_M: f64 = 0.5;
/// Edge of the cells of which only the lowest point can be a vertex, metres.
pub const FINEST_M: f64 = 0.5;
/// Down to this cell a step triangulates anew after taking vertices back; below, where taking back is
/// local and triangulating costs most, it does both with one triangulation, metres.
const SHARED_M: f64 = 1.5;
/// Of a level's cell only the lowest points of a grid of so many by so many are looked at.
const SAMPLED: f64 = 8.0;
/// A level ends when a step adds less than one vertex in so many.
const FEW: usize = 1000;
/// A vertex taken back this often stays out.
const LAST_REMOVAL: u8 = 3;
/// Below this distance from the plane the angle, unreliable there, does not count, metres.
const FLAT_M: f64 = 0.1;
/// A spike is at least this high, metres.
const LEAST_SPIKE_M: f64 = 0.3;
/// How much steeper a spike is while triangles are large: a ridge may lie between the vertices.
const COARSE_SPIKE: f64 = 1.4;
/// A pit is at least this deep, metres.
const LEAST_PIT_M: f64 = 1.0;

/// The vertices of the ground among the points of a block.
///
/// `points` are relative to the block's corner, on the world's lattice of cells there; `edge_m` is
/// the block's edge with its buffers.
///
/// # Errors
/// [`Error::Triangulation`].
pub fn densify(
    points: &[[f64; 3]],
    edge_m: f64,
    params: &GroundParams,
) -> Result<Vec<usize>, Error> {
    let all: Vec<usize> = (0..points.len()).collect();
    let low = without_pits(points, lowest_per_cell(points, &all, FINEST_M));
    let mut ground = Ground::new(points, low, edge_m, params.seed_cell_m);
    if ground.vertices.is_empty() {
        return Ok(Vec::new());
    }
    let spike = libm::tan(params.spike_deg.to_radians());
    for level in levels(params) {
        let steps = if level.cell_m > FINEST_LEVEL_M { STEPS } else { LAST_STEPS };
        for _ in 0..steps {
            let coarse = level.cell_m > SHARED_M;
            if !ground.step(&level, if coarse { COARSE_SPIKE * spike } else { spike })? {
                break;
            }
        }
    }
    let tin = ground.tin()?;
    ground.take_back(&tin, FINEST_LEVEL_M, spike);
    for _ in 0..TRIM_ROUNDS {
        if !ground.trim(params)? {
            break;
        }
    }
    Ok(ground.vertices)
}

/// One level of the densification.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Level {
    cell_m: f64,
    distance_m: f64,
    sine: f64,
}

/// Cells halve from the seeds' to [`FINEST_LEVEL_M`]; distances shrink geometrically, angles linearly.
fn levels(params: &GroundParams) -> Vec<Level> {
    let mut cells = vec![params.seed_cell_m];
    while cells[cells.len() - 1] > FINEST_LEVEL_M {
        cells.push((cells[cells.len() - 1] / 2.0).max(FINEST_LEVEL_M));
    }
    let last = (cells.len() - 1).max(1) as f64;
    let level = |(i, cell_m): (usize, f64)| {
        let t = i as f64 / last;
        let ratio = params.fine_distance_m / params.coarse_distance_m;
        let degrees =
            params.coarse_angle_deg + t * (params.fine_angle_deg - params.coarse_angle_deg);
        Level {
            cell_m,
            distance_m: params.coarse_distance_m * libm::pow(ratio, t),
            sine: libm::sin(degrees.to_radians()),
        }
    };
    cells.into_iter().enumerate().map(level).collect()
}

/// The growing ground of a block.
struct Ground<'a> {
    points: &'a [[f64; 3]],
    edge_m: f64,
    seed_cell_m: f64,
    /// Points that may become vertices.
    low: Vec<usize>,
    /// Those that are, ascending.
    vertices: Vec<usize>,
    is_vertex: Vec<bool>,
    removals: Vec<u8>,
}

impl<'a> Ground<'a> {
    fn new(points: &'a [[f64; 3]], low: Vec<usize>, edge_m: f64, seed_cell_m: f64) -> Self {
        let vertices = lowest_per_cell(points, &low, seed_cell_m);
        let mut is_vertex = vec![false; points.len()];
        vertices.iter().for_each(|&i| is_vertex[i] = true);
        let removals = vec![0; points.len()];
        Self { points, edge_m, seed_cell_m, low, vertices, is_vertex, removals }
    }

    /// Triangulates the vertices and a rim around the block that continues their slope.
    fn tin(&self) -> Result<Tin, Error> {
        let mut positions: Vec<[f64; 3]> = self.vertices.iter().map(|&i| self.points[i]).collect();
        positions.extend(rim(&positions, self.edge_m)?);
        Tin::new(&positions)
    }

    /// One step: takes back what sticks out, takes in the lowest acceptable point of every cell.
    /// `false` when hardly anything was taken in.
    fn step(&mut self, level: &Level, spike: f64) -> Result<bool, Error> {
        let mut tin = self.tin()?;
        let removed = self.take_back(&tin, level.cell_m, spike);
        if removed && level.cell_m > SHARED_M {
            tin = self.tin()?;
        }
        let acceptable = self.acceptable(&tin, level);
        let taken = lowest_per_cell(self.points, &acceptable, level.cell_m);
        taken.iter().for_each(|&i| self.is_vertex[i] = true);
        self.vertices.extend(&taken);
        self.vertices.sort_unstable();
        Ok(taken.len() > self.vertices.len() / FEW)
    }

    /// Points close enough to their triangle by distance and angle.
    fn acceptable(&self, tin: &Tin, level: &Level) -> Vec<usize> {
        let mut cursor = tin.cursor();
        let mut accept = |i: usize| {
            let Some(offset) = cursor.offset(self.points[i]) else { return false };
            let distance = offset.normal_m;
            let near = distance < level.distance_m && distance > -3.0 * level.distance_m;
            near && (offset.sine < level.sine || distance.abs() < FLAT_M)
        };
        let open = |i: &usize| !self.is_vertex[*i] && self.removals[*i] < LAST_REMOVAL;
        let fine_m = level.cell_m / SAMPLED;
        let low = if fine_m > FINEST_M {
            Cow::Owned(lowest_per_cell(self.points, &self.low, fine_m))
        } else {
            Cow::Borrowed(&self.low)
        };
        low.iter().copied().filter(open).filter(|&i| accept(i)).collect()
    }

    /// Takes back vertices that stick out of their neighbours' plane by more than the slope `spike`
    /// over the distance of the neighbours; by twice that, those below it. Whether there were any.
    fn take_back(&mut self, tin: &Tin, cell_m: f64, spike: f64) -> bool {
        if cell_m >= self.seed_cell_m {
            return false;
        }
        let before = self.vertices.len();
        for (place, &i) in self.vertices.iter().enumerate() {
            let (deviation, distance) = tin.deviation(place);
            if deviation > LEAST_SPIKE_M.max(spike * distance) {
                self.removals[i] += 1;
                self.is_vertex[i] = false;
            } else if -deviation > LEAST_PIT_M.max(2.0 * spike * distance) {
                self.removals[i] = LAST_REMOVAL;
                self.is_vertex[i] = false;
            }
        }
        self.keep_vertices();
        self.vertices.len() < before
    }

    /// Takes back vertices that stand above their neighbours by a hand, the highest of each
    /// neighbourhood only; `false` when there was none.
    fn trim(&mut self, params: &GroundParams) -> Result<bool, Error> {
        let tin = self.tin()?;
        let deviations: Vec<(f64, f64)> =
            (0..self.vertices.len()).map(|place| tin.deviation(place)).collect();
        let before = self.vertices.len();
        for (place, &i) in self.vertices.iter().enumerate() {
            let (deviation, distance) = deviations[place];
            let mut highest = deviation > params.trim_m + params.trim_slope * distance;
            if highest {
                tin.neighbours(place, |n| {
                    highest &= deviations.get(n).is_none_or(|other| other.0 <= deviation);
                });
            }
            self.is_vertex[i] = !highest;
        }
        self.keep_vertices();
        Ok(self.vertices.len() < before)
    }

    fn keep_vertices(&mut self) {
        let is_vertex = &self.is_vertex;
        self.vertices.retain(|&i| is_vertex[i]);
    }
}

/// Which points lie on the triangulated ground: within a tolerance along the normal above it, and
/// twice that below.
///
/// # Errors
/// [`Error::Triangulation`].
pub fn on_ground(
    points: &[[f64; 3]],
    vertices: &[usize],
    edge_m: f64,
    tolerance_m: f64,
) -> Result<Vec<bool>, Error> {
    if vertices.is_empty() {
        return Ok(vec![false; points.len()]);
    }
    let mut positions: Vec<[f64; 3]> = vertices.iter().map(|&i| points[i]).collect();
    positions.extend(rim(&positions, edge_m)?);
    let tin = Tin::new(&positions)?;
    let mut cursor = tin.cursor();
    let on = |p: &[f64; 3]| {
        let offset = cursor.offset(*p);
        offset.is_some_and(|o| o.normal_m <= tolerance_m && o.normal_m >= -2.0 * tolerance_m)
    };
    Ok(points.iter().map(on).collect())
}

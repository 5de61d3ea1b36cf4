//! Seeded fitting problems of every sort the solvers must cope with.
//!
//! A problem is a crown seen through a grid (outline, noise, what does not belong to it, ties by
//! rounded heights, weights) and what is asked of the fit (omega, bounds on the axes, prior).

use super::{normal, uniform};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use timberline_crowns::surface::{AxisBounds, Engine, L1, Prior, Problem};

/// Uniform in a range.
pub(crate) fn between(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * uniform(random)
}

/// One of several, each as likely.
pub(crate) fn pick<T: Copy>(random: &mut ChaCha8Rng, from: &[T]) -> T {
    let place = (uniform(random) * from.len() as f64) as usize;
    from[place.min(from.len() - 1)]
}

fn chance(random: &mut ChaCha8Rng, share: f64) -> bool {
    uniform(random) < share
}

/// A crown's vertical section.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Outline {
    Paraboloid,
    Cone,
    Ellipsoid,
    /// A paraboloid falling faster on one side.
    Lopsided,
}

/// A crown's upper surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Crown {
    outline: Outline,
    pub(crate) apex: [f64; 3],
    radius: f64,
    length: f64,
    stretch: f64,
    azimuth: f64,
}

impl Crown {
    /// A crown of a given radius with its apex near a position.
    pub(crate) fn random(random: &mut ChaCha8Rng, near: [f64; 2], radius: f64) -> Self {
        let outlines = [Outline::Paraboloid, Outline::Cone, Outline::Ellipsoid, Outline::Lopsided];
        let off = 0.4 * radius;
        Self {
            outline: pick(random, &outlines),
            apex: [
                near[0] + between(random, -off, off),
                near[1] + between(random, -off, off),
                between(random, -0.5, 0.5),
            ],
            radius,
            length: (radius * between(random, 0.8, 3.5)).min(20.0),
            stretch: if chance(random, 0.4) { 1.0 } else { between(random, 1.0, 1.35) },
            azimuth: between(random, 0.0, std::f64::consts::PI),
        }
    }

    /// Height of the surface.
    pub(crate) fn z(&self, x: f64, y: f64) -> f64 {
        let (sin, cos) = libm::sincos(self.azimuth);
        let (dx, dy) = (x - self.apex[0], y - self.apex[1]);
        let (along, across) = (cos * dx + sin * dy, cos * dy - sin * dx);
        let s = libm::hypot(along / self.stretch, across * self.stretch) / self.radius;
        let within = s.min(1.0);
        let depth = match self.outline {
            Outline::Paraboloid => s * s,
            Outline::Cone => s,
            Outline::Ellipsoid => 1.0 - (1.0 - within * within).sqrt() + 3.0 * (s - within),
            Outline::Lopsided if along > 0.0 => 1.8 * s * s,
            Outline::Lopsided => s * s,
        };
        self.apex[2] - self.length * depth
    }
}

/// The `count` cells of a grid nearest to the middle; of one side only if asked.
fn grid(count: usize, cell_m: f64, side: Option<f64>) -> Vec<[f64; 2]> {
    let reach = (1.2 * (count as f64).sqrt()) as i32 + 2;
    let kept = |[x, y]: &[f64; 2]| {
        side.is_none_or(|azimuth| {
            let (sin, cos) = libm::sincos(azimuth);
            x * cos + y * sin > 0.0
        })
    };
    let middle = |i: i32| (f64::from(i) + 0.5) * cell_m;
    let mut cells: Vec<[f64; 2]> = (-reach..reach)
        .flat_map(|i| (-reach..reach).map(move |j| [middle(i), middle(j)]))
        .filter(kept)
        .collect();
    let far = |cell: &[f64; 2]| cell[0] * cell[0] + cell[1] * cell[1];
    cells.sort_by(|a, b| far(a).total_cmp(&far(b)));
    cells.truncate(count);
    cells
}

/// Lowers a share of the cells onto what grows below, or lifts those on one side onto a neighbour.
fn contaminate(cells: &mut [[f64; 3]], share: f64, radius: f64, random: &mut ChaCha8Rng) {
    let neighbours = uniform(random);
    for cell in cells.iter_mut() {
        if chance(random, share * (1.0 - neighbours)) {
            cell[2] -= between(random, 2.0, 10.0);
        }
    }
    let (sin, cos) = libm::sincos(between(random, 0.0, 6.3));
    let far = between(random, 1.4, 2.0) * radius;
    let other = Crown::random(random, [far * cos, far * sin], radius);
    let along = |cell: &[f64; 3]| cell[0] * cos + cell[1] * sin;
    let mut order: Vec<usize> = (0..cells.len()).collect();
    order.sort_by(|&a, &b| along(&cells[b]).total_cmp(&along(&cells[a])));
    order.truncate((share * neighbours * cells.len() as f64) as usize);
    for i in order {
        let [x, y, z] = cells[i];
        cells[i][2] = z.max(other.z(x, y) + 0.1 * normal(random));
    }
}

/// Cells of a crown as a scan shows them.
pub(crate) fn crown_cells(count: usize, random: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
    let cell_m = pick(random, &[0.4, 0.5]);
    let radius = cell_m * (count as f64 / std::f64::consts::PI).sqrt();
    let side = chance(random, 0.05).then(|| between(random, 0.0, 6.3));
    let crown = Crown::random(random, [0.0; 2], radius);
    let sigma = pick(random, &[0.0, 0.02, 0.1, 0.1, 0.3, 0.6]);
    let deeper = between(random, 0.0, 0.3);
    let mut cells: Vec<[f64; 3]> = grid(count, cell_m, side)
        .into_iter()
        .map(|[x, y]| {
            let below =
                if chance(random, deeper) { -libm::log(1.0 - uniform(random)) } else { 0.0 };
            [x, y, crown.z(x, y) + sigma * normal(random) - 0.5 * below]
        })
        .collect();
    let share = if chance(random, 0.2) { 0.0 } else { between(random, 0.0, 0.3) };
    contaminate(&mut cells, share, radius, random);
    let step = pick(random, &[0.0, 0.0, 0.01, 0.01, 0.1]);
    if step > 0.0 {
        cells.iter_mut().for_each(|cell| cell[2] = (cell[2] / step).round() * step);
    }
    cells
}

/// A crown and what is asked of its fit.
#[derive(Debug, Clone)]
pub(crate) struct Case {
    pub(crate) seed: u64,
    pub(crate) cells: Vec<[f64; 3]>,
    pub(crate) weights: Option<Vec<f64>>,
    pub(crate) prior: Option<Prior>,
    pub(crate) omega: f64,
    pub(crate) bounds: AxisBounds,
}

/// What [`Case::random`] draws from.
#[derive(Debug, Clone)]
pub(crate) struct Wishes {
    /// Number of cells: at least, at most.
    pub(crate) cells: [usize; 2],
    pub(crate) omegas: Vec<f64>,
    /// Share of problems with a prior.
    pub(crate) priors: f64,
    /// Share of problems with weights.
    pub(crate) weights: f64,
}

impl Default for Wishes {
    fn default() -> Self {
        let omegas = vec![0.0, 0.0, 0.0, 0.2, 0.2, 0.2, 0.5, 0.5, 0.5, 0.05, 0.8, 1.0];
        Self { cells: [20, 1000], omegas, priors: 0.6, weights: 0.15 }
    }
}

impl Case {
    /// The problem of a seed.
    pub(crate) fn random(seed: u64, wishes: &Wishes) -> Self {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let [low, high] = wishes.cells.map(|count| libm::log(count as f64));
        let count = libm::exp(between(random, low, high)).round() as usize;
        let mut cells = crown_cells(count, random);
        let omega = pick(random, &wishes.omegas);
        let bounds = bounds(omega, random);
        let shift = if chance(random, 0.3) { [20.0, 20.0, 40.0] } else { [0.0; 3] };
        let shift = shift.map(|reach| between(random, -reach, reach));
        for cell in &mut cells {
            (0..3).for_each(|axis| cell[axis] += shift[axis]);
        }
        let prior = chance(random, wishes.priors).then(|| prior(&cells, random));
        let weights = chance(random, wishes.weights).then(|| weights(cells.len(), random));
        Self { seed, cells, weights, prior, omega, bounds }
    }

    /// The problem as the library takes it.
    pub(crate) fn problem(&self) -> Problem<'_> {
        Problem { cells: &self.cells, weights: self.weights.as_deref(), prior: self.prior }
    }

    /// The method as the library takes it.
    pub(crate) fn method(&self, engine: Engine) -> L1 {
        L1 { omega: self.omega, bounds: self.bounds, engine }
    }

    /// A cell's weight.
    pub(crate) fn weight(&self, index: usize) -> f64 {
        self.weights.as_ref().map_or(1.0, |weights| weights[index])
    }

    /// A group for tables: `omega 0.2, prior`.
    pub(crate) fn group(&self) -> String {
        let prior = match self.prior {
            None => "free",
            Some(Prior { half_width_m: 0.0, .. }) => "fixed",
            Some(_) => "prior",
        };
        format!("omega {}, {prior}", self.omega)
    }

    /// The problem as one line of JSON, with all digits.
    pub(crate) fn json(&self) -> String {
        let weights: Vec<f64> = (0..self.cells.len()).map(|i| self.weight(i)).collect();
        let prior = self.prior.map_or("null".to_owned(), |prior| {
            let [x, y] = prior.centre;
            format!("[{x:?}, {y:?}, {:?}]", prior.half_width_m)
        });
        let bounds = match self.bounds {
            AxisBounds::Exact { smallest_m, largest_m } => {
                format!("[{smallest_m:?}, {largest_m:?}]")
            }
            AxisBounds::Paper { largest_m } => format!("[{largest_m:?}]"),
        };
        format!(
            "{{\"seed\": {}, \"omega\": {:?}, \"axes\": {bounds}, \"prior\": {prior}, \
             \"weights\": {weights:?}, \"cells\": {:?}}}",
            self.seed, self.omega, self.cells
        )
    }
}

/// Bounds in either form, now and then so tight that they hold with equality.
fn bounds(omega: f64, random: &mut ChaCha8Rng) -> AxisBounds {
    let largest_m = pick(random, &[3.0, 3.0, 3.0, 1.0, 6.0, 12.0]);
    if omega < 1.0 && chance(random, 0.4) {
        return AxisBounds::Paper { largest_m };
    }
    AxisBounds::Exact { smallest_m: pick(random, &[0.1, 0.1, 0.3, 0.8]), largest_m }
}

/// A box at the highest cell, at one of the cells, or beyond them.
fn prior(cells: &[[f64; 3]], random: &mut ChaCha8Rng) -> Prior {
    let mut order: Vec<&[f64; 3]> = cells.iter().collect();
    order.sort_by(|a, b| b[2].total_cmp(&a[2]));
    let at = match pick(random, &[0, 0, 0, 1, 1, 2]) {
        0 => order[0],
        1 => pick(random, &order),
        _ => order[order.len() - 1],
    };
    let off = pick(random, &[0.0, 0.3, 0.3, 1.5]);
    Prior {
        centre: [0, 1].map(|axis| at[axis] + between(random, -off, off)),
        half_width_m: pick(random, &[0.0, 0.01, 0.05, 0.1, 0.1, 0.25, 0.5, 0.5, 1.0, 2.0]),
    }
}

/// Repetitions, shares, or ones with some cells left out.
fn weights(count: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
    let sort = pick(random, &[0, 1, 2]);
    (0..count)
        .map(|_| match sort {
            0 => pick(random, &[1.0, 2.0, 3.0]),
            1 => between(random, 0.1, 3.0),
            _ => pick(random, &[1.0, 1.0, 1.0, 1.0, 0.0]),
        })
        .collect()
}

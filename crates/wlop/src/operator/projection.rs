//! The iteration, and the passes over all pairs of neighbours that it is made of.

use super::cells::{Around, CELL_SHARE, Cells, Walk};
use super::kernel::{Block, Target, density, mean_offset, scatter};
use super::{Outcome, Settings, Weights};
use rayon::prelude::*;
use std::ops::Range;

/// Cells that one thread works on at a time.
const CELLS_AT_A_TIME: usize = 64;

/// Positions with their radii and what follows from them.
#[derive(Debug, Clone)]
pub(super) struct Cloud {
    at: Vec<[f64; 3]>,
    h_m: Vec<f64>,
    /// (4/h)², 1/m².
    narrowness: Vec<f32>,
    /// Exponent of the power of two above h: radii are worked off class by class, so that cells fit.
    class: Vec<i32>,
}

impl Cloud {
    pub(super) fn new(points: impl Iterator<Item = ([f64; 3], f64)>) -> Self {
        let (at, h_m): (Vec<[f64; 3]>, Vec<f64>) = points.unzip();
        let narrowness = h_m.iter().map(|h| (16.0 / (h * h)) as f32).collect();
        let class = h_m.iter().map(|h| libm::frexp(*h).1).collect();
        Self { at, h_m, narrowness, class }
    }

    /// The points on the lattice for a class.
    fn cells(&self, class: i32, settings: &Settings) -> Cells {
        let cell_m = libm::ldexp(1.0, class) * settings.reach_ratio * CELL_SHARE;
        Cells::new(&self.at, &self.narrowness, cell_m)
    }

    /// The classes that there are, ascending.
    fn classes(&self) -> Vec<i32> {
        let mut classes = self.class.clone();
        classes.sort_unstable();
        classes.dedup();
        classes
    }

    /// 1 + the sum of theta over the other points, for every point: v of points, w of samples.
    fn densities(&self, settings: &Settings) -> Vec<f32> {
        // A point is among its neighbours, with a theta of 1: the formula's 1.
        self.each(settings, |blocks, target| density(blocks, target).max(1.0))
    }

    /// The weighted scatter of the points around every point, see [`scatter`].
    pub(super) fn scatters(&self, settings: &Settings) -> Vec<[f32; 6]> {
        self.each(settings, scatter)
    }

    /// A sum over the neighbours of every point.
    fn each<T: Send + Copy + Default>(
        &self,
        settings: &Settings,
        sum: impl Fn(&[Block], &Target) -> T + Sync,
    ) -> Vec<T> {
        let mut all = vec![T::default(); self.at.len()];
        for class in self.classes() {
            let cells = self.cells(class, settings);
            let pass = Pass { cloud: self, targets: &cells, class, settings };
            for (index, value) in pass.over(&cells, &sum) {
                all[index as usize] = value;
            }
        }
        all
    }
}

/// What stays the same from iteration to iteration.
pub(super) struct Projection<'a> {
    settings: &'a Settings,
    /// The classes of the samples' radii, ascending, each with the points on its lattice.
    classes: Vec<(i32, Cells)>,
}

impl<'a> Projection<'a> {
    pub(super) fn new(cloud: &Cloud, samples: &Cloud, settings: &'a Settings) -> Self {
        let weights: Vec<f32> = cloud.densities(settings).iter().map(|v| 1.0 / v).collect();
        let weighed = |class| {
            let mut cells = cloud.cells(class, settings);
            cells.weigh(&weights);
            (class, cells)
        };
        Self { settings, classes: samples.classes().into_iter().map(weighed).collect() }
    }

    /// Moves the samples until the last iteration or until they are still.
    pub(super) fn run(&self, mut samples: Cloud) -> Outcome {
        let mut outcome =
            Outcome { positions_m: Vec::new(), iterations: 0, last_move_ratio: f64::INFINITY };
        let still = |o: &Outcome| o.iterations > 1 && o.last_move_ratio < self.settings.still_ratio;
        while outcome.iterations < self.settings.iterations && !still(&outcome) {
            let moves = self.moves(&samples, outcome.iterations == 0);
            let mut sum = 0.0;
            for ((at, by), h_m) in samples.at.iter_mut().zip(&moves).zip(&samples.h_m) {
                (0..3).for_each(|axis| at[axis] += by[axis]);
                sum += (by[0] * by[0] + by[1] * by[1] + by[2] * by[2]).sqrt() / h_m;
            }
            outcome.last_move_ratio = sum / moves.len().max(1) as f64;
            outcome.iterations += 1;
        }
        Outcome { positions_m: samples.at, ..outcome }
    }

    /// How far each sample moves in one iteration, m.
    fn moves(&self, samples: &Cloud, first: bool) -> Vec<[f64; 3]> {
        let mut moves = vec![[0.0; 3]; samples.at.len()];
        let guess = first && self.settings.weights == Weights::Paper;
        let weights = if guess { Vec::new() } else { samples.densities(self.settings) };
        for (class, points) in &self.classes {
            let mut cells = samples.cells(*class, self.settings);
            let class = *class;
            if guess {
                let pass = Pass { cloud: samples, targets: &cells, class, settings: self.settings };
                for (index, pull) in pass.over(points, mean_offset::<0, false>) {
                    moves[index as usize] = pull.map(f64::from);
                }
                continue;
            }
            cells.weigh(&weights);
            let pass = Pass { cloud: samples, targets: &cells, class, settings: self.settings };
            let (pulls, to_others) = match self.settings.weights {
                Weights::Paper => (
                    pass.over(points, mean_offset::<1, false>),
                    pass.over(&cells, mean_offset::<1, true>),
                ),
                Weights::Even => (
                    pass.over(points, mean_offset::<0, false>),
                    pass.over(&cells, mean_offset::<2, true>),
                ),
            };
            for ((index, pull), (_, to)) in pulls.into_iter().zip(to_others) {
                moves[index as usize] =
                    [0, 1, 2].map(|k| f64::from(pull[k]) - self.settings.mu * f64::from(to[k]));
            }
        }
        moves
    }
}

/// Sums over the neighbours of all targets whose radii are of one class.
struct Pass<'a> {
    cloud: &'a Cloud,
    /// The cloud on the lattice of the class.
    targets: &'a Cells,
    class: i32,
    settings: &'a Settings,
}

impl Pass<'_> {
    /// One result for each target, with the target's index, in a fixed sequence. `source` lies on
    /// the same lattice.
    fn over<T: Send>(
        &self,
        source: &Cells,
        sum: impl Fn(&[Block], &Target) -> T + Sync,
    ) -> Vec<(u32, T)> {
        let chunks = self.targets.len().div_ceil(CELLS_AT_A_TIME);
        let of_chunk = |chunk: usize| {
            let first = chunk * CELLS_AT_A_TIME;
            let last = (first + CELLS_AT_A_TIME).min(self.targets.len());
            self.over_cells(first..last, source, &sum)
        };
        let parts: Vec<Vec<(u32, T)>> = (0..chunks).into_par_iter().map(of_chunk).collect();
        parts.into_iter().flatten().collect()
    }

    fn over_cells<T>(
        &self,
        cells: Range<usize>,
        source: &Cells,
        sum: &impl Fn(&[Block], &Target) -> T,
    ) -> Vec<(u32, T)> {
        let (mut walk, mut results, mut here) = (Walk::new(source), Vec::new(), Vec::new());
        for cell in cells {
            self.targets_in(cell, &mut here);
            if !here.is_empty() {
                let blocks = walk.gather(self.targets, cell, &around(&here));
                results.extend(here.iter().map(|(index, target)| (*index, sum(blocks, target))));
            }
        }
        results
    }

    fn targets_in(&self, cell: usize, here: &mut Vec<(u32, Target)>) {
        here.clear();
        let middle = self.targets.middle(cell);
        let reach = self.settings.reach_ratio;
        let cut = (16.0 * reach * reach) as f32;
        for place in self.targets.places(cell) {
            let index = self.targets.order[place] as usize;
            if self.cloud.class[index] == self.class {
                let at = [0, 1, 2].map(|axis| (self.cloud.at[index][axis] - middle[axis]) as f32);
                let target = Target { at, narrowness: self.cloud.narrowness[index], cut };
                here.push((index as u32, target));
            }
        }
    }
}

/// The box of some targets and the reach of the widest.
fn around(targets: &[(u32, Target)]) -> Around {
    /// So that rounding leaves out none that counts.
    const A_LITTLE_MORE: f32 = 1.0001;
    let mut around = Around { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3], reach_m: 0.0 };
    for (_, target) in targets {
        for axis in 0..3 {
            around.low[axis] = around.low[axis].min(target.at[axis]);
            around.high[axis] = around.high[axis].max(target.at[axis]);
        }
        let reach_m = (target.cut / target.narrowness).sqrt() * A_LITTLE_MORE;
        around.reach_m = around.reach_m.max(reach_m);
    }
    around
}

//! The iteration, and the passes over all pairs of neighbours that it is made of.

use super::cells::{Around, Bounds, Cells, Walk, relative};
use super::kernel::{Density, Kernel, MeanOffset, Scatter, Target};
use super::{Outcome, Settings, Weights};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::marker::PhantomData;
use std::ops::Range;

/// Cells that one thread works on at a time.
const CELLS_AT_A_TIME: usize = 64;
/// Targets, next to each other in a cell, that share the blocks around them.
const TARGETS_AT_A_TIME: usize = 8;

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
        let cell_m = libm::ldexp(1.0, class) * settings.reach_ratio;
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
        let mut all = vec![1.0; self.at.len()];
        for class in self.classes() {
            self.add_densities(&mut all, &self.cells(class, settings), class, settings);
        }
        all
    }

    /// The densities of the points of one class. `cells` are those of the class.
    fn add_densities(&self, all: &mut [f32], cells: &Cells, class: i32, settings: &Settings) {
        let pass = Pass { cloud: self, targets: cells, class, settings };
        for (index, sum) in pass.over::<Density>(cells) {
            // A point is among its neighbours, with a theta of 1: the formula's 1.
            all[index as usize] = sum.max(1.0);
        }
    }

    /// The weighted scatter of the points around every point, see [`Scatter`].
    pub(super) fn scatters(&self, settings: &Settings) -> Vec<[f32; 6]> {
        let mut all = vec![[0.0; 6]; self.at.len()];
        for class in self.classes() {
            let cells = self.cells(class, settings);
            let pass = Pass { cloud: self, targets: &cells, class, settings };
            for (index, scatter) in pass.over::<Scatter>(&cells) {
                all[index as usize] = scatter;
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
        let guess = first && self.settings.weights == Weights::Paper;
        let lattice = |(class, _): &(i32, Cells)| samples.cells(*class, self.settings);
        let mut lattices: Vec<Cells> = self.classes.iter().map(lattice).collect();
        if !guess {
            let mut densities = vec![1.0; samples.at.len()];
            for ((class, _), cells) in self.classes.iter().zip(&lattices) {
                samples.add_densities(&mut densities, cells, *class, self.settings);
            }
            lattices.iter_mut().for_each(|cells| cells.weigh(&densities));
        }
        let mut moves = vec![[0.0; 3]; samples.at.len()];
        for ((class, points), cells) in self.classes.iter().zip(&lattices) {
            let (class, settings) = (*class, self.settings);
            let pass = Pass { cloud: samples, targets: cells, class, settings };
            self.add_moves(&mut moves, &pass, points, guess);
        }
        moves
    }

    /// The moves of the samples of one class; `guess` is the first one of the papers.
    fn add_moves(&self, moves: &mut [[f64; 3]], pass: &Pass<'_>, points: &Cells, guess: bool) {
        let pulls = match self.settings.weights {
            Weights::Paper if !guess => pass.over::<MeanOffset<1, false>>(points),
            _ => pass.over::<MeanOffset<0, false>>(points),
        };
        for (index, pull) in pulls {
            moves[index as usize] = pull.map(f64::from);
        }
        if guess {
            return;
        }
        let to_others = match self.settings.weights {
            Weights::Paper => pass.over::<MeanOffset<1, true>>(pass.targets),
            Weights::Even => pass.over::<MeanOffset<2, true>>(pass.targets),
        };
        for (index, to) in to_others {
            let moved = &mut moves[index as usize];
            (0..3).for_each(|k| moved[k] -= self.settings.mu * f64::from(to[k]));
        }
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
    fn over<K: Kernel>(&self, source: &Cells) -> Vec<(u32, K::Sum)> {
        let chunks = self.targets.len().div_ceil(CELLS_AT_A_TIME);
        let of_chunk = |chunk: usize| {
            let first = chunk * CELLS_AT_A_TIME;
            let last = (first + CELLS_AT_A_TIME).min(self.targets.len());
            let kernel = PhantomData::<K>;
            Arch::new().dispatch(Share { pass: self, cells: first..last, source, kernel })
        };
        let parts: Vec<Vec<(u32, K::Sum)>> = (0..chunks).into_par_iter().map(of_chunk).collect();
        parts.into_iter().flatten().collect()
    }

    #[inline(always)]
    fn over_cells<K: Kernel>(&self, cells: Range<usize>, source: &Cells) -> Vec<(u32, K::Sum)> {
        let (mut walk, mut results, mut here) = (Walk::new(source), Vec::new(), Vec::new());
        for cell in cells {
            self.targets_in(cell, &mut here);
            if here.is_empty() {
                continue;
            }
            walk.enter(self.targets, cell);
            for group in here.chunks(TARGETS_AT_A_TIME) {
                let blocks = walk.gather(&around(group));
                for (index, target) in group {
                    results.push((*index, K::sum(blocks, target)));
                }
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
                let at = relative(self.cloud.at[index], middle);
                let target = Target { at, narrowness: self.cloud.narrowness[index], cut };
                here.push((index as u32, target));
            }
        }
    }
}

/// The share of a thread in a pass. Not a closure: that would stay a function of its own, which is not
/// compiled for the processor that is found.
struct Share<'a, K> {
    pass: &'a Pass<'a>,
    cells: Range<usize>,
    source: &'a Cells,
    kernel: PhantomData<K>,
}

impl<K: Kernel> WithSimd for Share<'_, K> {
    type Output = Vec<(u32, K::Sum)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
        self.pass.over_cells::<K>(self.cells, self.source)
    }
}

/// The box of some targets and the reach of the widest.
#[inline(always)]
fn around(targets: &[(u32, Target)]) -> Around {
    /// So that rounding leaves out none that counts.
    const A_LITTLE_MORE: f32 = 1.0001;
    let mut around = Around { targets: Bounds::EMPTY, reach_m: 0.0 };
    for (_, target) in targets {
        around.targets.include(target.at);
        let reach_m = (target.cut / target.narrowness).sqrt() * A_LITTLE_MORE;
        around.reach_m = around.reach_m.max(reach_m);
    }
    around
}

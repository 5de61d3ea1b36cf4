//! The convex form of every L1 fit: absolute residuals under a few small cones.

use super::dense::{dot, gram_spread};

/// One cell: its row of the design matrix, its height and its weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row<const K: usize> {
    pub(super) d: [f64; K],
    pub(super) z: f64,
    pub(super) w: f64,
}

/// A constraint `|tail(x)| <= head(x)` with affine head and tail. Without a tail it is `head >= 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cone<const K: usize> {
    /// Head and tails: the first [`Self::dim`] count.
    pub(super) rows: [[f64; K]; 4],
    pub(super) shift: [f64; 4],
    pub(super) dim: usize,
}

impl<const K: usize> Cone<K> {
    /// `row * x + shift >= 0`.
    pub(super) fn linear(row: [f64; K], shift: f64) -> Self {
        let blank = [0.0; K];
        Self { rows: [row, blank, blank, blank], shift: [shift, 0.0, 0.0, 0.0], dim: 1 }
    }

    /// `|(a * x, b * x)| <= head * x + shift`.
    pub(super) fn second_order(head: [f64; K], shift: f64, tail: [[f64; K]; 2]) -> Self {
        let rows = [head, tail[0], tail[1], [0.0; K]];
        Self { rows, shift: [shift, 0.0, 0.0, 0.0], dim: 3 }
    }

    /// Adds a third entry to the tail.
    pub(super) fn with_tail(mut self, row: [f64; K], shift: f64) -> Self {
        (self.rows[3], self.shift[3], self.dim) = (row, shift, 4);
        self
    }

    /// Head and tail at `x`.
    pub(super) fn at(&self, x: &[f64; K]) -> [f64; 4] {
        std::array::from_fn(|i| dot(&self.rows[i], x) + self.shift[i])
    }

    /// The transposed rows times a vector.
    pub(super) fn transposed(&self, s: &[f64; 4]) -> [f64; K] {
        std::array::from_fn(|k| (0..self.dim).map(|i| self.rows[i][k] * s[i]).sum())
    }
}

/// Minimise `sum w |d * x - z|` under cones.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Program<const K: usize> {
    pub(super) rows: Vec<Row<K>>,
    pub(super) cones: Vec<Cone<K>>,
    /// Largest size of each unknown that a sum of absolute residuals plus heights of 1 allows: what
    /// turns a residue of the dual equations into a part of the bound. See [`super::dual::Dual::bound`].
    pub(super) spread: [f64; K],
    /// Size that no unknown can exceed in any case.
    pub(super) cap: [f64; K],
    /// Where to begin, well inside the cones; without, near least squares.
    pub(super) start: Option<[f64; K]>,
}

/// What an engine returns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Optimum<const K: usize> {
    pub(super) x: [f64; K],
    pub(super) objective: f64,
    /// No feasible `x` has a smaller objective.
    pub(super) lower_bound: f64,
    pub(super) iterations: u32,
}

impl<const K: usize> Program<K> {
    /// A program whose rows determine all unknowns.
    pub(super) fn new(rows: Vec<Row<K>>, cones: Vec<Cone<K>>) -> Self {
        let spread = gram_spread(&rows);
        Self { rows, cones, spread, cap: [f64::INFINITY; K], start: None }
    }

    pub(super) fn objective(&self, x: &[f64; K]) -> f64 {
        self.rows.iter().map(|row| row.w * (dot(&row.d, x) - row.z).abs()).sum()
    }

    /// Sum of the weighted sizes of the heights.
    pub(super) fn magnitude(&self) -> f64 {
        self.rows.iter().map(|row| row.w * row.z.abs()).sum()
    }

    /// How much a residue of the dual equations can matter: the most that `rho x` can be in size while
    /// the objective of `x` is not above `level`, `magnitude` being [`Self::magnitude`].
    pub(super) fn charge(&self, rho: &[f64; K], level: f64, magnitude: f64) -> f64 {
        let largest = |k: usize| (self.spread[k] * (level + magnitude)).min(self.cap[k]);
        (0..K).filter(|&k| rho[k] != 0.0).map(|k| rho[k].abs() * largest(k)).sum()
    }

    /// Whether all constraints are linear.
    pub(super) fn is_linear(&self) -> bool {
        self.cones.iter().all(|cone| cone.dim == 1)
    }
}

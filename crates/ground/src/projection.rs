//! Elimination of the polynomial part by Householder reflections.
//!
//! With P the matrix of the polynomial at the nodes (1, or 1 x y) and H the product of the
//! reflections that make it triangular, the kernel matrix restricted to the null space of Pᵀ is the
//! trailing block of H K Hᵀ, and positive definite: one small Cholesky factor solves the system.

use crate::dense::{Square, dot};
use crate::hardy::Trend;

/// A trailing column of R below this share of the largest counts as dependent: nodes on a line.
const RANK_TOLERANCE: f64 = 0.02;

/// The reflections and the triangle of P = Hᵀ R.
#[derive(Debug, Clone)]
pub(crate) struct Projection {
    /// Unit vectors of the reflections, the first applied first.
    reflections: Vec<Vec<f64>>,
    /// Upper triangle, row by row (order × order).
    triangle: Vec<Vec<f64>>,
}

impl Projection {
    /// Prepares the reflections for nodes at the given places. Drops the plane (keeping the
    /// constant) when the nodes lie on a line within 2 % of their extent.
    pub(crate) fn new(x: &[f64], y: &[f64], trend: Trend) -> Self {
        if trend == Trend::Plane {
            let full = Self::of_columns(vec![vec![1.0; x.len()], x.to_vec(), y.to_vec()]);
            let spread = |k: usize| full.triangle[k][k].abs();
            // The second diagonal entry is the spread in x, the third what y adds to it; the norm
            // of column 3 below row 1 is the spread in y.
            let across = (full.triangle[1][2] * full.triangle[1][2] + spread(2) * spread(2)).sqrt();
            let largest = spread(1).max(across);
            if spread(1) * spread(2) > RANK_TOLERANCE * largest * largest {
                return full;
            }
        }
        Self::of_columns(vec![vec![1.0; x.len()]])
    }

    fn of_columns(mut columns: Vec<Vec<f64>>) -> Self {
        let order = columns.len();
        let mut reflections = Vec::with_capacity(order);
        for k in 0..order {
            let reflection = reflection_of(&columns[k], k);
            columns[k..].iter_mut().for_each(|column| reflect(&reflection, column));
            reflections.push(reflection);
        }
        let triangle =
            (0..order).map(|i| columns.iter().map(|column| column[i]).collect()).collect();
        Self { reflections, triangle }
    }

    /// Number of polynomial terms: 1 or 3.
    pub(crate) fn order(&self) -> usize {
        self.reflections.len()
    }

    /// v becomes H v.
    pub(crate) fn apply(&self, v: &mut [f64]) {
        self.reflections.iter().for_each(|reflection| reflect(reflection, v));
    }

    /// v becomes Hᵀ v.
    pub(crate) fn apply_transposed(&self, v: &mut [f64]) {
        self.reflections.iter().rev().for_each(|reflection| reflect(reflection, v));
    }

    /// A becomes H A Hᵀ, for a symmetric A.
    pub(crate) fn apply_both_sides(&self, a: &mut Square) {
        for v in &self.reflections {
            // (I - 2vvᵀ) A (I - 2vvᵀ) = A - v wᵀ - w vᵀ with p = 2 A v, w = p - (vᵀp) v.
            let mut w: Vec<f64> = (0..a.size).map(|i| 2.0 * dot(a.row(i), v)).collect();
            let along = dot(&w, v);
            w.iter_mut().zip(v).for_each(|(w, v)| *w -= along * v);
            for i in 0..a.size {
                let (vi, wi) = (v[i], w[i]);
                let row = a.row_mut(i);
                row.iter_mut().zip(v.iter().zip(&w)).for_each(|(a, (v, w))| *a -= vi * w + wi * v);
            }
        }
    }

    /// Solves R a = b for the polynomial's coefficients, zero where there are none.
    pub(crate) fn trend_from(&self, b: &[f64]) -> [f64; 3] {
        let mut a = [0.0; 3];
        for i in (0..self.order()).rev() {
            let known: f64 = (i + 1..self.order()).map(|j| self.triangle[i][j] * a[j]).sum();
            a[i] = (b[i] - known) / self.triangle[i][i];
        }
        a
    }
}

/// Unit vector of the reflection that moves `column[k..]` onto its first axis (Householder 1958).
fn reflection_of(column: &[f64], k: usize) -> Vec<f64> {
    let mut v = column.to_vec();
    v[..k.min(column.len())].fill(0.0);
    let norm = dot(&v, &v).sqrt();
    if k < v.len() {
        v[k] += if v[k] < 0.0 { -norm } else { norm };
    }
    let length = dot(&v, &v).sqrt();
    if length > 0.0 {
        v.iter_mut().for_each(|value| *value /= length);
    }
    v
}

fn reflect(v: &[f64], target: &mut [f64]) {
    let along = 2.0 * dot(v, target);
    target.iter_mut().zip(v).for_each(|(t, v)| *t -= along * v);
}

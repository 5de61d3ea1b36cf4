//! Multipliers and the bound that they prove.

use super::dense::{Cholesky, add_outer, dot};
use super::program::Program;

/// Rounds of repair: the second takes out what limits cut off in the first.
const REPAIRS: usize = 2;

/// Multipliers: `y` of the residuals, `s` of the cones.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Dual {
    pub(super) y: Vec<f64>,
    pub(super) s: Vec<[f64; 4]>,
}

impl Dual {
    /// A bound that no feasible surface beats, whatever the multipliers are.
    ///
    /// With `|y| <= w` and `s` in the (self-dual) cones every feasible `x` has
    /// `sum w |d x - z| >= y (D x - z) - s (G x + h) = -z y - h s + rho x`, `rho = D'y - G's`. Where `rho`
    /// is not exactly zero, `rho x` is bounded by the size that `x` can have while its objective is not
    /// above `level`. `y` and `s` are brought into their sets first.
    pub(super) fn bound<const K: usize>(mut self, program: &Program<K>, level: f64) -> f64 {
        self.repair(program);
        self.restrict(program);
        let rho = self.residue(program);
        let mut value = 0.0;
        program.rows.iter().zip(&self.y).for_each(|(row, y)| value -= row.z * y);
        for (cone, s) in program.cones.iter().zip(&self.s) {
            value -= (0..cone.dim).map(|i| cone.shift[i] * s[i]).sum::<f64>();
        }
        value - program.charge(&rho, level, program.magnitude())
    }

    /// D'y - G's.
    fn residue<const K: usize>(&self, program: &Program<K>) -> [f64; K] {
        let mut rho = [0.0; K];
        for (row, y) in program.rows.iter().zip(&self.y) {
            rho.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum += d * y);
        }
        for (cone, s) in program.cones.iter().zip(&self.s) {
            let moved = cone.transposed(s);
            rho.iter_mut().zip(moved).for_each(|(sum, part)| *sum -= part);
        }
        rho
    }

    /// Brings the multipliers into their sets.
    fn restrict<const K: usize>(&mut self, program: &Program<K>) {
        for (row, y) in program.rows.iter().zip(&mut self.y) {
            *y = y.clamp(-row.w, row.w);
        }
        for (cone, s) in program.cones.iter().zip(&mut self.s) {
            *s = into_cone(*s, cone.dim);
        }
    }

    /// Takes out what residue there is by the smallest change relative to the distance from the
    /// limits: an affine scaling step with w² - y² and the quadratic representation of s.
    fn repair<const K: usize>(&mut self, program: &Program<K>) {
        for _ in 0..REPAIRS {
            self.restrict(program);
            let rho = self.residue(program);
            let mut matrix = [[0.0; K]; K];
            for (row, y) in program.rows.iter().zip(&self.y) {
                add_outer(&mut matrix, &row.d, row.w * row.w - y * y);
            }
            for (cone, s) in program.cones.iter().zip(&self.s) {
                add_outer(&mut matrix, &cone.transposed(s), 2.0);
                let determinant = determinant(s);
                for (i, row) in cone.rows.iter().enumerate().take(cone.dim) {
                    add_outer(&mut matrix, row, if i == 0 { -determinant } else { determinant });
                }
            }
            let Some(factor) = Cholesky::new(&matrix) else { return };
            let v = factor.solve(&rho);
            for (row, y) in program.rows.iter().zip(&mut self.y) {
                *y -= (row.w * row.w - *y * *y) * dot(&row.d, &v);
            }
            for (cone, s) in program.cones.iter().zip(&mut self.s) {
                let moved: [f64; 4] = std::array::from_fn(|i| dot(&cone.rows[i], &v));
                let (along, determinant) = (dot(s, &moved), determinant(s));
                for i in 0..cone.dim {
                    let mirrored = if i == 0 { moved[i] } else { -moved[i] };
                    s[i] += 2.0 * along * s[i] - determinant * mirrored;
                }
            }
        }
    }
}

/// Square of the head less that of the tail, not below nought.
fn determinant(s: &[f64; 4]) -> f64 {
    let tail = (s[1] * s[1] + s[2] * s[2] + s[3] * s[3]).sqrt();
    ((s[0] - tail) * (s[0] + tail)).max(0.0)
}

/// The vector with its tail shortened or its head raised until it lies in the cone.
fn into_cone(mut s: [f64; 4], dim: usize) -> [f64; 4] {
    let tail = (1..dim).map(|i| s[i] * s[i]).sum::<f64>().sqrt();
    s[0] = s[0].max(tail).max(0.0);
    s
}

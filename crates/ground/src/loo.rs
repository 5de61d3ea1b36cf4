//! Leave-one-out errors of multiquadric surfaces for many kernels at once.
//!
//! Rippa 1999 (An algorithm for selecting a good value for the parameter c in radial basis function
//! interpolation, section 3): the error at node i of the surface fitted without it is
//! e_i = c_i / (A⁻¹)_ii. With the projected kernel matrix B = U Λ Uᵀ and G = Q U (Q: basis of the
//! null space of Pᵀ), smoothing only shifts the eigenvalues:
//!
//! ```text
//! c_i = sum_k G_ik t_k / (Λ_k + λ),   (A⁻¹)_ii = sum_k G_ik² / (Λ_k + λ),   t = Gᵀ z
//! ```
//! so that one eigenvalue problem per offset serves every smoothing.

use crate::Error;
use crate::dense::{Eigen, Square};
use crate::hardy::{Sample, Trend, kernel_matrix, trend_of};
use crate::projection::Projection;

/// The eigen-decomposed system of one sample and one offset.
#[derive(Debug, Clone)]
pub struct LeaveOneOut {
    /// Row k is column k of G.
    vectors: Vec<Vec<f64>>,
    values: Vec<f64>,
    /// t = Gᵀ z.
    loads: Vec<f64>,
    nodes: usize,
}

impl LeaveOneOut {
    /// Decomposes the system for offset D.
    ///
    /// # Errors
    /// [`Error::NoNodes`] unless there are more nodes than polynomial terms, [`Error::Eigen`].
    pub fn new(sample: Sample<'_>, offset_m: f64, trend: Trend) -> Result<Self, Error> {
        let nodes = sample.len();
        let projection = Projection::new(sample.x, sample.y, trend_of(sample, trend));
        let order = projection.order();
        if nodes <= order {
            return Err(Error::NoNodes);
        }
        let mut matrix = kernel_matrix(sample, offset_m);
        projection.apply_both_sides(&mut matrix);
        let mut block = Square::zeros(nodes - order);
        for i in 0..block.size {
            block.row_mut(i).copy_from_slice(&matrix.row(order + i)[order..]);
        }
        let eigen = Eigen::of_symmetric(&block)?;
        let vectors: Vec<Vec<f64>> = (0..block.size)
            .map(|k| {
                let mut g = vec![0.0; order];
                g.extend_from_slice(eigen.vectors.row(k));
                projection.apply_transposed(&mut g);
                g
            })
            .collect();
        let loads = vectors.iter().map(|g| crate::dense::dot(g, sample.z)).collect();
        Ok(Self { vectors, values: eigen.values, loads, nodes })
    }

    /// The leave-one-out error at every node, metres, for smoothing λ.
    #[must_use]
    pub fn errors(&self, smoothing_m: f64) -> Vec<f64> {
        let mut c = vec![0.0; self.nodes];
        let mut d = vec![0.0; self.nodes];
        // Rounding can leave the smallest eigenvalues at or below zero.
        let floor = 1e-12 * self.values.last().copied().unwrap_or(1.0);
        for ((g, value), load) in self.vectors.iter().zip(&self.values).zip(&self.loads) {
            let inverse = 1.0 / (value + smoothing_m).max(floor);
            for ((c, d), g) in c.iter_mut().zip(&mut d).zip(g) {
                let scaled = g * inverse;
                *c += scaled * load;
                *d += scaled * g;
            }
        }
        c.iter().zip(&d).map(|(c, d)| if *d > 0.0 { c / d } else { 0.0 }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hardy::{Hardy, Kernel};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn agrees_with_leaving_one_out(seed in prop::collection::vec(0f64..1., 90), offset in 0f64..1.5, smoothing in 0f64..0.3) {
            let n = 30;
            let x: Vec<f64> = (0..n).map(|i| (i % 6) as f64 + 0.7 * seed[3 * i]).collect();
            let y: Vec<f64> = (0..n).map(|i| (i / 6) as f64 + 0.7 * seed[3 * i + 1]).collect();
            let z: Vec<f64> = (0..n).map(|i| seed[3 * i + 2]).collect();
            let sample = Sample { x: &x, y: &y, z: &z };
            let errors = LeaveOneOut::new(sample, offset, Trend::Plane).unwrap().errors(smoothing);
            for out in [0, 7, 29] {
                let without = |v: &[f64]| v.iter().enumerate().filter(|(i, _)| *i != out).map(|(_, v)| *v).collect::<Vec<_>>();
                let (xs, ys, zs) = (without(&x), without(&y), without(&z));
                let kernel = Kernel { offset_m: offset, smoothing_m: smoothing };
                let rest = Hardy::fit(Sample { x: &xs, y: &ys, z: &zs }, kernel, Trend::Plane).unwrap();
                let explicit = z[out] - rest.at(x[out], y[out]);
                prop_assert!((errors[out] - explicit).abs() < 1e-6 * (1.0 + explicit.abs()), "{} {}", errors[out], explicit);
            }
        }
    }
}

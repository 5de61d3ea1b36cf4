//! Dense linear algebra: the one place that knows faer, and a factorisation of fixed order.
//!
//! faer picks its instructions by the processor it runs on, so its last bits may differ between
//! machines. It is therefore used for *decisions between discrete candidates* (the eigenvalues of
//! the leave-one-out search) and as the reference in tests; numbers that end up in an artefact come
//! from [`Cholesky`], whose sums run in one order everywhere.

use crate::Error;
use faer::linalg::solvers::SelfAdjointEigen;
use faer::{MatRef, Side};

/// A square matrix by rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Square {
    /// Number of rows and of columns.
    pub size: usize,
    /// Entries, row after row.
    pub values: Vec<f64>,
}

impl Square {
    /// A matrix of zeros.
    #[must_use]
    pub fn zeros(size: usize) -> Self {
        Self { size, values: vec![0.0; size * size] }
    }

    /// One row.
    #[must_use]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.values[i * self.size..(i + 1) * self.size]
    }

    /// One row to write to.
    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.values[i * self.size..(i + 1) * self.size]
    }
}

/// Eigenvalues (ascending) and eigenvectors of a symmetric matrix.
#[derive(Debug, Clone)]
pub struct Eigen {
    /// Eigenvalues, ascending.
    pub values: Vec<f64>,
    /// Row `k` is the unit eigenvector of `values[k]`.
    pub vectors: Square,
}

impl Eigen {
    /// Decomposes a symmetric matrix.
    ///
    /// # Errors
    /// [`Error::Eigen`] when the iteration does not converge (a matrix that is not finite).
    pub fn of_symmetric(matrix: &Square) -> Result<Self, Error> {
        let n = matrix.size;
        if !matrix.values.iter().all(|v| v.is_finite()) {
            return Err(Error::Eigen { size: n });
        }
        let view = MatRef::from_row_major_slice(&matrix.values, n, n);
        let found =
            SelfAdjointEigen::new(view, Side::Lower).map_err(|_| Error::Eigen { size: n })?;
        let values = (0..n).map(|k| found.S()[k]).collect();
        let mut vectors = Square::zeros(n);
        for k in 0..n {
            for (i, value) in vectors.row_mut(k).iter_mut().enumerate() {
                *value = found.U()[(i, k)];
            }
        }
        Ok(Self { values, vectors })
    }
}

/// The factor L of a symmetric positive definite matrix, L Lᵀ = A, computed in a fixed order.
#[derive(Debug, Clone)]
pub struct Cholesky {
    lower: Square,
}

impl Cholesky {
    /// Factors a matrix (its lower half is read); `None` when it is not positive definite to
    /// working precision: a pivot below `1e-14` of its diagonal entry.
    #[must_use]
    pub fn new(mut matrix: Square) -> Option<Self> {
        let n = matrix.size;
        for i in 0..n {
            let (done, rest) = matrix.values.split_at_mut(i * n);
            let row = &mut rest[..n];
            for j in 0..i {
                let other = &done[j * n..j * n + j + 1];
                let sum = row[j] - dot(&row[..j], &other[..j]);
                row[j] = sum / other[j];
            }
            let pivot = row[i] - dot(&row[..i], &row[..i]);
            if pivot.is_nan() || pivot <= 1e-14 * row[i] {
                return None;
            }
            row[i] = pivot.sqrt();
        }
        Some(Self { lower: matrix })
    }

    /// Solves A x = b in place.
    pub fn solve(&self, b: &mut [f64]) {
        let n = self.lower.size;
        for i in 0..n {
            let row = self.lower.row(i);
            b[i] = (b[i] - dot(&row[..i], &b[..i])) / row[i];
        }
        for i in (0..n).rev() {
            let row = self.lower.row(i);
            b[i] /= row[i];
            let value = b[i];
            b[..i].iter_mut().zip(row).for_each(|(b, l)| *b -= l * value);
        }
    }
}

/// Scalar product in a fixed order: four interleaved partial sums, then the remainder.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0f64; 4];
    let (fours_a, rest_a) = a.as_chunks::<4>();
    let (fours_b, rest_b) = b.as_chunks::<4>();
    for (p, q) in fours_a.iter().zip(fours_b) {
        for lane in 0..4 {
            lanes[lane] += p[lane] * q[lane];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(p, q)| p * q).sum();
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::linalg::solvers::Solve;
    use proptest::prelude::*;

    /// Gram matrix of random rows plus a diagonal: positive definite.
    fn gram(n: usize, entries: &[f64]) -> Square {
        let mut matrix = Square::zeros(n);
        for i in 0..n {
            for j in 0..n {
                let sum: f64 = (0..n).map(|k| entries[i * n + k] * entries[j * n + k]).sum();
                matrix.row_mut(i)[j] = sum + if i == j { 0.5 } else { 0.0 };
            }
        }
        matrix
    }

    proptest! {
        #[test]
        fn cholesky_agrees_with_faer(n in 1usize..12, entries in prop::collection::vec(-2f64..2., 144), b in prop::collection::vec(-2f64..2., 12)) {
            let matrix = gram(n, &entries);
            let view = MatRef::from_row_major_slice(&matrix.values, n, n).to_owned();
            let reference = view.partial_piv_lu().solve(faer::ColRef::from_slice(&b[..n]).to_owned());
            let mut mine = b[..n].to_vec();
            Cholesky::new(matrix).unwrap().solve(&mut mine);
            for i in 0..n {
                prop_assert!((mine[i] - reference[i]).abs() < 1e-9 * (1.0 + reference[i].abs()));
            }
        }

        #[test]
        fn eigenvectors_rebuild_the_matrix(n in 1usize..12, entries in prop::collection::vec(-2f64..2., 144)) {
            let matrix = gram(n, &entries);
            let eigen = Eigen::of_symmetric(&matrix).unwrap();
            for i in 0..n {
                for j in 0..n {
                    let sum: f64 = (0..n).map(|k| eigen.values[k] * eigen.vectors.row(k)[i] * eigen.vectors.row(k)[j]).sum();
                    prop_assert!((sum - matrix.row(i)[j]).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn an_indefinite_matrix_has_no_factor() {
        let matrix = Square { size: 2, values: vec![1.0, 2.0, 2.0, 1.0] };
        assert!(Cholesky::new(matrix).is_none());
    }

    #[test]
    fn a_matrix_with_nan_has_no_eigenvalues() {
        let matrix = Square { size: 1, values: vec![f64::NAN] };
        assert_eq!(Eigen::of_symmetric(&matrix).unwrap_err(), Error::Eigen { size: 1 });
    }
}

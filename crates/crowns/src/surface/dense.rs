//! Dense linear algebra of the sizes that occur here: 2 to 8 unknowns.

use super::program::Row;

pub(super) fn dot<const K: usize>(a: &[f64; K], b: &[f64; K]) -> f64 {
    (0..K).map(|k| a[k] * b[k]).sum()
}

/// A factor `L` of `A = L L'`, of which the lower half counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Cholesky<const K: usize> {
    lower: [[f64; K]; K],
}

impl<const K: usize> Cholesky<K> {
    /// Factorises a matrix of which the lower half counts; `None` unless it is positive definite.
    pub(super) fn new(a: &[[f64; K]; K]) -> Option<Self> {
        let mut lower = *a;
        for j in 0..K {
            let diagonal = lower[j][j] - (0..j).map(|k| lower[j][k] * lower[j][k]).sum::<f64>();
            if !(diagonal > 0.0 && diagonal.is_finite()) {
                return None;
            }
            let root = diagonal.sqrt();
            lower[j][j] = root;
            for i in j + 1..K {
                let sum: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                lower[i][j] = (lower[i][j] - sum) / root;
            }
        }
        Some(Self { lower })
    }

    pub(super) fn solve(&self, rhs: &[f64; K]) -> [f64; K] {
        let mut x = *rhs;
        for i in 0..K {
            let known: f64 = (0..i).map(|k| self.lower[i][k] * x[k]).sum();
            x[i] = (x[i] - known) / self.lower[i][i];
        }
        for i in (0..K).rev() {
            let known: f64 = (i + 1..K).map(|k| self.lower[k][i] * x[k]).sum();
            x[i] = (x[i] - known) / self.lower[i][i];
        }
        x
    }
}

/// Adds `weight * d d'` to the lower half of a matrix.
#[inline]
pub(super) fn add_outer<const K: usize>(a: &mut [[f64; K]; K], d: &[f64; K], weight: f64) {
    for i in 0..K {
        let scaled = weight * d[i];
        for j in 0..=i {
            a[i][j] += scaled * d[j];
        }
    }
}

/// Solution of the weighted least squares problem; `None` where the rows do not determine it.
pub(super) fn least_squares<const K: usize>(rows: &[Row<K>]) -> Option<[f64; K]> {
    let (mut gram, mut rhs) = ([[0.0; K]; K], [0.0; K]);
    for row in rows {
        add_outer(&mut gram, &row.d, row.w);
        rhs.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum += row.w * row.z * d);
    }
    let factor = Cholesky::new(&gram)?;
    let first = factor.solve(&rhs);
    // One step of refinement: the normal equations square the condition.
    let mut rest = [0.0; K];
    for row in rows {
        let residual = row.w * (row.z - dot(&row.d, &first));
        rest.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum += residual * d);
    }
    let step = factor.solve(&rest);
    Some(std::array::from_fn(|k| first[k] + step[k]))
}

/// By how much each unknown can differ from nought while `|W D x| = 1`: since the sum of absolute
/// values is at least the Euclidean length, the roots of the diagonal of `(D'W²D)^-1`.
pub(super) fn gram_spread<const K: usize>(rows: &[Row<K>]) -> [f64; K] {
    let mut gram = [[0.0; K]; K];
    rows.iter().for_each(|row| add_outer(&mut gram, &row.d, row.w * row.w));
    let Some(factor) = Cholesky::new(&gram) else { return [f64::INFINITY; K] };
    std::array::from_fn(|k| {
        let mut unit = [0.0; K];
        unit[k] = 1.0;
        factor.solve(&unit)[k].max(0.0).sqrt()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_solves_its_system() {
        let a = [[4.0, 0.0, 0.0], [2.0, 5.0, 0.0], [0.6, 1.5, 3.8]];
        let x = Cholesky::new(&a).unwrap().solve(&[1.0, -2.0, 3.0]);
        let full = |i: usize, j: usize| if i >= j { a[i][j] } else { a[j][i] };
        for (i, expected) in [1.0, -2.0, 3.0].into_iter().enumerate() {
            let value: f64 = (0..3).map(|j| full(i, j) * x[j]).sum();
            assert!((value - expected).abs() < 1e-12);
        }
        assert_eq!(Cholesky::new(&[[1.0, 0.0], [2.0, 1.0]]), None);
    }

    #[test]
    fn a_line_is_found_and_its_spread() {
        let row = |x: f64| Row { d: [x, 1.0], z: 2.0 * x - 1.0, w: 1.0 };
        let rows: Vec<Row<2>> = (0..5).map(|i| row(f64::from(i))).collect();
        let [slope, offset] = least_squares(&rows).unwrap();
        assert!((slope - 2.0).abs() < 1e-12 && (offset + 1.0).abs() < 1e-12);
        // Sum of squares about the mean of 0..4 is 10.
        assert!((gram_spread(&rows)[0] - (0.1f64).sqrt()).abs() < 1e-12);
        assert_eq!(least_squares(&rows[..1]), None);
    }
}

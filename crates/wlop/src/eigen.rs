//! Eigenvalues of small symmetric matrices, by arithmetic that is the same on every machine.

/// Rounds of rotations; three are enough for double precision, as convergence is quadratic.
const ROUNDS: u32 = 12;

/// Eigenvalues, descending, and eigenvectors of the matrix of xx, xy, xz, yy, yz, zz, by cyclic
/// Jacobi rotations (Golub and Van Loan, section 8.5).
#[must_use]
pub(crate) fn symmetric(scatter: [f64; 6]) -> ([f64; 3], [[f64; 3]; 3]) {
    let [xx, xy, xz, yy, yz, zz] = scatter;
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    // Rows are the eigenvectors.
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..ROUNDS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let tau = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = tau.signum() / (tau.abs() + (1.0 + tau * tau).sqrt());
            let c = 1.0 / (1.0 + t * t).sqrt();
            let s = t * c;
            for k in 0..3 {
                (a[k][p], a[k][q]) = (c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]);
            }
            for k in 0..3 {
                (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                let (vp, vq) = (vectors[p][k], vectors[q][k]);
                (vectors[p][k], vectors[q][k]) = (c * vp - s * vq, s * vp + c * vq);
            }
        }
    }
    let mut axes = [0, 1, 2];
    axes.sort_by(|&i, &j| a[j][j].total_cmp(&a[i][i]));
    (axes.map(|i| a[i][i]), axes.map(|i| vectors[i]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn vectors_are_orthonormal_and_make_the_matrix_again(
            scatter in prop::array::uniform6(-5.0f64..5.0), small in prop::bool::ANY,
        ) {
            let scatter = if small { scatter.map(|v| v * 1e-9) } else { scatter };
            let (values, vectors) = symmetric(scatter);
            prop_assert!(values[0] >= values[1] && values[1] >= values[2]);
            let size = scatter.iter().fold(0.0f64, |most, v| most.max(v.abs()));
            let places = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
            for ((i, j), expected) in places.into_iter().zip(scatter) {
                let made: f64 = (0..3).map(|k| values[k] * vectors[k][i] * vectors[k][j]).sum();
                prop_assert!((made - expected).abs() <= 1e-13 * size, "{made} {expected}");
                let dot: f64 = (0..3).map(|k| vectors[i][k] * vectors[j][k]).sum();
                prop_assert!((dot - f64::from(i == j)).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn a_matrix_of_nothing_has_axes() {
        assert_eq!(symmetric([0.0; 6]).0, [0.0; 3]);
    }
}

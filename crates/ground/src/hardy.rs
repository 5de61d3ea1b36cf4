//! One multiquadric surface over a small set of nodes.
//!
//! Hardy 1971 (Multiquadric equations of topography and other irregular surfaces): elevation as a
//! sum of hyperboloids, here with a polynomial of order 0 or 1 and its side conditions (Micchelli
//! 1986: the kernel is conditionally definite, with them the system has one solution):
//!
//! ```text
//! z(x, y) = a0 + a1 x + a2 y + sum_j c_j sqrt((x - x_j)² + (y - y_j)² + D²)
//! sum_j c_j = 0      (and sum_j c_j x_j = sum_j c_j y_j = 0 with a plane)
//! ```
//!
//! Smoothing λ (metres) adds λ to the diagonal of the positive definite form `-sqrt(..)`, which is
//! the convention of `SciPy`'s `RBFInterpolator(kernel="multiquadric", epsilon=1/D)` with
//! `smoothing = λ / D`, `degree` 0 or 1. D = 0 is the cone of Tittmann et al. 2011, equation 9.

use crate::Error;
use crate::dense::{Cholesky, Square, dot};
use crate::projection::Projection;
use serde::{Deserialize, Serialize};

/// Positions and elevations of nodes, metres, relative to any common origin near them.
#[derive(Debug, Clone, Copy)]
pub struct Sample<'a> {
    /// x of the nodes.
    pub x: &'a [f64],
    /// y of the nodes.
    pub y: &'a [f64],
    /// z of the nodes.
    pub z: &'a [f64],
}

impl Sample<'_> {
    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there are no nodes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }
}

/// The two numbers that shape the surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Kernel {
    /// D: how far around a node its hyperboloid is rounded, metres.
    pub offset_m: f64,
    /// λ: 0 passes through every node, metres.
    pub smoothing_m: f64,
}

/// The polynomial beside the kernel sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trend {
    /// A constant.
    Constant,
    /// A plane; becomes a constant where the nodes are too few or nearly on one line.
    Plane,
}

/// A fitted surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Hardy {
    /// x of the nodes, metres.
    pub x: Vec<f64>,
    /// y of the nodes, metres.
    pub y: Vec<f64>,
    /// Coefficient of each node's hyperboloid.
    pub coefficients: Vec<f64>,
    /// a0 (metres), a1, a2.
    pub trend: [f64; 3],
    /// D², m².
    pub offset_squared_m2: f64,
}

/// With fewer nodes than this a plane is not asked for: three points and some redundancy.
const PLANE_NODES: usize = 6;
/// Factors of the smoothing added when rounding spoils definiteness, relative to the mean diagonal.
const REGULARISATION: [f64; 4] = [0.0, 1e-12, 1e-10, 1e-8];

impl Hardy {
    /// Solves for the coefficients. Nodes must differ in (x, y) unless there is smoothing.
    ///
    /// # Errors
    /// [`Error::NoNodes`], [`Error::Length`], [`Error::Singular`].
    pub fn fit(sample: Sample<'_>, kernel: Kernel, trend: Trend) -> Result<Self, Error> {
        check_sample(sample)?;
        let projection = Projection::new(sample.x, sample.y, trend_of(sample, trend));
        let mut matrix = kernel_matrix(sample, kernel.offset_m);
        projection.apply_both_sides(&mut matrix);
        let mut rhs = sample.z.to_vec();
        projection.apply(&mut rhs);
        let order = projection.order();
        let solution = solve_definite(&matrix, order, kernel, &rhs[order..])?;
        let mut coefficients = vec![0.0; order];
        coefficients.extend(&solution);
        let coupling: Vec<f64> =
            (0..order).map(|i| rhs[i] - dot(&matrix.row(i)[order..], &solution)).collect();
        let trend = projection.trend_from(&coupling);
        projection.apply_transposed(&mut coefficients);
        coefficients.iter_mut().for_each(|c| *c = -*c);
        let offset_squared_m2 = kernel.offset_m * kernel.offset_m;
        let (x, y) = (sample.x.to_vec(), sample.y.to_vec());
        Ok(Self { x, y, coefficients, trend, offset_squared_m2 })
    }

    /// Elevation at a position of the nodes' frame, metres.
    #[must_use]
    pub fn at(&self, x: f64, y: f64) -> f64 {
        let sum = hyperboloids(&self.x, &self.y, &self.coefficients, self.offset_squared_m2, x, y);
        self.trend[0] + self.trend[1] * x + self.trend[2] * y + sum
    }
}

/// Sum of c_j sqrt((x-x_j)² + (y-y_j)² + D²) in a fixed order of four interleaved partial sums.
#[must_use]
fn hyperboloids(xs: &[f64], ys: &[f64], cs: &[f64], offset2: f64, x: f64, y: f64) -> f64 {
    let mut lanes = [0.0f64; 4];
    let ((fx, rx), (fy, ry), (fc, rc)) =
        (xs.as_chunks::<4>(), ys.as_chunks::<4>(), cs.as_chunks::<4>());
    for ((px, py), pc) in fx.iter().zip(fy).zip(fc) {
        for lane in 0..4 {
            let (dx, dy) = (px[lane] - x, py[lane] - y);
            lanes[lane] += pc[lane] * (dx * dx + dy * dy + offset2).sqrt();
        }
    }
    let mut rest = 0.0;
    for ((px, py), pc) in rx.iter().zip(ry).zip(rc) {
        let (dx, dy) = (px - x, py - y);
        rest += pc * (dx * dx + dy * dy + offset2).sqrt();
    }
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]) + rest
}

fn check_sample(sample: Sample<'_>) -> Result<(), Error> {
    let expected = sample.len();
    for (what, found) in [("y", sample.y.len()), ("z", sample.z.len())] {
        if found != expected {
            return Err(Error::Length { what, expected, found });
        }
    }
    if expected == 0 { Err(Error::NoNodes) } else { Ok(()) }
}

/// The trend that a sample can carry.
pub(crate) fn trend_of(sample: Sample<'_>, asked: Trend) -> Trend {
    if sample.len() < PLANE_NODES { Trend::Constant } else { asked }
}

/// The conditionally positive definite matrix `-sqrt(r² + D²)`.
pub(crate) fn kernel_matrix(sample: Sample<'_>, offset_m: f64) -> Square {
    let (n, offset2) = (sample.len(), offset_m * offset_m);
    let mut matrix = Square::zeros(n);
    for i in 0..n {
        let (x, y) = (sample.x[i], sample.y[i]);
        for (value, (px, py)) in matrix.row_mut(i).iter_mut().zip(sample.x.iter().zip(sample.y)) {
            let (dx, dy) = (px - x, py - y);
            *value = -(dx * dx + dy * dy + offset2).sqrt();
        }
    }
    matrix
}

/// Solves the projected system, adding the least trace of smoothing that makes it definite.
fn solve_definite(
    matrix: &Square,
    order: usize,
    kernel: Kernel,
    rhs: &[f64],
) -> Result<Vec<f64>, Error> {
    let n = matrix.size - order;
    let diagonal = (0..n).map(|i| matrix.row(order + i)[order + i].abs());
    let scale = diagonal.fold(0.0, f64::max);
    for factor in REGULARISATION {
        let mut block = Square::zeros(n);
        for i in 0..n {
            block.row_mut(i).copy_from_slice(&matrix.row(order + i)[order..]);
            block.row_mut(i)[i] += kernel.smoothing_m + factor * scale;
        }
        if let Some(factor) = Cholesky::new(block) {
            let mut solution = rhs.to_vec();
            factor.solve(&mut solution);
            return Ok(solution);
        }
    }
    Err(Error::Singular { nodes: matrix.size, offset_m: kernel.offset_m })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Distinct nodes of a jittered lattice with rough elevations.
    fn nodes(n: usize, seed: &[f64]) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let value = |i: usize| seed[i % seed.len()];
        let x = (0..n).map(|i| (i % 7) as f64 + 0.8 * value(3 * i)).collect();
        let y = (0..n).map(|i| (i / 7) as f64 + 0.8 * value(3 * i + 1)).collect();
        let z = (0..n).map(|i| 5.0 * value(3 * i + 2)).collect();
        (x, y, z)
    }

    proptest! {
        #[test]
        fn passes_through_its_nodes(n in 1usize..60, seed in prop::collection::vec(0f64..1., 181), offset in 0f64..2.) {
            let (x, y, z) = nodes(n, &seed);
            let sample = Sample { x: &x, y: &y, z: &z };
            let kernel = Kernel { offset_m: offset, smoothing_m: 0.0 };
            let surface = Hardy::fit(sample, kernel, Trend::Plane).unwrap();
            for i in 0..n {
                prop_assert!((surface.at(x[i], y[i]) - z[i]).abs() < 1e-6, "{} against {}", surface.at(x[i], y[i]), z[i]);
            }
        }

        #[test]
        fn side_conditions_hold(n in 6usize..60, seed in prop::collection::vec(0f64..1., 181)) {
            let (x, y, z) = nodes(n, &seed);
            let kernel = Kernel { offset_m: 0.7, smoothing_m: 0.1 };
            let surface = Hardy::fit(Sample { x: &x, y: &y, z: &z }, kernel, Trend::Plane).unwrap();
            let sum = |weight: &dyn Fn(usize) -> f64| (0..n).map(|i| surface.coefficients[i] * weight(i)).sum::<f64>();
            prop_assert!(sum(&|_| 1.0).abs() < 1e-8);
            prop_assert!(sum(&|i| x[i]).abs() < 1e-7);
            prop_assert!(sum(&|i| y[i]).abs() < 1e-7);
        }

        #[test]
        fn a_plane_is_reproduced(n in 8usize..60, seed in prop::collection::vec(0f64..1., 181), a in -1f64..1., b in -1f64..1., smoothing in 0f64..0.5) {
            let (x, y, _) = nodes(n, &seed);
            let z: Vec<f64> = x.iter().zip(&y).map(|(x, y)| 3.0 + a * x + b * y).collect();
            let kernel = Kernel { offset_m: 0.5, smoothing_m: smoothing };
            let surface = Hardy::fit(Sample { x: &x, y: &y, z: &z }, kernel, Trend::Plane).unwrap();
            prop_assert!((surface.at(2.3, 17.0) - (3.0 + a * 2.3 + b * 17.0)).abs() < 1e-7);
        }
    }

    #[test]
    fn nodes_on_a_line_fall_back_to_a_constant() {
        let x: Vec<f64> = (0..10).map(f64::from).collect();
        let (y, z) = (vec![0.0; 10], vec![4.0; 10]);
        let kernel = Kernel { offset_m: 0.5, smoothing_m: 0.0 };
        let surface = Hardy::fit(Sample { x: &x, y: &y, z: &z }, kernel, Trend::Plane).unwrap();
        assert!((surface.at(3.0, 50.0) - 4.0).abs() < 1e-9);
        assert_eq!(&surface.trend[1..], &[0.0, 0.0]);
    }

    #[test]
    fn one_node_is_a_constant_and_none_an_error() {
        let kernel = Kernel { offset_m: 0.5, smoothing_m: 0.0 };
        let one = Sample { x: &[1.0], y: &[2.0], z: &[7.5] };
        assert_eq!(Hardy::fit(one, kernel, Trend::Plane).unwrap().at(90.0, -3.0), 7.5);
        let none = Sample { x: &[], y: &[], z: &[] };
        assert_eq!(Hardy::fit(none, kernel, Trend::Plane).unwrap_err(), Error::NoNodes);
    }

    #[test]
    fn coincident_nodes_are_singular_only_without_smoothing() {
        let sample = Sample { x: &[0.0, 0.0, 1.0], y: &[0.0, 0.0, 1.0], z: &[1.0, 2.0, 1.0] };
        let smooth = Kernel { offset_m: 0.0, smoothing_m: 0.1 };
        assert!(Hardy::fit(sample, smooth, Trend::Plane).unwrap().at(0.0, 0.0) > 1.0);
    }
}

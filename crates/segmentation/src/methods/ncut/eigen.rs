//! The second eigenvector of (D - W) y = lambda D y, by Lanczos (Golub and Van Loan 2013, chapter
//! 10) with full reorthogonalisation.
//!
//! It is D^(-1/2) times the eigenvector of the second largest eigenvalue of D^(-1/2) W D^(-1/2)
//! (Shi and Malik 2000, section 2.2); that of the largest, D^(1/2) 1, is known and kept out of the
//! search. Own code rather than a library's, because its sums must run in the same order on every
//! machine: the sign of one component decides on which side of a cut a voxel lies.

use super::Graph;

/// The vector and how well it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Second {
    /// The eigenvector y.
    pub vector: Vec<f64>,
    /// Its eigenvalue lambda, from 0 (two parts without an edge between them) to 2.
    pub value: f64,
    /// Norm of the residual of the symmetric problem, for a unit vector.
    pub residual: f64,
}

/// Steps after which the estimate is looked at again.
const STEPS_BETWEEN: usize = 8;

/// Searches from a start vector (by vertex; any that is not constant) until the residual is below
/// `tolerance` or after `most_steps` steps. All vertices need an edge; the graph should be connected.
/// `None` for fewer than two vertices.
#[must_use]
pub fn second(graph: &Graph, start: &[f64], tolerance: f64, most_steps: usize) -> Option<Second> {
    let degrees = graph.degrees();
    if degrees.len() < 2 || degrees.iter().any(|degree| *degree <= 0.0) {
        return None;
    }
    let roots: Vec<f64> = degrees.iter().map(|degree| degree.sqrt()).collect();
    let mut krylov = Krylov::new(graph, roots, start)?;
    let most = most_steps.clamp(1, degrees.len() - 1);
    loop {
        krylov.step();
        let steps = krylov.diagonal.len();
        let done = steps == most || krylov.exhausted();
        if !done && !steps.is_multiple_of(STEPS_BETWEEN) {
            continue;
        }
        let (value, vector) = largest(&krylov.diagonal, &krylov.beside[..steps - 1]);
        let residual = krylov.beside[steps - 1] * vector[steps - 1].abs();
        if done || residual < tolerance {
            let vector = krylov.combine(&vector);
            return Some(Second { vector, value: 1.0 - value, residual });
        }
    }
}

/// An orthonormal basis of the space that powers of the matrix make of the start vector.
struct Krylov<'a> {
    graph: &'a Graph,
    /// Square roots of the degrees.
    roots: Vec<f64>,
    /// The known eigenvector, then the basis.
    basis: Vec<Vec<f64>>,
    diagonal: Vec<f64>,
    beside: Vec<f64>,
}

impl<'a> Krylov<'a> {
    fn new(graph: &'a Graph, roots: Vec<f64>, start: &[f64]) -> Option<Self> {
        let mut known = roots.clone();
        normalise(&mut known);
        let mut first: Vec<f64> = start.iter().zip(&roots).map(|(s, root)| s * root).collect();
        let basis = vec![known];
        let scale = normalise(&mut first);
        remove(&mut first, &basis);
        let left = normalise(&mut first);
        if !(scale > 0.0 && left > 1e-9) {
            return None;
        }
        let basis = basis.into_iter().chain([first]).collect();
        Some(Self { graph, roots, basis, diagonal: Vec::new(), beside: Vec::new() })
    }

    fn step(&mut self) {
        let last = &self.basis[self.basis.len() - 1];
        let scaled: Vec<f64> = last.iter().zip(&self.roots).map(|(v, root)| v / root).collect();
        let row = |v: usize| {
            let sum: f64 = self.graph.edges(v).map(|(end, weight)| weight * scaled[end]).sum();
            sum / self.roots[v]
        };
        let mut next: Vec<f64> = (0..scaled.len()).map(row).collect();
        self.diagonal.push(dot(&next, last));
        remove(&mut next, &self.basis);
        self.beside.push(normalise(&mut next));
        self.basis.push(next);
    }

    /// Whether the space cannot grow any more.
    fn exhausted(&self) -> bool {
        self.beside.last().is_some_and(|beta| *beta < 1e-12)
    }

    /// D^(-1/2) times the combination of the basis.
    fn combine(&self, factors: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.roots.len()];
        for (factor, vector) in factors.iter().zip(&self.basis[1..]) {
            sum.iter_mut().zip(vector).for_each(|(sum, v)| *sum += factor * v);
        }
        sum.iter().zip(&self.roots).map(|(v, root)| v / root).collect()
    }
}

/// Takes out of a vector what it has of an orthonormal basis; twice is enough (Giraud et al. 2005).
fn remove(vector: &mut [f64], basis: &[Vec<f64>]) {
    for _ in 0..2 {
        for other in basis {
            let share = dot(vector, other);
            vector.iter_mut().zip(other).for_each(|(v, o)| *v -= share * o);
        }
    }
}

/// Divides a vector by its norm, which is returned; a zero vector stays.
fn normalise(vector: &mut [f64]) -> f64 {
    let norm = dot(vector, vector).sqrt();
    if norm > 0.0 {
        vector.iter_mut().for_each(|v| *v /= norm);
    }
    norm
}

/// Scalar product in a fixed order: four interleaved partial sums, then the remainder.
fn dot(a: &[f64], b: &[f64]) -> f64 {
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

/// Largest eigenvalue and its unit eigenvector of a symmetric tridiagonal matrix with eigenvalues
/// in [-1, 1] and positive entries beside the diagonal: bisection by the signs of the pivots, then
/// the twisted factorisation (Dhillon and Parlett 2004).
fn largest(diagonal: &[f64], beside: &[f64]) -> (f64, Vec<f64>) {
    let (mut low, mut high) = (-1.1, 1.1);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let above = pivots(diagonal, beside, middle).iter().any(|pivot| *pivot > 0.0);
        *(if above { &mut low } else { &mut high }) = middle;
    }
    let forward = pivots(diagonal, beside, high);
    let turned: [Vec<f64>; 2] = [diagonal, beside].map(|v| v.iter().rev().copied().collect());
    let mut backward = pivots(&turned[0], &turned[1], high);
    backward.reverse();
    let len = diagonal.len();
    let gamma = |k: usize| (forward[k] + backward[k] - (diagonal[k] - high)).abs();
    let twist = (0..len).min_by(|a, b| gamma(*a).total_cmp(&gamma(*b))).unwrap_or(0);
    let mut vector = vec![0.0; len];
    vector[twist] = 1.0;
    for k in (0..twist).rev() {
        vector[k] = -beside[k] / forward[k] * vector[k + 1];
    }
    for k in twist + 1..len {
        vector[k] = -beside[k - 1] / backward[k] * vector[k - 1];
    }
    normalise(&mut vector);
    (high, vector)
}

/// Pivots of the matrix less a multiple of the identity, none of them 0.
fn pivots(diagonal: &[f64], beside: &[f64], shift: f64) -> Vec<f64> {
    let mut pivots: Vec<f64> = Vec::with_capacity(diagonal.len());
    for (k, entry) in diagonal.iter().enumerate() {
        let before = if k == 0 { 0.0 } else { beside[k - 1] * beside[k - 1] / pivots[k - 1] };
        let pivot = entry - shift - before;
        pivots.push(if pivot == 0.0 { -f64::MIN_POSITIVE.sqrt() } else { pivot });
    }
    pivots
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// All eigenvalues and eigenvectors (as columns) of a dense symmetric matrix, by Jacobi.
    fn dense(mut a: Vec<Vec<f64>>) -> (Vec<f64>, Vec<Vec<f64>>) {
        let n = a.len();
        let mut vectors: Vec<Vec<f64>> =
            (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
        for _ in 0..60 {
            for p in 0..n {
                for q in p + 1..n {
                    if a[p][q].abs() < 1e-300 {
                        continue;
                    }
                    let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                    let t = if theta == 0.0 { 1.0 } else { t };
                    let c = 1.0 / (t * t + 1.0).sqrt();
                    let s = t * c;
                    for row in a.iter_mut().chain(vectors.iter_mut()) {
                        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                    }
                    for k in 0..n {
                        (a[p][k], a[q][k]) = (c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]);
                    }
                }
            }
        }
        ((0..n).map(|i| a[i][i]).collect(), vectors)
    }

    fn graph(n: usize, weights: &[f64]) -> Graph {
        let weight = |i: usize, j: usize| weights[i.min(j) * 12 + i.max(j)] as f32;
        Graph::from_rows((0..n).map(|i| (0..n).map(|j| (j as u32, weight(i, j))).collect()))
    }

    proptest! {
        #[test]
        fn agrees_with_a_dense_solver(
            n in 3usize..12,
            weights in prop::collection::vec(0.01f64..1.0, 144),
            start in prop::collection::vec(-1f64..1.0, 12),
        ) {
            let graph = graph(n, &weights);
            let degrees = graph.degrees();
            let symmetric: Vec<Vec<f64>> = (0..n).map(|i| {
                let row: Vec<(usize, f64)> = graph.edges(i).collect();
                row.into_iter().map(|(j, w)| w / (degrees[i] * degrees[j]).sqrt()).collect()
            }).collect();
            let (values, vectors) = dense(symmetric);
            let mut order: Vec<usize> = (0..n).collect();
            order.sort_by(|a, b| values[*b].total_cmp(&values[*a]));
            let found = second(&graph, &start[..n], 1e-12, n).unwrap();
            let k = order[1];
            prop_assert!((found.value - (1.0 - values[k])).abs() < 1e-9, "{found:?} {values:?}");
            // Only where the eigenvalue is alone is there one eigenvector.
            prop_assume!(values[k] - values[order[2]] > 1e-4);
            let unit: Vec<f64> = (0..n).map(|i| found.vector[i] * degrees[i].sqrt()).collect();
            let along: f64 = (0..n).map(|i| unit[i] * vectors[i][k]).sum();
            prop_assert!((along.abs() - 1.0).abs() < 1e-6, "{along}");
        }
    }

    #[test]
    fn a_path_has_a_cosine() {
        let n = 200;
        let row = |i: u32| {
            let near = [i.checked_sub(1), Some(i + 1).filter(|j| *j < n)];
            near.into_iter().flatten().map(|j| (j, 1.0)).collect()
        };
        let path = Graph::from_rows((0..n).map(row));
        let start: Vec<f64> = (0..n).map(|i| f64::from(i * i % 17)).collect();
        let found = second(&path, &start, 1e-10, 400).unwrap();
        let expected = 1.0 - libm::cos(std::f64::consts::PI / f64::from(n - 1));
        assert!((found.value - expected).abs() < 1e-12, "{} {expected}", found.value);
        assert!(found.vector.is_sorted() || found.vector.iter().rev().is_sorted());
    }

    #[test]
    fn what_has_no_second_vector() {
        let lone = Graph::from_rows(std::iter::once(vec![(0, 1.0)]));
        assert_eq!(second(&lone, &[1.0], 1e-9, 9), None);
        let pair = Graph::from_rows([vec![(1, 1.0)], vec![(0, 1.0)]].into_iter());
        assert_eq!(second(&pair, &[1.0, 1.0], 1e-9, 9), None, "a constant start");
        let found = second(&pair, &[1.0, 0.0], 1e-9, 9).unwrap();
        assert!((found.value - 2.0).abs() < 1e-12);
    }
}

//! Finding a model.

use crate::bins::{Column, columns};
use crate::grow::{Leaf, Slope, Split};
use crate::{Model, Node, logistic};
use rayon::prelude::*;

/// What is known about one case.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample<const N: usize> {
    /// What it is judged by; at most 256 values.
    pub values: [f64; N],
    /// Whether it is right.
    pub is_right: bool,
    /// How much it counts.
    pub weight: f64,
}

/// How large a model is, and how carefully it is found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Number of trees.
    pub trees: usize,
    /// Most leaves of a tree.
    pub leaves: usize,
    /// Share of its best step that a tree goes (Friedman 2001, section 5: shrinkage).
    pub rate: f64,
    /// Fewest samples of a leaf.
    pub leaf_samples: u32,
    /// Added to the curvature of a leaf: few samples make small steps.
    pub ridge: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self { trees: 100, leaves: 31, rate: 0.15, leaf_samples: 100, ridge: 1.0 }
    }
}

/// A model as it was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    constant: f64,
    roots: Vec<i16>,
    nodes: Vec<Node>,
    leaves: Vec<f32>,
    /// Mean of the negative logarithm of the likelihood of the samples, by weight.
    pub loss: f64,
}

/// Places of nodes and leaves fit so many bits.
const MOST_PLACES: usize = i16::MAX as usize;

impl Fitted {
    /// The model, ready to be asked.
    #[must_use]
    pub fn model(&self) -> Model<'_> {
        Model {
            constant: self.constant,
            roots: &self.roots,
            nodes: &self.nodes,
            leaves: &self.leaves,
        }
    }

    /// Adds a tree; gives the samples' steps, by row.
    fn plant(&mut self, tree: &Tree, columns: &[Column], params: &Params) -> Vec<(u32, f64)> {
        let first = [self.nodes.len() as i16, self.leaves.len() as i16];
        let place = |child: i16| if child < 0 { child - first[1] } else { child + first[0] };
        self.roots.push(place(if tree.nodes.is_empty() { !0 } else { 0 }));
        self.nodes.extend(tree.nodes.iter().map(|(split, [below, above])| {
            let threshold = columns[split.column].cuts[split.cut];
            Node(split.column as u8, threshold, place(*below), place(*above))
        }));
        let mut steps = Vec::new();
        for leaf in &tree.leaves {
            let step = rounded(params.rate * leaf.step(params));
            self.leaves.push(step);
            steps.extend(leaf.rows.iter().map(|row| (*row, f64::from(step))));
        }
        steps
    }
}

/// Steps are printed: four decimals.
fn rounded(step: f64) -> f32 {
    format!("{step:.4}").parse().unwrap_or_default()
}

/// A tree: its splits with their children (a split, or below 0 the leaf `!number`), and its leaves.
struct Tree {
    nodes: Vec<(Split, [i16; 2])>,
    leaves: Vec<Leaf>,
}

impl Tree {
    fn grow(columns: &[Column], slopes: &[Slope], params: &Params) -> Self {
        let rows = (0..slopes.len() as u32).collect();
        let root = Leaf::new(rows, columns, slopes, params);
        let mut tree = Self { nodes: Vec::new(), leaves: vec![root] };
        while tree.leaves.len() < params.leaves {
            let gains = tree.leaves.iter().map(Leaf::gain).enumerate();
            let best = gains.reduce(|a, b| if b.1 > a.1 { b } else { a });
            let Some((place, split)) =
                best.and_then(|(place, _)| Some((place, tree.leaves[place].split?)))
            else {
                break;
            };
            tree.split(place, split, columns, slopes, params);
        }
        tree
    }

    fn split(
        &mut self,
        place: usize,
        split: Split,
        columns: &[Column],
        slopes: &[Slope],
        params: &Params,
    ) {
        let (own, node) = (!(place as i16), self.nodes.len() as i16);
        let parents = self.nodes.iter_mut().flat_map(|(_, children)| children.iter_mut());
        parents.filter(|child| **child == own).for_each(|child| *child = node);
        self.nodes.push((split, [own, !(self.leaves.len() as i16)]));
        let leaf = self.leaves.swap_remove(place);
        let [below, above] = leaf.divided(split, columns, slopes, params);
        self.leaves.push(below);
        let last = self.leaves.len() - 1;
        self.leaves.swap(place, last);
        self.leaves.push(above);
    }
}

/// Finds a model. It stops early where trees find nothing to split, and where there would be more
/// nodes than a model can number (32,767).
#[must_use]
pub fn fit<const N: usize>(samples: &[Sample<N>], params: &Params) -> Fitted {
    let columns = columns(&samples.iter().map(|sample| &sample.values).collect::<Vec<_>>());
    let (mut right, mut all) = (0.0, 0.0);
    for sample in samples {
        right += if sample.is_right { sample.weight } else { 0.0 };
        all += sample.weight;
    }
    let constant = libm::log((right + 0.5) / (all - right + 0.5));
    let mut fitted =
        Fitted { constant, roots: Vec::new(), nodes: Vec::new(), leaves: Vec::new(), loss: 0.0 };
    let mut log_odds = vec![constant; samples.len()];
    for _ in 0..params.trees {
        let slopes: Vec<Slope> = samples.par_iter().zip(&log_odds).map(slope).collect();
        let tree = Tree::grow(&columns, &slopes, params);
        if tree.nodes.is_empty() || fitted.leaves.len() + tree.leaves.len() > MOST_PLACES {
            break;
        }
        for (row, step) in fitted.plant(&tree, &columns, params) {
            log_odds[row as usize] += step;
        }
    }
    fitted.loss = samples.iter().zip(&log_odds).map(loss).sum::<f64>() / all.max(f64::MIN_POSITIVE);
    fitted
}

/// Derivatives of the loss of a sample in the logarithm of its odds.
fn slope<const N: usize>((sample, log_odds): (&Sample<N>, &f64)) -> Slope {
    let probability = logistic(*log_odds);
    Slope {
        gradient: sample.weight * (probability - f64::from(u8::from(sample.is_right))),
        curvature: sample.weight * probability * (1.0 - probability),
    }
}

fn loss<const N: usize>((sample, log_odds): (&Sample<N>, &f64)) -> f64 {
    let sign = if sample.is_right { -1.0 } else { 1.0 };
    sample.weight * libm::log1p(libm::exp(sign * log_odds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Right in two opposite quarters of a square, and noise in a third value.
    fn quarters(count: u32) -> Vec<Sample<3>> {
        let unit =
            |i: u32, factor: u32| f64::from(i.wrapping_mul(factor) >> 8) / f64::from(1 << 24);
        let sample = |i: u32| {
            let [x, y, z] = [2_654_435_761, 2_246_822_519, 3_266_489_917].map(|f| unit(i + 1, f));
            Sample { values: [x, y, z], is_right: (x < 0.5) == (y < 0.3), weight: 1.0 }
        };
        (0..count).map(sample).collect()
    }

    fn small() -> Params {
        Params { trees: 30, leaves: 4, rate: 0.3, leaf_samples: 20, ridge: 1.0 }
    }

    #[test]
    fn what_no_single_value_tells_is_found() {
        let fitted = fit(&quarters(4000), &small());
        let model = fitted.model();
        for (values, is_right) in [([0.2, 0.1], true), ([0.2, 0.8], false), ([0.8, 0.8], true)] {
            let probability = model.probability(&[values[0], values[1], 0.5]);
            assert_eq!(probability > 0.5, is_right, "{values:?}: {probability}");
            assert!((probability - 0.5).abs() > 0.4, "{values:?}: {probability}");
        }
        assert!(fitted.loss < 0.1, "{}", fitted.loss);
    }

    #[test]
    fn the_loss_told_is_that_of_the_model() {
        let samples = quarters(1500);
        let fitted = fit(&samples, &small());
        let own = samples.iter().map(|sample| {
            let probability = fitted.model().probability(&sample.values);
            -libm::log(if sample.is_right { probability } else { 1.0 - probability })
        });
        let own = own.sum::<f64>() / samples.len() as f64;
        assert!((own - fitted.loss).abs() < 1e-9, "{own} and {}", fitted.loss);
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let samples = quarters(3000);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| fit(&samples, &small()))
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn nothing_to_learn_leaves_the_constant() {
        let samples: Vec<Sample<1>> =
            (0..400).map(|i| Sample { values: [1.0], is_right: i % 4 == 0, weight: 1.0 }).collect();
        let fitted = fit(&samples, &small());
        assert!((fitted.model().probability(&[7.0]) - 0.25).abs() < 1e-2);
        assert_eq!(fit::<2>(&[], &small()).model().probability(&[0.0, 0.0]), 0.5);
    }

    proptest! {
        #[test]
        fn a_weight_is_a_number_of_copies(times in 2_u32..5) {
            let base = quarters(600);
            let weighted: Vec<_> =
                base.iter().map(|s| Sample { weight: f64::from(times), ..s.clone() }).collect();
            let copied: Vec<_> = (0..times).flat_map(|_| base.clone()).collect();
            let params = Params { leaf_samples: 1, leaves: 3, trees: 5, ..small() };
            let [a, b] = [fit(&weighted, &params), fit(&copied, &params)];
            prop_assert!((a.loss - b.loss).abs() < 1e-3, "{} and {}", a.loss, b.loss);
        }
    }
}

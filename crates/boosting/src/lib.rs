//! Gradient boosted decision trees for questions with two answers (Friedman 2001, Greedy function
//! approximation: a gradient boosting machine, algorithm 5).
//!
//! A sum of small trees, each of which follows the gradient that those before it left, goes through
//! the logistic function. Trees ask one value at a time, so that beyond the values a model was found
//! with its answer stays that at their border; products of values, as in a regression of second
//! order, go anywhere there.
//!
//! A [`Model`] is evaluated over constant arrays; [`fit`] finds one, and [`source::source`] prints it
//! as the arrays to build a program with. The same samples give the same model, bit by bit, whatever
//! the number of threads.

mod bins;
mod grow;
pub mod source;
mod train;

pub use train::{Fitted, Params, Sample, fit};

/// An inner node: number of the value asked, threshold, and where to go with a value up to the
/// threshold and with one above: to a node, or, below 0, to the leaf `!number`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node(pub u8, pub f32, pub i16, pub i16);

/// A model, by reference: constant arrays of the program or those of a [`Fitted`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model<'a> {
    /// What the sum begins with: the logarithm of the odds without any evidence.
    pub constant: f64,
    /// Where each tree begins, as a child of a [`Node`].
    pub roots: &'a [i16],
    /// The nodes of all trees. Children come after their parents.
    pub nodes: &'a [Node],
    /// What leaves add.
    pub leaves: &'a [f32],
}

impl Model<'_> {
    /// The logarithm of the odds. Values that are asked for but not given, and those that are no
    /// numbers, count as above every threshold.
    #[must_use]
    pub fn log_odds(&self, values: &[f64]) -> f64 {
        self.roots.iter().fold(self.constant, |sum, root| sum + self.leaf(*root, values))
    }

    /// The probability, between 0 and 1.
    #[must_use]
    pub fn probability(&self, values: &[f64]) -> f64 {
        logistic(self.log_odds(values))
    }

    /// What one tree adds.
    fn leaf(&self, root: i16, values: &[f64]) -> f64 {
        let mut place = root;
        while let Some(Node(value, threshold, below, above)) = self.node(place) {
            let value = values.get(usize::from(*value)).copied().unwrap_or(f64::NAN);
            place = if value <= f64::from(*threshold) { *below } else { *above };
        }
        let leaf = usize::try_from(!place).ok().and_then(|leaf| self.leaves.get(leaf));
        f64::from(leaf.copied().unwrap_or_default())
    }

    fn node(&self, place: i16) -> Option<&Node> {
        self.nodes.get(usize::try_from(place).ok()?)
    }
}

/// From the logarithm of the odds to a probability.
fn logistic(log_odds: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-log_odds))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Up to 1: leaf 0; above: by the second value, leaf 1 or 2.
    const MODEL: Model<'static> = Model {
        constant: -0.5,
        roots: &[0, !2],
        nodes: &[Node(0, 1.0, !0, 1), Node(1, 4.0, !1, !2)],
        leaves: &[-2.0, 1.0, 3.0],
    };

    #[test]
    fn each_tree_adds_the_leaf_its_questions_lead_to() {
        for (values, sum) in [([1.0, 9.0], -2.0), ([1.5, 4.0], 1.0), ([2.0, 5.0], 3.0)] {
            assert_eq!(MODEL.log_odds(&values), -0.5 + sum + 3.0, "{values:?}");
        }
        assert!((MODEL.probability(&[1.0, 0.0]) - logistic(0.5)).abs() < 1e-15);
    }

    #[test]
    fn what_is_missing_is_above() {
        assert_eq!(MODEL.log_odds(&[f64::NAN, 1.0]), MODEL.log_odds(&[2.0, 1.0]));
        assert_eq!(MODEL.log_odds(&[2.0]), MODEL.log_odds(&[2.0, 9.0]));
    }
}

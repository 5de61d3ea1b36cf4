//! Tree labels of points against true ones.

use crate::Error;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The label of a point that belongs to no tree.
pub const NO_TREE: u64 = 0;

/// One true tree and the found tree that holds most of its points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TreeLabels {
    /// Label of the true tree.
    pub reference: u64,
    /// Its points.
    pub reference_points: usize,
    /// Label of the found tree with the largest share of them ([`NO_TREE`] if no tree holds any).
    pub found: u64,
    /// Points of that found tree.
    pub found_points: usize,
    /// Points of both.
    pub shared: usize,
}

impl TreeLabels {
    /// Share of the true tree's points that its found tree holds.
    #[must_use]
    pub fn completeness(&self) -> f64 {
        ratio(self.shared, self.reference_points)
    }

    /// Share of the found tree's points that belong to the true tree.
    #[must_use]
    pub fn purity(&self) -> f64 {
        ratio(self.shared, self.found_points)
    }

    /// Intersection over union of the two sets of points.
    #[must_use]
    pub fn iou(&self) -> f64 {
        ratio(self.shared, self.reference_points + self.found_points - self.shared)
    }
}

fn ratio(part: usize, whole: usize) -> f64 {
    if whole > 0 { part as f64 / whole as f64 } else { 0.0 }
}

/// How well points were assigned to trees.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct LabelAccuracy {
    /// Points given.
    pub points: usize,
    /// Found trees.
    pub found_trees: usize,
    /// Every true tree with its found tree, sorted by label.
    pub trees: Vec<TreeLabels>,
    /// Share of the points of true trees that lie in the found tree of their true tree.
    pub completeness: f64,
    /// Share of the points of found trees that belong to the true tree most of them belong to.
    pub purity: f64,
    /// Mean over true trees of the intersection over union.
    pub mean_iou: f64,
}

/// Assesses the labels of points, pair by pair; [`NO_TREE`] marks points without a tree on either
/// side. Of found trees that share equally many points with a true one, the lower label counts.
///
/// # Errors
/// [`Error::Length`] when the two columns differ in length.
pub fn assess_labels(reference: &[u64], found: &[u64]) -> Result<LabelAccuracy, Error> {
    if reference.len() != found.len() {
        return Err(Error::Length { reference: reference.len(), found: found.len() });
    }
    let counts = Counts::new(reference, found);
    let trees: Vec<TreeLabels> =
        counts.reference.iter().map(|(&label, &points)| counts.tree(label, points)).collect();
    let shared: usize = trees.iter().map(|tree| tree.shared).sum();
    let pure: usize = counts.found.keys().map(|&label| counts.most_of(label)).sum();
    let mean_iou = trees.iter().map(TreeLabels::iou).sum::<f64>() / trees.len().max(1) as f64;
    Ok(LabelAccuracy {
        points: reference.len(),
        found_trees: counts.found.len(),
        completeness: ratio(shared, counts.reference.values().sum()),
        purity: ratio(pure, counts.found.values().sum()),
        mean_iou,
        trees,
    })
}

/// Points by true label, by found label, and by both ways of pairing them.
struct Counts {
    reference: BTreeMap<u64, usize>,
    found: BTreeMap<u64, usize>,
    by_reference: BTreeMap<(u64, u64), usize>,
    by_found: BTreeMap<(u64, u64), usize>,
}

impl Counts {
    fn new(reference: &[u64], found: &[u64]) -> Self {
        let mut pairs: BTreeMap<(u64, u64), usize> = BTreeMap::new();
        reference.iter().zip(found).for_each(|(&r, &f)| *pairs.entry((r, f)).or_default() += 1);
        let mut counts = Self {
            reference: BTreeMap::new(),
            found: BTreeMap::new(),
            by_reference: BTreeMap::new(),
            by_found: BTreeMap::new(),
        };
        for (&(r, f), &points) in &pairs {
            if r != NO_TREE {
                *counts.reference.entry(r).or_default() += points;
            }
            if f != NO_TREE {
                *counts.found.entry(f).or_default() += points;
            }
            if r != NO_TREE && f != NO_TREE {
                counts.by_reference.insert((r, f), points);
                counts.by_found.insert((f, r), points);
            }
        }
        counts
    }

    fn tree(&self, label: u64, reference_points: usize) -> TreeLabels {
        let parts = self.by_reference.range((label, 0)..=(label, u64::MAX));
        // The first of the largest: ranges ascend, and only more points replace.
        let largest =
            parts.fold(
                (NO_TREE, 0),
                |best, (&(_, found), &points)| {
                    if points > best.1 { (found, points) } else { best }
                },
            );
        TreeLabels {
            reference: label,
            reference_points,
            found: largest.0,
            found_points: self.found.get(&largest.0).copied().unwrap_or(0),
            shared: largest.1,
        }
    }

    /// Points of a found tree in the true tree with most of them.
    fn most_of(&self, found: u64) -> usize {
        let parts = self.by_found.range((found, 0)..=(found, u64::MAX));
        parts.map(|(_, &points)| points).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn by_hand() {
        //              tree 1: 4 points    tree 2: 3    none: 3
        let reference = [1, 1, 1, 1, /**/ 2, 2, 2, /**/ 0, 0, 0];
        let found = [/**/ 5, 5, 5, 6, /**/ 6, 6, 0, /**/ 6, 6, 0];
        let result = assess_labels(&reference, &found).unwrap();
        assert_eq!((result.points, result.found_trees), (10, 2));
        let [first, second] = result.trees[..] else { panic!("two trees") };
        assert_eq!(
            (first.found, first.completeness(), first.purity(), first.iou()),
            (5, 0.75, 1.0, 0.75)
        );
        assert_eq!((second.found, second.shared, second.found_points), (6, 2, 5));
        assert_eq!(
            (second.completeness(), second.purity(), second.iou()),
            (2.0 / 3.0, 0.4, 2.0 / 6.0)
        );
        assert_eq!(result.completeness, 5.0 / 7.0);
        assert_eq!(result.purity, 5.0 / 8.0);
        assert_eq!(result.mean_iou, (0.75 + 2.0 / 6.0) / 2.0);
    }

    #[test]
    fn perfect_labels_need_not_have_the_same_names() {
        let result = assess_labels(&[1, 1, 2, 0], &[9, 9, 4, 0]).unwrap();
        assert_eq!((result.completeness, result.purity, result.mean_iou), (1.0, 1.0, 1.0));
    }

    #[test]
    fn a_tree_without_a_label_is_not_found() {
        let result = assess_labels(&[3, 3], &[0, 0]).unwrap();
        assert_eq!(
            (result.trees[0].found, result.trees[0].iou(), result.purity),
            (NO_TREE, 0.0, 0.0)
        );
    }

    #[test]
    fn columns_must_agree() {
        let error = assess_labels(&[1], &[]).unwrap_err();
        assert_eq!(error.to_string(), "1 reference labels for 0 found labels");
    }
}

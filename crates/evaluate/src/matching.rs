//! One-to-one matching of detected to reference trees.

use crate::assignment::{Edge, cheapest_largest};
use crate::{Error, Tree};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use timberline_pointcloud::Nearest2;

/// How candidates within reach are paired.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MatchRule {
    /// Reference trees choose in turn, tallest first, each the nearest detected tree still free.
    TallestFirst,
    /// As many pairs as possible, and of these matchings the one with the least sum of distances.
    Optimal,
}

/// When a detected tree can be a reference tree.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MatchParams {
    /// Largest distance in the plane, metres.
    pub max_distance_m: f64,
    /// Largest difference in height, metres; no limit if none. Trees without a height always pass.
    pub max_height_difference_m: Option<f64>,
    /// How candidates are paired.
    pub rule: MatchRule,
}

impl Default for MatchParams {
    fn default() -> Self {
        Self { max_distance_m: 2.0, max_height_difference_m: None, rule: MatchRule::TallestFirst }
    }
}

/// A detected tree taken for a reference tree; both as indices into the given slices.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pair {
    /// Index of the reference tree.
    pub reference: usize,
    /// Index of the detected tree.
    pub detected: usize,
    /// Distance in the plane, metres.
    pub distance_m: f64,
}

/// Who was matched to whom. No tree appears twice.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Matching {
    /// Pairs by ascending index of the reference tree.
    pub pairs: Vec<Pair>,
    /// Reference trees without a partner, ascending.
    pub missed: Vec<usize>,
    /// Detected trees without a partner, ascending.
    pub false_alarms: Vec<usize>,
}

/// Matches detected to reference trees, at most one to one.
///
/// Equal heights of reference trees and equal distances are decided by the lower id, so the result
/// does not depend on the order of either list.
///
/// # Errors
/// [`Error::DuplicateId`], [`Error::Position`] for a position that is not finite,
/// [`Error::Parameter`] for a limit that is negative or not a number.
pub fn match_trees(
    reference: &[Tree],
    detected: &[Tree],
    params: &MatchParams,
) -> Result<Matching, Error> {
    check_list("reference", reference)?;
    check_list("detected", detected)?;
    check_limit("max_distance_m", params.max_distance_m)?;
    check_limit("max_height_difference_m", params.max_height_difference_m.unwrap_or(0.0))?;
    let candidates = candidates(reference, detected, params)?;
    let chosen = match params.rule {
        MatchRule::TallestFirst => tallest_first(reference, detected, &candidates),
        MatchRule::Optimal => optimal(reference, detected, &candidates),
    };
    Ok(matching(chosen, reference.len(), detected.len()))
}

fn check_list(list: &'static str, trees: &[Tree]) -> Result<(), Error> {
    let mut seen = BTreeSet::new();
    for tree in trees {
        if !seen.insert(tree.id) {
            return Err(Error::DuplicateId { list, id: tree.id });
        }
        if !tree.at_m.iter().all(|value| value.is_finite()) {
            return Err(Error::Position { list, id: tree.id, at_m: tree.at_m });
        }
    }
    Ok(())
}

fn check_limit(name: &'static str, value: f64) -> Result<(), Error> {
    if value >= 0.0 {
        return Ok(());
    }
    Err(Error::Parameter { name, value, allowed: "it must be 0 m or more" })
}

/// For each reference tree the detected trees within reach.
fn candidates(
    reference: &[Tree],
    detected: &[Tree],
    params: &MatchParams,
) -> Result<Vec<Vec<Pair>>, Error> {
    let positions: Vec<[f64; 2]> = detected.iter().map(|tree| tree.at_m).collect();
    let search = Nearest2::new(&positions)?;
    let gate = params.max_height_difference_m.unwrap_or(f64::INFINITY);
    let of = |(index, tree): (usize, &Tree)| {
        let near = search.within(&tree.at_m, params.max_distance_m);
        let pairs = near.into_iter().map(|n| Pair {
            reference: index,
            detected: n.index,
            distance_m: n.squared_m2.sqrt(),
        });
        // A missing height is NaN, and so is the difference: not more than the gate.
        let far_in_height =
            |pair: &Pair| (detected[pair.detected].height_m - tree.height_m).abs() > gate;
        pairs.filter(|pair| !far_in_height(pair)).collect()
    };
    Ok(reference.iter().enumerate().map(of).collect())
}

fn tallest_first(reference: &[Tree], detected: &[Tree], candidates: &[Vec<Pair>]) -> Vec<Pair> {
    let mut order: Vec<usize> = (0..reference.len()).collect();
    let height = |i: usize| {
        let height = reference[i].height_m;
        if height.is_nan() { f64::NEG_INFINITY } else { height }
    };
    order.sort_unstable_by(|&a, &b| {
        height(b).total_cmp(&height(a)).then(reference[a].id.cmp(&reference[b].id))
    });
    let mut taken = vec![false; detected.len()];
    let mut chosen = Vec::new();
    for index in order {
        let free = candidates[index].iter().filter(|pair| !taken[pair.detected]);
        let best = free.min_by(|a, b| {
            let ids = detected[a.detected].id.cmp(&detected[b.detected].id);
            a.distance_m.total_cmp(&b.distance_m).then(ids)
        });
        if let Some(pair) = best {
            taken[pair.detected] = true;
            chosen.push(*pair);
        }
    }
    chosen
}

fn optimal(reference: &[Tree], detected: &[Tree], candidates: &[Vec<Pair>]) -> Vec<Pair> {
    // The solver sees trees in the order of their ids, so that ties fall the same way always.
    let (rows, columns) = (by_id(reference), by_id(detected));
    let mut column_of = vec![0; detected.len()];
    columns.iter().enumerate().for_each(|(column, &index)| column_of[index] = column);
    let edges: Vec<Vec<Edge>> = rows
        .iter()
        .map(|&index| {
            let edge = |pair: &Pair| Edge { column: column_of[pair.detected], cost: ticks(pair) };
            let mut edges: Vec<Edge> = candidates[index].iter().map(edge).collect();
            edges.sort_unstable_by_key(|edge| edge.column);
            edges
        })
        .collect();
    let assigned = cheapest_largest(&edges, detected.len());
    let pair_of = |(row, column): (usize, &Option<usize>)| {
        let wanted = columns[(*column)?];
        candidates[rows[row]].iter().find(|pair| pair.detected == wanted).copied()
    };
    assigned.iter().enumerate().filter_map(pair_of).collect()
}

fn by_id(trees: &[Tree]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..trees.len()).collect();
    order.sort_unstable_by_key(|&index| trees[index].id);
    order
}

/// Distance in ticks of 0.1 mm: whole numbers make sums of distances exact.
fn ticks(pair: &Pair) -> i64 {
    timberline_pointcloud::frame::ticks_from_world(pair.distance_m)
}

fn matching(mut pairs: Vec<Pair>, references: usize, detections: usize) -> Matching {
    pairs.sort_unstable_by_key(|pair| pair.reference);
    let mut has_partner = (vec![false; references], vec![false; detections]);
    for pair in &pairs {
        has_partner.0[pair.reference] = true;
        has_partner.1[pair.detected] = true;
    }
    let without = |flags: &[bool]| {
        flags.iter().enumerate().filter(|(_, has)| !**has).map(|(i, _)| i).collect()
    };
    Matching { pairs, missed: without(&has_partner.0), false_alarms: without(&has_partner.1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(id: u64, x: f64, height_m: f64) -> Tree {
        Tree { id, at_m: [x, 0.0], height_m, ..Tree::default() }
    }

    fn pairs(reference: &[Tree], detected: &[Tree], params: &MatchParams) -> Vec<(usize, usize)> {
        let found = match_trees(reference, detected, params).unwrap();
        found.pairs.iter().map(|pair| (pair.reference, pair.detected)).collect()
    }

    #[test]
    fn the_tallest_chooses_first_and_may_spoil_the_count() {
        let reference = [tree(1, 0.0, 10.0), tree(2, 1.0, 20.0)];
        let detected = [tree(1, 0.4, 9.0), tree(2, 2.9, 18.0)];
        let greedy = MatchParams::default();
        assert_eq!(pairs(&reference, &detected, &greedy), [(1, 0)]);
        let optimal = MatchParams { rule: MatchRule::Optimal, ..greedy };
        assert_eq!(pairs(&reference, &detected, &optimal), [(0, 0), (1, 1)]);
    }

    #[test]
    fn the_limit_is_inclusive() {
        let reference = [tree(1, 0.0, 10.0)];
        let params = MatchParams::default();
        assert_eq!(pairs(&reference, &[tree(1, 2.0, 1.0)], &params), [(0, 0)]);
        assert_eq!(pairs(&reference, &[tree(1, 2.001, 1.0)], &params), []);
    }

    #[test]
    fn the_height_gate_lets_unknown_heights_pass() {
        let reference = [tree(1, 0.0, 10.0), tree(2, 10.0, f64::NAN)];
        let detected = [tree(1, 0.0, 16.0), tree(2, 10.0, 16.0)];
        let params = MatchParams { max_height_difference_m: Some(5.0), ..MatchParams::default() };
        assert_eq!(pairs(&reference, &detected, &params), [(1, 1)]);
    }

    #[test]
    fn ties_go_to_the_lower_id() {
        let detected = [tree(9, 1.0, 5.0), tree(4, -1.0, 5.0)];
        assert_eq!(pairs(&[tree(1, 0.0, 5.0)], &detected, &MatchParams::default()), [(0, 1)]);
    }

    #[test]
    fn an_optimal_matching_of_equal_size_takes_the_shorter_sum() {
        let reference = [tree(1, 0.0, 5.0), tree(2, 1.0, 5.0)];
        let detected = [tree(1, 0.9, 5.0), tree(2, 0.1, 5.0)];
        let params = MatchParams { rule: MatchRule::Optimal, ..MatchParams::default() };
        assert_eq!(pairs(&reference, &detected, &params), [(0, 1), (1, 0)]);
    }

    #[test]
    fn faults_are_named() {
        let twice = [tree(3, 0.0, 5.0), tree(3, 1.0, 5.0)];
        let error = match_trees(&twice, &[], &MatchParams::default()).unwrap_err();
        assert_eq!(error.to_string(), "the reference trees name id 3 twice");
        let nowhere = [tree(3, f64::NAN, 5.0)];
        let error = match_trees(&[], &nowhere, &MatchParams::default()).unwrap_err();
        assert_eq!(error.to_string(), "the detected tree 3 stands at (NaN, 0)");
        let params = MatchParams { max_distance_m: -1.0, ..MatchParams::default() };
        assert!(match_trees(&[], &[], &params).unwrap_err().to_string().contains("is -1;"));
    }
}

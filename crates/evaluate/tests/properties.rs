//! What holds of every assessment.

#![allow(clippy::unwrap_used, reason = "these are tests")]

use proptest::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use timberline_evaluate::{
    ErrorStats, Layer, MatchParams, MatchRule, Tree, assess_labels, assess_trees, match_trees,
};

/// Trees on a coarse lattice with few heights, so that ties abound.
fn trees() -> impl Strategy<Value = Vec<Tree>> {
    prop::collection::vec((0i32..24, 0i32..24, 2i32..9), 0..40).prop_map(|raw| {
        let tree = |(id, (x, y, height)): (usize, (i32, i32, i32))| Tree {
            id: (id as u64).wrapping_mul(0x9E37_79B9) % 1009,
            at_m: [f64::from(x) * 0.5, f64::from(y) * 0.5],
            height_m: f64::from(height * 3),
            crown_diameter_m: f64::from(height),
            layer: (height > 4).then_some(Layer::Upper),
        };
        raw.into_iter().enumerate().map(tree).collect()
    })
}

fn params() -> impl Strategy<Value = MatchParams> {
    (0u8..5, prop::option::of(0u8..12), any::<bool>()).prop_map(|(distance, gate, optimal)| {
        MatchParams {
            max_distance_m: f64::from(distance),
            max_height_difference_m: gate.map(f64::from),
            rule: if optimal { MatchRule::Optimal } else { MatchRule::TallestFirst },
        }
    })
}

fn by_id(reference: &[Tree], detected: &[Tree], params: &MatchParams) -> BTreeMap<u64, u64> {
    let matching = match_trees(reference, detected, params).unwrap();
    let ids = matching.pairs.iter().map(|p| (reference[p.reference].id, detected[p.detected].id));
    ids.collect()
}

proptest! {
    #[test]
    fn one_to_one_and_within_the_limits(reference in trees(), detected in trees(), params in params()) {
        let matching = match_trees(&reference, &detected, &params).unwrap();
        let references: BTreeSet<usize> = matching.pairs.iter().map(|p| p.reference).collect();
        let detections: BTreeSet<usize> = matching.pairs.iter().map(|p| p.detected).collect();
        prop_assert_eq!(references.len(), matching.pairs.len());
        prop_assert_eq!(detections.len(), matching.pairs.len());
        prop_assert_eq!(references.len() + matching.missed.len(), reference.len());
        prop_assert_eq!(detections.len() + matching.false_alarms.len(), detected.len());
        for pair in &matching.pairs {
            let (r, d) = (&reference[pair.reference], &detected[pair.detected]);
            let distance = ((r.at_m[0] - d.at_m[0]).powi(2) + (r.at_m[1] - d.at_m[1]).powi(2)).sqrt();
            prop_assert!((distance - pair.distance_m).abs() < 1e-12 && distance <= params.max_distance_m);
            let gate = params.max_height_difference_m.unwrap_or(f64::INFINITY);
            prop_assert!((r.height_m - d.height_m).abs() <= gate);
        }
    }

    #[test]
    fn the_order_of_the_lists_does_not_matter(
        reference in trees(), detected in trees(), params in params(), seed in any::<u64>(),
    ) {
        let shuffled = |trees: &[Tree]| {
            let mut trees = trees.to_vec();
            trees.sort_by_key(|tree| (tree.id ^ seed).wrapping_mul(0x2545_F491_4F6C_DD1D));
            trees
        };
        let (other_reference, other_detected) = (shuffled(&reference), shuffled(&detected));
        prop_assert_eq!(
            by_id(&reference, &detected, &params),
            by_id(&other_reference, &other_detected, &params)
        );
        let assess = |r: &[Tree], d: &[Tree]| {
            let mut found = assess_trees(r, d, &params, &[9.0, 18.0]).unwrap();
            found.matching = timberline_evaluate::Matching::default();
            found
        };
        prop_assert_eq!(assess(&reference, &detected), assess(&other_reference, &other_detected));
    }

    #[test]
    fn optimal_is_never_worse(reference in trees(), detected in trees(), params in params()) {
        let run = |rule| {
            let matching = match_trees(&reference, &detected, &MatchParams { rule, ..params }).unwrap();
            let distance: f64 = matching.pairs.iter().map(|pair| pair.distance_m).sum();
            (matching.pairs.len(), distance)
        };
        let (greedy, optimal) = (run(MatchRule::TallestFirst), run(MatchRule::Optimal));
        prop_assert!(optimal.0 >= greedy.0);
        prop_assert!(optimal.0 > greedy.0 || optimal.1 <= greedy.1 + 1e-3);
    }

    #[test]
    fn a_list_against_itself_is_perfect(mut list in trees()) {
        // Two trees in one place would be each other's equal.
        list.sort_by(|a, b| a.at_m[0].total_cmp(&b.at_m[0]).then(a.at_m[1].total_cmp(&b.at_m[1])));
        list.dedup_by(|a, b| a.at_m == b.at_m);
        let found = assess_trees(&list, &list, &MatchParams::default(), &[9.0]).unwrap();
        prop_assert_eq!(found.all.recall(), (!list.is_empty()).then_some(1.0));
        prop_assert_eq!(found.position_m.max_abs, 0.0);
        let groups: usize = found.by_height.iter().map(|group| group.found).sum();
        prop_assert_eq!(groups, list.len());
    }

    #[test]
    fn statistics_are_ordered(mut errors in prop::collection::vec(-9f64..9.0, 1..60)) {
        let stats = ErrorStats::of(errors.clone());
        errors.reverse();
        prop_assert_eq!(stats, ErrorStats::of(errors));
        prop_assert!(stats.bias.abs() <= stats.rmse + 1e-12 && stats.rmse <= stats.max_abs + 1e-12);
        prop_assert!(stats.median_abs <= stats.p95_abs && stats.p95_abs <= stats.max_abs);
    }

    #[test]
    fn names_of_labels_do_not_matter(
        labels in prop::collection::vec((0u64..5, 0u64..5), 0..80),
    ) {
        let (reference, found): (Vec<u64>, Vec<u64>) = labels.into_iter().unzip();
        let renamed: Vec<u64> = found.iter().map(|&l| if l == 0 { 0 } else { 100 - l }).collect();
        let (a, b) = (assess_labels(&reference, &found).unwrap(), assess_labels(&reference, &renamed).unwrap());
        prop_assert_eq!((a.completeness, a.purity), (b.completeness, b.purity));
        prop_assert!(a.completeness <= 1.0 && a.purity <= 1.0 && a.mean_iou <= 1.0);
    }
}

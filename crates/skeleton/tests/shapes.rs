//! Accuracy on shapes whose axes are known.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

mod common;

use common::{Tube, fork, mean, missed, off_axis, scan, share_above, spruce};
use timberline_skeleton::{Method, Skeleton, SkeletonParams, skeleton};

fn of(points: &[[f64; 3]], params: &SkeletonParams) -> Skeleton {
    skeleton(points, None, None, params).unwrap().skeleton
}

fn bent() -> Vec<Tube> {
    let axis = (0..=24)
        .map(|i| {
            let angle = 0.05 * f64::from(i);
            [4.0 - 4.0 * libm::cos(angle), 0.0, 4.0 * libm::sin(angle)]
        })
        .collect();
    vec![Tube::new(axis, [0.12, 0.08])]
}

#[test]
fn a_bent_tube_is_one_branch_along_its_axis() {
    let tubes = bent();
    let found = of(&scan(&tubes, 4000.0, 0.004, 1), &SkeletonParams::default());
    assert_eq!(found.branches(), 1);
    let (off, lost) = (off_axis(&found, &tubes), missed(&tubes, &found));
    assert!(mean(&off) < 0.012, "{}", mean(&off));
    assert!(share_above(&off, 0.04) < 0.03 && share_above(&lost, 0.05) < 0.03);
}

#[test]
fn a_tube_seen_over_120_degrees_keeps_its_axis() {
    let mut tubes = bent();
    tubes[0].seen = [0.4, 0.4 + 2.0 * std::f64::consts::PI / 3.0];
    let found = of(&scan(&tubes, 6000.0, 0.004, 2), &SkeletonParams::default());
    assert_eq!(found.branches(), 1);
    let off = off_axis(&found, &tubes);
    // The mean of the points seen is 0.083 m off at a radius of 0.1 m.
    assert!(mean(&off) < 0.02, "{}", mean(&off));
    assert!(share_above(&off, 0.05) < 0.05, "{}", share_above(&off, 0.05));
}

#[test]
fn a_fork_has_two_arms_and_no_more() {
    let tubes = fork();
    let found = of(&scan(&tubes, 4000.0, 0.004, 3), &SkeletonParams::default());
    // The arms, and at most one stub on an open end.
    assert!((2..=3).contains(&found.branches()), "{}", found.branches());
    let (off, lost) = (off_axis(&found, &tubes), missed(&tubes, &found));
    assert!(mean(&off) < 0.015, "{}", mean(&off));
    assert!(share_above(&lost, 0.06) < 0.05, "{}", share_above(&lost, 0.06));
}

#[test]
fn a_spruce_has_its_branches_where_they_are() {
    let tubes = spruce();
    let points = scan(&tubes, 6000.0, 0.002, 4);
    let found = of(&points, &SkeletonParams { detail: 0.05, ..Default::default() });
    let (off, lost) = (off_axis(&found, &tubes), missed(&tubes, &found));
    // 49 axes: a stem, 24 branches, 24 twigs. Some sides of thin branches are branches of their own.
    assert!((49..=68).contains(&found.branches()), "{}", found.branches());
    assert!(mean(&off) < 0.012, "{}", mean(&off));
    assert!(share_above(&off, 0.03) < 0.08, "false: {}", share_above(&off, 0.03));
    assert!(share_above(&lost, 0.04) < 0.03, "missing: {}", share_above(&lost, 0.04));
}

#[test]
fn the_stem_goes_on_to_the_top_as_the_first_branch() {
    let found = of(&scan(&spruce(), 6000.0, 0.002, 4), &SkeletonParams::default());
    let run = &found.runs()[0];
    let top = found.nodes[run[run.len() - 1] as usize].position_m;
    assert!(top[2] > 9.8, "{top:?}");
    let sideways = |&node: &u32| {
        let [x, y, _] = found.nodes[node as usize].position_m;
        libm::hypot(x, y)
    };
    assert!(run.iter().map(sideways).fold(0.0, f64::max) < 0.06);
}

#[test]
fn radii_follow_the_stem() {
    let found = of(&scan(&spruce(), 6000.0, 0.002, 4), &SkeletonParams::default());
    let at = |z: f64| {
        let stem = &found.runs()[0];
        let near = stem.iter().skip(1).map(|&node| &found.nodes[node as usize]);
        let height = |node: &&timberline_skeleton::Node| (node.position_m[2] - z).abs();
        near.min_by(|a, b| height(a).total_cmp(&height(b))).unwrap().radius_m
    };
    assert!((at(1.3) - 0.106).abs() < 0.04, "{}", at(1.3));
    assert!(at(1.3) > at(5.0) && at(5.0) > at(9.0));
}

#[test]
fn leaves_do_not_move_the_axes() {
    let tubes = fork();
    let mut points = scan(&tubes, 4000.0, 0.003, 5);
    let wood = points.len();
    let mut random = common::seeded(6);
    for _ in 0..3000 {
        let mut at = || common::uniform(&mut random);
        let side = if at() < 0.5 { -1.0 } else { 1.0 };
        points.push([side * (0.2 + at()), at() - 0.5, 2.6 + 1.6 * at()]);
    }
    let likely: Vec<f32> = (0..points.len()).map(|i| if i < wood { 1.0 } else { 0.1 }).collect();
    let params = SkeletonParams { detail: 0.1, ..Default::default() };
    let found = skeleton(&points, Some(&likely), None, &params).unwrap().skeleton;
    let lost = missed(&tubes, &found);
    assert!(mean(&lost) < 0.025, "{}", mean(&lost));
    assert!(share_above(&lost, 0.08) < 0.05, "{}", share_above(&lost, 0.08));
}

#[test]
fn paths_keep_to_a_sparse_leader_beside_dense_twigs() {
    // A leader of few points, whose neighbourhoods therefore do not look like wood, and beside it twigs of
    // many that come back to it: shortest paths to which leaves were dear went over the twigs, and the
    // leader was a twig of them (an oak of the sample plot).
    let stem = Tube::new(vec![[0.0; 3], [0.0, 0.0, 2.0]], [0.09, 0.07]);
    let leader = Tube::new(vec![[0.0, 0.0, 2.0], [0.0, 0.0, 5.0]], [0.07, 0.04]);
    let twig = |side: f64| {
        let away = 0.5 * side;
        let axis = vec![
            [0.07 * side, 0.0, 1.9],
            [away, 0.0, 2.2],
            [away, 0.0, 4.0],
            [0.07 * side, 0.0, 4.2],
        ];
        Tube::new(axis, [0.008, 0.004])
    };
    let dense = scan(&[stem, twig(1.0), twig(-1.0)], 8000.0, 0.002, 8);
    let sparse = scan(&[leader], 500.0, 0.002, 9);
    let likely: Vec<f32> = dense.iter().map(|_| 1.0).chain(sparse.iter().map(|_| 0.1)).collect();
    let points: Vec<[f64; 3]> = dense.into_iter().chain(sparse).collect();
    let found =
        skeleton(&points, Some(&likely), None, &SkeletonParams::default()).unwrap().skeleton;
    let run = &found.runs()[0];
    let at = |node: &u32| found.nodes[*node as usize].position_m;
    let sideways = run.iter().map(at).map(|[x, y, _]| libm::hypot(x, y)).fold(0.0, f64::max);
    assert!(at(&run[run.len() - 1])[2] > 4.8 && sideways < 0.07, "{sideways}");
}

#[test]
fn more_detail_is_more_branches_and_less_distance() {
    let points = scan(&spruce(), 6000.0, 0.003, 7);
    let counts: Vec<usize> = [0.1, 1.0, 10.0]
        .map(|detail| of(&points, &SkeletonParams { detail, ..Default::default() }).branches())
        .to_vec();
    assert!(counts.is_sorted() && counts[2] > 2 * counts[0], "{counts:?}");
}

#[test]
fn adtree_finds_the_same_fork() {
    let tubes = fork();
    let params = SkeletonParams { method: Method::Adtree, ..Default::default() };
    let found = of(&scan(&tubes, 4000.0, 0.004, 3), &params);
    let (off, lost) = (off_axis(&found, &tubes), missed(&tubes, &found));
    assert!(found.branches() >= 2);
    // Vertices beyond half the height lie on the surface: that is part of the method.
    assert!(mean(&off) < 0.08 && mean(&lost) < 0.065, "{} {}", mean(&off), mean(&lost));
    let trunk = found.nodes[1].radius_m;
    assert!((trunk - 0.11).abs() < 0.02, "{trunk}");
}

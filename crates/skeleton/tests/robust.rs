//! What no cloud should do to a skeleton.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

mod common;

use common::{Point, add, fork, scan, spruce};
use timberline_skeleton::{
    Edges, Error, GraphKind, Method, Outcome, Skeleton, SkeletonParams, Tree, skeleton,
};

/// Every way to make a skeleton.
fn ways() -> Vec<SkeletonParams> {
    let adtree = |tree, edges| SkeletonParams {
        method: Method::Adtree,
        tree,
        edges,
        ..SkeletonParams::default()
    };
    vec![
        SkeletonParams::default(),
        SkeletonParams { detail: 20.0, ..SkeletonParams::default() },
        adtree(Tree::ShortestPaths, Edges::Auto),
        adtree(Tree::SpanningTree, Edges::Delaunay),
        adtree(Tree::ShortestPaths, Edges::Neighbours),
    ]
}

fn each(points: &[Point]) -> Vec<Outcome> {
    ways().iter().map(|params| skeleton(points, None, None, params).unwrap()).collect()
}

/// Parents come first, positions and radii are numbers, no point is counted twice.
fn check(outcome: &Outcome) {
    let Skeleton { nodes } = &outcome.skeleton;
    assert!(nodes.len() >= 2 && nodes[0].parent.is_none());
    for (place, node) in nodes.iter().enumerate() {
        assert!(place == 0 || node.parent.is_some_and(|parent| (parent as usize) < place));
        assert!(node.position_m.iter().all(|value| value.is_finite()), "{node:?}");
        assert!(node.radius_m.is_finite() && node.radius_m > 0.0, "{node:?}");
    }
    let counted: u64 = nodes.iter().map(|node| u64::from(node.points)).sum();
    assert!(counted <= outcome.report.points - outcome.report.not_finite);
    assert_eq!(outcome.skeleton.runs().len(), outcome.skeleton.branches());
}

#[test]
fn ten_points() {
    let points = scan(&fork(), 4000.0, 0.01, 1);
    for len in 2..=10 {
        each(&points[..len]).iter().for_each(check);
    }
}

#[test]
fn collinear_points() {
    let upright: Vec<Point> = (0..50).map(|i| [1.5, 2.5, 0.1 * f64::from(i)]).collect();
    let level: Vec<Point> = (0..50).map(|i| [0.1 * f64::from(i), 2.5, 1.0]).collect();
    for line in [upright, level] {
        for outcome in each(&line) {
            check(&outcome);
            assert_eq!(outcome.skeleton.branches(), 1);
            assert_eq!(outcome.report.graph, GraphKind::Neighbours);
        }
    }
}

#[test]
fn all_duplicates_are_refused_and_some_counted() {
    for params in ways() {
        let refused = skeleton(&[[3.0, 4.0, 5.0]; 40], None, None, &params);
        assert_eq!(refused, Err(Error::OnePosition { given: 40, at: [3.0, 4.0, 5.0] }));
        let mut points = scan(&fork(), 1000.0, 0.003, 2);
        let once = skeleton(&points, None, None, &params).unwrap();
        points.extend(points.clone());
        let twice = skeleton(&points, None, None, &params).unwrap();
        assert_eq!(twice.report.duplicates, points.len() as u64 / 2);
        let places = |outcome: &Outcome| -> Vec<Point> {
            outcome.skeleton.nodes.iter().map(|node| node.position_m).collect()
        };
        assert_eq!(places(&once), places(&twice));
    }
}

#[test]
fn positions_that_are_no_numbers_are_left_out_and_counted() {
    let clean = scan(&fork(), 1000.0, 0.003, 3);
    let mut points = clean.clone();
    points.insert(7, [f64::NAN, 0.0, 1.0]);
    points.push([0.0, f64::INFINITY, 1.0]);
    for (params, clean) in ways().iter().zip(each(&clean)) {
        let found = skeleton(&points, None, None, params).unwrap();
        assert_eq!(found.report.not_finite, 2);
        assert_eq!(found.skeleton, clean.skeleton);
    }
}

#[test]
fn an_empty_cloud_a_bad_base_and_bad_parameters_are_said() {
    let default = SkeletonParams::default();
    assert_eq!(
        skeleton(&[], None, None, &default),
        Err(Error::NoPoints { given: 0, not_finite: 0 })
    );
    let two = [[0.0; 3], [1.0; 3]];
    let base = skeleton(&two, None, Some([0.0, f64::NEG_INFINITY, 0.0]), &default);
    assert!(base.unwrap_err().to_string().contains("-inf"));
    let wood = skeleton(&two, Some(&[1.0; 3]), None, &default);
    assert_eq!(wood, Err(Error::WoodCount { points: 2, wood: 3 }));
    let params = SkeletonParams { detail: f64::NAN, ..default };
    assert!(skeleton(&two, None, None, &params).unwrap_err().to_string().contains("`detail`"));
}

#[test]
fn a_planar_wall() {
    let wall: Vec<Point> =
        (0..3600).map(|i| [0.05 * f64::from(i % 60), 2.0, 0.05 * f64::from(i / 60)]).collect();
    each(&wall).iter().for_each(check);
}

#[test]
fn the_second_tree_in_a_cloud_is_cut_off_and_counted() {
    let one = scan(&fork(), 2000.0, 0.003, 4);
    let mut both = one.clone();
    let second: Vec<Point> = one.iter().take(2500).map(|p| add(*p, [9.0, 0.0, 0.5])).collect();
    both.extend(&second);
    let found = skeleton(&both, None, None, &SkeletonParams::default()).unwrap();
    check(&found);
    assert_eq!(found.report.cut_off, second.len() as u64);
    assert_eq!(found.report.pieces_cut_off, 1);
    assert!(found.skeleton.nodes.iter().all(|node| node.position_m[0] < 1.5));
    let base = Some([9.0, 0.0, 0.5]);
    let other = skeleton(&both, None, base, &SkeletonParams::default()).unwrap();
    assert_eq!(other.report.cut_off, one.len() as u64);
    assert!(other.skeleton.nodes.iter().all(|node| node.position_m[0] > 7.5));
}

#[test]
fn far_noise_has_no_branch_and_a_gap_in_the_stem_is_bridged() {
    let mut points = scan(&spruce(), 4000.0, 0.003, 5);
    let before = points.len();
    // No echo from 1 m of the stem, as behind a neighbour.
    points.retain(|p| !(1.2..2.2).contains(&p[2]));
    assert!(points.len() < before);
    points.extend([[6.0, 6.0, 4.0], [6.02, 6.0, 4.0], [-5.0, 3.0, 9.0], [0.0, 0.0, 16.0]]);
    let found = skeleton(&points, None, None, &SkeletonParams::default()).unwrap();
    assert_eq!(found.report.cut_off, 4);
    let run = &found.skeleton.runs()[0];
    let top = found.skeleton.nodes[run[run.len() - 1] as usize].position_m[2];
    assert!((9.8..10.2).contains(&top), "{top}");
}

#[test]
fn a_tree_without_its_lower_stem_begins_where_its_points_do() {
    let mut points = scan(&spruce(), 4000.0, 0.003, 6);
    points.retain(|p| p[2] > 2.0);
    let base = Some([0.0; 3]);
    let found = skeleton(&points, None, base, &SkeletonParams::default()).unwrap();
    check(&found);
    let foot = found.skeleton.nodes[0].position_m;
    assert!(libm::hypot(foot[0], foot[1]) < 0.08, "{foot:?}");
}

#[test]
fn shuffled_points_give_the_same_skeleton() {
    let points = scan(&spruce(), 800.0, 0.003, 7);
    let mut shuffled = points.clone();
    let mut random = common::seeded(8);
    for i in (1..shuffled.len()).rev() {
        shuffled.swap(i, (common::uniform(&mut random) * (i + 1) as f64) as usize);
    }
    assert_ne!(points, shuffled);
    for (a, b) in each(&points).iter().zip(each(&shuffled)) {
        assert_eq!(a, &b);
    }
}

#[test]
fn a_shift_by_whole_metres_shifts_the_skeleton() {
    let lattice = |p: &Point| p.map(|value| (value * 10_000.0).round() / 10_000.0);
    let points: Vec<Point> = scan(&spruce(), 800.0, 0.003, 9).iter().map(lattice).collect();
    let by = [500_000.0, 5_000_000.0, 1000.0];
    let shifted: Vec<Point> = points.iter().map(|p| add(*p, by)).collect();
    for (a, b) in each(&points).iter().zip(each(&shifted)) {
        let moved = a.skeleton.nodes.iter().map(|node| add(node.position_m, by));
        assert!(moved.eq(b.skeleton.nodes.iter().map(|node| node.position_m)));
        let rest = |o: &Outcome| -> Vec<(Option<u32>, u64, u32)> {
            let nodes = &o.skeleton.nodes;
            nodes.iter().map(|n| (n.parent, n.radius_m.to_bits(), n.points)).collect()
        };
        assert_eq!(rest(a), rest(&b));
    }
}

#[test]
fn one_and_two_threads_give_the_same_skeleton() {
    let points = scan(&spruce(), 1500.0, 0.003, 10);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| each(&points))
    };
    assert_eq!(with(1), with(2));
}

//! Consolidation on shapes whose surface is known, and on input that is no tree.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test may stop at what it did not expect, and tells what it measured"
)]

use timberline_wlop::{Consolidated, ConsolidationParams, Method, Skipped, Tree, consolidate};

/// A repeatable number in 0 to 1 (SplitMix64, Steele et al. 2014).
fn uniform(seed: u64) -> f64 {
    let mut v = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    v = (v ^ (v >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((v ^ (v >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A standard normal number (Box and Muller 1958).
fn normal(seed: u64) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - uniform(2 * seed))).sqrt();
    radius * libm::cos(std::f64::consts::TAU * uniform(2 * seed + 1))
}

/// Points at random on an upright cylinder around (0.5, 0.5), with noise across its surface.
fn cylinder(radius_m: f64, spacing_m: f64, length_m: f64, noise_m: f64) -> Vec<[f64; 3]> {
    let count = std::f64::consts::TAU * radius_m * length_m / (spacing_m * spacing_m);
    let point = |i: u64| {
        let (angle, z) = (std::f64::consts::TAU * uniform(9 * i), length_m * uniform(9 * i + 1));
        let radius = radius_m + noise_m * normal(9 * i + 2);
        [0.5 + radius * libm::cos(angle), 0.5 + radius * libm::sin(angle), z]
    };
    (0..count as u64).map(point).collect()
}

fn run(points_m: &[[f64; 3]], params: &ConsolidationParams) -> Consolidated {
    let tree = Tree { points_m, base_m: [0.5, 0.5, 0.0], dbh_m: None };
    consolidate(&tree, params).unwrap()
}

/// Mean and standard deviation of the distance from the axis, away from the ends.
fn radius(positions: &[[f64; 3]], length_m: f64) -> [f64; 2] {
    let inner = positions.iter().filter(|p| (0.1 * length_m..0.9 * length_m).contains(&p[2]));
    let radii: Vec<f64> =
        inner.map(|p| ((p[0] - 0.5) * (p[0] - 0.5) + (p[1] - 0.5) * (p[1] - 0.5)).sqrt()).collect();
    let mean = radii.iter().sum::<f64>() / radii.len() as f64;
    let variance = radii.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>() / radii.len() as f64;
    [mean, variance.sqrt()]
}

#[test]
fn a_noisy_thin_trunk_keeps_its_radius() {
    let points = cylinder(0.07, 0.015, 2.0, 0.01);
    let done = run(&points, &ConsolidationParams::default());
    assert_eq!(done.skipped, None);
    let moved: Vec<[f64; 3]> =
        done.positions_m.iter().zip(&done.moved).filter(|(_, m)| **m).map(|(p, _)| *p).collect();
    let ([before, noise], [after, left]) = (radius(&points, 2.0), radius(&moved, 2.0));
    let share = moved.len() as f64 / points.len() as f64;
    println!(
        "radius {before:.4} -> {after:.4} m, noise {noise:.4} -> {left:.4} m, {share:.2} moved"
    );
    assert!((after / 0.07 - 1.0).abs() < 0.03, "{after}");
    assert!(left < 0.9 * noise && share > 0.5, "{noise} {left} {share}");
    assert!(done.effect.thickness_after_m < done.effect.thickness_before_m);
    assert!(done.effect.distance_after_m <= done.effect.distance_before_m);
}

#[test]
fn a_well_scanned_trunk_becomes_thinner() {
    let points = cylinder(0.15, 0.006, 1.0, 0.004);
    let done = run(&points, &ConsolidationParams::default());
    assert!(done.stem.iter().filter(|s| **s).count() * 10 > done.stem.len() * 9);
    let ([_, noise], [after, left]) = (radius(&points, 1.0), radius(&done.positions_m, 1.0));
    assert!((after / 0.15 - 1.0).abs() < 0.01, "{after}");
    assert!(left < 0.75 * noise, "{noise} {left}");
}

#[test]
fn a_twig_as_thin_as_the_spacing_is_left_alone() {
    let points = cylinder(0.01, 0.01, 3.0, 0.002);
    let done = run(&points, &ConsolidationParams::default());
    assert!(matches!(done.skipped, Some(Skipped::Sparse { .. })), "{:?}", done.skipped);
    // Beside a trunk, too.
    let trunk = cylinder(0.15, 0.006, 1.0, 0.004);
    let twig: Vec<[f64; 3]> = points.iter().map(|p| [p[0] + 3.0, p[1], p[2]]).collect();
    let done = run(&[trunk, twig].concat(), &ConsolidationParams::default());
    let mut twigs = done.positions_m.iter().zip(&done.moved).filter(|(p, _)| p[0] > 2.0);
    assert!(twigs.all(|(_, moved)| !moved));
    assert!(done.moved.contains(&true));
}

#[test]
fn what_is_smooth_already_is_skipped() {
    let points = cylinder(0.15, 0.008, 1.0, 0.0003);
    let done = run(&points, &ConsolidationParams::default());
    let why = done.skipped.unwrap();
    assert!(matches!(why, Skipped::Thin { .. }), "{why}");
    assert!(why.to_string().contains("`noise_floor_m` = 1.50 mm"), "{why}");
    assert!(done.positions_m.is_empty() && done.effect.thickness_before_m < 0.0015);
}

#[test]
fn too_large_a_radius_is_noticed_and_undone() {
    let points = cylinder(0.07, 0.015, 2.0, 0.01);
    let wide = ConsolidationParams {
        radius_spacings: 30.0,
        branch_radius_share: 3.0,
        ..ConsolidationParams::default()
    };
    // Three radii of the trunk wide, the operator draws its points together at its axis.
    let done = run(&points, &wide);
    let Some(Skipped::Farther { before_m, after_m }) = done.skipped else {
        panic!("{:?} {:?}", done.skipped, done.effect)
    };
    assert!(after_m > 1.2 * before_m && done.positions_m.is_empty(), "{before_m} {after_m}");
    // The same points with the radius that suits them.
    let suited = run(&points, &ConsolidationParams::default());
    assert!(suited.skipped.is_none() && suited.effect.distance_after_m <= before_m);
    // The paper's mode takes it, and says what it did.
    let paper = run(&points, &ConsolidationParams::paper());
    assert_eq!(paper.skipped, None);
    assert!(paper.moved.iter().all(|m| *m));
    let kept = paper.positions_m.len() as f64 / points.len() as f64;
    assert!((kept - 0.5).abs() < 0.01, "{kept}");
    assert!(paper.effect.distance_before_m > 0.0);
}

#[test]
fn input_that_is_no_tree_has_a_clear_outcome() {
    let params = ConsolidationParams::default();
    let line: Vec<[f64; 3]> = (0..3000).map(|i| [0.5, 0.5, f64::from(i) * 0.001]).collect();
    let wall = |i: u32| {
        [f64::from(i % 100) * 0.01, 0.003 * normal(u64::from(i)), f64::from(i / 100) * 0.01]
    };
    let wall: Vec<[f64; 3]> = (0..10_000).map(wall).collect();
    let heap = vec![[0.5; 3]; 5000];
    for (name, points) in [("empty", &[][..]), ("ten", &wall[..10]), ("duplicates", &heap)] {
        let done = run(points, &params);
        assert!(
            matches!(done.skipped, Some(Skipped::FewPoints { .. })),
            "{name}: {:?}",
            done.skipped
        );
    }
    assert!(matches!(run(&line, &params).skipped, Some(Skipped::Sparse { .. })));
    let done = run(&wall, &params);
    assert!(done.skipped.is_none() && done.effect.thickness_after_m < 0.0015, "{:?}", done.effect);
    let none = ConsolidationParams { method: Method::None, ..params.clone() };
    assert_eq!(run(&wall, &none).skipped, Some(Skipped::NotAsked));
    let paper =
        run(&heap[..1], &ConsolidationParams { min_points: 10, ..ConsolidationParams::paper() });
    assert!(paper.skipped.is_some());
    let broken = [[0.0, 0.0, f64::INFINITY]];
    let tree = Tree { points_m: &broken, base_m: [0.0; 3], dbh_m: None };
    assert!(consolidate(&tree, &params).unwrap_err().to_string().contains("z = inf m"));
}

#[test]
fn a_lone_far_point_disturbs_nothing() {
    let mut points = cylinder(0.15, 0.008, 1.0, 0.004);
    let before = run(&points, &ConsolidationParams::default());
    points.push([900.0, -2000.0, 50.0]);
    let after = run(&points, &ConsolidationParams::default());
    assert_eq!(after.positions_m.iter().filter(|p| p[0] < 10.0).count(), before.positions_m.len());
    let far = after.positions_m.iter().position(|p| p[0] > 10.0).unwrap();
    assert_eq!((after.positions_m[far], after.moved[far]), ([900.0, -2000.0, 50.0], false));
}

#[test]
fn order_duplicates_and_threads_change_nothing() {
    let points = cylinder(0.12, 0.01, 0.5, 0.005);
    for params in [ConsolidationParams::default(), ConsolidationParams::paper()] {
        let on = |threads: usize, points: &[[f64; 3]]| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| run(points, &params))
        };
        let one = on(1, &points);
        assert_eq!(one, on(2, &points));
        let mut other: Vec<[f64; 3]> = points.iter().rev().copied().collect();
        other.extend_from_slice(&points[..50]);
        let two = on(2, &other);
        assert_eq!(one.positions_m, two.positions_m);
        assert_eq!((&one.moved, &one.stem, one.effect), (&two.moved, &two.stem, two.effect));
        assert!(
            two.origins
                .iter()
                .zip(&one.origins)
                .all(|(&t, &o)| other[t as usize] == points[o as usize])
        );
    }
}

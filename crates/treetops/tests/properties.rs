//! The detection against its definition, point by point, and its independence of frame, order and tile.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "these are tests"
)]

use proptest::prelude::*;
use timberline_pointcloud::{Frame, Point, PointCloud, frame, order};
use timberline_treetops::{Input, Method, Params, RankBy, Returns, Treetop, WindowKind, find};

/// Many equal heights and coordinates: x, y in decimetres, z in metres, return number.
type Raw = (i32, i32, i32, u8);

fn raw_points(most: usize) -> impl Strategy<Value = Vec<Raw>> {
    prop::collection::vec((0i32..120, 0i32..120, 0i32..9, 0u8..4), 1..most)
}

fn cloud_of(raw: &[Raw], origin_m: [i64; 3]) -> (PointCloud, Vec<f32>) {
    let mut cloud = PointCloud::new(Frame::new(origin_m));
    for &(x, y, z, return_number) in raw {
        let world =
            [f64::from(x) * 0.1 + 4_997.0, f64::from(y) * 0.1 + 8_192.0, f64::from(z) + 100.0];
        let world = world.map(frame::quantise);
        cloud.push_world(world, &Point { return_number, ..Point::default() });
    }
    // Ground falls to the east, so that height and elevation rank differently.
    let height_m = raw.iter().map(|p| p.2 as f32 + 0.25 * (p.0 / 10) as f32).collect();
    (cloud, height_m)
}

fn all_params() -> impl Strategy<Value = Params> {
    let window =
        prop_oneof![Just(WindowKind::Variable), Just(WindowKind::Circle), Just(WindowKind::Square)];
    (window, 6u32..40, 0u32..4, any::<bool>(), any::<bool>()).prop_map(
        |(window, size, support_points, first, elevation)| Params {
            window,
            window_m: f64::from(size) * 0.1,
            window_base_m: f64::from(size) * 0.05,
            window_per_height: 0.2,
            window_max_m: 4.0,
            returns: if first { Returns::First } else { Returns::All },
            rank_by: if elevation { RankBy::Elevation } else { RankBy::Height },
            min_prominence_m: 0.0,
            support_points,
            support_radius_m: 1.5,
            ..Params::by_window()
        },
    )
}

/// By evidence, with a halo shorter than the 12 m over which the points lie.
fn by_evidence(params: Params) -> Params {
    let params = Params { method: Method::Evidence, min_score: 0.0, max_height_m: 15.0, ..params };
    assert!(params.halo_m() < 8.0, "{}", params.halo_m());
    params
}

/// The definition of a treetop, with no cells and no short cuts.
fn by_definition(cloud: &PointCloud, height_m: &[f32], params: &Params) -> Vec<u32> {
    let rank = |i: usize| match params.rank_by {
        RankBy::Height => f64::from(height_m[i]),
        RankBy::Elevation => cloud.z[i],
    };
    let metres = |a: f64, b: f64| ((a - b) * 1e4).round() / 1e4;
    let supported = |i: usize| {
        let near = |j: &usize| {
            let d = [0, 1, 2].map(|axis| cloud.local(i)[axis] - cloud.local(*j)[axis]);
            *j != i && d.iter().map(|v| v * v).sum::<f64>() <= params.support_radius_m.powi(2)
        };
        (0..cloud.len()).filter(near).count() >= params.support_points as usize
    };
    let supported: Vec<bool> = (0..cloud.len()).map(supported).collect();
    let is_top = |&i: &usize| {
        let size = match params.window {
            WindowKind::Variable => (params.window_base_m
                + params.window_per_height * f64::from(height_m[i]))
            .min(params.window_max_m),
            _ => params.window_m,
        };
        let half = (size / 2.0 * 1e9).round() / 1e9;
        let inside = |j: usize| {
            let (dx, dy) = (metres(cloud.x[j], cloud.x[i]), metres(cloud.y[j], cloud.y[i]));
            match params.window {
                WindowKind::Square => dx.abs().max(dy.abs()) <= half,
                _ => dx * dx + dy * dy <= half * half,
            }
        };
        let outranks = |j: usize| {
            let tie = order::compare(cloud, j, i).then(j.cmp(&i)).is_lt();
            rank(j) > rank(i) || (rank(j) == rank(i) && tie)
        };
        let return_fits = params.returns == Returns::All || cloud.return_number[i] <= 1;
        supported[i]
            && return_fits
            && f64::from(height_m[i]) >= params.min_height_m
            && !(0..cloud.len()).any(|j| j != i && supported[j] && inside(j) && outranks(j))
    };
    let mut tops: Vec<usize> = (0..cloud.len()).filter(is_top).collect();
    tops.sort_by(|&a, &b| order::compare(cloud, a, b));
    tops.into_iter().map(|i| i as u32).collect()
}

/// A window of known size whose border runs between lattice positions, so that both formulas agree on the border.
fn off_lattice(mut params: Params) -> Params {
    params.window_min_spacings = 0.0;
    params.window_m += 0.013;
    params.window_base_m += 0.013;
    params
}

fn positions(tops: &[Treetop]) -> Vec<([f64; 3], [u64; 5])> {
    let bits = |t: &Treetop| {
        [t.height_m, t.window_m, t.prominence_m, t.score, t.cover_m].map(f64::to_bits)
    };
    tops.iter().map(|t| (t.world_m, bits(t))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn as_defined(raw in raw_points(200), params in all_params()) {
        let params = off_lattice(params);
        let (cloud, height_m) = cloud_of(&raw, [4_990, 8_000, 90]);
        let found = find(&Input::new(&cloud, &height_m), &params).unwrap();
        let found: Vec<u32> = found.into_iter().map(|top| top.index).collect();
        prop_assert_eq!(found, by_definition(&cloud, &height_m, &params));
    }

    #[test]
    fn frame_and_order_do_not_matter(raw in raw_points(200), params in all_params(), shift in -900i64..900) {
        let method = if raw.len() % 2 == 0 { Method::Evidence } else { Method::Window };
        let params = Params { method, min_score: 0.0, min_prominence_m: 0.5, ..params };
        let mut reversed = raw.clone();
        reversed.reverse();
        let (first, first_height) = cloud_of(&raw, [0, 0, 0]);
        let (second, second_height) = cloud_of(&reversed, [shift, -shift, shift / 3]);
        let first = find(&Input::new(&first, &first_height), &params).unwrap();
        let second = find(&Input::new(&second, &second_height), &params).unwrap();
        prop_assert_eq!(positions(&first), positions(&second));
    }

    #[test]
    fn only_the_halo_matters(
        raw in raw_points(250),
        params in all_params(),
        evidence in any::<bool>(),
        edge in 0i32..120,
    ) {
        let params = Params { min_prominence_m: 0.5, prominence_reach_m: 1.0, ..params };
        let params = if evidence { by_evidence(params) } else { params };
        let (cloud, height_m) = cloud_of(&raw, [0, 0, 0]);
        let whole = find(&Input::new(&cloud, &height_m), &params).unwrap();
        let border = f64::from(edge) * 0.1 + 4_997.0;
        let near: Vec<u32> = (0..cloud.len() as u32)
            .filter(|&i| cloud.x[i as usize] <= border + params.halo_m())
            .collect();
        let near_height: Vec<f32> = near.iter().map(|&i| height_m[i as usize]).collect();
        let part = cloud.select(&near);
        let part = find(&Input::new(&part, &near_height), &params).unwrap();
        let own = |tops: &[Treetop]| {
            let tops: Vec<Treetop> = tops.iter().filter(|t| t.world_m[0] < border).copied().collect();
            positions(&tops)
        };
        prop_assert_eq!(own(&whole), own(&part));
    }
}

fn column(points: &[(f64, f64, Point)]) -> (PointCloud, Vec<f32>) {
    let mut cloud = PointCloud::new(Frame::new([0, 0, 0]));
    points.iter().for_each(|(x, z, point)| cloud.push_world([*x, 0.25, *z], point));
    let height_m = cloud.z.iter().map(|&z| z as f32).collect();
    (cloud, height_m)
}

/// The same points in several rows, the lower the farther aside.
fn rows(points: &[(f64, f64, Point)]) -> (PointCloud, Vec<f32>) {
    let mut cloud = PointCloud::new(Frame::new([0, 0, 0]));
    for row in -4i32..=4 {
        let (y, lower) = (0.25 + 0.5 * f64::from(row), 0.5 * f64::from(row * row));
        points.iter().for_each(|(x, z, point)| cloud.push_world([*x, y, z - lower], point));
    }
    let height_m = cloud.z.iter().map(|&z| z as f32).collect();
    (cloud, height_m)
}

fn tops_x(points: &[(f64, f64, Point)], params: &Params) -> Vec<f64> {
    let (cloud, height_m) = column(points);
    let tops = find(&Input::new(&cloud, &height_m), params).unwrap();
    tops.iter().map(|top| top.world_m[0]).collect()
}

/// Points every quarter metre along a profile of heights.
fn profile(heights: &[f64]) -> Vec<(f64, f64, Point)> {
    let at = |(i, &z): (usize, &f64)| (i as f64 * 0.25 + 0.1, z, Point::default());
    heights.iter().enumerate().map(at).collect()
}

#[test]
fn return_number_zero_counts_as_first() {
    let point = |return_number| Point { return_number, ..Point::default() };
    let points = [(0.0, 5.0, point(0)), (10.0, 5.0, point(1)), (20.0, 5.0, point(2))];
    assert_eq!(tops_x(&points, &Params::paper()), [0.0, 10.0]);
    assert_eq!(tops_x(&points, &Params::fixed_circle(3.0)), [0.0, 10.0, 20.0]);
}

#[test]
fn ground_and_noise_are_no_treetops() {
    let point = |classification| Point { classification, ..Point::default() };
    let points = [
        (0.0, 5.0, point(2)),
        (10.0, 5.0, point(7)),
        (20.0, 5.0, point(18)),
        (30.0, 5.0, point(5)),
        (30.5, 50.0, point(18)),
    ];
    assert_eq!(tops_x(&points, &Params::fixed_circle(3.0)), [30.0]);
}

#[test]
fn a_ground_mask_replaces_the_classes() {
    let (cloud, height_m) = column(&[(0.0, 5.0, Point::default()), (9.0, 5.0, Point::default())]);
    let input = Input { cloud: &cloud, height_m: &height_m, ground: Some(&[true, false]) };
    let tops = find(&input, &Params::paper()).unwrap();
    assert_eq!(tops.iter().map(|top| top.index).collect::<Vec<_>>(), [1]);
}

#[test]
fn a_lone_point_above_a_crown_neither_counts_nor_hides_it() {
    let mut points = profile(&[8.0, 9.0, 10.0, 9.0, 8.0]);
    points.push((0.7, 40.0, Point::default()));
    assert_eq!(tops_x(&points, &Params::by_window()), [0.6]);
    let any = Params { min_score: 0.0, ..Params::default() };
    assert_eq!(tops_x(&points, &any), [0.6]);
    assert_eq!(tops_x(&points, &Params::fixed_circle(3.0)), [0.7]);
}

#[test]
fn prominence_is_the_descent_to_the_way_to_something_higher() {
    let heights = [4.0, 12.0, 12.0, 12.0, 9.0, 9.0, 9.0, 9.0, 11.0, 11.5, 11.0, 11.0, 5.0];
    let (cloud, height_m) = rows(&profile(&heights));
    let params = Params { support_points: 0, ..Params::fixed_circle(1.0) };
    let tops = find(&Input::new(&cloud, &height_m), &params).unwrap();
    let found: Vec<(f64, f64)> = tops.iter().map(|t| (t.height_m, t.prominence_m)).collect();
    assert_eq!(found, [(12.0, 12.0), (11.5, 2.5)]);
    let strict = Params { min_prominence_m: 3.0, ..params };
    assert_eq!(find(&Input::new(&cloud, &height_m), &strict).unwrap().len(), 1);
}

#[test]
fn wrong_input_is_named() {
    let (cloud, _) = column(&[(0.0, 5.0, Point::default())]);
    let error = find(&Input::new(&cloud, &[]), &Params::default()).unwrap_err();
    assert_eq!(error.to_string(), "`height_m` has 0 values for 1 points");
    let params = Params { window_m: -1.0, ..Params::default() };
    let error = find(&Input::new(&cloud, &[5.0]), &params).unwrap_err();
    assert!(error.to_string().contains("`window_m` is -1"), "{error}");
}

#[test]
fn unknown_heights_do_not_take_part() {
    let (cloud, _) = column(&[(0.0, 9.0, Point::default()), (0.5, 8.0, Point::default())]);
    let tops = find(&Input::new(&cloud, &[f32::NAN, 8.0]), &Params::fixed_circle(3.0)).unwrap();
    assert_eq!(tops.iter().map(|top| top.index).collect::<Vec<_>>(), [1]);
}

#[test]
fn no_points_no_treetops() {
    let cloud = PointCloud::default();
    assert_eq!(find(&Input::new(&cloud, &[]), &Params::default()).unwrap(), []);
}

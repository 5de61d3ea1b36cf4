//! The terrain does not depend on frames, tiles or the order of points.

#![allow(clippy::unwrap_used, reason = "these are tests")]

mod forest;

use forest::{ORIGIN, cloud_of, forest, ground, hash01, terrain};
use proptest::prelude::*;
use timberline_ground::{DtmParams, GroundParams, Label, Nodes, Source, Surface, Tuning, classify};
use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::{Frame, Point, PointCloud, Rect};

fn square(low: f64, high: f64) -> Rect {
    Rect { min: ORIGIN.map(|v| v + low), max: ORIGIN.map(|v| v + high) }
}

fn bits(surface: &Surface, at: &[[f64; 2]]) -> Vec<u64> {
    surface.elevations(at).iter().map(|z| z.to_bits()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]
    #[test]
    fn a_part_of_the_campaign_gives_the_same_elevations(corner in (30f64..150., 30f64..150.)) {
        let points = ground(3000, 240.0);
        let params = DtmParams::default();
        let whole = Surface::build(&Nodes::new(points.iter().copied(), params.merge_m), square(0.0, 240.0), &params).unwrap();
        let tile = Rect { min: [ORIGIN[0] + corner.0.floor(), ORIGIN[1] + corner.1.floor()], max: [ORIGIN[0] + corner.0.floor() + 23.0, ORIGIN[1] + corner.1.floor() + 31.0] };
        let near = tile.grown(params.reach_m());
        let part = points.iter().rev().copied().filter(|p| near.contains(p[0], p[1]));
        let part = Surface::build(&Nodes::new(part, params.merge_m), tile, &params).unwrap();
        let at: Vec<[f64; 2]> = (0..200).map(|i| [tile.min[0] + 23.0 * hash01(i), tile.min[1] + 31.0 * hash01(i + 9999)]).collect();
        prop_assert_eq!(bits(&whole, &at), bits(&part, &at));
    }
}

#[test]
fn every_ground_point_is_met_without_smoothing() {
    let points = ground(2500, 120.0);
    let params = DtmParams {
        tuning: Tuning::Given,
        offset_m: 0.6,
        smoothing_m: 0.0,
        merge_m: 0.0,
        ..Default::default()
    };
    let surface =
        Surface::build(&Nodes::new(points.iter().copied(), 0.0), square(0.0, 120.0), &params)
            .unwrap();
    for p in &points {
        let error = surface.at([p[0], p[1]]) - p[2];
        assert!(error.abs() < 1e-6, "{error} m at {p:?}");
    }
}

#[test]
fn a_plane_is_a_plane() {
    let plane = |p: &[f64; 3]| 640.0 + 0.5 * (p[0] - ORIGIN[0]) - 0.25 * (p[1] - ORIGIN[1]);
    let mut points = ground(1500, 120.0);
    points.iter_mut().for_each(|p| {
        // Multiples of 1/125 m, where the plane lies on the lattice of positions.
        p[0] = quantise((p[0] * 125.0).round() / 125.0);
        p[1] = quantise((p[1] * 125.0).round() / 125.0);
        p[2] = quantise(plane(p));
    });
    let params = DtmParams { merge_m: 0.0, ..DtmParams::default() };
    let surface =
        Surface::build(&Nodes::new(points.into_iter(), 0.0), square(0.0, 120.0), &params).unwrap();
    for i in 0..500 {
        let p = [ORIGIN[0] + 120.0 * hash01(i), ORIGIN[1] + 120.0 * hash01(i + 7777), 0.0];
        assert!((surface.at([p[0], p[1]]) - plane(&p)).abs() < 1e-6);
    }
}

#[test]
fn there_is_no_terrain_far_from_ground() {
    let params = DtmParams { max_distance_m: 12.0, ..DtmParams::default() };
    let points = ground(4000, 120.0);
    let left = points.into_iter().filter(|p| p[0] < ORIGIN[0] + 60.0);
    let surface = Surface::build(&Nodes::new(left, 0.1), square(0.0, 120.0), &params).unwrap();
    assert!(surface.at([ORIGIN[0] + 62.0, ORIGIN[1] + 50.0]).is_finite());
    assert!(surface.at([ORIGIN[0] + 80.0, ORIGIN[1] + 50.0]).is_nan());
}

#[test]
fn labels_do_not_depend_on_frame_tile_or_order() {
    let points = forest(60_000, 200.0);
    let params = GroundParams { source: Source::Classify, ..GroundParams::default() };
    let near = cloud_of(&points, Frame::new([481_200, 3_813_000, 800]));
    let reversed: Vec<[f64; 3]> = points.iter().rev().copied().collect();
    let far = cloud_of(&reversed, Frame::new([480_003, 3_812_911, 0]));
    let whole = classify(&near, square(0.0, 200.0), &params).unwrap();
    let tile = square(37.0, 121.0);
    let part = classify(&far, tile, &params).unwrap();
    for i in 0..near.len() {
        let world = near.world(i);
        assert_eq!(world, far.world(i));
        let expected = if tile.contains(world[0], world[1]) { whole[i] } else { Label::Other };
        assert_eq!(part[i], expected, "{world:?}");
    }
}

#[test]
fn ground_is_found_on_a_steep_slope_under_forest_with_outliers() {
    let points = forest(60_000, 200.0);
    let params = GroundParams { source: Source::Classify, ..GroundParams::default() };
    let cloud = cloud_of(&points, Frame::new([481_200, 3_813_000, 0]));
    let labels = classify(&cloud, square(0.0, 200.0), &params).unwrap();
    let (mut found, mut all, mut wrong) = (0, 0, 0);
    for (i, label) in labels.iter().enumerate() {
        let [x, y, z] = cloud.world(i);
        let is_ground = (z - terrain(x - ORIGIN[0], y - ORIGIN[1])).abs() < 0.1;
        all += usize::from(is_ground);
        found += usize::from(is_ground && *label == Label::Classified);
        wrong += usize::from(!is_ground && *label == Label::Classified);
    }
    assert!(f64::from(found as u32) > 0.9 * f64::from(all as u32), "{found} of {all}");
    assert!(wrong <= 3, "{wrong} points are no ground");
}

#[test]
fn supplied_classes_are_used_where_they_cover_the_area() {
    let points = forest(30_000, 128.0);
    let mut cloud = PointCloud::new(Frame::new([481_200, 3_813_000, 0]));
    for world in &points {
        let is_ground =
            (world[2] - terrain(world[0] - ORIGIN[0], world[1] - ORIGIN[1])).abs() < 0.1;
        let classification = if is_ground { 2 } else { 1 };
        cloud.push_world(*world, &Point { classification, ..Point::default() });
    }
    let labels = classify(&cloud, square(0.0, 128.0), &GroundParams::default()).unwrap();
    for (label, class) in labels.iter().zip(&cloud.classification) {
        assert_eq!(*label == Label::Supplied, *class == 2);
    }
}

//! Accuracy of the terrain model on real scans.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "these are tests"
)]

mod common;

use common::{Scan, hash01, rms};
use timberline_ground::tin::Tin;
use timberline_ground::{DtmParams, Nodes, Surface};
use timberline_pointcloud::Rect;

fn rect_of(points: &[[f64; 3]]) -> Rect {
    let mut rect = Rect::EMPTY;
    for p in points {
        rect = rect.union(&Rect { min: [p[0], p[1]], max: [p[0], p[1]] });
    }
    rect
}

fn errors_at(surface: &Surface, at: &[[f64; 3]]) -> Vec<f64> {
    at.iter().map(|p| surface.at([p[0], p[1]]) - p[2]).collect()
}

fn cross_validated(points: &[[f64; 3]], params: &DtmParams) -> f64 {
    let rect = rect_of(points);
    let mut errors = Vec::new();
    for fold in 0..5 {
        let held = |i: usize| (hash01(i) * 5.0) as usize == fold;
        let (mut train, mut test) = (Vec::new(), Vec::new());
        for (i, p) in points.iter().enumerate() {
            if held(i) { test.push(*p) } else { train.push(*p) }
        }
        let nodes = Nodes::new(train.into_iter(), params.merge_m);
        let surface = Surface::build(&nodes, rect, params).unwrap();
        errors.extend(errors_at(&surface, &test));
    }
    let (rmse, missing) = rms(&errors);
    assert_eq!(missing, 0);
    rmse
}

/// 5-fold cross-validation at the supplier's ground points with automatic kernels. The linear
/// triangulation has 0.196, 0.125 and 0.066 m.
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn cross_validated_error() {
    let params = DtmParams::default();
    for (name, most) in [
        ("lidR/Topography.laz", 0.157),
        ("lasR_bcts/bcts_4.laz", 0.109),
        ("lasR_bcts/bcts_1.laz", 0.060),
    ] {
        let rmse = cross_validated(&Scan::read(name).supplier_ground(), &params);
        println!("{name}: {rmse:.4} m (at most {most})");
        assert!(rmse <= most, "{name}: {rmse}");
    }
}

/// Errors in discs without any ground point, like those under crowns, against the linear
/// triangulation of the same points (which discs are drawn matters more than the method).
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn error_in_removed_discs() {
    let points = Scan::read("lidR/Topography.laz").supplier_ground();
    for (radius, discs, share) in [(2.5, 400, 0.90), (5.0, 200, 0.85), (10.0, 80, 0.80)] {
        let (errors, tin) = disc_errors(&points, radius, discs);
        let ((ours, missing), (linear, _)) = (rms(&errors), rms(&tin));
        println!(
            "radius {radius} m: {ours:.3} m at {} points (linear TIN {linear:.3})",
            errors.len()
        );
        assert_eq!(missing, 0);
        assert!(ours <= share * linear, "{ours} against {linear}");
    }
}

/// Errors of surface and linear TIN in discs around ground points, removed one at a time. Discs keep
/// 12 m from the border, so that none is a matter of extrapolation.
fn disc_errors(points: &[[f64; 3]], radius: f64, discs: usize) -> (Vec<f64>, Vec<f64>) {
    let inner = rect_of(points).grown(-radius - 12.0);
    let params = DtmParams::default();
    let candidates = (0..).map(|i| points[(hash01(i) * points.len() as f64) as usize]);
    let centres = candidates.filter(|c| inner.contains(c[0], c[1])).take(discs);
    let (mut errors, mut linear) = (Vec::new(), Vec::new());
    for centre in centres {
        let square =
            |p: &[f64; 3], r: f64| (p[0] - centre[0]).powi(2) + (p[1] - centre[1]).powi(2) < r * r;
        let held: Vec<[f64; 3]> = points.iter().filter(|p| square(p, radius)).copied().collect();
        let near = points.iter().filter(|p| !square(p, radius) && square(p, radius + 80.0));
        let near: Vec<[f64; 3]> = near.copied().collect();
        let nodes = Nodes::new(near.iter().copied(), params.merge_m);
        let surface = Surface::build(&nodes, rect_of(&held), &params).unwrap();
        errors.extend(errors_at(&surface, &held));
        let local = |p: &[f64; 3]| [p[0] - centre[0], p[1] - centre[1], p[2]];
        let tin = Tin::new(&near.iter().map(local).collect::<Vec<_>>()).unwrap();
        let mut cursor = tin.cursor();
        linear.extend(held.iter().filter_map(|p| cursor.offset(local(p))).map(|o| o.vertical_m));
    }
    (errors, linear)
}

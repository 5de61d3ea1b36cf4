//! StarSac on simulated windows with known crowns.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may stop at what it did not expect"
)]

mod common;

use common::{TrueCrown, stand, surface_rmse, window};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use timberline_crowns::params::{Method, OutlierScope, RadiusRule, Returns, ShapeChoice};
use timberline_crowns::starsac::{self, CrownModel, Outcome, Rejection, Shape};
use timberline_crowns::{CrownModelParams, Window};

const SHAPES: [ShapeChoice; 3] = [ShapeChoice::Paraboloid, ShapeChoice::Cone, ShapeChoice::Blend];

/// The paper's score at its optimum, with this program's idea of a radius.
fn exact(shape: ShapeChoice) -> CrownModelParams {
    CrownModelParams {
        method: Method::Exact,
        shape,
        tolerance_m: 0.8,
        max_outlier_ratio: 1e9,
        ..CrownModelParams::default()
    }
}

fn paper(shape: ShapeChoice) -> CrownModelParams {
    CrownModelParams { max_outlier_ratio: 1e9, ..CrownModelParams::paper(shape) }
}

fn fit(
    params: &CrownModelParams,
    seed: u64,
    per_m2: f64,
    apex_echo: bool,
) -> (TrueCrown, Outcome, f64) {
    let (truth, points) = stand(seed, per_m2, apex_echo);
    let (window, apex) = window(&truth, &points, params.half_width_m(truth.apex[2]));
    (truth, starsac::fit_window(&window, params, seed), truth.apex[2] - apex[2])
}

/// Medians over the accepted crowns.
struct Measured {
    rmse_m: f64,
    radius_error: f64,
    accepted: f64,
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

fn measure(params: &CrownModelParams, stands: u64, per_m2: f64, apex_echo: bool) -> Measured {
    let (mut rmse, mut radius) = (Vec::new(), Vec::new());
    for seed in 0..stands {
        let (truth, outcome, drop) = fit(params, seed, per_m2, apex_echo);
        if let Some(CrownModel { model, radius_m, .. }) = outcome.accepted() {
            rmse.push(surface_rmse(model, &truth, drop));
            radius.push(radius_m / truth.radius - 1.0);
        }
    }
    let accepted = rmse.len() as f64 / stands as f64;
    Measured { rmse_m: median(rmse), radius_error: median(radius), accepted }
}

#[test]
#[ignore = "prints a table: cargo test -p timberline-crowns --test simulated -- --ignored --nocapture"]
fn table_of_models() {
    println!("model | apex echo | points/m2 | surface RMSE m | radius error | accepted");
    for (apex_echo, per_m2) in
        [(true, 4.0), (true, 10.0), (true, 25.0), (false, 4.0), (false, 10.0), (false, 25.0)]
    {
        let row = |name: &str, params: &CrownModelParams| {
            let found = measure(params, 300, per_m2, apex_echo);
            println!(
                "{name} | {apex_echo} | {per_m2} | {:.3} | {:+.3} | {:.2}",
                found.rmse_m, found.radius_error, found.accepted
            );
        };
        row("two-parameter", &CrownModelParams::default());
        for shape in SHAPES.into_iter().chain([ShapeChoice::Best]) {
            row(&format!("exact {shape:?}"), &exact(shape));
            row(&format!("paper {shape:?}"), &paper(shape));
        }
    }
}

#[test]
fn the_default_model_follows_the_surface_better_than_the_papers() {
    let default = measure(&CrownModelParams::default(), 80, 10.0, true);
    assert!(default.rmse_m < 0.09 && default.accepted > 0.97, "{}", default.rmse_m);
    assert!(default.radius_error.abs() < 0.1, "{}", default.radius_error);
    for shape in SHAPES {
        let theirs = measure(&paper(shape), 80, 10.0, true);
        assert!(default.rmse_m < 0.2 * theirs.rmse_m, "{shape:?}: {}", theirs.rmse_m);
    }
}

#[test]
fn a_clean_window_of_each_model_is_recovered_by_each_method() {
    for (choice, shape, parameter) in [
        (ShapeChoice::Paraboloid, Shape::Paraboloid, 0.7),
        (ShapeChoice::Cone, Shape::Cone, 2.5),
        (ShapeChoice::Blend, Shape::Blend, 0.4),
    ] {
        let truth = shape.model(parameter);
        let points = (0..200u32).map(|i| {
            let (sin, cos) = libm::sincos(f64::from(i) * 2.4);
            let r = 3.0 * (f64::from(i) / 200.0).sqrt();
            (i, [r * cos, r * sin, -truth.depth(r)], true)
        });
        let window = Window::new(points);
        for params in
            [paper(choice), exact(choice), paper(ShapeChoice::Best), exact(ShapeChoice::Best)]
        {
            let crown = starsac::fit_window(&window, &params, 11).crown.unwrap();
            assert_eq!(crown.grade(), 200, "{params:?}");
            assert_eq!(crown.outliers, 0);
            assert!((crown.radius_m - 3.0).abs() < 0.01);
            let off = crown.model.depth(2.0) - truth.depth(2.0);
            assert!(off.abs() < params.tolerance_m, "{shape:?} {off}");
        }
    }
}

#[test]
fn radius_rules_and_outlier_scopes() {
    // A cone to 2 m, then ground but for one stray echo on the cone's continuation.
    let cone = (1..=20u32).map(|i| (i, [0.1 * f64::from(i), 0.0, -0.2 * f64::from(i)], true));
    let flat = (21..=60u32).map(|i| (i, [0.1 * f64::from(i), 0.0, -1.0], false));
    let window = Window::new(cone.chain(flat).chain([(99, [5.0, 0.0, -10.0], true)]));
    let with = |radius_rule, outlier_scope| {
        let params = CrownModelParams {
            shape: ShapeChoice::Cone,
            tolerance_m: 0.3,
            outlier_cost: 0.5,
            radius_rule,
            radius_quantile: 0.5,
            outlier_scope,
            ..exact(ShapeChoice::Cone)
        };
        starsac::fit_window(&window, &params, 1).crown.unwrap()
    };
    let farthest = with(RadiusRule::Farthest, OutlierScope::Window);
    assert_eq!((farthest.radius_m, farthest.grade(), farthest.outliers), (5.0, 21, 40));
    let contiguous = with(RadiusRule::Contiguous, OutlierScope::Radius);
    assert!((contiguous.radius_m - 2.0).abs() < 1e-9);
    assert_eq!((contiguous.grade(), contiguous.outliers), (20, 0));
    let half = with(RadiusRule::Quantile, OutlierScope::Radius);
    assert!((half.radius_m - 1.1).abs() < 1e-9, "{}", half.radius_m);
}

#[test]
fn every_reason_for_rejection() {
    let params = CrownModelParams::default();
    let at = |r: f64, h: f64, i: u32| (i, [r, 0.0, -h], true);
    let reason = |window: &Window, params: &CrownModelParams| {
        starsac::fit_window(window, params, 5).rejection
    };
    let two = Window::new([at(0.5, 1.0, 0), at(1.0, 2.0, 1)]);
    assert_eq!(reason(&two, &params), Some(Rejection::TooFewPoints));
    let above = Window::new((1..20).map(|i| at(0.1 * f64::from(i), -1.0, i)));
    assert_eq!(reason(&above, &params), Some(Rejection::NoModel));
    assert_eq!(reason(&above, &exact(ShapeChoice::Cone)), Some(Rejection::NoModel));
    let strict = CrownModelParams { max_outlier_ratio: 0.1, ..params.clone() };
    let every_fifth_inside = |i: u32| {
        let r = 0.1 * f64::from(i);
        at(r, 2.0 * r + if i.is_multiple_of(5) { 4.0 } else { 0.0 }, i)
    };
    let noisy = Window::new((1..40).map(every_fifth_inside));
    assert_eq!(reason(&noisy, &strict), Some(Rejection::TooManyOutliers));
    assert!(starsac::fit_window(&noisy, &strict, 5).crown.is_some(), "the model is still told");
    assert!(Rejection::NoModel.reason().contains("downward"));
}

#[test]
fn draws_depend_on_the_seed_and_nothing_else() {
    let (truth, points) = stand(17, 10.0, false);
    let (seen, _) = window(&truth, &points, 8.0);
    let mut reversed = points.clone();
    reversed.reverse();
    let (again, _) = window(&truth, &reversed, 8.0);
    for params in [CrownModelParams::default(), paper(ShapeChoice::Best)] {
        let first = starsac::fit_window(&seen, &params, 42).crown.unwrap();
        let second = starsac::fit_window(&again, &params, 42).crown.unwrap();
        assert_eq!(
            (first.model, first.radius_m, first.inliers),
            (second.model, second.radius_m, second.inliers)
        );
    }
    assert_eq!(CrownModelParams::paper(ShapeChoice::Cone).returns, Returns::All);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn on_simulated_stands_no_draw_beats_the_exact_consensus(seed in 0u64..10_000, trials in 1usize..400) {
        let (truth, points) = stand(seed, 6.0, false);
        let (window, _) = window(&truth, &points, 8.0);
        for shape in [Shape::Paraboloid, Shape::Cone, Shape::Blend] {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let drawn = starsac::sampled(shape, &window, 0.5 - 1e-9, trials, &mut random);
            let best = starsac::exact(shape, &window, 0.5);
            prop_assert!(best.map_or(0, |b| b.count) >= drawn.map_or(0, |d| d.count));
        }
    }
}

//! StarSac on simulated windows with known crowns.

mod common;

use common::{TrueCrown, stand, surface_rmse, window};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use timberline_crowns::CrownModelParams;
use timberline_crowns::params::{Method, RadiusRule, ShapeChoice};
use timberline_crowns::starsac::{self, CrownModel, Outcome, Rejection, Shape};

const STANDS: u64 = 300;

fn fit(params: &CrownModelParams, seed: u64, per_m2: f64) -> (TrueCrown, Outcome, f64) {
    let (truth, points) = stand(seed, per_m2);
    let (window, apex) = window(&truth, &points, params.half_width_m(truth.apex[2]));
    (truth, starsac::fit_window(&window, params, seed), truth.apex[2] - apex[2])
}

/// Over the accepted crowns: median surface RMSE, median relative radius error, share accepted.
fn measure(params: &CrownModelParams, per_m2: f64) -> (f64, f64, f64) {
    let (mut rmse, mut radius) = (Vec::new(), Vec::new());
    for seed in 0..STANDS {
        let (truth, outcome, drop) = fit(params, seed, per_m2);
        if let Some(CrownModel { model, radius_m, .. }) = outcome.accepted() {
            rmse.push(surface_rmse(model, &truth, drop));
            radius.push(radius_m / truth.radius - 1.0);
        }
    }
    let accepted = rmse.len() as f64 / STANDS as f64;
    let mut median = |values: &mut Vec<f64>| {
        values.sort_unstable_by(f64::total_cmp);
        values[values.len() / 2]
    };
    (median(&mut rmse), median(&mut radius), accepted)
}

#[test]
#[ignore = "prints a table: cargo test -p timberline-crowns --test simulated -- --ignored --nocapture"]
fn table_of_models() {
    println!("model | points/m2 | median surface RMSE m | median radius error | accepted");
    for per_m2 in [4.0, 10.0, 25.0] {
        let mut row = |name: &str, params: &CrownModelParams| {
            let (rmse, radius, accepted) = measure(params, per_m2);
            println!("{name} | {per_m2} | {rmse:.3} | {radius:+.3} | {accepted:.2}");
        };
        row("two-parameter", &CrownModelParams::default());
        for shape in
            [ShapeChoice::Paraboloid, ShapeChoice::Cone, ShapeChoice::Blend, ShapeChoice::Best]
        {
            row(
                &format!("exact {shape:?}"),
                &CrownModelParams {
                    method: Method::Exact,
                    max_outlier_ratio: 1e9,
                    shape,
                    ..CrownModelParams::default()
                },
            );
            row(
                &format!("paper {shape:?}"),
                &CrownModelParams { max_outlier_ratio: 1e9, ..CrownModelParams::paper(shape) },
            );
        }
    }
}

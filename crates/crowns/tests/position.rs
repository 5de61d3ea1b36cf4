//! How near to the true axis the fitted position comes, by width of the prior box.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may stop at what it did not expect"
)]

mod common;

use common::{stand, window};
use timberline_crowns::starsac;
use timberline_crowns::surface::{AxisBounds, L1, Method, Prior, Problem, thin};
use timberline_crowns::{CrownFitParams, CrownModelParams};

/// Median distance to the axis of the highest echo, and of the fit for each half width.
fn medians(per_m2: f64, half_widths: &[Option<f64>]) -> (f64, Vec<f64>) {
    let (params, defaults) = (CrownModelParams::default(), CrownFitParams::default());
    let mut highest = Vec::new();
    let mut fitted = vec![Vec::new(); half_widths.len()];
    for seed in 0..200 {
        let (truth, points) = stand(seed, per_m2, false);
        let (seen, apex) = window(&truth, &points, params.half_width_m(truth.apex[2]));
        let outcome = starsac::fit_window(&seen, &params, seed);
        let Some(crown) = outcome.accepted() else { continue };
        let members = crown.inliers.iter().map(|&i| points[seen.index[i as usize] as usize]);
        let cells = thin(members, apex, defaults.cell_m).unwrap();
        highest.push(libm::hypot(apex[0] - truth.apex[0], apex[1] - truth.apex[1]));
        for (width, off) in half_widths.iter().zip(&mut fitted) {
            let prior = width.map(|half_width_m| Prior { centre: [0.0; 2], half_width_m });
            let bounds = AxisBounds::Exact {
                largest_m: defaults.largest_axis_m,
                smallest_m: defaults.smallest_axis_m,
            };
            let problem = Problem { prior, ..Problem::new(&cells) };
            let [x, y] = L1 { bounds, ..L1::default() }.fit(&problem).unwrap().position;
            off.push(libm::hypot(apex[0] + x - truth.apex[0], apex[1] + y - truth.apex[1]));
        }
    }
    (median(highest), fitted.into_iter().map(median).collect())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
#[ignore = "prints a table: cargo test -p timberline-crowns --test position -- --ignored --nocapture"]
fn table_of_prior_widths() {
    let widths = [Some(0.1), Some(0.2), Some(0.3), Some(0.5), Some(0.75), Some(1.0), None];
    println!("points/m2 | highest echo | {widths:?}");
    for per_m2 in [2.0, 4.0, 10.0, 25.0, 100.0] {
        let (highest, fitted) = medians(per_m2, &widths);
        println!("{per_m2} | {highest:.3} | {fitted:.3?}");
    }
}

#[test]
fn the_fit_halves_the_error_of_the_highest_echo() {
    let (highest, fitted) = medians(10.0, &[Some(CrownFitParams::default().prior_half_width_m)]);
    assert!(fitted[0] < 0.5 * highest, "{} m against {highest} m", fitted[0]);
}

//! Crowns per second: `cargo bench -p timberline-crowns`.
#![allow(missing_docs, reason = "criterion's macros make public items")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{normal, stand, window};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use std::hint::black_box;
use timberline_crowns::params::{Method, ShapeChoice};
use timberline_crowns::starsac::fit_window;
use timberline_crowns::surface::{AxisBounds, EqualAxis, Paraboloid, Prior, Problem, Shape, fit};
use timberline_crowns::{CrownModelParams, Window};

/// Windows of 20 m around simulated trees.
fn windows(per_m2: f64) -> Vec<Window> {
    (0..20)
        .map(|seed| {
            let (truth, points) = stand(seed, per_m2, false);
            window(&truth, &points, 10.0).0
        })
        .collect()
}

fn starsac(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("starsac, per window");
    let methods = [
        ("two-parameter", CrownModelParams::default()),
        (
            "exact best of three",
            CrownModelParams {
                method: Method::Exact,
                shape: ShapeChoice::Best,
                ..CrownModelParams::default()
            },
        ),
        ("paper cone", CrownModelParams::paper(ShapeChoice::Cone)),
    ];
    for per_m2 in [4.0, 10.0, 50.0] {
        let windows = windows(per_m2);
        for (name, params) in &methods {
            let mut next = windows.iter().cycle().zip(0..);
            group.bench_function(BenchmarkId::new(*name, format!("{per_m2} points/m2")), |bench| {
                bench.iter(|| next.next().map(|(w, seed)| fit_window(black_box(w), params, seed)));
            });
        }
    }
    group.finish();
}

fn gathering(criterion: &mut Criterion) {
    let (truth, points) = stand(1, 10.0, false);
    criterion.bench_function("window of 4000 points", |bench| {
        bench.iter(|| window(black_box(&truth), black_box(&points), 10.0));
    });
}

/// `count` cells in a disc over a noisy paraboloid.
fn cells(count: usize) -> Vec<[f64; 3]> {
    let truth = Paraboloid::from_shape(&Shape {
        centre: [0.2, -0.1],
        apex_z_m: 20.0,
        semiaxes_m: [0.9; 2],
        azimuth: 0.0,
    });
    let mut random = ChaCha8Rng::seed_from_u64(count as u64);
    let radius = 0.5 * (count as f64 / std::f64::consts::PI).sqrt();
    (0..count)
        .map(|i| {
            let (sin, cos) = libm::sincos(2.4 * i as f64);
            let r = radius * (i as f64 / count as f64).sqrt();
            let cell = |v: f64| (v / 0.5).floor() * 0.5 + 0.25;
            let (x, y) = (cell(r * cos), cell(r * sin));
            [x, y, truth.z(x, y) + 0.3 * normal(&mut random)]
        })
        .collect()
}

fn surface(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("L1 paraboloid");
    for count in [30, 100, 300, 1000] {
        let cells = cells(count);
        let problem = Problem {
            cells: &cells,
            axes: AxisBounds { largest_m: 3.0, smallest_m: 0.1 },
            prior: Some(Prior { centre: [0.0; 2], half_width_m: 0.5 }),
        };
        group.bench_function(BenchmarkId::new("equal axes, cells", count), |bench| {
            bench.iter(|| fit(black_box(&problem), &EqualAxis));
        });
    }
    group.finish();
}

criterion_group!(benches, starsac, gathering, surface);
criterion_main!(benches);

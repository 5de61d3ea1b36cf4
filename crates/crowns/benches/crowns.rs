//! Crowns per second: `cargo bench -p timberline-crowns`.
#![allow(missing_docs, reason = "criterion's macros make public items")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::problems::{Case, Wishes};
use common::{stand, window};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use timberline_crowns::params::{Method as Consensus, ShapeChoice};
use timberline_crowns::starsac::fit_window;
use timberline_crowns::surface::{Engine, Method};
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
                method: Consensus::Exact,
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

/// Crowns as the tests generate them, without weights.
fn cases(count: usize, omega: f64, prior: bool) -> Vec<Case> {
    let priors = f64::from(u8::from(prior));
    let wishes = Wishes { cells: [count, count], omegas: vec![omega], priors, weights: 0.0 };
    (0..50).map(|seed| Case::random(seed, &wishes)).collect()
}

fn surface(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("L1 paraboloid, cells");
    let kinds = [
        ("linear program", 0.0, None),
        ("omega 0.2", 0.2, None),
        ("omega 0.2, prior", 0.2, Some(0.1)),
        ("omega 0.2, fixed centre", 0.2, Some(0.0)),
    ];
    for (name, omega, half_width_m) in kinds {
        for count in [30, 100, 300, 1000] {
            let mut cases = cases(count, omega, half_width_m.is_some());
            for prior in cases.iter_mut().filter_map(|case| case.prior.as_mut()) {
                prior.half_width_m = half_width_m.unwrap_or(0.0);
            }
            let mut next = cases.iter().cycle();
            group.bench_function(BenchmarkId::new(name, count), |bench| {
                bench.iter(|| {
                    let case = next.next()?;
                    case.method(Engine::Dedicated).fit(black_box(&case.problem())).ok()
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, starsac, gathering, surface);
criterion_main!(benches);

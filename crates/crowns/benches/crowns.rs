//! Consensus models per second: `cargo bench -p timberline-crowns --bench crowns`. The surfaces fitted
//! to crowns are timed by `solvers.rs`.
#![allow(missing_docs, reason = "criterion's macros make public items")]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{stand, window};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use timberline_crowns::params::{Method, ShapeChoice};
use timberline_crowns::starsac::fit_window;
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

criterion_group!(benches, starsac, gathering);
criterion_main!(benches);

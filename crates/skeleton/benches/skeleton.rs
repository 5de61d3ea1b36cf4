//! Time of a skeleton and of its costliest parts on seeded clouds: `cargo bench -p timberline-skeleton`.
#![allow(missing_docs, clippy::unwrap_used, reason = "a measurement")]

#[path = "../tests/common/mod.rs"]
mod common;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use timberline_skeleton::graph::delaunay::delaunay;
use timberline_skeleton::graph::emst::emst;
use timberline_skeleton::graph::knn::Neighbours;
use timberline_skeleton::{Method, SkeletonParams, skeleton};

fn methods(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("skeleton");
    group.sample_size(10);
    for per_m2 in [1000.0, 10_000.0, 60_000.0] {
        let points = common::scan(&common::spruce(), per_m2, 0.003, 1);
        group.throughput(Throughput::Elements(points.len() as u64));
        for method in [Method::Levels, Method::Adtree] {
            let params = SkeletonParams { method, ..SkeletonParams::default() };
            let id = BenchmarkId::new(format!("{method:?}").to_lowercase(), points.len());
            group.bench_function(id, |bench| {
                bench.iter(|| skeleton(black_box(&points), None, None, &params).unwrap());
            });
        }
    }
    group.finish();
}

fn graphs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("graph");
    group.sample_size(10);
    let points = common::scan(&common::spruce(), 10_000.0, 0.003, 1);
    group.throughput(Throughput::Elements(points.len() as u64));
    group.bench_function("delaunay", |bench| bench.iter(|| delaunay(black_box(&points)).unwrap()));
    group.bench_function("emst", |bench| bench.iter(|| emst(black_box(&points))));
    group.bench_function("neighbours", |bench| {
        bench.iter(|| Neighbours::new(black_box(&points), 12, 4));
    });
    group.finish();
}

criterion_group!(benches, methods, graphs);
criterion_main!(benches);

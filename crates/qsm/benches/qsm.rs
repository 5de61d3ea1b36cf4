//! Models per second: `cargo bench -p timberline-qsm --bench qsm`.
#![allow(missing_docs, reason = "criterion's macros make public items")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use timberline_qsm::assign::assign;
use timberline_qsm::branches::split;
use timberline_qsm::fit::{Expected, Sample, fit};
use timberline_qsm::sections::cut;
use timberline_qsm::{Params, SkeletonNode, TreePoints, model_tree};

/// A stem of 10 m with limbs every 20 cm that turn around it, and so many points on them.
fn tree(points: usize) -> (Vec<[f64; 3]>, Vec<SkeletonNode>) {
    let mut nodes: Vec<SkeletonNode> = (0u32..=50)
        .map(|i| SkeletonNode {
            position_m: [0.0, 0.0, 0.2 * f64::from(i)],
            parent: i.checked_sub(1),
            radius_m: 0.16 - 0.003 * f64::from(i),
        })
        .collect();
    for limb in 5u32..50 {
        let (sin, cos) = libm::sincos(f64::from(limb) * 2.4);
        for step in 1u32..=10 {
            let (out, z) = (0.2 * f64::from(step), 0.2 * f64::from(limb) + 0.1 * f64::from(step));
            let parent = if step == 1 { limb } else { nodes.len() as u32 - 1 };
            let radius_m = 0.04 - 0.003 * f64::from(step);
            nodes.push(SkeletonNode {
                position_m: [out * cos, out * sin, z],
                parent: Some(parent),
                radius_m,
            });
        }
    }
    let on_surface = |i: usize| {
        let node = &nodes[1 + i % (nodes.len() - 1)];
        let below = nodes[node.parent.unwrap_or(0) as usize].position_m;
        let share = (i as f64 * 0.618_034).fract();
        let (sin, cos) = libm::sincos(i as f64 * 2.399_963);
        let radius = node.radius_m + 0.002 * libm::sin(i as f64 * 12.9898);
        let at = |k: usize| below[k] + share * (node.position_m[k] - below[k]);
        [at(0) + radius * cos, at(1) + radius * sin, at(2)]
    };
    ((0..points).map(on_surface).collect(), nodes)
}

fn models(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("model");
    group.sample_size(10);
    for count in [10_000, 100_000] {
        let (points, skeleton) = tree(count);
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::from_parameter(count), |bench| {
            let given = TreePoints { points_m: &points, wood: None, base_m: [0.0; 3], dbh_m: None };
            bench.iter(|| model_tree(black_box(&given), &skeleton, &Params::default()));
        });
    }
    group.finish();
}

fn parts(criterion: &mut Criterion) {
    let (points, skeleton) = tree(100_000);
    if let Ok(branches) = split(&skeleton) {
        let sections = cut(&branches, &Params::default());
        criterion.bench_function("assign 100000 points", |bench| {
            bench.iter(|| assign(black_box(&points), &sections.all));
        });
    }
    for count in [12, 60, 240] {
        let sample = |i: usize| {
            let (sin, cos) = libm::sincos(i as f64 * 2.4);
            let radius = 0.1 + 0.003 * libm::sin(i as f64 * 12.9898);
            Sample { across_m: [radius * cos, radius * sin], along_m: 0.0, weight: 1.0 }
        };
        let samples: Vec<Sample> = (0..count).map(sample).collect();
        let expected = Expected { radius_m: 0.13, noise_m: 0.003, noise_weight: 8.0 };
        criterion.bench_function(&format!("fit {count} points"), |bench| {
            bench.iter(|| fit(black_box(&samples), &expected));
        });
    }
}

criterion_group!(benches, models, parts);
criterion_main!(benches);

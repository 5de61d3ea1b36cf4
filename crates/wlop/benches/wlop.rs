//! Cost of consolidation on a made-up trunk: `cargo bench -p timberline-wlop`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use timberline_wlop::operator::{Radius, Settings, Weights, project};
use timberline_wlop::{ConsolidationParams, Tree, consolidate, thin};

/// A repeatable number in 0 to 1 (SplitMix64, Steele et al. 2014).
fn uniform(seed: u64) -> f64 {
    let mut v = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    v = (v ^ (v >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((v ^ (v >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A trunk of 15 cm radius with a point per 25 mm² and noise of 4 mm either way.
fn trunk(count: u64) -> Vec<[f64; 3]> {
    let length_m = count as f64 * 25e-6 / (0.15 * std::f64::consts::TAU);
    let point = |i: u64| {
        let angle = uniform(4 * i) * std::f64::consts::TAU;
        let radius = 0.15 + 0.004 * (2.0 * uniform(4 * i + 1) - 1.0);
        [radius * libm::cos(angle), radius * libm::sin(angle), uniform(4 * i + 2) * length_m]
    };
    (0..count).map(point).collect()
}

fn wlop(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("wlop");
    group.sample_size(10);
    for count in [20_000, 80_000] {
        let points = trunk(count);
        group.throughput(Throughput::Elements(count));
        for weights in [Weights::Even, Weights::Paper] {
            let settings =
                Settings { weights, mu: 0.45, iterations: 5, reach_ratio: 0.5, still_ratio: 0.0 };
            let kept = thin::drawn(&points, 0.5);
            group.bench_function(format!("operator-{weights:?}/{count}"), |b| {
                b.iter(|| black_box(project(&points, &kept, Radius::Everywhere(0.04), &settings)));
            });
        }
        let tree = Tree { points_m: &points, base_m: [0.0; 3], dbh_m: Some(0.3) };
        group.bench_function(format!("tree/{count}"), |b| {
            b.iter(|| black_box(consolidate(&tree, &ConsolidationParams::default())));
        });
    }
    group.finish();
}

criterion_group!(benches, wlop);
criterion_main!(benches);

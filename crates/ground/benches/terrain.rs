//! Speed of the ground filter and of the terrain model on a made-up steep forest.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use timberline_ground::{DtmParams, GroundParams, Label, Nodes, Source, Surface, classify};
use timberline_pointcloud::{Frame, Point, PointCloud, Rect};

const EDGE_M: f64 = 128.0;
const POINTS: usize = 160_000;

/// A reproducible number in 0..1 (`SplitMix64`).
fn hash01(i: usize) -> f64 {
    let mut z = (i as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Ten points per m², one in five on the ground.
fn forest() -> PointCloud {
    let mut cloud = PointCloud::new(Frame::default());
    for i in 0..POINTS {
        let (x, y) = (hash01(4 * i) * EDGE_M, hash01(4 * i + 1) * EDGE_M);
        let terrain = 0.6 * x + 3.0 * libm::sin(x / 9.0) * libm::cos(y / 7.0);
        let above = if hash01(4 * i + 2) < 0.2 { 0.05 } else { 25.0 };
        cloud.push_world([x, y, terrain + above * hash01(4 * i + 3)], &Point::default());
    }
    cloud.in_canonical_order()
}

fn terrain(criterion: &mut Criterion) {
    let cloud = forest();
    let rect = Rect { min: [0.0; 2], max: [EDGE_M; 2] };
    let filter = GroundParams { source: Source::Classify, ..GroundParams::default() };
    let labels = classify(&cloud, rect, &filter).unwrap_or_default();
    let ground: Vec<[f64; 3]> =
        (0..cloud.len()).filter(|i| labels[*i] != Label::Other).map(|i| cloud.world(i)).collect();
    let params = DtmParams::default();
    let nodes = Nodes::new(ground.iter().copied(), params.merge_m);
    let Ok(surface) = Surface::build(&nodes, rect, &params) else { return };

    let mut group = criterion.benchmark_group("ground");
    group.sample_size(10);
    group.throughput(Throughput::Elements(POINTS as u64));
    group.bench_function("classify a point", |b| {
        b.iter(|| classify(black_box(&cloud), rect, &filter));
    });
    group.throughput(Throughput::Elements(nodes.len() as u64));
    group.bench_function("fit a ground point", |b| {
        b.iter(|| Surface::build(black_box(&nodes), rect, &params));
    });
    group.throughput(Throughput::Elements(1));
    let mut i = 0;
    group.bench_function("predict an elevation", |b| {
        b.iter(|| {
            i += 1;
            surface.at(black_box([hash01(i) * EDGE_M, hash01(i + 7) * EDGE_M]))
        });
    });
    group.finish();
}

criterion_group!(benches, terrain);
criterion_main!(benches);

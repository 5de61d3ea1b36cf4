//! Points per second of the detection on a made-up canopy: `cargo bench -p timberline-treetops`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use timberline_pointcloud::{Frame, Point, PointCloud, frame};
use timberline_treetops::{Input, Params, find};

/// A repeatable number in 0 to 1 (SplitMix64, Steele et al. 2014).
fn noise(seed: u64) -> f64 {
    let mut v = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    v = (v ^ (v >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((v ^ (v >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A square of cones 5 m apart with points at random, 10 a square metre.
fn canopy(edge_m: u32) -> (PointCloud, Vec<f32>) {
    let mut cloud = PointCloud::new(Frame::new([500_000, 5_000_000, 0]));
    let edge = f64::from(edge_m);
    for i in 0..u64::from(edge_m) * u64::from(edge_m) * 10 {
        let (x, y) = (noise(3 * i) * edge, noise(3 * i + 1) * edge);
        let (tree_x, tree_y) = ((x / 5.0).floor(), (y / 5.0).floor());
        let top = 15.0 + 10.0 * noise(1 << 40 | (tree_x * 1000.0 + tree_y) as u64);
        let (dx, dy) = (x - (tree_x + 0.5) * 5.0, y - (tree_y + 0.5) * 5.0);
        let z = top - 3.0 * (dx * dx + dy * dy).sqrt() - 2.0 * noise(3 * i + 2);
        let world = [500_000.0 + x, 5_000_000.0 + y, z].map(frame::quantise);
        cloud.push_world(world, &Point::default());
    }
    let cloud = cloud.in_canonical_order();
    let height_m = cloud.z.iter().map(|&z| z as f32).collect();
    (cloud, height_m)
}

fn treetops(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("treetops");
    for edge_m in [122, 500] {
        let (cloud, height_m) = canopy(edge_m);
        group.throughput(Throughput::Elements(cloud.len() as u64)).sample_size(10);
        let input = Input::new(&cloud, &height_m);
        for (name, params) in [
            ("default", Params::default()),
            ("paper", Params::paper()),
            ("circle-5", Params::fixed_circle(5.0)),
        ] {
            group.bench_function(format!("{name}/{}", cloud.len()), |b| {
                b.iter(|| black_box(find(&input, &params)));
            });
        }
    }
    group.finish();
}

criterion_group!(benches, treetops);
criterion_main!(benches);

//! What distances to many cylinders and triangles cost, and the closed surface of a model.
//!
//! `cargo bench -p timberline-solids`
#![allow(missing_docs, reason = "criterion's macros make public items")]

use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use timberline_solids::closed::{RoundCone, cell_for, closed};
use timberline_solids::{Cylinder, CylinderIndex, MeshIndex};

/// Numbers between 0 and 1 that look random (xorshift, Marsaglia 2003).
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        for (left, shift) in [(true, 13), (false, 7), (true, 17)] {
            self.0 ^= if left { self.0 << shift } else { self.0 >> shift };
        }
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Branches of a crown 10 m wide: chains of 20 short cylinders.
fn cylinders(count: usize) -> Vec<Cylinder> {
    let mut draw = Draw(7);
    let mut all = Vec::with_capacity(count);
    let mut at = [0.0; 3];
    for place in 0..count {
        if place % 20 == 0 {
            at = [draw.next() * 10.0 - 5.0, draw.next() * 10.0 - 5.0, draw.next() * 15.0];
        }
        let end = at.map(|value| value + draw.next() * 0.16 - 0.08);
        all.push(Cylinder { start_m: at, end_m: end, radius_m: 0.005 + 0.02 * draw.next() });
        at = end;
    }
    all
}

/// Points on the surfaces, a few centimetres off, cylinder by cylinder.
fn points(cylinders: &[Cylinder], count: usize) -> Vec<[f64; 3]> {
    let mut draw = Draw(11);
    let one = |place: usize| {
        let cylinder = cylinders[place * cylinders.len() / count];
        cylinder.start_m.map(|value| value + draw.next() * 0.1 - 0.05)
    };
    (0..count).map(one).collect()
}

fn distances(criterion: &mut Criterion) {
    let cylinders = cylinders(30_000);
    let points = points(&cylinders, 1_000_000);
    let mut group = criterion.benchmark_group("distances");
    group.sample_size(10);
    group.bench_function("index of 30k cylinders", |bencher| {
        bencher.iter(|| CylinderIndex::new(black_box(&cylinders)));
    });
    let index = CylinderIndex::new(&cylinders);
    group.bench_function("1M points to 30k cylinders", |bencher| {
        bencher.iter(|| index.nearest_all(black_box(&points)));
    });
    group.finish();
}

fn surfaces(criterion: &mut Criterion) {
    let cylinders = cylinders(10_000);
    let points = points(&cylinders, 1_000_000);
    let cone =
        |c: &Cylinder| RoundCone { start: (c.start_m, c.radius_m), end: (c.end_m, c.radius_m) };
    let cones: Vec<RoundCone> = cylinders.iter().map(cone).collect();
    let cell_m = cell_for(&cones, 300_000, 0.005);
    let mesh = closed(&cones, cell_m).mesh;
    let mut group = criterion.benchmark_group("surfaces");
    group.sample_size(10);
    let name = format!("closed surface of 10k cylinders, {} triangles", mesh.triangles.len());
    group.bench_function(name, |bencher| {
        bencher.iter(|| closed(black_box(&cones), cell_m));
    });
    let index = MeshIndex::new(&mesh);
    group.bench_function("1M points to that surface", |bencher| {
        bencher.iter(|| index.nearest_all(black_box(&points)));
    });
    group.finish();
}

criterion_group!(benches, distances, surfaces);
criterion_main!(benches);

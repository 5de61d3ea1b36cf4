//! Points per second of the virtual scanner, and growing of forests.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use timberline_pointcloud::Rect;
use timberline_synth::{Scene, benchmark, sample};

fn scanning(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("scanning");
    group.sample_size(10);
    let scenes =
        [("sample", sample::als_stand_params()), ("stand", benchmark::stand(4_000_000, 7))];
    for (name, params) in scenes {
        let Ok(scene) = Scene::new(params) else { continue };
        let area = scene.params().area;
        let edge = area.size()[0].min(256.0);
        let rect = Rect { min: area.min, max: area.min.map(|value| value + edge) };
        group.throughput(Throughput::Elements(scene.points_in(&rect).len() as u64));
        group.bench_function(name, |bencher| bencher.iter(|| scene.points_in(&rect)));
    }
    group.finish();
}

fn growing(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("growing");
    group.sample_size(10);
    let params = benchmark::stand(4_000_000, 7);
    group.bench_function("forest of 33 ha", |bencher| bencher.iter(|| Scene::new(params.clone())));
    group.finish();
}

criterion_group!(benches, scanning, growing);
criterion_main!(benches);

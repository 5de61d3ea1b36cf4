//! Pulses per second of the virtual terrestrial scanner, and growing of trees.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use timberline_synth::terrestrial::{
    PlotParams, ScanParams, TreeSize, TreeSpecies, grow, plot, scan_tree,
};

fn growing(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("growing a tree of 35 cm");
    group.sample_size(10);
    for species in TreeSpecies::ALL {
        let size = TreeSize::of_dbh(species, 0.35);
        group.bench_function(species.code(), |bencher| bencher.iter(|| grow(species, &size, 7)));
    }
    group.finish();
}

fn casting(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("casting");
    group.sample_size(10);
    let size = TreeSize::of_dbh(TreeSpecies::NorwaySpruce, 0.3);
    if let Ok(tree) = grow(TreeSpecies::NorwaySpruce, &size, 7) {
        let params = ScanParams::tls().with_step(0.3);
        group.bench_function("one spruce, 0.3 degrees", |bencher| {
            bencher.iter(|| scan_tree(&tree, &params, 1));
        });
    }
    let params = PlotParams { scan: ScanParams::tls().with_step(0.6), ..PlotParams::default() };
    if let Ok(scene) = plot(7, &params) {
        let [low, high] = params.scan.elevation_deg;
        let rows = (high - low) / params.scan.step_deg;
        let pulses = f64::from(params.positions) * rows * 360.0 / params.scan.step_deg;
        group.throughput(Throughput::Elements(pulses as u64));
        group.bench_function("pulses of the plot", |bencher| bencher.iter(|| scene.scan()));
    }
    group.finish();
}

criterion_group!(benches, growing, casting);
criterion_main!(benches);

//! The terrestrial sample is what it was.

#![allow(clippy::unwrap_used, reason = "a plot that cannot be planted fails the test")]

use timberline_pointcloud::frame::ticks_from_world;
use timberline_synth::sample;
use timberline_synth::terrestrial::{Label, PlotParams, plot, truth};
use xxhash_rust::xxh3::{Xxh3, xxh3_64};

/// Raise these figures only with a change that is meant to change the sample. A coarse scan of the
/// sample's plot stands for the fine one, which takes minutes.
#[test]
fn the_sample_is_what_it_was() {
    let scene = sample::tls_plot_scene().unwrap();
    let cylinders: usize = scene.trees.iter().map(|tree| tree.cylinders.len()).sum();
    let leaves: usize = scene.trees.iter().map(|tree| tree.leaves.len()).sum();
    let tables =
        truth::trees(&scene) + &truth::cylinders(&scene, 0.0) + &truth::terrain(&scene, 0.5);
    let mut params: PlotParams = scene.params.clone();
    params.scan = params.scan.with_step(0.9);
    let points = plot(scene.seed, &params).unwrap().scan();
    let labels = [Label::Ground, Label::Wood, Label::Leaf, Label::Understorey]
        .map(|label| points.label.iter().filter(|&&found| found == label).count());
    let mut hash = Xxh3::new();
    for i in 0..points.len() {
        let ticks = points.cloud.world(i).map(ticks_from_world);
        ticks.iter().for_each(|t| hash.update(&t.to_le_bytes()));
        hash.update(&points.cloud.intensity[i].to_le_bytes());
    }
    let hashes = [xxh3_64(tables.as_bytes()), hash.digest()].map(|hash| format!("{hash:016x}"));
    assert_eq!(([cylinders, leaves], labels, hashes), (PIECES, LABELS, HASHES.map(str::to_owned)));
}

const PIECES: [usize; 2] = [79_190, 271_417];
const LABELS: [usize; 4] = [88_136, 25_076, 15_596, 4_697];
const HASHES: [&str; 2] = ["965aa1927da5ea93", "9dead05a1c5e05f4"];

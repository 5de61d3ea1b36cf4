//! Writes points of a plot as text, to look at them.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]
use std::io::Write;
use timberline_synth::terrestrial::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let step: f64 = args[2].parse().unwrap();
    let t = std::time::Instant::now();
    let mut params = PlotParams::default();
    params.scan.step_deg = step;
    let scene = plot(20_261_122, &params).unwrap();
    let n: usize = scene.trees.iter().map(|t| t.cylinders.len()).sum();
    let l: usize = scene.trees.iter().map(|t| t.leaves.len()).sum();
    println!("plot {:?} pieces {n} leaves {l} low {}", t.elapsed(), scene.understorey.len());
    for least in [0.002, 0.0025, 0.003,0.0035, 0.004, 0.005] { let c = truth::cylinders(&scene, least); println!("least {least}: rows {} bytes {}", c.lines().count(), c.len()); }
    println!("{}", truth::trees(&scene));
    let t = std::time::Instant::now();
    let points = scene.scan();
    println!("points {} scan {:?}", points.len(), t.elapsed());
    for voxel in [0.01, 0.015, 0.02, 0.03] {
        let mut n = 0; for s in 1..=5 { n += points.of_station(s).thinned(voxel).len(); }
        println!("voxel {voxel}: per scan {n}, merged {}", points.thinned(voxel).len());
    }
    let thin = points.thinned(0.02);
    let mut counts = [0; 5]; for l in &thin.label { counts[*l as usize] += 1; }
    println!("{counts:?}");
    let mut out = std::io::BufWriter::new(std::fs::File::create(&args[1]).unwrap());
    for i in 0..thin.len() { let p = thin.cloud.local(i); writeln!(out, "{:.4} {:.4} {:.4} {} {}", p[0], p[1], p[2], thin.label[i] as u8, thin.tree_id[i]).unwrap(); }
}

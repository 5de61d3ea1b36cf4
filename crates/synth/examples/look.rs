//! Writes points of a tree as text, to look at them.
#![allow(clippy::unwrap_used, clippy::print_stdout, missing_docs)]
use std::io::Write;
use timberline_synth::terrestrial::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let species = TreeSpecies::ALL[args[1].parse::<usize>().unwrap()];
    let dbh: f64 = args[2].parse().unwrap();
    let mut size = TreeSize::of_dbh(species, dbh);
    let flags = args.get(4).cloned().unwrap_or_default();
    if flags.contains("leafless") { size = size.leafless(); }
    if flags.contains("lean") { size = size.leaning(9.0, 20.0); }
    if flags.contains("fork") { size = size.forked_at(2.0); }
    if flags.contains("supp") { size = size.suppressed(); }
    let t = std::time::Instant::now();
    let tree = grow(species, &size, 7).unwrap();
    println!("{:?} dbh {:.4} h {:.2} cb {:.2} area {:.1} pieces {} leaves {} orders {:?} vol stem {:.3} thick {:.3} thin {:.3} grow {:?}",
        species, tree.dbh_m(), tree.height_m(), tree.crown_base_height_m, tree.crown_area_m2(), tree.cylinders.len(), tree.leaves.len(),
        tree.branches_by_order(), tree.volume_m3(VolumeClass::Stem), tree.volume_m3(VolumeClass::ThickBranches), tree.volume_m3(VolumeClass::ThinBranches), t.elapsed());
    let mut params = if flags.contains("uav") { ScanParams::uav() } else if flags.contains("side") { ScanParams::one_sided() } else { ScanParams::tls() };
    if flags.contains("ground") { params = params.with_ground(); }
    let t = std::time::Instant::now();
    let points = scan_tree(&tree, &params, 3).unwrap();
    let thin = points.thinned(0.01);
    println!("points {} thinned {} mixed {} scan {:?}", points.len(), thin.len(), points.mixed.iter().filter(|m| **m).count(), t.elapsed());
    let mut out = std::io::BufWriter::new(std::fs::File::create(&args[3]).unwrap());
    for i in 0..thin.len() { let p = thin.cloud.world(i); writeln!(out, "{:.4} {:.4} {:.4} {}", p[0], p[1], p[2], thin.label[i] as u8).unwrap(); }
}

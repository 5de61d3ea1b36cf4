//! Time and memory of consolidation on a generated trunk (30 cm, noise of 4 mm, a point every 6 mm) with
//! branches half as thick, or on a text cloud (x y z per line):
//! `cargo run --release -p timberline-wlop --example consolidation -- 1000000` or `... -- FILE`
//!
//! The peak memory is that of the process (Linux), the points themselves included.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example prints")]

use timberline_wlop::{ConsolidationParams, Tree, consolidate};

/// A repeatable number in 0 to 1 (SplitMix64, Steele et al. 2014).
fn uniform(seed: u64) -> f64 {
    let mut v = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    v = (v ^ (v >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((v ^ (v >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

fn generated(count: u64) -> Vec<[f64; 3]> {
    let spacing_m = 0.006;
    let length_m = count as f64 * spacing_m * spacing_m / (std::f64::consts::TAU * 0.15 * 1.5);
    let point = |i: u64| {
        // Three of four points on the trunk, one on a branch beside it.
        let branch = i % 4 == 3;
        let radius_m = if branch { 0.075 } else { 0.15 } + 0.004 * (2.0 * uniform(4 * i) - 1.0);
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * uniform(4 * i + 1));
        let beside_m = if branch { 1.0 } else { 0.0 };
        [beside_m + radius_m * cos, radius_m * sin, length_m * uniform(4 * i + 2)]
    };
    (0..count).map(point).collect()
}

fn read(path: &str) -> Vec<[f64; 3]> {
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let mut fields = line.split([' ', ',', ';', '\t']).filter_map(|f| f.parse::<f64>().ok());
        Some([fields.next()?, fields.next()?, fields.next()?])
    };
    text.lines().filter_map(row).collect()
}

/// A value of `/proc/self/status` in megabytes.
fn status_mb(name: &str) -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = text.lines().find(|line| line.starts_with(name)).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap() / 1024.0
}

/// CPU seconds of the process so far (Linux, ticks of 10 ms).
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = text.rsplit(')').next().unwrap().split_whitespace().collect();
    let ticks: f64 = fields[11..13].iter().map(|field| field.parse::<f64>().unwrap()).sum();
    ticks / 100.0
}

fn main() {
    for argument in std::env::args().skip(1) {
        let points_m = argument.parse().map_or_else(|_| read(&argument), generated);
        let low = points_m.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
        let foot = points_m.iter().find(|p| p[2] == low).unwrap();
        let base_m = if argument.parse::<u64>().is_ok() { [0.0; 3] } else { *foot };
        let (before_mb, start_s) = (status_mb("VmRSS:"), cpu_s());
        let tree = Tree { points_m: &points_m, base_m, dbh_m: None };
        let done = consolidate(&tree, &ConsolidationParams::default()).unwrap();
        let (took_s, count) = (cpu_s() - start_s, points_m.len() as f64);
        let more_mb = status_mb("VmHWM:") - before_mb;
        println!(
            "{argument}: {count} points, CPU {took_s:.2} s ({:.1} us per point), peak {more_mb:.0} MB more \
             than before ({:.0} bytes per point); {} points after, skipped: {:?}",
            took_s / count * 1e6,
            more_mb * 1048576.0 / count,
            done.positions_m.len(),
            done.skipped.map(|why| why.to_string())
        );
    }
}

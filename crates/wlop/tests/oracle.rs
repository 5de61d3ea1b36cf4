//! The operator against CGAL's: the same clouds, shares, iterations and kernels in one run.
//!
//! Asked when the environment variable `TIMBERLINE_WLOP_ORACLE` names the program built from
//! `tests/oracle/wlop.cpp` (Debian: `libcgal-dev`); `TIMBERLINE_WLOP_CASES` chooses cases as
//! `points:percent`, separated by blanks:
//!
//! `TIMBERLINE_WLOP_ORACLE=/tmp/wlop cargo test --release -p timberline-wlop --test oracle -- --ignored --nocapture`
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test may stop at what it did not expect, and tells what it measured"
)]

use std::path::Path;
use std::process::Command;
use timberline_pointcloud::Nearest3;
use timberline_wlop::operator::{Radius, Settings, Weights, project};
use timberline_wlop::thin::drawn;

/// Radius of the trunk, spacing of its points, and noise, m.
const TRUNK_M: f64 = 0.15;
const SPACING_M: f64 = 0.005;
const NOISE_M: f64 = 0.004;
/// CGAL's radius by default: 8 spacings.
const CGAL_RADIUS_M: f64 = 8.0 * SPACING_M;
/// We take at most CGAL's CPU seconds over this.
const LEAST_TIMES: f64 = 5.0;
/// CGAL's number of iterations by default.
const ITERATIONS: u32 = 35;

/// A repeatable number in 0 to 1 (SplitMix64, Steele et al. 2014).
fn uniform(seed: u64) -> f64 {
    let mut v = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    v = (v ^ (v >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((v ^ (v >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

fn trunk(count: u64) -> Vec<[f64; 3]> {
    let length_m = count as f64 * SPACING_M * SPACING_M / (TRUNK_M * std::f64::consts::TAU);
    let point = |i: u64| {
        let angle = uniform(4 * i) * std::f64::consts::TAU;
        let radius = TRUNK_M + NOISE_M * (2.0 * uniform(4 * i + 1) - 1.0);
        [radius * libm::cos(angle), radius * libm::sin(angle), uniform(4 * i + 2) * length_m]
    };
    (0..count).map(point).collect()
}

/// CPU seconds of this thread so far (Linux).
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    text.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
}

fn write(path: &Path, points: &[[f64; 3]]) {
    let bytes: Vec<u8> = points.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    std::fs::write(path, bytes).unwrap();
}

fn read(path: &Path) -> Vec<[f64; 3]> {
    let bytes = std::fs::read(path).unwrap();
    let value = |at: &[u8]| f64::from_le_bytes(at.try_into().unwrap());
    bytes.chunks_exact(24).map(|p| [value(&p[..8]), value(&p[8..16]), value(&p[16..])]).collect()
}

/// CGAL's result and its CPU seconds.
fn theirs(program: &str, points: &[[f64; 3]], percent: f64) -> (Vec<[f64; 3]>, f64) {
    let folder = tempfile::tempdir().unwrap();
    let [input, output] = ["in", "out"].map(|name| folder.path().join(name));
    write(&input, points);
    let words = [percent, CGAL_RADIUS_M, f64::from(ITERATIONS)].map(|word| word.to_string());
    let run = Command::new(program).args([&input, &output]).args(words).output().unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    (read(&output), String::from_utf8_lossy(&run.stdout).trim().parse().unwrap())
}

/// Our result and the CPU seconds of one thread, drawing the samples included.
fn ours(points: &[[f64; 3]], percent: f64) -> (Vec<[f64; 3]>, f64) {
    let settings = Settings {
        weights: Weights::Even,
        mu: 0.45,
        iterations: ITERATIONS,
        reach_ratio: 0.5,
        still_ratio: 0.0,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        let start = cpu_s();
        let kept = drawn(points, percent / 100.0);
        let radius = Radius::Everywhere(2.0 * CGAL_RADIUS_M);
        let made = project(points, &kept, radius, &settings).unwrap();
        (made.positions_m, cpu_s() - start)
    })
}

/// Mean and standard deviation of the distance from the axis, away from the ends.
fn radius(positions: &[[f64; 3]]) -> [f64; 2] {
    let length_m = positions.iter().fold(0.0f64, |most, p| most.max(p[2]));
    let inner = positions.iter().filter(|p| (0.1..length_m - 0.1).contains(&p[2]));
    let radii: Vec<f64> = inner.map(|p| (p[0] * p[0] + p[1] * p[1]).sqrt()).collect();
    let mean = radii.iter().sum::<f64>() / radii.len() as f64;
    let variance = radii.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>() / radii.len() as f64;
    [mean, variance.sqrt()]
}

/// Mean distance from each of some points to the nearest of others.
fn mean_nearest(from: &[[f64; 3]], to: &[[f64; 3]], rank: usize) -> f64 {
    let tree = Nearest3::new(to).unwrap();
    let nearest = from.iter().map(|p| tree.nearest(p, rank + 1)[rank].squared_m2.sqrt());
    nearest.sum::<f64>() / from.len() as f64
}

#[test]
#[ignore = "needs CGAL, see the head of this file"]
fn as_thin_and_even_as_cgal_and_several_times_faster() {
    let Ok(program) = std::env::var("TIMBERLINE_WLOP_ORACLE") else {
        panic!("TIMBERLINE_WLOP_ORACLE names no program");
    };
    let cases =
        std::env::var("TIMBERLINE_WLOP_CASES").unwrap_or("50000:5 200000:5 200000:50".into());
    for case in cases.split_whitespace() {
        let (count, percent) = case.split_once(':').unwrap();
        let (points, percent) = (trunk(count.parse().unwrap()), percent.parse().unwrap());
        let (them, their_s) = theirs(&program, &points, percent);
        let (us, our_s) = ours(&points, percent);
        assert_eq!(us.len(), them.len());
        let ([noisy, noise], [our_mean, our_sd], [their_mean, their_sd]) =
            (radius(&points), radius(&us), radius(&them));
        let (own, apart) = (mean_nearest(&us, &us, 1), mean_nearest(&us, &them, 0));
        let their_own = mean_nearest(&them, &them, 1);
        println!(
            "{count} points, {percent} %: CPU {our_s:.2} s, CGAL {their_s:.2} s, {:.1} times; {:.2} \
             us per point; radius {noisy:.6} +- {noise:.6} -> {our_mean:.6} +- {our_sd:.6}, CGAL \
             {their_mean:.6} +- {their_sd:.6} m; gaps {own:.6}, CGAL {their_own:.6} m; nearest of \
             the other {apart:.6} m",
            their_s / our_s,
            our_s / points.len() as f64 * 1e6,
        );
        // Measured: radii apart by less than 1e-5 m, standard deviations by 1 %, gaps by 0.4 %.
        assert!((our_mean - their_mean).abs() < 0.005 * SPACING_M, "radius");
        assert!((our_sd / their_sd - 1.0).abs() < 0.03 && our_sd < 0.2 * noise, "thickness");
        assert!((own / their_own - 1.0).abs() < 0.01 && apart < own, "evenness");
        assert!(their_s >= LEAST_TIMES * our_s, "speed");
    }
}

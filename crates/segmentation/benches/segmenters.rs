//! CPU time of the segmenters on simulated mixed forest of 12 points per square metre, the trees
//! given, and how it grows: `cargo bench -p timberline-segmentation`. Arguments: methods (all), and
//! `--most=POINTS` (2000000).
//!
//! In squares of the world as in the pipeline, on one thread. The time is that of the thread, so that
//! a busy machine does not matter; where the system does not tell it, that of the clock. The least of
//! three runs, of one above half a million points. The last column is the share of the trees' points
//! that have the right tree.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a benchmark speaks, and may stop at what it did not expect"
)]

#[path = "../tests/common/stand.rs"]
mod stand;

use stand::Stand;
use std::time::{Duration, Instant};
use timberline_segmentation::{
    Claim, SegmentMethod, SegmentationParams, Segmenter, View, segment_in_blocks, segmenter,
};

const SIZES: [u64; 4] = [250_000, 500_000, 1_000_000, 2_000_000];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let most = arguments.iter().find_map(|a| a.strip_prefix("--most=")?.parse().ok());
    let named: Vec<&String> = arguments.iter().filter(|a| !a.starts_with("--")).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    println!(
        "| segmenter | points | trees | CPU s | points/s | us/point | right |\n|---|---|---|---|---|---|---|"
    );
    for size in SIZES.into_iter().filter(|size| *size <= most.unwrap_or(u64::MAX)) {
        let stand = stand::stand(size, 4);
        let view = stand.piece.view();
        for method in SegmentMethod::ALL {
            let name = method.name();
            if named.is_empty() || named.iter().any(|n| *n == name) {
                let params = SegmentationParams { method, ..SegmentationParams::default() };
                let runs = if size > 500_000 { 1 } else { 3 };
                let run = || pool.install(|| timed(&*segmenter(&params), &view, params.block_m));
                let (first, claims) = run();
                let least = (1..runs).map(|_| run().0).fold(first, Duration::min).as_secs_f64();
                let (points, trees) = (view.len(), view.markers.len());
                let (rate, each) = (points as f64 / least, least * 1e6 / points as f64);
                let right = 100.0 * right(&stand, &claims);
                println!(
                    "| {name} | {points} | {trees} | {least:.3} | {rate:.0} | {each:.2} | {right:.1} % |"
                );
            }
        }
    }
}

fn right(stand: &Stand, claims: &[Claim]) -> f64 {
    let is_tree = |id: &u64| stand.piece.markers.binary_search_by_key(id, |m| m.crown.id).is_ok();
    let (mut right, mut all) = (0_u32, 0_u32);
    for (truth, claim) in stand.truth.iter().zip(claims).filter(|(truth, _)| is_tree(truth)) {
        all += 1;
        right += u32::from(claim.id == *truth);
    }
    f64::from(right) / f64::from(all)
}

fn timed(segmenter: &dyn Segmenter, view: &View<'_>, block_m: u32) -> (Duration, Vec<Claim>) {
    let (wall, before) = (Instant::now(), cpu_time());
    let claims = segment_in_blocks(segmenter, view, &vec![true; view.len()], block_m);
    let used = match (before, cpu_time()) {
        (Some(before), Some(after)) => after - before,
        _ => wall.elapsed(),
    };
    (used, claims.unwrap())
}

/// What this thread has used of a processor (Linux: the first number of `schedstat`, ns).
fn cpu_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(Duration::from_nanos(text.split_whitespace().next()?.parse().ok()?))
}

//! Skeletons of text clouds (x y z per line), with figures:
//! `cargo run --release -p timberline-skeleton --example skeletons -- [detail=1] [method=levels] [out=FOLDER] FILE…`
//!
//! Per cloud: points, branches, nodes, CPU time, and the distance of the points from the skeleton's
//! tubes when every segment has the median distance of its own points as radius.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example prints")]

use std::fmt::Write as _;
use std::time::Instant;
use timberline_skeleton::{Method, Skeleton, SkeletonParams, skeleton};

fn read(path: &str) -> Vec<[f64; 3]> {
    let text = std::fs::read_to_string(path).unwrap();
    let number = |field: &str| field.parse::<f64>().ok();
    let row = |line: &str| {
        let mut fields = line.split([' ', ',', ';', '\t']).filter_map(number);
        Some([fields.next()?, fields.next()?, fields.next()?])
    };
    text.lines().filter_map(row).collect()
}

fn to_segment(p: [f64; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    let (mut along, mut to, mut dot, mut len) = ([0.0; 3], [0.0; 3], 0.0, 0.0);
    for i in 0..3 {
        along[i] = b[i] - a[i];
        to[i] = p[i] - a[i];
        dot += along[i] * to[i];
        len += along[i] * along[i];
    }
    let t = if len > 0.0 { (dot / len).clamp(0.0, 1.0) } else { 0.0 };
    (0..3).map(|i| (to[i] - t * along[i]).powi(2)).sum::<f64>().sqrt()
}

/// Mean and RMS distance from the tubes, m: every point to the nearest segment among those whose
/// boxes are near, found by brute force over a coarse grid.
fn distances(points: &[[f64; 3]], skeleton: &Skeleton) -> (f64, f64) {
    let nodes = &skeleton.nodes;
    let segment = |i: usize| (nodes[nodes[i].parent.unwrap() as usize].position_m, nodes[i].position_m);
    let cell = |p: [f64; 3]| p.map(|v| (v / 0.25).floor() as i64);
    let mut grid: std::collections::BTreeMap<[i64; 3], Vec<u32>> = std::collections::BTreeMap::new();
    for i in 1..nodes.len() {
        let (a, b) = segment(i);
        let steps = (a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt() / 0.1).ceil();
        let mut last = None;
        for s in 0..=steps as usize {
            let t = if steps > 0.0 { s as f64 / steps } else { 0.0 };
            let at = cell(std::array::from_fn(|k| a[k] + t * (b[k] - a[k])));
            if last != Some(at) {
                grid.entry(at).or_default().push(i as u32);
            }
            last = Some(at);
        }
    }
    let mut own: Vec<Vec<f64>> = vec![Vec::new(); nodes.len()];
    for p in points {
        let at = cell(*p);
        let mut best = (f64::INFINITY, 0u32);
        for ring in 0..12i64 {
            for x in -ring..=ring {
                for y in -ring..=ring {
                    for z in -ring..=ring {
                        if x.abs().max(y.abs()).max(z.abs()) != ring {
                            continue;
                        }
                        for &i in grid.get(&[at[0] + x, at[1] + y, at[2] + z]).into_iter().flatten() {
                            let (a, b) = segment(i as usize);
                            let d = to_segment(*p, a, b);
                            if d < best.0 {
                                best = (d, i);
                            }
                        }
                    }
                }
            }
            if best.0 < ring as f64 * 0.25 {
                break;
            }
        }
        if best.0.is_finite() {
            own[best.1 as usize].push(best.0);
        }
    }
    let (mut sum, mut squares, mut n) = (0.0, 0.0, 0.0);
    for list in &mut own {
        list.sort_by(f64::total_cmp);
        let radius = list.get(list.len() / 2).copied().unwrap_or(0.0);
        for d in list.iter() {
            sum += (d - radius).abs();
            squares += (d - radius) * (d - radius);
            n += 1.0;
        }
    }
    (sum / n, f64::sqrt(squares / n))
}

fn main() {
    let mut params = SkeletonParams::default();
    let mut out = None;
    for argument in std::env::args().skip(1) {
        if let Some(detail) = argument.strip_prefix("detail=") {
            params.detail = detail.parse().unwrap();
        } else if let Some(simplify) = argument.strip_prefix("simplify=") {
            params.simplify = simplify.parse().unwrap();
        } else if let Some(smoothing) = argument.strip_prefix("smoothing=") {
            params.smoothing = smoothing.parse().unwrap();
        } else if argument == "method=adtree" {
            params.method = Method::Adtree;
        } else if let Some(folder) = argument.strip_prefix("out=") {
            out = Some(folder.to_owned());
        } else {
            one(&argument, &params, out.as_deref());
        }
    }
}

fn one(path: &str, params: &SkeletonParams, out: Option<&str>) {
    let points = read(path);
    let start = Instant::now();
    let found = skeleton(&points, None, None, params).unwrap();
    let seconds = start.elapsed().as_secs_f64();
    let (mean, rms) = distances(&points, &found.skeleton);
    let name = path.rsplit('/').next().unwrap();
    println!(
        "{name:22} {:7} points {:5} branches {:6} nodes {seconds:6.3} s  mean {:6.1} rms {:6.1} mm  cut {} spacing {:.1} mm  first radius {:.3}",
        points.len(),
        found.skeleton.branches(),
        found.skeleton.nodes.len(),
        1000.0 * mean,
        1000.0 * rms,
        found.report.cut_off,
        1000.0 * found.report.spacing_m,
        found.skeleton.nodes[0].radius_m,
    );
    if let Some(folder) = out {
        let mut text = String::new();
        for node in &found.skeleton.nodes {
            let [x, y, z] = node.position_m;
            let parent = node.parent.map_or(-1, i64::from);
            writeln!(text, "{x} {y} {z} {parent} {} {}", node.radius_m, node.points).unwrap();
        }
        std::fs::write(format!("{folder}/{name}.skeleton"), text).unwrap();
    }
}

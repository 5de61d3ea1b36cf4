//! The multiquadric surface against SciPy's `RBFInterpolator` (values made by `oracle/make_fixtures.py`).

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "these are tests"
)]

use std::path::Path;
use timberline_ground::{Hardy, Kernel, Sample, Trend};

#[derive(Default)]
struct Case {
    kernel: [f64; 3],
    nodes: [Vec<f64>; 3],
    queries: Vec<[f64; 3]>,
}

fn read(name: &str) -> Case {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle").join(name);
    let mut case = Case::default();
    for line in std::fs::read_to_string(path).unwrap().lines().skip(1) {
        let (kind, numbers) = line.split_once(',').unwrap();
        let row: Vec<f64> = numbers.split(',').map(|number| number.parse().unwrap()).collect();
        match kind {
            "node" => (0..3).for_each(|axis| case.nodes[axis].push(row[axis])),
            "query" => case.queries.push([row[0], row[1], row[2]]),
            _ => case.kernel = [row[0], row[1], row[2]],
        }
    }
    case
}

fn largest_difference(case: &Case) -> f64 {
    let [x, y, z] = &case.nodes;
    let kernel = Kernel { offset_m: case.kernel[0], smoothing_m: case.kernel[1] };
    let trend = if case.kernel[2] == 0.0 { Trend::Constant } else { Trend::Plane };
    let surface = Hardy::fit(Sample { x, y, z }, kernel, trend).unwrap();
    let differences = case.queries.iter().map(|[x, y, z]| (surface.at(*x, *y) - z).abs());
    differences.fold(0.0, f64::max)
}

#[test]
fn same_values_as_scipy() {
    for name in ["exact-plane", "exact-constant", "smoothed-plane", "smoothed-constant", "large"] {
        let difference = largest_difference(&read(&format!("{name}.csv")));
        assert!(difference < 1e-6, "{name}: {difference} m");
    }
}

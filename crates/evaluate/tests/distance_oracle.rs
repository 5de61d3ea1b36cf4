//! Distances against trimesh and SciPy.
//!
//! `TIMBERLINE_ORACLE=python3 cargo test -p timberline-evaluate --test distance_oracle -- --ignored`

#![allow(clippy::unwrap_used, reason = "a test may fail")]

use serde::Deserialize;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use timberline_evaluate::distances::{points_and_mesh, to_points};
use timberline_solids::closed::{closed, cones_of};
use timberline_solids::tubes::axis_of;
use timberline_solids::{Cylinder, CylinderIndex, MeshIndex, free_ends};

#[derive(Deserialize)]
struct Answer {
    mesh: Vec<f64>,
    cylinders: Vec<f64>,
    points: Vec<f64>,
    summary: Summary,
    watertight: bool,
    volume_m3: f64,
}

#[derive(Deserialize)]
struct Summary {
    mean_m: f64,
    rms_m: f64,
    p95_m: f64,
    max_m: f64,
}

/// A bent stem and two branches.
fn model() -> (Vec<Cylinder>, Vec<Option<u32>>) {
    let one = |start_m, end_m, radius_m| Cylinder { start_m, end_m, radius_m };
    let cylinders = vec![
        one([0.0, 0.0, 0.0], [0.05, 0.0, 1.0], 0.2),
        one([0.05, 0.0, 1.0], [0.2, 0.1, 2.0], 0.15),
        one([0.2, 0.1, 2.0], [0.2, 0.3, 2.8], 0.1),
        one([0.05, 0.0, 1.0], [1.0, 0.2, 1.5], 0.05),
        one([0.2, 0.1, 2.0], [-0.5, -0.4, 2.7], 0.03),
    ];
    (cylinders, vec![None, Some(0), Some(1), Some(0), Some(1)])
}

/// Positions around and inside, from an additive recurrence.
fn points() -> Vec<[f64; 3]> {
    let place = |i: u32| {
        let step = |rate: f64| (f64::from(i) * rate).fract();
        [
            step(0.819_172_513) * 2.4 - 1.0,
            step(0.671_043_606) * 1.6 - 0.8,
            step(0.549_700_477) * 3.6 - 0.4,
        ]
    };
    (1..=400).map(place).collect()
}

#[test]
#[ignore = "needs Python with the packages of .ci/requirements.txt"]
fn trimesh_and_scipy_find_the_same_distances() {
    let (cylinders, parents) = model();
    let ends = free_ends(&cylinders, &parents);
    let mesh = {
        let branches = [&cylinders[..3], &cylinders[3..4], &cylinders[4..]];
        let cones: Vec<_> = branches.iter().flat_map(|b| cones_of(&axis_of(b))).collect();
        closed(&cones, 0.05).mesh
    };
    let points = points();
    let scene = serde_json::json!({
        "points": points, "vertices": mesh.vertices_m, "triangles": mesh.triangles,
        "cylinders": cylinders,
        "ends": ends.iter().map(|e| [e.start, e.end]).collect::<Vec<_>>(),
    });
    let answer = ask(&scene);
    let agree = |what: &str, found: &[f64], expected: &[f64], tolerance: f64| {
        assert_eq!(found.len(), expected.len());
        for (place, (found, expected)) in found.iter().zip(expected).enumerate() {
            assert!((found - expected).abs() < tolerance, "{what} {place}: {found} {expected}");
        }
    };
    let distances = |found: Vec<Option<(u32, f64)>>| -> Vec<f64> {
        found.into_iter().map(|f| f.unwrap().1).collect()
    };
    let by_mesh = distances(MeshIndex::new(&mesh).nearest_all(&points));
    agree("mesh", &by_mesh, &answer.mesh, 1e-9);
    let index = CylinderIndex::with_ends(&cylinders, &ends);
    agree("cylinder", &distances(index.nearest_all(&points)), &answer.cylinders, 2e-7);
    let back = to_points(&mesh.vertices_m, &points).unwrap();
    let mean = answer.points.iter().sum::<f64>() / answer.points.len() as f64;
    assert!((back.mean_m - mean).abs() < 1e-9);
    let both = points_and_mesh(&points, &mesh, 0.05).unwrap().forth;
    let Summary { mean_m, rms_m, p95_m, max_m } = answer.summary;
    agree(
        "summary",
        &[both.mean_m, both.rms_m, both.p95_m, both.max_m],
        &[mean_m, rms_m, p95_m, max_m],
        1e-9,
    );
    assert!(answer.watertight && mesh.is_watertight());
    assert!((answer.volume_m3 - mesh.volume_m3()).abs() < 1e-9);
}

fn ask(scene: &serde_json::Value) -> Answer {
    let python = std::env::var("TIMBERLINE_ORACLE").unwrap_or_else(|_| "python3".to_owned());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle/distances.py");
    let mut child = Command::new(python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let text = serde_json::to_vec(scene).unwrap();
    child.stdin.take().unwrap().write_all(&text).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    serde_json::from_slice(&output.stdout).unwrap()
}

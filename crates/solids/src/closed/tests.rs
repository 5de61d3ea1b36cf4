use super::*;
use crate::vector::add;
use proptest::prelude::*;
use std::f64::consts::PI;

fn cone(a: [f64; 3], ra: f64, b: [f64; 3], rb: f64) -> RoundCone {
    RoundCone { start: (a, ra), end: (b, rb) }
}

/// The least distance to balls strung closely along the cone.
fn brute(cone: &RoundCone, p: [f64; 3]) -> f64 {
    let ((a, ra), (b, rb)) = (cone.start, cone.end);
    let ball = |i: u32| {
        let t = f64::from(i) / 4000.0;
        distance(p, along(a, sub(b, a), t)) - (ra + (rb - ra) * t)
    };
    (0..=4000).map(ball).fold(f64::INFINITY, f64::min)
}

proptest! {
    #[test]
    fn the_distance_of_a_cone_is_that_of_its_balls(
        a in prop::array::uniform3(-1.0f64..1.0), b in prop::array::uniform3(-1.0f64..1.0),
        ra in 0.0f64..0.5, rb in 0.0f64..0.5, p in prop::array::uniform3(-2.0f64..2.0),
    ) {
        let cone = cone(a, ra, b, rb);
        prop_assert!((cone.signed_distance_m(p) - brute(&cone, p)).abs() < 2e-3);
    }

    /// Whatever is thrown together, the surface is closed, and lies where it should.
    #[test]
    fn every_union_is_closed(
        balls in prop::collection::vec((prop::array::uniform3(-10i32..10), 0u32..8), 1..12),
        cell in 4u32..12,
    ) {
        let nodes: Vec<([f64; 3], f64)> = balls
            .iter()
            .map(|(p, r)| (p.map(|v| f64::from(v) * 0.05), f64::from(*r) * 0.02))
            .collect();
        let pairs = nodes.windows(2).map(|w| RoundCone { start: w[0], end: w[1] });
        let cones: Vec<RoundCone> = pairs.chain([RoundCone { start: nodes[0], end: nodes[0] }]).collect();
        let cell_m = f64::from(cell) * 0.01;
        let found = closed(&cones, cell_m);
        prop_assert!(found.mesh.is_valid() && found.mesh.is_watertight());
        prop_assert!(found.mesh.volume_m3() > 0.0);
        for vertex in &found.mesh.vertices_m {
            let thick = cones.iter().map(|c| c.at_least(found.least_radius_m));
            let value = thick.map(|c| c.signed_distance_m(*vertex)).fold(f64::INFINITY, f64::min);
            // Interpolated along an edge of at most the diagonal.
            prop_assert!(value.abs() < 0.87 * cell_m, "{value} of {cell_m}");
        }
    }
}

#[test]
fn a_ball_has_its_volume() {
    let found = closed(&[cone([0.3, 0.2, 0.1], 0.5, [0.3, 0.2, 0.1], 0.5)], 0.04);
    let volume = 4.0 / 3.0 * PI * 0.125;
    assert!((found.mesh.volume_m3() / volume - 1.0).abs() < 0.01, "{}", found.mesh.volume_m3());
    assert_eq!(found.thickened, 0);
}

#[test]
fn a_fork_is_one_body_without_inner_walls() {
    let fork = [
        cone([0.0; 3], 0.2, [0.0, 0.0, 1.0], 0.15),
        cone([0.0, 0.0, 1.0], 0.15, [0.5, 0.0, 1.6], 0.08),
        cone([0.0, 0.0, 1.0], 0.15, [-0.5, 0.1, 1.7], 0.06),
    ];
    let found = closed(&fork, 0.02);
    assert!(found.mesh.is_watertight());
    // Euler's formula: a single body without handles.
    let (v, f) = (found.mesh.vertices_m.len() as i64, found.mesh.triangles.len() as i64);
    assert_eq!(v - f / 2, 2);
    let parts: f64 = fork.iter().map(|c| closed(&[*c], 0.02).mesh.volume_m3()).sum();
    assert!(found.mesh.volume_m3() < parts);
}

#[test]
fn a_thin_branch_is_thickened_not_lost() {
    let twig = cone([0.013, 0.017, 0.011], 0.002, [1.0, 0.4, 0.7], 0.001);
    let found = closed(&[twig], 0.05);
    assert!(found.mesh.is_watertight());
    assert_eq!(found.thickened, 1);
    let (v, f) = (found.mesh.vertices_m.len() as i64, found.mesh.triangles.len() as i64);
    assert_eq!(v - f / 2, 2, "it is in one piece");
}

#[test]
fn moving_by_whole_cells_moves_the_surface() {
    let twig = cone([0.0, 0.0, 0.0], 0.1, [0.5, 0.25, 0.75], 0.06);
    let by = [8.0, -16.0, 4.0];
    let moved = cone(add(twig.start.0, by), 0.1, add(twig.end.0, by), 0.06);
    let (a, b) = (closed(&[twig], 0.03125), closed(&[moved], 0.03125));
    assert_eq!(a.mesh.triangles, b.mesh.triangles);
}

#[test]
fn the_number_of_triangles_is_foreseen() {
    for end in [[0.0, 0.0, 2.0], [1.0, 0.7, 1.5], [1.2, 1.1, 1.3]] {
        let cone = cone([0.0; 3], 0.2, end, 0.2);
        let found = closed(&[cone], 0.02);
        let ends = 4.0 * PI * 0.04;
        let squares = (cone.area_m2() + ends) / (0.02 * 0.02);
        let rate = found.mesh.triangles.len() as f64 / squares;
        assert!((6.7..=TRIANGLES_A_SQUARE).contains(&rate), "{rate}");
    }
    let long = cone([0.0; 3], 0.1, [0.0, 0.0, 30.0], 0.1);
    let cell_m = cell_for(&[long], 100_000, 0.005);
    let count = closed(&[long], cell_m).mesh.triangles.len();
    assert!((75_000..105_000).contains(&count), "{count}");
    assert_eq!(cell_for(&[long], u64::MAX, 0.005), 0.005);
}

#[test]
fn a_fat_ball_does_not_fill_the_memory() {
    let fat = cone([0.0; 3], 50.0, [0.0, 0.0, 0.01], 50.0);
    let cell_m = cell_for(&[fat], 10_000, 0.005);
    assert!(100.0f64.powi(3) / cell_m.powi(3) < 500_000.0, "{cell_m}");
    assert!(closed(&[fat], cell_m).mesh.is_watertight());
}

#[test]
fn nothing_comes_of_nothing() {
    assert_eq!(closed(&[], 0.1).mesh, Mesh::default());
    assert_eq!(closed(&[cone([0.0; 3], 1.0, [1.0; 3], 1.0)], 0.0), Closed::default());
    let bad = cone([f64::NAN; 3], 1.0, [1.0; 3], 1.0);
    assert_eq!(closed(&[bad], 0.1).mesh, Mesh::default());
}

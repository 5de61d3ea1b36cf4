use super::*;
use crate::MeshIndex;
use proptest::prelude::*;

/// Cylinders of one radius between positions.
fn chain(positions: &[[f64; 3]], radius_m: f64) -> Vec<Cylinder> {
    positions
        .windows(2)
        .map(|pair| Cylinder { start_m: pair[0], end_m: pair[1], radius_m })
        .collect()
}

#[test]
fn a_straight_tube_is_a_prism_with_the_volume_of_the_cylinder() {
    let branch = chain(&[[0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 3.0]], 0.2);
    let tube = tube(&branch, Fineness { sides: 7, step_m: 0.5 });
    assert!(tube.mesh.is_watertight());
    assert!((tube.mesh.volume_m3() - 3.0 * PI * 0.04).abs() < 1e-9);
    // Rings at 0, 0.5, 1, 1.5 ... 3, and two centres.
    assert_eq!(tube.mesh.vertices_m.len(), 7 * 7 + 2);
    assert_eq!(tube.cylinder.len(), tube.mesh.vertices_m.len());
    assert_eq!(tube.cylinder[7 * 2], 0);
    assert_eq!(tube.cylinder[7 * 3], 1);
}

#[test]
fn radii_between_cylinders_are_means() {
    let mut branch = chain(&[[0.0; 3], [0.0, 0.0, 1.0], [0.0, 0.0, 2.0]], 0.2);
    branch[1].radius_m = 0.1;
    let radii: Vec<f64> = axis_of(&branch).iter().map(|node| node.radius_m).collect();
    assert_eq!(radii, [0.2, 0.5 * (0.2 + 0.1), 0.1]);
}

#[test]
fn a_curve_through_an_arc_keeps_to_the_arc() {
    let place = |i: usize| {
        let (sin, cos) = libm::sincos(PI * i as f64 / 16.0);
        [2.0 * cos, 2.0 * sin, 0.0]
    };
    let positions: Vec<[f64; 3]> = (0..=8).map(place).collect();
    let nodes = smoothed(&axis_of(&chain(&positions, 0.1)), 0.02);
    // Away from the ends, where tangents are those of chords.
    let inner = &nodes[nodes.len() / 8..nodes.len() * 7 / 8];
    let worst = inner.iter().map(|node| (norm(node.centre_m) - 2.0).abs()).fold(0.0, f64::max);
    assert!(worst < 5e-4, "{worst}");
}

/// A frame that is carried round a closed way in a plane comes back as it was.
#[test]
fn frames_do_not_twist_in_a_plane() {
    let place = |i: usize| {
        let (sin, cos) = libm::sincos(2.0 * PI * i as f64 / 60.0);
        Node { centre_m: [cos, sin, 0.0], radius_m: 0.1, cylinder: 0 }
    };
    let nodes: Vec<Node> = (0..=60).map(place).collect();
    let frames = frames(&nodes);
    let normal = |i: usize| frames[i][0][2];
    assert!((0..=60).all(|i| (normal(i) - normal(0)).abs() < 1e-9));
}

#[test]
fn there_and_back_again_is_still_closed() {
    let tube =
        tube(&chain(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]], 0.1), Fineness::default());
    assert!(tube.mesh.is_watertight() && tube.mesh.is_valid());
    assert_eq!(super::tube(&[], Fineness::default()), Tubes::default());
    assert_eq!(
        super::tube(&chain(&[[1.0; 3], [1.0; 3]], 0.1), Fineness::default()),
        Tubes::default()
    );
}

proptest! {
    #[test]
    fn every_tube_is_watertight_and_near_its_cylinders(
        positions in prop::collection::vec(prop::array::uniform3(-20i32..20), 2..8),
        sides in 3u32..14, step in 1u32..40,
    ) {
        let positions: Vec<[f64; 3]> =
            positions.iter().map(|p| p.map(|v| f64::from(v) * 0.1)).collect();
        let branch = chain(&positions, 0.05);
        let tube = tube(&branch, Fineness { sides, step_m: f64::from(step) * 0.01 });
        prop_assume!(!tube.mesh.triangles.is_empty());
        prop_assert!(tube.mesh.is_valid());
        prop_assert!(tube.mesh.is_watertight());
        let index = MeshIndex::new(&tube.mesh);
        for position in &positions {
            // The axis passes through every node, a ring's width from the surface.
            prop_assert!(index.nearest(*position).unwrap().1 < 0.05 * 1.6);
        }
    }
}

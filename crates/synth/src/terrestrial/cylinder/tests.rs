use super::super::vector::dot;
use super::*;
use proptest::prelude::*;

fn piece(end_m: Vec3, radii: [f64; 2]) -> TrueCylinder {
    TrueCylinder {
        id: 0,
        parent: None,
        branch: 0,
        order: 0,
        start_m: [0.2, -0.1, 0.3],
        end_m,
        start_radius_m: radii[0],
        end_radius_m: radii[1],
    }
}

const ENDS: [[Joint; 2]; 3] =
    [[Joint::Flat, Joint::Flat], [Joint::Buried, Joint::Ball], [Joint::Flat, Joint::Ball]];

proptest! {
    #[test]
    fn rays_end_on_the_surface(
        end in [-1f64..1., -1f64..1., 0.5f64..2.],
        radii in [0.02f64..0.3, 0.02f64..0.3],
        from in [-3f64..3., -3f64..3., -2f64..4.],
        aim in [-0.4f64..0.4, -0.4f64..0.4, -0.4f64..0.4],
        ends in 0usize..3,
    ) {
        let piece = piece(end, radii);
        let solid = Solid::new(&piece, ENDS[ends]);
        prop_assume!(solid.signed_distance_m(from) > 0.01);
        let middle = scale(add(piece.start_m, piece.end_m), 0.5);
        let direction = unit(sub(add(middle, aim), from));
        if let Some((range, normal)) = solid.hit(from, direction, 20.0) {
            let at = along(from, direction, range);
            prop_assert!(solid.signed_distance_m(at).abs() < 1e-9);
            prop_assert!(dot(normal, direction) <= 0.0);
            // Nothing of the wood lies before it (a buried end is open).
            if ends != 1 {
                for step in 1..50 {
                    let before = along(from, direction, range * f64::from(step) / 50.0);
                    prop_assert!(solid.signed_distance_m(before) > -1e-9);
                }
            }
        }
    }

    #[test]
    fn distances_are_those_of_dense_points_on_the_surface(
        radii in [0.05f64..0.3, 0.05f64..0.3],
        point in [-1f64..1., -1f64..1., -0.5f64..1.8],
    ) {
        let piece = piece([0.2, -0.1, 1.3], radii);
        let solid = Solid::new(&piece, [Joint::Flat, Joint::Flat]);
        let mut nearest = f64::INFINITY;
        for i in 0..=100 {
            let share = f64::from(i) / 100.0;
            for j in 0..180 {
                let (sin, cos) = libm::sincos(f64::from(j).to_radians() * 2.0);
                let side = radii[0] + share * (radii[1] - radii[0]);
                let spots = [(side, share), (radii[0] * share, 0.0), (radii[1] * share, 1.0)];
                for (r, u) in spots {
                    let spot = [0.2 + r * cos, -0.1 + r * sin, 0.3 + u];
                    nearest = nearest.min(length(sub(spot, point)));
                }
            }
        }
        let exact = solid.signed_distance_m(point).abs();
        prop_assert!(exact <= nearest + 1e-9 && nearest < exact + 0.012, "{exact} {nearest}");
    }
}

#[test]
fn a_joint_has_neither_step_nor_gap() {
    let lower = piece([0.2, -0.1, 1.3], [0.1, 0.09]);
    let upper = TrueCylinder {
        start_m: lower.end_m,
        end_m: [0.5, -0.1, 2.2],
        start_radius_m: 0.09,
        end_radius_m: 0.08,
        ..lower
    };
    let solids = [
        Solid::new(&lower, [Joint::Flat, Joint::Ball]),
        Solid::new(&upper, [Joint::Buried, Joint::Flat]),
    ];
    let at = |p: Vec3| solids.iter().map(|s| s.signed_distance_m(p)).fold(f64::INFINITY, f64::min);
    // On the axis the depth is the radius on both sides of the joint.
    for z in [1.2, 1.299, 1.301] {
        assert!((at([0.2, -0.1, z]) + 0.0905).abs() < 2e-3, "{z}: {}", at([0.2, -0.1, z]));
    }
    // On the outer side of the bend the ball closes the wedge.
    let ray = [[-2.0, -0.1, 1.305], [1.0, 0.0, 0.0]];
    let ranges = solids.iter().filter_map(|s| s.hit(ray[0], ray[1], 9.0)).map(|hit| hit.0);
    let nearest = ranges.fold(f64::INFINITY, f64::min);
    assert!((nearest - 2.11).abs() < 1e-3, "{nearest}");
}

#[test]
fn leaves_are_hit_within_their_rim_from_both_sides() {
    let blade = leaf([0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.3], [0.05, 0.02]);
    let down = |x: f64, y: f64| blade.hit([x, y, 3.0], [0.0, 0.0, -1.0], 9.0);
    assert_eq!(down(0.049, 0.0).map(|hit| hit.0), Some(2.0));
    assert!(down(0.051, 0.0).is_none() && down(0.0, 0.021).is_none());
    let (range, normal) = blade.hit([0.0, 0.019, 0.0], [0.0, 0.0, 1.0], 9.0).unwrap();
    assert_eq!((range, normal), (1.0, [0.0, 0.0, -1.0]));
    assert!((blade.area_m2() - std::f64::consts::PI * 0.001).abs() < 1e-12);
    let bounds = blade.bounds();
    assert!((bounds.max[0] - 0.05).abs() < 1e-12 && (bounds.min[1] + 0.02).abs() < 1e-12);
}

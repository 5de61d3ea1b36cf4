use super::*;
use crate::vector::{across, add, cross, scale};
use proptest::prelude::*;

const UPRIGHT: Cylinder =
    Cylinder { start_m: [1.0, 2.0, 3.0], end_m: [1.0, 2.0, 7.0], radius_m: 0.5 };

fn cylinder() -> impl Strategy<Value = Cylinder> {
    let position = || prop::array::uniform3(-3.0f64..3.0);
    (position(), position(), 0.01f64..1.0).prop_map(|(start_m, end_m, radius_m)| Cylinder {
        start_m,
        end_m,
        radius_m,
    })
}

#[test]
fn sizes_of_an_upright_cylinder() {
    assert_eq!(UPRIGHT.length_m(), 4.0);
    assert!((UPRIGHT.volume_m3() - PI).abs() < 1e-12);
    assert!((UPRIGHT.lateral_area_m2() - 4.0 * PI).abs() < 1e-12);
    assert_eq!(UPRIGHT.along_and_across_m([4.0, 6.0, 4.5]), (1.5, 5.0));
}

#[test]
fn distances_inside_beside_above_and_off_the_rim() {
    for (position, expected) in [
        ([1.0, 2.0, 5.0], -0.5), // on the axis
        ([1.0, 2.0, 6.9], -0.1), // below the disc
        ([2.0, 2.0, 5.0], 0.5),  // beside
        ([1.2, 2.0, 9.0], 2.0),  // above the disc
        ([4.5, 2.0, 11.0], 5.0), // off the rim: 3 across, 4 up
        ([1.0, 2.5, 5.0], 0.0),  // on the surface
    ] {
        let found = UPRIGHT.signed_distance_m(position);
        assert!((found - expected).abs() < 1e-12, "{position:?}: {found}");
        assert_eq!(UPRIGHT.distance_m(position), found.abs());
    }
}

#[test]
fn an_open_end_has_no_disc() {
    let below = |ends| UPRIGHT.distance_to_m([1.0, 2.0, 2.0], ends);
    assert_eq!(below(Ends::BOTH), 1.0);
    assert_eq!(below(Ends { start: true, end: false }), 1.0);
    // The rim of the open end is as far as 1 down and 0.5 across.
    assert!((below(Ends { start: false, end: true }) - 1.25f64.sqrt()).abs() < 1e-12);
    // Just inside an open end the nearest surface is the lateral one.
    assert!((UPRIGHT.distance_to_m([1.0, 2.0, 6.9], Ends::NONE) - 0.5).abs() < 1e-12);
}

#[test]
fn without_length_it_is_a_ball() {
    let ball = Cylinder { end_m: UPRIGHT.start_m, ..UPRIGHT };
    assert_eq!(ball.distance_m([1.0, 2.0, 5.0]), 1.5);
    assert_eq!(ball.distance_to_m([1.0, 2.0, 5.0], Ends::BOTH), 1.5);
    assert_eq!(ball.volume_m3(), 0.0);
}

#[test]
fn only_tips_and_the_foot_are_free() {
    let at = |z: f64, x: f64| Cylinder {
        start_m: [0.0, 0.0, z],
        end_m: [x, 0.0, z + 1.0],
        radius_m: 0.1,
    };
    // A stem of two cylinders, and a branch that begins half way up the second.
    let mut branch = at(1.5, 1.0);
    branch.radius_m = 0.05;
    let ends = free_ends(&[at(0.0, 0.0), at(1.0, 0.0), branch], &[None, Some(0), Some(1)]);
    let tip = Ends { start: false, end: true };
    assert_eq!(ends, [Ends { start: true, end: false }, tip, tip]);
}

proptest! {
    /// Points laid around a cylinder at known distances: the signed distance finds them again.
    #[test]
    fn beside_it_the_distance_is_to_the_axis_less_the_radius(
        c in cylinder(), t in 0.0f64..1.0, angle in 0.0f64..6.3, off in 0.0f64..4.0,
    ) {
        prop_assume!(c.length_m() > 0.01);
        let axis = c.axis().unwrap();
        let u = across(axis);
        let v = cross(axis, u);
        let out = add(scale(u, libm::cos(angle)), scale(v, libm::sin(angle)));
        let foot = along(c.start_m, sub(c.end_m, c.start_m), t);
        let p = along(foot, out, off);
        let lateral = (off - c.radius_m).abs();
        prop_assert!((c.distance_to_m(p, Ends::NONE) - lateral).abs() < 1e-9);
        let discs = (t * c.length_m()).min((1.0 - t) * c.length_m());
        let expected = if off > c.radius_m { lateral } else { lateral.min(discs) };
        prop_assert!((c.distance_m(p) - expected).abs() < 1e-9);
        prop_assert!((c.distance_to_m(p, Ends::BOTH) - expected).abs() < 1e-9);
        prop_assert_eq!(c.signed_distance_m(p) < -1e-9, off < c.radius_m && expected > 1e-9);
    }

    /// A distance changes by no more than the way walked.
    #[test]
    fn distances_are_lipschitz(c in cylinder(), p in prop::array::uniform3(-5.0f64..5.0), d in prop::array::uniform3(-1.0f64..1.0)) {
        let way = crate::vector::norm(d);
        let change = c.signed_distance_m(add(p, d)) - c.signed_distance_m(p);
        prop_assert!(change.abs() <= way + 1e-9);
    }

    #[test]
    fn the_box_holds_the_surface(c in cylinder(), t in 0.0f64..1.0, angle in 0.0f64..6.3) {
        prop_assume!(c.length_m() > 0.01);
        let axis = c.axis().unwrap();
        let u = across(axis);
        let v = cross(axis, u);
        let rim = add(scale(u, c.radius_m * libm::cos(angle)), scale(v, c.radius_m * libm::sin(angle)));
        let p = add(along(c.start_m, sub(c.end_m, c.start_m), t), rim);
        prop_assert!(c.bounds().squared_distance(p) < 1e-18);
    }
}

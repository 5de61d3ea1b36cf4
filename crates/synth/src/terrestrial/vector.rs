//! Vectors in space, as arrays.

/// A position or a direction, m or without unit.
pub(crate) type Vec3 = [f64; 3];

pub(crate) fn add(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn scale(a: Vec3, factor: f64) -> Vec3 {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

/// `a + factor b`.
pub(crate) fn along(a: Vec3, b: Vec3, factor: f64) -> Vec3 {
    [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]]
}

pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn length(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// The vector of length 1; straight up for one of no length.
pub(crate) fn unit(a: Vec3) -> Vec3 {
    let length = length(a);
    if length > 1e-12 { scale(a, 1.0 / length) } else { [0.0, 0.0, 1.0] }
}

/// Two unit vectors across a unit vector and each other, right-handed with it.
pub(crate) fn across(axis: Vec3) -> [Vec3; 2] {
    let helper = if axis[2].abs() < 0.9 { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    let first = unit(cross(helper, axis));
    [first, cross(axis, first)]
}

/// A unit vector turned by an angle about a unit axis across it (Rodrigues).
pub(crate) fn turned(a: Vec3, axis: Vec3, angle_rad: f64) -> Vec3 {
    let (sin, cos) = libm::sincos(angle_rad);
    let lateral = cross(axis, a);
    let along_axis = dot(axis, a) * (1.0 - cos);
    std::array::from_fn(|i| a[i] * cos + lateral[i] * sin + axis[i] * along_axis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn across_is_a_right_handed_frame(x in -1f64..1., y in -1f64..1., z in -1f64..1.) {
            let axis = unit([x, y, z]);
            let [u, v] = across(axis);
            for (a, b) in [(u, v), (u, axis), (v, axis)] {
                prop_assert!(dot(a, b).abs() < 1e-12);
            }
            prop_assert!(dot(cross(axis, u), v) > 1.0 - 1e-12);
        }

        #[test]
        fn turning_keeps_length_and_gives_the_angle(x in -1f64..1., y in -1f64..1., angle in 0f64..3.) {
            let axis = unit([x, y, 0.7]);
            let [u, _] = across(axis);
            let moved = turned(u, axis, angle);
            prop_assert!((length(moved) - 1.0).abs() < 1e-12);
            prop_assert!((dot(moved, u) - libm::cos(angle)).abs() < 1e-12);
        }
    }
}

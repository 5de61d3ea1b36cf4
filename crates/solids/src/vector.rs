//! Arithmetic of positions and directions in space.

/// `a + b`.
#[must_use]
pub fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`.
#[must_use]
pub fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a` times a factor.
#[must_use]
pub fn scale(a: [f64; 3], factor: f64) -> [f64; 3] {
    a.map(|value| value * factor)
}

/// `a + factor b`.
#[must_use]
pub fn along(a: [f64; 3], b: [f64; 3], factor: f64) -> [f64; 3] {
    add(a, scale(b, factor))
}

/// Inner product.
#[must_use]
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Outer product.
#[must_use]
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Length.
#[must_use]
pub fn norm(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}

/// Distance between two positions.
#[must_use]
pub fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    norm(sub(a, b))
}

/// The direction of `a`, of length 1; none where `a` has no length or is not finite.
#[must_use]
pub fn unit(a: [f64; 3]) -> Option<[f64; 3]> {
    let length = norm(a);
    (length > 0.0 && length.is_finite()).then(|| a.map(|value| value / length))
}

/// A unit vector across a unit vector: the projection of the axis it is farthest from.
#[must_use]
pub fn across(direction: [f64; 3]) -> [f64; 3] {
    let smallest =
        (1..3).fold(
            0,
            |best, axis| {
                if direction[axis].abs() < direction[best].abs() { axis } else { best }
            },
        );
    let mut axis = [0.0; 3];
    axis[smallest] = 1.0;
    unit(along(axis, direction, -dot(axis, direction))).unwrap_or([1.0, 0.0, 0.0])
}

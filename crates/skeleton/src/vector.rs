//! Vectors of three, as plain arrays.

pub(crate) type Vector = [f64; 3];

pub(crate) fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(crate) fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn scale(a: Vector, by: f64) -> Vector {
    [a[0] * by, a[1] * by, a[2] * by]
}

pub(crate) fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn norm(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

pub(crate) fn squared(a: Vector, b: Vector) -> f64 {
    let d = sub(a, b);
    dot(d, d)
}

pub(crate) fn distance(a: Vector, b: Vector) -> f64 {
    squared(a, b).sqrt()
}

/// The vector at length one; `None` for one without length.
pub(crate) fn unit(a: Vector) -> Option<Vector> {
    let length = norm(a);
    (length > 1e-12).then(|| scale(a, 1.0 / length))
}

/// Two unit vectors across a unit vector and each other.
pub(crate) fn across(axis: Vector) -> [Vector; 2] {
    let least = if axis[0].abs() <= axis[1].abs() && axis[0].abs() <= axis[2].abs() {
        [1.0, 0.0, 0.0]
    } else if axis[1].abs() <= axis[2].abs() {
        [0.0, 1.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let u = unit(cross(axis, least)).unwrap_or(least);
    [u, cross(axis, u)]
}

/// Distance from a point to a segment, and where along it (0 to 1) the nearest place is.
pub(crate) fn to_segment(p: Vector, from: Vector, to: Vector) -> (f64, f64) {
    let along = sub(to, from);
    let length = dot(along, along);
    let t = if length > 0.0 { (dot(sub(p, from), along) / length).clamp(0.0, 1.0) } else { 0.0 };
    (distance(p, add(from, scale(along, t))), t)
}

/// Mean of points; the origin for none.
pub(crate) fn mean(points: impl Iterator<Item = Vector>) -> Vector {
    let (sum, count) = points.fold(([0.0; 3], 0u32), |(sum, n), p| (add(sum, p), n + 1));
    scale(sum, 1.0 / f64::from(count.max(1)))
}

//! Convex hulls in the plane.

/// Area of the convex hull (monotone chain, Andrew 1979), m2; 0 of fewer than three points.
#[must_use]
pub fn hull_area_m2(mut points_m: Vec<[f64; 2]>) -> f64 {
    points_m.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points_m.dedup();
    let lower = chain(points_m.iter().copied());
    let upper = chain(points_m.iter().rev().copied());
    let corners: Vec<[f64; 2]> = lower.into_iter().chain(upper).collect();
    let Some(&origin) = corners.first() else { return 0.0 };
    let twice: f64 = corners.windows(2).map(|pair| turn(origin, pair[0], pair[1])).sum();
    0.5 * twice.abs()
}

/// Twice the area of a triangle, positive to the left.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Half of the hull, without its last point, which begins the other half.
fn chain(points_m: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut corners: Vec<[f64; 2]> = Vec::new();
    for point in points_m {
        while let [.., a, b] = corners[..]
            && turn(a, b, point) <= 0.0
        {
            corners.pop();
        }
        corners.push(point);
    }
    corners.pop();
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn areas() {
        let square = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 3.0], [1.0, 1.0], [1.0, 0.0]];
        assert_eq!(hull_area_m2(square), 6.0);
        assert_eq!(hull_area_m2(vec![[1.0, 1.0]; 4]), 0.0);
        assert_eq!(hull_area_m2(vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), 0.0);
        assert_eq!(hull_area_m2(Vec::new()), 0.0);
    }

    proptest! {
        #[test]
        fn no_triangle_of_points_is_larger(
            points in prop::collection::vec(prop::array::uniform2(-50i32..50), 3..40),
        ) {
            let points: Vec<[f64; 2]> = points.iter().map(|p| p.map(f64::from)).collect();
            let area = hull_area_m2(points.clone());
            let triangle = 0.5 * turn(points[0], points[1], points[2]).abs();
            prop_assert!(triangle <= area + 1e-9);
        }
    }
}

//! Overlap of convex outlines.

/// Area of a convex polygon, counter-clockwise, m²; 0 with fewer than three corners.
#[must_use]
pub fn area_m2(corners: &[[f64; 2]]) -> f64 {
    let Some(&[x0, y0]) = corners.first() else { return 0.0 };
    let cross = |pair: &[[f64; 2]]| {
        let ([ax, ay], [bx, by]) = (pair[0], pair[1]);
        (ax - x0) * (by - y0) - (bx - x0) * (ay - y0)
    };
    0.5 * corners.windows(2).map(cross).sum::<f64>()
}

/// The part of a convex polygon within another, both counter-clockwise (Sutherland and Hodgman
/// 1974, Reentrant polygon clipping).
#[must_use]
pub fn intersection(polygon: &[[f64; 2]], within: &[[f64; 2]]) -> Vec<[f64; 2]> {
    if within.len() < 3 {
        return Vec::new();
    }
    let mut kept = polygon.to_vec();
    for (i, &from) in within.iter().enumerate() {
        kept = left_of(&kept, from, within[(i + 1) % within.len()]);
    }
    kept
}

/// The part of a polygon left of a line.
fn left_of(polygon: &[[f64; 2]], from: [f64; 2], to: [f64; 2]) -> Vec<[f64; 2]> {
    let side =
        |p: [f64; 2]| (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0]);
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (at_a, at_b) = (side(a), side(b));
        if at_a >= 0.0 {
            kept.push(a);
        }
        if (at_a > 0.0 && at_b < 0.0) || (at_a < 0.0 && at_b > 0.0) {
            let share = at_a / (at_a - at_b);
            kept.push([a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])]);
        }
    }
    kept
}

/// Intersection over union of two convex polygons, counter-clockwise; 0 when either has no area.
#[must_use]
pub fn iou(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let (area_a, area_b) = (area_m2(a), area_m2(b));
    if area_a <= 0.0 || area_b <= 0.0 {
        return 0.0;
    }
    let shared = area_m2(&intersection(a, b)).max(0.0);
    shared / (area_a + area_b - shared)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use timberline_crowns::footprint::footprint;

    fn square(x: f64, y: f64, edge: f64) -> Vec<[f64; 2]> {
        vec![[x, y], [x + edge, y], [x + edge, y + edge], [x, y + edge]]
    }

    #[test]
    fn squares() {
        let at = |x| iou(&square(0.0, 0.0, 2.0), &square(x, 0.0, 2.0));
        assert!((at(0.0) - 1.0).abs() < 1e-12);
        assert!((at(1.0) - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!((at(2.0), at(5.0)), (0.0, 0.0));
        let inner = iou(&square(0.0, 0.0, 4.0), &square(1.0, 1.0, 2.0));
        assert!((inner - 0.25).abs() < 1e-12);
        assert_eq!(iou(&square(0.0, 0.0, 4.0), &[[1.0, 1.0], [2.0, 2.0]]), 0.0);
        assert_eq!(iou(&[], &[]), 0.0);
    }

    proptest! {
        #[test]
        fn symmetric_and_bounded(
            a in prop::collection::vec((-50i32..50, -50i32..50), 3..20),
            b in prop::collection::vec((-50i32..50, -50i32..50), 3..20),
        ) {
            let hull = |points: &[(i32, i32)]| {
                footprint(points.iter().map(|p| [f64::from(p.0) * 0.1, f64::from(p.1) * 0.1])).corners
            };
            let (a, b) = (hull(&a), hull(&b));
            let (one, other) = (iou(&a, &b), iou(&b, &a));
            prop_assert!((one - other).abs() < 1e-9 && (0.0..=1.0 + 1e-9).contains(&one));
            if area_m2(&a) > 0.0 {
                prop_assert!((iou(&a, &a) - 1.0).abs() < 1e-9);
            }
        }
    }
}

//! A crown's outline seen from above.

use timberline_pointcloud::frame::{TICK_M, TICKS_PER_M};

/// A convex polygon around a crown.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Footprint {
    /// Corners relative to the apex, m, counter-clockwise from the westernmost (southernmost of
    /// equals); no corner lies on the line between its neighbours.
    pub corners: Vec<[f64; 2]>,
    /// Area, m².
    pub area_m2: f64,
    /// Largest distance between two corners, m.
    pub max_diameter_m: f64,
    /// Diameter of the circle of the same area, m.
    pub mean_diameter_m: f64,
}

/// The convex hull of positions relative to an apex, in metres.
///
/// Positions are rounded to the world lattice first, so that turns are decided in integers.
/// Fewer than three positions, or all on a line, give a polygon without area: the ends of the line.
#[must_use]
pub fn footprint(offsets: impl IntoIterator<Item = [f64; 2]>) -> Footprint {
    let ticks = |value: f64| (value * TICKS_PER_M).round() as i64;
    let mut points: Vec<[i64; 2]> = offsets.into_iter().map(|p| p.map(ticks)).collect();
    points.sort_unstable();
    points.dedup();
    let mut corners = chain(points.iter().copied());
    let upper = chain(points.iter().rev().copied());
    if points.len() > 1 {
        corners.pop();
        corners.extend_from_slice(&upper[..upper.len() - 1]);
    }
    measured(&corners)
}

/// One side of the hull: keeps only left turns.
fn chain(points: impl Iterator<Item = [i64; 2]>) -> Vec<[i64; 2]> {
    let mut side: Vec<[i64; 2]> = Vec::new();
    for point in points {
        while let [.., a, b] = side[..]
            && cross(a, b, point) <= 0
        {
            side.pop();
        }
        side.push(point);
    }
    side
}

fn cross(a: [i64; 2], b: [i64; 2], c: [i64; 2]) -> i128 {
    let along = |k: usize, from: [i64; 2], to: [i64; 2]| i128::from(to[k] - from[k]);
    along(0, a, b) * along(1, a, c) - along(1, a, b) * along(0, a, c)
}

fn measured(corners: &[[i64; 2]]) -> Footprint {
    let Some(&first) = corners.first() else { return Footprint::default() };
    let next = |i: usize| corners.get(i + 1).copied().unwrap_or(first);
    let distance = |a: [i64; 2], b: [i64; 2]| {
        let (dx, dy) = ((b[0] - a[0]) as f64, (b[1] - a[1]) as f64);
        (dx * dx + dy * dy).sqrt() * TICK_M
    };
    let twice: i128 = (0..corners.len()).map(|i| cross(first, corners[i], next(i))).sum();
    let area_m2 = 0.5 * twice as f64 * TICK_M * TICK_M;
    let widest = corners
        .iter()
        .enumerate()
        .flat_map(|(i, &a)| corners[..i].iter().map(move |&b| distance(a, b)))
        .fold(0.0, f64::max);
    Footprint {
        corners: corners
            .iter()
            .map(|corner| corner.map(|tick| tick as f64 / TICKS_PER_M))
            .collect(),
        area_m2,
        max_diameter_m: widest,
        mean_diameter_m: 2.0 * (area_m2 / std::f64::consts::PI).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_square_with_points_on_its_edges() {
        let square =
            [[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [2.0, 2.0], [0.0, 2.0], [1.0, 1.0], [0.0, 1.0]];
        let found = footprint(square);
        assert_eq!(found.corners, [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        assert!((found.area_m2 - 4.0).abs() < 1e-9);
        assert!((found.max_diameter_m - 8f64.sqrt()).abs() < 1e-9);
        assert!((found.mean_diameter_m - 4.0 / std::f64::consts::PI.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn nothing_one_and_a_line() {
        assert_eq!(footprint([]), Footprint::default());
        assert_eq!(footprint([[1.0, 1.0], [1.0, 1.0]]).corners, [[1.0, 1.0]]);
        let line = footprint([[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]]);
        assert_eq!(line.corners, [[0.0, 0.0], [3.0, 3.0]]);
        assert_eq!(line.area_m2, 0.0);
    }

    #[test]
    fn a_circle_has_its_diameter() {
        let circle = (0..720).map(|i| {
            let (sin, cos) = libm::sincos(f64::from(i) * std::f64::consts::PI / 360.0);
            [3.0 * cos, 3.0 * sin]
        });
        let found = footprint(circle);
        assert!(
            (found.mean_diameter_m - 6.0).abs() < 1e-3 && (found.max_diameter_m - 6.0).abs() < 1e-3
        );
    }

    proptest! {
        #[test]
        fn convex_and_around_all(points in prop::collection::vec((-30i32..30, -30i32..30), 3..60)) {
            let offsets: Vec<[f64; 2]> = points.iter().map(|p| [f64::from(p.0) * 0.1, f64::from(p.1) * 0.1]).collect();
            let found = footprint(offsets.iter().copied());
            prop_assume!(found.corners.len() > 2);
            let tick = |p: [f64; 2]| p.map(|v| (v * TICKS_PER_M).round() as i64);
            for (i, &a) in found.corners.iter().enumerate() {
                let b = found.corners[(i + 1) % found.corners.len()];
                prop_assert!(offsets.iter().all(|&p| cross(tick(a), tick(b), tick(p)) >= 0));
            }
        }
    }
}

//! Whether a crown is cut by the edge of the scanned area.

use timberline_pointcloud::Grid2;

/// Width of the ring around the crown in which points are looked for, m.
pub const MARGIN_M: f64 = 3.0;

/// Directions looked into.
const SECTORS: usize = 16;

/// Neighbouring directions without any point that make an edge: 45 degrees, 3 m² even around
/// the smallest crowns, so that a scan of 1.6 points/m² is not taken for its own edge.
const EMPTY_RUN: usize = 2;

/// Whether the ring of [`MARGIN_M`] around a crown has no points at all, of whatever kind, in
/// two neighbouring sectors of sixteen: the scan then ends there (or has a hole: open water, say).
///
/// Positions and apex are in one frame, metres.
#[must_use]
pub fn at_survey_edge([x, y]: [&[f64]; 2], grid: &Grid2, apex: [f64; 2], radius_m: f64) -> bool {
    let outer = radius_m + MARGIN_M;
    let mut seen = [false; SECTORS];
    grid.candidates(apex[0], apex[1], outer, |i| {
        let (dx, dy) = (x[i] - apex[0], y[i] - apex[1]);
        let squared = dx * dx + dy * dy;
        if squared > radius_m * radius_m && squared <= outer * outer {
            seen[sector(dx, dy)] = true;
        }
    });
    let empty = |first: usize| (0..EMPTY_RUN).all(|k| !seen[(first + k) % SECTORS]);
    (0..SECTORS).any(empty)
}

/// The sector of a direction, counter-clockwise from east: the quadrant by signs, then the part of
/// it by tangents of 22.5, 45 and 67.5 degrees.
fn sector(dx: f64, dy: f64) -> usize {
    let (quadrant, along, across) = match (dx > 0.0, dy >= 0.0) {
        (true, true) => (0, dx, dy),
        (false, true) => (1, dy, -dx),
        (false, false) => (2, -dx, -dy),
        (true, false) => (3, -dy, dx),
    };
    const TANGENTS: [f64; 3] =
        [std::f64::consts::SQRT_2 - 1.0, 1.0, std::f64::consts::SQRT_2 + 1.0];
    quadrant * 4 + TANGENTS.iter().filter(|&&tangent| across >= tangent * along).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sectors_go_round() {
        let at = |degrees: f64| {
            let (sin, cos) = libm::sincos(degrees.to_radians());
            sector(cos, sin)
        };
        for k in 0..SECTORS {
            assert_eq!(at(22.5 * k as f64 + 11.0), k);
        }
    }

    #[test]
    fn an_edge_is_seen_and_an_even_scan_has_none() {
        let field = |west: i32| -> (Vec<f64>, Vec<f64>) {
            (west..30)
                .flat_map(|i| (-30..30).map(move |j| (f64::from(i) * 0.5, f64::from(j) * 0.5)))
                .unzip()
        };
        let judge = |west: i32| {
            let (x, y) = field(west);
            at_survey_edge([&x, &y], &Grid2::new(&x, &y, 2.0).unwrap(), [0.1, 0.1], 2.0)
        };
        assert!(!judge(-30));
        assert!(judge(-3), "the scan ends 1.6 m west of the apex, the crown 2 m");
        assert!(!judge(-9));
    }
}

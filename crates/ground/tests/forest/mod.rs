//! A made-up steep forest with outliers.

#![allow(dead_code, reason = "not every test uses all of it")]

use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::{Frame, Point, PointCloud};

/// A reproducible number in 0..1 (`SplitMix64`).
pub(crate) fn hash01(i: usize) -> f64 {
    let mut z = (i as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

pub(crate) const ORIGIN: [f64; 2] = [481_200.0, 3_813_000.0];

/// Elevation of a steep slope with a gully.
pub(crate) fn terrain(x: f64, y: f64) -> f64 {
    812.0 + 0.7 * x + 2.0 * libm::sin(x / 11.0)
        - 6.0 * libm::exp(-((y - 70.0) / 6.0) * ((y - 70.0) / 6.0))
}

/// Ground points of uneven density over a square, with roughness.
pub(crate) fn ground(count: usize, edge: f64) -> Vec<[f64; 3]> {
    (0..count)
        .map(|i| {
            let crowd = if hash01(7 * i + 3) < 0.5 { 0.25 } else { 1.0 };
            let (x, y) = (hash01(5 * i) * edge * crowd, hash01(5 * i + 1) * edge);
            let z = terrain(x, y) + 0.1 * (hash01(5 * i + 2) - 0.5);
            [ORIGIN[0] + x, ORIGIN[1] + y, z].map(quantise)
        })
        .collect()
}

/// A forest on that terrain: ground seen by one pulse in four, crowns of 12 to 30 m, a few low outliers.
pub(crate) fn forest(count: usize, edge: f64) -> Vec<[f64; 3]> {
    (0..count)
        .map(|i| {
            let (x, y) = (hash01(9 * i) * edge, hash01(9 * i + 1) * edge);
            let above = match hash01(9 * i + 2) {
                u if u < 0.25 => 0.08 * (hash01(9 * i + 3) - 0.5),
                u if u < 0.2503 => -4.0 - 6.0 * hash01(9 * i + 4),
                _ => 12.0 + 18.0 * hash01(9 * i + 5),
            };
            [ORIGIN[0] + x, ORIGIN[1] + y, terrain(x, y) + above].map(quantise)
        })
        .collect()
}

pub(crate) fn cloud_of(points: &[[f64; 3]], frame: Frame) -> PointCloud {
    let mut cloud = PointCloud::new(frame);
    let point = Point { return_number: 1, number_of_returns: 1, ..Point::default() };
    points.iter().for_each(|world| cloud.push_world(*world, &point));
    cloud.in_canonical_order()
}

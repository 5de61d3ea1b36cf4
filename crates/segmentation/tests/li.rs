//! The indexed Li et al. 2012 against the quadratic one.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

mod li_reference;

use proptest::prelude::*;
use timberline_segmentation::{LiParams, methods::li};

proptest! {
    #[test]
    fn the_index_changes_nothing(
        points in prop::collection::vec((-60i32..60, -60i32..60, 0i32..60), 1..300),
        window in 0i32..4, radius in 1i32..12, lattice in prop::bool::ANY,
    ) {
        // On a lattice many distances and heights are equal.
        let step = if lattice { 0.5 } else { 0.213 };
        let x: Vec<f64> = points.iter().map(|p| step * f64::from(p.0)).collect();
        let y: Vec<f64> = points.iter().map(|p| step * f64::from(p.1)).collect();
        let height: Vec<f32> = points.iter().map(|p| 0.5 * p.2 as f32).collect();
        let params = LiParams {
            window_m: f64::from(window),
            max_radius_m: f64::from(radius),
            min_height_m: 1.0,
            ..LiParams::default()
        };
        let found = li::trees(&x, &y, &height, &params).unwrap();
        prop_assert_eq!(found, li_reference::trees(&x, &y, &height, &params));
    }
}

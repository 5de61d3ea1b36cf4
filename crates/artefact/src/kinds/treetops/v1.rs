//! Version 1 of the treetops: local maxima in windows without an upper end, each as good as another.

use serde::{Deserialize, Serialize};

/// Treetops as version 1 wrote them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Treetops {
    tops: Vec<Treetop>,
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
struct Treetop {
    id: u64,
    point: u32,
    apex_m: [f64; 3],
    height_m: f64,
    window_m: f64,
    prominence_m: f64,
}

impl From<Treetops> for super::Treetops {
    fn from(old: Treetops) -> Self {
        Self { tops: old.tops.into_iter().map(Into::into).collect() }
    }
}

impl From<Treetop> for super::Treetop {
    fn from(old: Treetop) -> Self {
        Self {
            id: old.id,
            point: old.point,
            apex_m: old.apex_m,
            height_m: old.height_m,
            window_m: old.window_m,
            prominence_m: old.prominence_m,
            score: 1.0,
            cover_m: 0.0,
        }
    }
}

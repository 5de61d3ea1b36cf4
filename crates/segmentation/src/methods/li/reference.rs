//! The paper word for word, every point compared with all others: what the indexed one must equal.

use super::LiParams;
use crate::Segments;

fn squared(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    dx * dx + dy * dy
}

fn nearest(at: [f64; 2], set: &[[f64; 2]]) -> f64 {
    set.iter().map(|other| squared(at, *other)).fold(f64::INFINITY, f64::min)
}

/// As [`super::trees`].
pub(super) fn trees(x: &[f64], y: &[f64], height_m: &[f32], params: &LiParams) -> Segments {
    let at = |i: usize| [x[i], y[i]];
    let mut left: Vec<usize> = (0..x.len()).filter(|&i| !height_m[i].is_nan()).collect();
    left.sort_by(|&a, &b| height_m[b].total_cmp(&height_m[a]).then(a.cmp(&b)));
    let all = left.clone();
    let is_maximum = |i: usize| {
        let higher = all.iter().take_while(|&&j| j != i);
        !higher.into_iter().any(|&j| squared(at(i), at(j)) <= params.window_m * params.window_m)
            || params.window_m == 0.0
    };
    let mut segments = Segments { tops: Vec::new(), tree: vec![Segments::NONE; x.len()] };
    while let Some(&top) = left.first() {
        if f64::from(height_m[top]) < params.min_top_m {
            break;
        }
        let (mut tree, mut not_tree) = (vec![at(top)], Vec::new());
        let mut rest = Vec::new();
        for &u in &left {
            if u != top && squared(at(u), at(top)) > params.max_radius_m * params.max_radius_m {
                rest.push(u);
                continue;
            }
            let (dmin1, dmin2) = (nearest(at(u), &tree), nearest(at(u), &not_tree));
            let gap = if f64::from(height_m[u]) > params.split_height_m {
                params.gap_high_m
            } else {
                params.gap_low_m
            };
            let belongs = if is_maximum(u) { dmin1.sqrt() <= gap && dmin1 <= dmin2 } else { dmin1 <= dmin2 };
            if belongs || u == top {
                tree.push(at(u));
                segments.tree[u] = segments.tops.len() as u32;
            } else {
                not_tree.push(at(u));
                rest.push(u);
            }
        }
        segments.tops.push(top as u32);
        left = rest;
    }
    for (i, tree) in segments.tree.iter_mut().enumerate() {
        if f64::from(height_m[i]) < params.min_height_m {
            *tree = Segments::NONE;
        }
    }
    segments
}

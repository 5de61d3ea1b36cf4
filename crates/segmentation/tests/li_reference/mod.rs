//! Li et al. 2012 word for word, every point compared with all others: what the indexed one must
//! equal.

use timberline_segmentation::{LiParams, Segments};

fn squared(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    dx * dx + dy * dy
}

fn nearest_squared(at: [f64; 2], set: &[[f64; 2]]) -> f64 {
    set.iter().map(|other| squared(at, *other)).fold(f64::INFINITY, f64::min)
}

/// Points from the highest down, with whether each is a local maximum.
fn from_the_top(x: &[f64], y: &[f64], height_m: &[f32], window_m: f64) -> Vec<(usize, bool)> {
    let mut order: Vec<usize> = (0..x.len()).filter(|&i| !height_m[i].is_nan()).collect();
    order.sort_by(|&a, &b| height_m[b].total_cmp(&height_m[a]).then(a.cmp(&b)));
    let higher_near = |rank: usize| {
        let at = |i: usize| [x[order[i]], y[order[i]]];
        window_m > 0.0 && (0..rank).any(|i| squared(at(i), at(rank)) <= window_m * window_m)
    };
    (0..order.len()).map(|rank| (order[rank], !higher_near(rank))).collect()
}

/// As `methods::li::trees`.
pub(crate) fn trees(x: &[f64], y: &[f64], height_m: &[f32], params: &LiParams) -> Segments {
    let at = |i: usize| [x[i], y[i]];
    let height = |i: usize| f64::from(height_m[i]);
    let radius = params.max_radius_m * params.max_radius_m;
    let mut left = from_the_top(x, y, height_m, params.window_m);
    let mut segments = Segments { tops: Vec::new(), tree: vec![Segments::NONE; x.len()] };
    while let Some(&(top, _)) = left.first().filter(|(top, _)| height(*top) >= params.min_top_m) {
        let (mut tree, mut not_tree) = (vec![at(top)], Vec::new());
        left.retain(|&(u, is_maximum)| {
            if squared(at(u), at(top)) > radius {
                return true;
            }
            let dmin1 = nearest_squared(at(u), &tree);
            let dmin2 = nearest_squared(at(u), &not_tree);
            let high = height(u) > params.split_height_m;
            let dt = if high { params.gap_high_m } else { params.gap_low_m };
            let belongs = dmin1 <= dmin2 && (!is_maximum || dmin1.sqrt() <= dt);
            if belongs {
                tree.push(at(u));
                segments.tree[u] = segments.tops.len() as u32;
            } else {
                not_tree.push(at(u));
            }
            !belongs
        });
        segments.tops.push(top as u32);
    }
    for (i, tree) in segments.tree.iter_mut().enumerate() {
        if height(i) < params.min_height_m {
            *tree = Segments::NONE;
        }
    }
    segments
}

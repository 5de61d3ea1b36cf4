//! The papers' methods written down as they are described, without regard to cost.

use std::collections::BTreeMap;

/// Column and row of a raster.
pub(crate) type Cell = [i64; 2];

/// Heights by cell; cells that are not there have none.
pub(crate) type Heights = BTreeMap<Cell, f64>;

/// A tree: where its apex is.
pub(crate) type Apex = Cell;

pub(crate) fn squared(a: Cell, b: Cell) -> f64 {
    ((a[0] - b[0]).pow(2) + (a[1] - b[1]).pow(2)) as f64
}

/// Immersion (Vincent and Soille 1991, section 4.1, with given markers; on the heights upside down):
/// level by level downwards, basins spread into all that is connected with them at that level.
/// Heights must be distinct. Returns the index of the apex by cell.
pub(crate) fn immersion(heights: &Heights, apexes: &[Apex], least: f64) -> BTreeMap<Cell, usize> {
    let mut levels: Vec<f64> = heights.values().copied().filter(|h| *h >= least).collect();
    levels.sort_by(|a, b| b.total_cmp(a));
    let mut labels: BTreeMap<Cell, usize> = BTreeMap::new();
    // When a cell was reached: of two basins that meet at a cell, the one that came to it first.
    let mut since: BTreeMap<Cell, usize> = BTreeMap::new();
    for level in levels {
        for (apex, cell) in apexes.iter().enumerate() {
            if heights.get(cell).is_some_and(|h| *h == level) && !labels.contains_key(cell) {
                labels.insert(*cell, apex);
                since.insert(*cell, since.len());
            }
        }
        loop {
            let open = |cell: &Cell| heights[cell] >= level && !labels.contains_key(cell);
            let shore = heights.keys().filter(|cell| open(cell)).filter_map(|cell| {
                let near = around(*cell).filter(|near| labels.contains_key(near));
                near.min_by_key(|near| since[near]).map(|near| (since[&near], *cell, labels[&near]))
            });
            let Some((_, cell, label)) = shore.min() else { break };
            labels.insert(cell, label);
            since.insert(cell, since.len());
        }
    }
    labels
}

fn around([column, row]: Cell) -> impl Iterator<Item = Cell> {
    let offsets = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [dx, dy]));
    offsets.filter(|d| *d != [0, 0]).map(move |[dx, dy]| [column + dx, row + dy])
}

fn beside([column, row]: Cell) -> [Cell; 4] {
    [[column, row - 1], [column - 1, row], [column + 1, row], [column, row + 1]]
}

/// Thresholds of Dalponte and Coomes 2016.
pub(crate) struct Dalponte {
    pub(crate) least: f64,
    pub(crate) seed_share: f64,
    pub(crate) crown_share: f64,
    /// In cells.
    pub(crate) radius: f64,
}

/// Dalponte and Coomes 2016: sweep after sweep over all cells of all crowns, until nothing changes.
pub(crate) fn dalponte(
    heights: &Heights,
    apexes: &[Apex],
    how: &Dalponte,
) -> BTreeMap<Cell, usize> {
    let mut labels: BTreeMap<Cell, usize> =
        apexes.iter().enumerate().map(|(apex, cell)| (*cell, apex)).collect();
    loop {
        let mut wanted: BTreeMap<Cell, usize> = BTreeMap::new();
        for (apex, top) in apexes.iter().enumerate() {
            let crown: Vec<Cell> =
                labels.iter().filter(|(_, label)| **label == apex).map(|(cell, _)| *cell).collect();
            let mean = crown.iter().map(|cell| heights[cell]).sum::<f64>() / crown.len() as f64;
            for next in crown.iter().flat_map(|cell| beside(*cell)) {
                let Some(height) = heights.get(&next) else { continue };
                let taken = labels.contains_key(&next)
                    || wanted
                        .get(&next)
                        .is_some_and(|other| heights[&apexes[*other]] >= heights[top]);
                let fits = *height > how.least
                    && *height > how.seed_share * heights[top]
                    && *height > how.crown_share * mean
                    && *height <= 1.05 * heights[top]
                    && squared(next, *top) <= how.radius * how.radius;
                if !taken && fits {
                    wanted.insert(next, apex);
                }
            }
        }
        if wanted.is_empty() {
            return labels;
        }
        labels.extend(wanted);
    }
}

/// Silva et al. 2016: every cell to the nearest apex, if near and high enough.
pub(crate) fn silva(
    heights: &Heights,
    apexes: &[Apex],
    [least, radius_share, least_share]: [f64; 3],
    cell_m: f64,
) -> BTreeMap<Cell, usize> {
    let mut labels = BTreeMap::new();
    for (cell, height) in heights {
        let rank = |apex: &usize| (squared(apexes[*apex], *cell), *apex);
        let nearest = (0..apexes.len()).min_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap());
        if let Some(apex) = nearest {
            let top = heights[&apexes[apex]];
            let near = squared(apexes[apex], *cell).sqrt() * cell_m <= radius_share * top;
            if near && *height >= least_share * top && *height >= least {
                labels.insert(*cell, apex);
            }
        }
    }
    labels
}

/// Height of the Delaunay triangulation of points over a position: that of the triangle which holds it
/// and whose circumcircle holds no other point. Triangles with a longer edge do not count.
pub(crate) fn delaunay(points: &[[f64; 3]], at: [f64; 2], longest: f64) -> Option<f64> {
    for i in 0..points.len() {
        for j in i + 1..points.len() {
            for k in j + 1..points.len() {
                let corners = [points[i], points[j], points[k]];
                let long = (0..3).any(|c| {
                    let (p, q) = (corners[c], corners[(c + 1) % 3]);
                    (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2) > longest * longest
                });
                if !long
                    && let Some(height) = over(&corners, at)
                    && points.iter().all(|p| !in_circle(&corners, *p))
                {
                    return Some(height);
                }
            }
        }
    }
    None
}

fn twice_area(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// Height of a triangle's plane over a position in it.
fn over([a, b, c]: &[[f64; 3]; 3], at: [f64; 2]) -> Option<f64> {
    let p = [at[0], at[1], 0.0];
    let all = twice_area(*a, *b, *c);
    let shares =
        [twice_area(p, *b, *c) / all, twice_area(*a, p, *c) / all, twice_area(*a, *b, p) / all];
    let inside = shares.iter().all(|share| *share >= 0.0);
    inside.then(|| shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2])
}

fn in_circle([a, b, c]: &[[f64; 3]; 3], p: [f64; 3]) -> bool {
    let row = |q: &[f64; 3]| {
        let (x, y) = (q[0] - p[0], q[1] - p[1]);
        [x, y, x * x + y * y]
    };
    let [a0, b0, c0] = [row(a), row(b), row(c)];
    let determinant = a0[0] * (b0[1] * c0[2] - b0[2] * c0[1])
        - a0[1] * (b0[0] * c0[2] - b0[2] * c0[0])
        + a0[2] * (b0[0] * c0[1] - b0[1] * c0[0]);
    determinant * twice_area(*a, *b, *c) > 1e-9
}

//! Where a tree begins.

use crate::cloud::compare;
use crate::vector::{Vector, squared};

/// Share of the height of which AdTree measures the first radius (Du et al. 2019, its code).
const LOWEST_SHARE: f64 = 0.02;

/// The vertex that paths begin at: the one nearest to the base where that is known, else the lowest;
/// among those that may be.
pub(crate) fn root(points: &[Vector], base_m: Option<Vector>, may: impl Fn(u32) -> bool) -> u32 {
    let all = (0..points.len() as u32).filter(|&v| may(v));
    let at = |v: &u32| points[*v as usize];
    let found = match base_m {
        Some(base) => all.min_by(|a, b| {
            squared(at(a), base).total_cmp(&squared(at(b), base)).then(compare(&at(a), &at(b)))
        }),
        None => all.min_by(|a, b| compare(&at(a), &at(b))),
    };
    found.unwrap_or(0)
}

/// Half the larger horizontal extent of points, m.
pub(crate) fn first_radius_m(points: &[Vector], of: &[u32]) -> f64 {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &v in of {
        let p = points[v as usize];
        for axis in 0..2 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
    }
    (0..2).map(|axis| 0.5 * (high[axis] - low[axis])).fold(0.0, f64::max)
}

/// The points within the lowest share of the tree's height.
pub(crate) fn lowest(points: &[Vector]) -> Vec<u32> {
    let low = points.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    let high = points.iter().map(|p| p[2]).fold(f64::NEG_INFINITY, f64::max);
    let upto = low + LOWEST_SHARE * (high - low);
    (0..points.len() as u32).filter(|&v| points[v as usize][2] <= upto).collect()
}

//! Where consolidation did harm, and points are put back.

use crate::ConsolidationParams;
use crate::consolidate::{Effect, effect_of};
use crate::surface::{Found, Query};

/// Edge of the cubes that are judged by themselves, m; a power of two, so that they lie the same in
/// every frame.
const CUBE_M: f64 = 0.5;
/// A cube with fewer places to compare has no verdict of its own.
const FEWEST: usize = 20;

/// Where the result stands.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Verdict {
    /// Cubes in which it does not, sorted.
    put_back: Vec<[i64; 3]>,
    /// Mean distances of points from the surface everywhere, had nothing been put back, m.
    pub(crate) before_m: f64,
    pub(crate) after_m: f64,
    /// What was gained, with points put back.
    pub(crate) effect: Effect,
}

fn cube(point: [f64; 3]) -> [i64; 3] {
    point.map(|value| (value / CUBE_M).floor() as i64)
}

impl Verdict {
    /// Whether the result stands around a point.
    pub(crate) fn stands_at(&self, point: [f64; 3]) -> bool {
        self.put_back.binary_search(&cube(point)).is_err()
    }
}

/// Compares the distances of points from the surface before and after, cube by cube. In the paper's
/// mode everything stands.
pub(crate) fn judge(
    queries: &[Query],
    before: &[Option<Found>],
    after: &[Option<Found>],
    params: &ConsolidationParams,
) -> Verdict {
    let pairs = queries.iter().zip(before.iter().zip(after));
    let mut pairs: Vec<([i64; 3], (Found, Found))> = pairs
        .filter_map(|(query, (before, after))| Some((cube(query.at_m), ((*before)?, (*after)?))))
        .collect();
    pairs.sort_by_key(|(cube, _)| *cube);
    let all = effect_of(&pairs.iter().map(|(_, pair)| *pair).collect::<Vec<_>>());
    let worse = |before_m: f64, after_m: f64| after_m > before_m * params.worst_distance_ratio;
    let mut put_back = Vec::new();
    for members in pairs.chunk_by_mut(|a, b| a.0 == b.0) {
        let sum = |side: fn(&(Found, Found)) -> f64| members.iter().map(|(_, p)| side(p)).sum();
        let (before_m, after_m) = (sum(|p| p.0.distance_m), sum(|p| p.1.distance_m));
        if !params.paper && members.len() >= FEWEST && worse(before_m, after_m) {
            put_back.push(members[0].0);
            members.iter_mut().for_each(|(_, pair)| pair.1 = pair.0);
        }
    }
    let effect = effect_of(&pairs.iter().map(|(_, pair)| *pair).collect::<Vec<_>>());
    let (before_m, after_m) = (all.distance_before_m, all.distance_after_m);
    Verdict { put_back, before_m, after_m, effect }
}

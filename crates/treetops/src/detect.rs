//! The detection of treetops.

use crate::candidates::Scene;
use crate::input::Ranked;
use crate::maxima::{CELL_TICKS, Surface, cell_ticks};
use crate::model::MODEL;
use crate::prominence::prominence;
use crate::window::Window;
use crate::{Candidate, Error, Input, Method, Params, apart};
use rayon::prelude::*;
use timberline_pointcloud::order;

/// A treetop: a candidate for a tree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Treetop {
    /// Index of its point in the cloud.
    pub index: u32,
    /// Position in the world, metres.
    pub world_m: [f64; 3],
    /// Height above ground, metres.
    pub height_m: f64,
    /// Diameter or edge of the window in which nothing outranks it, metres; for the method by
    /// evidence, in which nothing lies just above it (within `candidate_gap_m`).
    pub window_m: f64,
    /// Least descent on a way to anything higher, metres; see [`crate::prominence`]. NaN for the
    /// method by evidence, which does not ask for it.
    pub prominence_m: f64,
    /// Probability that it is the top of a tree, by the points around it; 1 for the method by window.
    pub score: f64,
    /// Height of what hangs over it, metres above it; 0 where nothing does.
    pub cover_m: f64,
}

/// Finds the treetops of a cloud, in the canonical order of their points.
///
/// The result is the same in any frame and for any order of the points (but for the indices), and
/// whether a point is a top depends only on points within [`Params::halo_m`] of it in the plane.
/// Cost by window: a sort of the points, then about constant time per half-metre cell. By
/// evidence: for every candidate a look at all points within [`REACH_M`](crate::evidence::REACH_M).
///
/// # Errors
/// [`Error::Params`] when [`Params::check`] finds something, [`Error::Length`] when a column does
/// not fit the cloud, [`Error::TooManyPoints`] beyond 2^32.
pub fn find(input: &Input<'_>, params: &Params) -> Result<Vec<Treetop>, Error> {
    let wrong = params.check();
    if !wrong.is_empty() {
        return Err(Error::Params(wrong));
    }
    input.check()?;
    let ranked = Ranked { input, params };
    let mut tops = match params.method {
        Method::Evidence => by_evidence(&ranked)?,
        Method::Window => by_window(ranked),
    };
    tops.sort_by(|a, b| order::compare(input.cloud, a.index as usize, b.index as usize));
    Ok(tops)
}

/// The candidates of a cloud with what there is to say about them, from which their scores follow:
/// what the model behind the score is found on.
///
/// # Errors
/// As [`find`].
pub fn candidates(input: &Input<'_>, params: &Params) -> Result<Vec<Candidate>, Error> {
    input.check()?;
    Ok(Scene::new(Ranked { input, params })?.candidates())
}

fn by_evidence(ranked: &Ranked<'_>) -> Result<Vec<Treetop>, Error> {
    let scored = Scene::new(*ranked)?.candidates().into_par_iter().map(|candidate| {
        let score = MODEL.probability(&candidate.evidence);
        (candidate, score)
    });
    let scored = scored.filter(|(_, score)| *score >= ranked.params.min_score).collect();
    let treetop = |(candidate, score): (Candidate, f64)| Treetop {
        index: candidate.index,
        world_m: ranked.input.cloud.world(candidate.index as usize),
        height_m: ranked.height(candidate.index as usize),
        window_m: 2.0 * ranked.params.candidate_radius_m,
        prominence_m: f64::NAN,
        score,
        cover_m: candidate.cover_m,
    };
    Ok(apart::keep(ranked, scored)?.into_iter().map(treetop).collect())
}

fn by_window(ranked: Ranked<'_>) -> Vec<Treetop> {
    let params = ranked.params;
    let edge = cell_ticks(params);
    let fine = Surface::new(ranked, edge);
    let candidates = maxima(&fine);
    let coarse = if edge == CELL_TICKS { fine } else { Surface::new(ranked, CELL_TICKS) };
    let tops = candidates.into_par_iter().map(|(index, window)| treetop(&coarse, index, window));
    tops.filter(|top| stands_out(params, top)).collect()
}

/// The points of the surface that no other of their window outranks, with their windows.
fn maxima(surface: &Surface<'_>) -> Vec<(u32, Window)> {
    let ranked = &surface.ranked;
    let test = |&index: &u32| {
        let place = index as usize;
        let window = ranked.may_be_top(place).then(|| surface.test(place)).flatten();
        window.map(|window| (index, window))
    };
    surface.best.par_iter().flatten().filter_map(test).collect()
}

fn treetop(surface: &Surface<'_>, index: u32, window: Window) -> Treetop {
    let ranked = &surface.ranked;
    Treetop {
        index,
        world_m: ranked.input.cloud.world(index as usize),
        height_m: ranked.height(index as usize),
        window_m: window.size_m,
        prominence_m: prominence(surface, index as usize),
        score: 1.0,
        cover_m: 0.0,
    }
}

fn stands_out(params: &Params, top: &Treetop) -> bool {
    let least = params.min_prominence_m.max(params.min_prominence_ratio * top.height_m);
    top.prominence_m >= least
}

#[cfg(test)]
mod tests {
    use super::MODEL;
    use crate::evidence::LEN;

    #[test]
    fn the_model_asks_for_values_that_there_are() {
        assert!(MODEL.nodes.iter().all(|node| usize::from(node.0) < LEN));
    }
}

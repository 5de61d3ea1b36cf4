//! The default model: `h = b1 r + b2 r²`, b1, b2 >= 0, by MSAC with an extent and L1 refinement.

use super::extent::{Extent, Scoring};
use super::lad::{self, Row};
use super::model::{Model, Shape};
use crate::Window;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;

/// Refinements after which the set of inliers is taken as settled.
const MAX_REFINEMENTS: usize = 4;

/// Share of its score a refined surface must keep. MSAC's squares are drawn to the echoes from inside
/// the crown, all on one side, so the better surface scores a little less; one that loses more has
/// left the crown.
const KEPT_SCORE: f64 = 0.8;

/// How hard the search works.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Pairs of points tried (all pairs when they are not more).
    pub draws: usize,
    /// Points on which trials are scored; refinement uses as many.
    pub scored_points: usize,
}

/// The surface through two points, held to coefficients that are not negative: where the two ask
/// for a negative one it is set to 0 and the farther point decides.
#[must_use]
pub fn through_two(near: (f64, f64), far: (f64, f64)) -> Option<Model> {
    let (slope_near, slope_far) = (near.1 / near.0, far.1 / far.0);
    if !(near.0 > 0.0 && slope_far > 0.0 && slope_far.is_finite()) {
        return None;
    }
    let b2 = (slope_far - slope_near) / (far.0 - near.0);
    let b1 = slope_far - b2 * far.0;
    let (b1, b2) = match (b1 >= 0.0, b2 >= 0.0) {
        (true, true) => (b1, b2),
        (true, false) => (slope_far, 0.0),
        _ => (0.0, slope_far / far.0),
    };
    Some(Model { shape: Shape::TwoParameter, b1, b2 })
}

/// The best surface found and its extent in `window`.
///
/// Trials pass through pairs of points drawn evenly over the distance (an even draw over the
/// points would take most from the rim, where other crowns begin). The best is refined by least
/// absolute deviations on its inliers.
#[must_use]
pub fn search(
    window: &Window,
    scoring: &Scoring,
    effort: Effort,
    random: &mut ChaCha8Rng,
) -> Option<(Model, Extent)> {
    let thin = window.thinned(effort.scored_points);
    let eligible: Vec<(f64, f64)> = thin
        .r
        .iter()
        .zip(&thin.h)
        .filter(|&(&r, &h)| r > 0.0 && h.is_finite())
        .map(|(&r, &h)| (r, h))
        .collect();
    let mut best: Option<(Model, Extent)> = None;
    for_each_pair(eligible.len(), effort.draws, random, |i, j| {
        let floor = best.map_or(0.0, |(_, extent)| extent.score);
        if let Some(model) = through_two(eligible[i], eligible[j])
            && let Some(extent) = scoring.extent(&model, &thin, floor)
        {
            best = Some((model, extent));
        }
    });
    let (model, _) = refined(best?, &thin, scoring);
    scoring.extent(&model, window, 0.0).map(|extent| (model, extent))
}

/// Calls `visit` with pairs i < j of places below `len`: all of them, or `draws` random ones.
fn for_each_pair(
    len: usize,
    draws: usize,
    random: &mut ChaCha8Rng,
    mut visit: impl FnMut(usize, usize),
) {
    if len < 2 {
        return;
    }
    if len * (len - 1) / 2 <= draws {
        (0..len).for_each(|j| (0..j).for_each(|i| visit(i, j)));
        return;
    }
    for _ in 0..draws {
        let (i, j) = (pick_inward(random, len), pick_inward(random, len));
        if i != j {
            visit(i.min(j), i.max(j));
        }
    }
}

/// A place with a density of 1 / sqrt(place): even over the distance for points even in the plane.
fn pick_inward(random: &mut ChaCha8Rng, len: usize) -> usize {
    const BITS: u32 = 24;
    let u = (random.next_u64() >> (64 - BITS)) as usize;
    let scaled = (u as u128 * u as u128 * len as u128) >> (2 * BITS);
    (scaled as usize).min(len - 1)
}

/// Least absolute deviations on the inliers, a few times over as the inliers change.
fn refined(mut best: (Model, Extent), window: &Window, scoring: &Scoring) -> (Model, Extent) {
    for _ in 0..MAX_REFINEMENTS {
        let (model, extent) = best;
        let inlier =
            |&place: &usize| scoring.is_inlier(model.distance(window.r[place], window.h[place]));
        let row = |place: usize| {
            let (r, h) = (window.r[place], window.h[place]);
            let weight = model.obliquity(r);
            Row { u: weight * r, v: weight * r * r, target: weight * h }
        };
        let rows: Vec<Row> = (0..extent.points).filter(inlier).map(row).collect();
        let [b1, b2] = lad::refine(&rows, [model.b1, model.b2]);
        let next = Model { shape: Shape::TwoParameter, b1, b2 };
        match scoring.extent(&next, window, KEPT_SCORE * extent.score) {
            Some(extent) if next != model => best = (next, extent),
            _ => break,
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand_chacha::rand_core::SeedableRng;

    #[test]
    fn negative_coefficients_are_refused_not_squared_away() {
        let cone = through_two((1.0, 2.0), (2.0, 3.0)).unwrap();
        assert_eq!((cone.b1, cone.b2), (1.5, 0.0));
        let paraboloid = through_two((1.0, 0.1), (2.0, 4.0)).unwrap();
        assert_eq!((paraboloid.b1, paraboloid.b2), (0.0, 1.0));
        assert_eq!(through_two((1.0, 1.0), (2.0, -1.0)), None);
        assert_eq!(through_two((0.0, 0.0), (2.0, 1.0)), None);
    }

    #[test]
    fn inward_picks_are_even_in_distance() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let places: Vec<usize> = (0..4000).map(|_| pick_inward(&mut random, 10_000)).collect();
        let within_half = places.iter().filter(|&&place| place < 2500).count();
        assert!(
            (1800..2200).contains(&within_half),
            "{within_half}: r = 1/2 holds a quarter of the points"
        );
    }

    proptest! {
        #[test]
        fn a_clean_crown_is_recovered(b1 in 0.2f64..3.0, b2 in 0.0f64..0.8, seed in 0u64..1000) {
            let crown = Model { shape: Shape::TwoParameter, b1, b2 };
            let points = (0..150u32).map(|i| {
                let (sin, cos) = libm::sincos(f64::from(i) * 2.4);
                let r = 3.0 * (f64::from(i) / 150.0).sqrt();
                (i, [r * cos, r * sin, -crown.depth(r)], true)
            });
            let window = Window::new(points);
            let scoring = Scoring { tolerance_m: 0.4, outlier_cost: 0.5 };
            let effort = Effort { draws: 60, scored_points: 1000 };
            let (model, extent) = search(&window, &scoring, effort, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            prop_assert_eq!(extent.points, 150);
            prop_assert!((model.b1 - b1).abs() < 1e-6 && (model.b2 - b2).abs() < 1e-6, "{:?}", model);
        }
    }
}

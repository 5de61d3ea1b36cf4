//! One-parameter models by consensus: the paper's sampling, and the exact optimum.

use super::model::{Interval, Model, Shape};
use crate::Window;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::Rng;

/// A model with the number of points nearer to it than the tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Consensus {
    /// The model.
    pub model: Model,
    /// Number of inliers in the whole window.
    pub count: usize,
    /// Sum of squared residuals of the inliers, m².
    pub squares_m2: f64,
}

impl Consensus {
    /// Counts a model's inliers: |residual| < tolerance (Tittmann et al. 2011, section 3).
    #[must_use]
    pub fn of(model: Model, window: &Window, tolerance_m: f64) -> Self {
        let (mut count, mut squares_m2) = (0, 0.0);
        for (&r, &h) in window.r.iter().zip(&window.h) {
            let residual = model.residual(r, h);
            if residual.abs() < tolerance_m {
                count += 1;
                squares_m2 += residual * residual;
            }
        }
        Self { model, count, squares_m2 }
    }

    /// Whether this one is to be preferred: more inliers, then smaller squares, then the flatter
    /// model (so that the choice does not depend on the sequence of trials).
    #[must_use]
    pub fn beats(&self, other: &Self) -> bool {
        other
            .count
            .cmp(&self.count)
            .then_with(|| self.squares_m2.total_cmp(&other.squares_m2))
            .then_with(|| self.model.b1.total_cmp(&other.model.b1))
            .then_with(|| self.model.b2.total_cmp(&other.model.b2))
            .is_lt()
    }

    /// The better of two, either of which may be missing.
    #[must_use]
    pub fn better(left: Option<Self>, right: Option<Self>) -> Option<Self> {
        match (left, right) {
            (Some(a), Some(b)) => Some(if b.beats(&a) { b } else { a }),
            (a, b) => a.or(b),
        }
    }
}

/// Number of draws for which, with probability `confidence`, one at least is of inliers only, when
/// a share `inlier_share` of the points are inliers and a draw takes `k` points: Eq 5 of Tittmann
/// et al. 2011, T = -ln(1 - p) / (c/N)^k, rounded up.
#[must_use]
pub fn draws(confidence: f64, inlier_share: f64, k: i32) -> usize {
    let share = (0..k).fold(1.0, |product, _| product * inlier_share);
    let count = -libm::log(1.0 - confidence) / share;
    if count.is_finite() && count > 0.0 { count.ceil() as usize } else { usize::MAX }
}

/// An unbiased-enough index below `len` from the top bits of one draw (Lemire 2019, without the
/// rejection step: the bias is below `len` / 2^64).
pub(crate) fn pick(random: &mut ChaCha8Rng, len: usize) -> usize {
    ((u128::from(random.next_u64()) * len as u128) >> 64) as usize
}

/// The best of the models through single points of the window, as in the paper: through `trials`
/// points drawn at random, or through every point when that is no more work.
#[must_use]
pub fn sampled(
    shape: Shape,
    window: &Window,
    tolerance_m: f64,
    trials: usize,
    random: &mut ChaCha8Rng,
) -> Option<Consensus> {
    let eligible: Vec<usize> = (0..window.len()).filter(|&i| window.h[i].is_finite()).collect();
    let try_point = |i: usize| {
        let parameter = shape.through(window.r[i], window.h[i])?;
        Some(Consensus::of(shape.model(parameter), window, tolerance_m))
    };
    if trials >= eligible.len() {
        return eligible.into_iter().map(try_point).fold(None, Consensus::better);
    }
    (0..trials)
        .map(|_| try_point(eligible[pick(random, eligible.len())]))
        .fold(None, Consensus::better)
}

/// One range of the parameter in which the number of inliers does not change.
#[derive(Debug, Clone, Copy)]
struct Plateau {
    count: usize,
    low: f64,
    high: f64,
}

/// The model of the family with the largest consensus of all, in O(N log N): every point is an
/// inlier in one interval of the parameter, so the optimum is where most intervals overlap.
///
/// Among ranges of equal count the widest wins, then the lowest; the model is that of the middle.
/// The optimum is that of exact arithmetic up to points within rounding of the tolerance.
#[must_use]
pub fn exact(shape: Shape, window: &Window, tolerance_m: f64) -> Option<Consensus> {
    let mut plateaus = plateaus(shape, window, tolerance_m);
    plateaus.sort_unstable_by(|a, b| {
        b.count
            .cmp(&a.count)
            .then_with(|| (b.high - b.low).total_cmp(&(a.high - a.low)))
            .then_with(|| a.low.total_cmp(&b.low))
    });
    let mut best: Option<Consensus> = None;
    for plateau in plateaus {
        // The recount can fall short of the sweep only by rounding; then the next may be better.
        if best.is_some_and(|found| found.count >= plateau.count) {
            break;
        }
        let middle = plateau.low + 0.5 * (plateau.high - plateau.low);
        let found = Consensus::of(shape.model(middle), window, tolerance_m);
        if best.is_none_or(|before| found.count > before.count) {
            best = Some(found);
        }
    }
    best.filter(|found| found.count > 0)
}

/// Sweeps over the ends of all intervals. Intervals are open: one that ends where another begins
/// does not overlap it, so ends come first.
fn plateaus(shape: Shape, window: &Window, tolerance_m: f64) -> Vec<Plateau> {
    let mut always = 0;
    let mut events: Vec<(f64, bool)> = Vec::with_capacity(2 * window.len());
    for (&r, &h) in window.r.iter().zip(&window.h) {
        match shape.consensus_interval(r, h, tolerance_m) {
            Interval::Never => {}
            Interval::Always => always += 1,
            Interval::Between(low, high) => events.extend([(low, true), (high, false)]),
        }
    }
    events.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let (mut count, mut plateaus) = (always, Vec::new());
    if events.is_empty() && always > 0 && shape == Shape::Blend {
        plateaus.push(Plateau { count, low: 0.0, high: 1.0 });
    }
    for (k, &(low, begins)) in events.iter().enumerate() {
        count = if begins { count + 1 } else { count - 1 };
        if let Some(&(high, _)) = events.get(k + 1)
            && high > low
            && count > 0
        {
            plateaus.push(Plateau { count, low, high });
        }
    }
    plateaus
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand_chacha::rand_core::SeedableRng;

    const SHAPES: [Shape; 3] = [Shape::Paraboloid, Shape::Cone, Shape::Blend];

    fn window(points: &[(f64, f64)]) -> Window {
        Window::new(points.iter().enumerate().map(|(i, p)| (i as u32, [p.0, 0.0, -p.1], true)))
    }

    #[test]
    fn eq_5() {
        assert_eq!(draws(0.99, 0.5, 1), 10, "-ln(0.01) / 0.5 = 9.21");
        assert_eq!(draws(0.99, 0.1, 2), 461);
        assert_eq!(draws(0.99, 0.0, 1), usize::MAX);
    }

    #[test]
    fn a_known_cone_is_found_among_noise() {
        let mut points: Vec<(f64, f64)> =
            (1..30).map(|i| (0.1 * f64::from(i), 0.22 * f64::from(i))).collect();
        points.extend((0..12).map(|i| (3.0 + 0.1 * f64::from(i), 1.0)));
        let found = exact(Shape::Cone, &window(&points), 0.05).unwrap();
        assert!((found.model.b1 - 2.2).abs() < 0.02, "{found:?}");
        assert!(found.count >= 29);
    }

    #[test]
    fn every_point_is_tried_when_draws_are_not_fewer() {
        let points: Vec<(f64, f64)> =
            (1..40).map(|i| (0.1 * f64::from(i), 0.03 * f64::from(i * i % 17))).collect();
        let (window, mut random) = (window(&points), ChaCha8Rng::seed_from_u64(1));
        let before = random.clone();
        let all = sampled(Shape::Cone, &window, 0.1, 39, &mut random);
        assert_eq!(random, before, "no draw is made");
        let few = sampled(Shape::Cone, &window, 0.1, 20, &mut random).unwrap();
        assert!(all.unwrap().count >= few.count);
    }

    #[test]
    fn nothing_eligible_nothing_found() {
        let empty = Window::new([(0, [1.0, 0.0, -1.0], false)]);
        for shape in SHAPES {
            assert_eq!(exact(shape, &empty, 0.3), None);
            assert_eq!(sampled(shape, &empty, 0.3, 5, &mut ChaCha8Rng::seed_from_u64(0)), None);
        }
    }

    proptest! {
        #[test]
        fn the_exact_consensus_is_never_smaller_than_a_sampled_one(
            points in prop::collection::vec((0.0f64..6.0, -1.0f64..12.0), 1..120),
            which in 0usize..3, tolerance in 0.02f64..0.8,
        ) {
            let (shape, window) = (SHAPES[which], window(&points));
            let all = sampled(shape, &window, tolerance - 1e-9, usize::MAX, &mut ChaCha8Rng::seed_from_u64(3));
            let best = exact(shape, &window, tolerance).map_or(0, |found| found.count);
            prop_assert!(best >= all.map_or(0, |found| found.count));
        }

        #[test]
        fn also_on_positions_of_a_coarse_lattice(
            points in prop::collection::vec((0u8..40, 0u8..60), 1..120), which in 0usize..3,
        ) {
            let points: Vec<(f64, f64)> = points.iter().map(|p| (f64::from(p.0) * 0.1, f64::from(p.1) * 0.1)).collect();
            let (shape, window) = (SHAPES[which], window(&points));
            let all = sampled(shape, &window, 0.3 - 1e-9, usize::MAX, &mut ChaCha8Rng::seed_from_u64(3));
            let best = exact(shape, &window, 0.3).map_or(0, |found| found.count);
            prop_assert!(best >= all.map_or(0, |found| found.count));
        }

        #[test]
        fn no_parameter_at_all_has_a_larger_consensus(
            points in prop::collection::vec((0.01f64..6.0, -1.0f64..12.0), 1..60),
            which in 0usize..3, parameter in 0.001f64..1.0,
        ) {
            let (shape, window) = (SHAPES[which], window(&points));
            let any = Consensus::of(shape.model(parameter), &window, 0.3 - 1e-9).count;
            prop_assert!(exact(shape, &window, 0.3).map_or(0, |found| found.count) >= any);
        }
    }
}

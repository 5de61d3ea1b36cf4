//! The operator of weighted locally optimal projection (Huang et al. 2009; Lipman et al. 2007).
//!
//! With theta(r) = exp(-r²/(h/4)²), points p_j and samples x_i, every iteration moves all samples at
//! once (Jacobi) to
//!
//! ```text
//! x_i' = sum_j p_j a_ij/v_j / sum_j a_ij/v_j + mu sum_i' (x_i - x_i') w_i' b_ii' / sum_i' w_i' b_ii'
//! a_ij = theta(|x_i - p_j|)/|x_i - p_j|    v_j = 1 + sum_j' theta(|p_j - p_j'|)
//! b_ii' = theta(|x_i - x_i'|)/|x_i - x_i'|  w_i = 1 + sum_i' theta(|x_i - x_i'|)
//! ```
//!
//! The v_j are computed once, the w_i once an iteration. These are [`Weights::Paper`]. With a = theta and
//! b = theta/r² ([`Weights::Even`], as CGAL has them) the result is thinner and more even: on a plane of
//! 4000 points with noise of 5.8 mm, half of them kept, 1.1 mm instead of 2.8 mm, and the distance to the
//! nearest sample varies by 18 % instead of 44 % (`cargo test -p timberline-wlop
//! noise_across_a_plane -- --nocapture`).
//!
//! What the papers leave open:
//!
//! * **Radii of one's own**: of two points with different h the smaller counts, h_ij = min(h_i, h_j).
//!   That is symmetric, and keeps the points of a thin branch from being pulled by the thick one it
//!   grows from.
//! * **r = 0**, at duplicates and where a sample still lies on the point it was: r is softened to
//!   sqrt(r² + (h/80)²) in a and b. Samples at one place do not push each other and stay together.
//! * **The beginning**: with the paper's weights the first iteration has a = theta and no second term, the
//!   first guess of Lipman et al. 2007; with theta/r a sample hardly leaves the point it was taken from.
//! * **The end of theta**, which is never 0: pairs farther apart than `reach_ratio` h are left out.
//! * **Nothing near**: a sample without neighbours stays where it is.
//!
//! Points are sorted by position first and sums have a fixed sequence: results are the same byte for
//! byte whatever the order of points and the number of threads.

mod cells;
mod kernel;
mod projection;
#[cfg(test)]
mod tests;

use crate::Error;
use projection::{Cloud, Projection};
use rayon::prelude::*;
use timberline_pointcloud::frame::MAX_COORDINATE_M;

/// Smallest and largest support radius, m.
pub(crate) const RADII_M: [f64; 2] = [1e-4, 1e4];

/// The support radius h.
#[derive(Debug, Clone, Copy)]
pub enum Radius<'a> {
    /// The same everywhere, m.
    Everywhere(f64),
    /// One for every point, m; a sample has that of the point it was.
    OfPoints(&'a [f64]),
}

/// What neighbours weigh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weights {
    /// theta/r in both terms: Huang et al. 2009.
    Paper,
    /// theta in the first term and theta/r² in the second.
    Even,
}

/// How the operator is applied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// What neighbours weigh.
    pub weights: Weights,
    /// Weight of the repulsion between samples, 0 to below 0.5 (Huang et al. 2009, section 3).
    pub mu: f64,
    /// Most iterations.
    pub iterations: u32,
    /// Pairs farther apart than this share of h are left out, 0.25 to 1: theta is exp(-16) at 1,
    /// exp(-4) at 0.5.
    pub reach_ratio: f64,
    /// Iterations end when the samples move less than this share of their h, in the mean; 0 never
    /// ends them.
    pub still_ratio: f64,
}

/// Where the samples came to lie.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Positions in the sequence of the samples, m.
    pub positions_m: Vec<[f64; 3]>,
    /// Iterations made.
    pub iterations: u32,
    /// Mean over the samples of their last movement over their h.
    pub last_move_ratio: f64,
}

/// Moves the samples, which are some of the points (by index), onto the surface that the points
/// suggest. Positions are in metres in any one local frame.
///
/// # Errors
/// [`Error::Position`], [`Error::Radius`], [`Error::Length`], [`Error::Index`], [`Error::TooManyPoints`]
/// or [`Error::Params`] naming the value.
pub fn project(
    points: &[[f64; 3]],
    samples: &[u32],
    radius: Radius<'_>,
    settings: &Settings,
) -> Result<Outcome, Error> {
    check(points, samples, radius, settings)?;
    let radius_of = |i: usize| match radius {
        Radius::Everywhere(h) => h,
        Radius::OfPoints(h) => h[i],
    };
    let order = by_position(points, radius_of);
    let mut places = vec![0u32; points.len()];
    order.iter().zip(0..).for_each(|(&index, place)| places[index as usize] = place);
    let mut sequence: Vec<u32> = (0..samples.len() as u32).collect();
    sequence.sort_by_key(|&s| places[samples[s as usize] as usize]);

    let cloud = Cloud::new(order.iter().map(|&i| (points[i as usize], radius_of(i as usize))));
    let kept = sequence.iter().map(|&s| samples[s as usize] as usize);
    let start = Cloud::new(kept.map(|i| (points[i], radius_of(i))));
    let moved = Projection::new(&cloud, &start, settings).run(start);
    let mut positions_m = vec![[0.0; 3]; samples.len()];
    for (&sample, at) in sequence.iter().zip(&moved.positions_m) {
        positions_m[sample as usize] = *at;
    }
    Ok(Outcome { positions_m, ..moved })
}

/// Weighted scatter of the points around every point about their mean (xx, xy, xz, yy, yz, zz in m²),
/// with theta of the given radii as weights and `reach_ratio` as in [`Settings`].
///
/// The sums depend on the sequence of the points in their last bits: sort them first.
pub(crate) fn scatters(points: &[[f64; 3]], h_m: &[f64], reach_ratio: f64) -> Vec<[f32; 6]> {
    let cloud = Cloud::new(points.iter().copied().zip(h_m.iter().copied()));
    let weights = Weights::Even;
    let settings = Settings { weights, mu: 0.0, iterations: 0, reach_ratio, still_ratio: 0.0 };
    cloud.scatters(&settings)
}

fn check(
    points: &[[f64; 3]],
    samples: &[u32],
    radius: Radius<'_>,
    settings: &Settings,
) -> Result<(), Error> {
    if points.len() >= u32::MAX as usize {
        return Err(Error::TooManyPoints(points.len()));
    }
    crate::error::check_positions(points, MAX_COORDINATE_M)?;
    let radii = match radius {
        Radius::Everywhere(h) => &[h][..],
        Radius::OfPoints(h) if h.len() != points.len() => {
            return Err(Error::Length { column: "radius", expected: points.len(), found: h.len() });
        }
        Radius::OfPoints(h) => h,
    };
    if let Some(h) = radii.iter().find(|h| !(RADII_M[0]..=RADII_M[1]).contains(*h)) {
        return Err(Error::Radius { found_m: *h, allowed_m: RADII_M });
    }
    if let Some(&index) = samples.iter().find(|i| **i as usize >= points.len()) {
        return Err(Error::Index { index, points: points.len() });
    }
    let wrong = settings.check();
    if wrong.is_empty() { Ok(()) } else { Err(Error::Params(wrong)) }
}

impl Settings {
    /// What is out of range, one sentence each.
    #[must_use]
    pub fn check(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        for (name, value, low, high) in [
            ("mu", self.mu, 0.0, 0.499),
            ("reach_ratio", self.reach_ratio, 0.25, 1.0),
            ("still_ratio", self.still_ratio, 0.0, 1.0),
        ] {
            if !(low..=high).contains(&value) {
                wrong.push(format!("`{name}` is {value}, allowed are {low} to {high}"));
            }
        }
        wrong
    }
}

/// Indices of points sorted by position, equal ones by radius; equal in both are exchangeable.
fn by_position(points: &[[f64; 3]], radius_of: impl Fn(usize) -> f64) -> Vec<u32> {
    // With their values, so that comparisons do not look them up all over the memory.
    let keyed = points.iter().zip(0..).map(|(p, index)| (*p, radius_of(index as usize), index));
    let mut keyed: Vec<([f64; 3], f64, u32)> = keyed.collect();
    keyed.par_sort_unstable_by(|(p, p_m, i), (q, q_m, j)| {
        let place = p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])).then(p[2].total_cmp(&q[2]));
        place.then_with(|| p_m.total_cmp(q_m)).then(i.cmp(j))
    });
    keyed.into_iter().map(|(_, _, index)| index).collect()
}

//! The whole of it for one tree.

use crate::local::{Radii, radii};
use crate::operator::{RADII_M, Radius, project};
use crate::restore::{Verdict, judge};
use crate::surface::{Found, Query, measure};
use crate::{ConsolidationParams, Error, Method, stem, thin};
use timberline_pointcloud::frame::MAX_COORDINATE_M;
use timberline_pointcloud::order::morton;

/// Thickness and distances are measured at about this many places, evenly spread over the points.
const QUERIES: usize = 20_000;
/// How far around such a place the surface is fitted, over h or the radius of the branch, whichever is
/// smaller: farther around a branch there is no surface, and harm would not be seen.
const QUERY_RADIUS_RATIO: f64 = 0.75;
/// Where fewer than this share of a tree's points can be moved, it is skipped.
const FEWEST_MOVED: f64 = 0.1;

/// One tree, in any one local frame.
#[derive(Debug, Clone, Copy)]
pub struct Tree<'a> {
    /// Its points, m.
    pub points_m: &'a [[f64; 3]],
    /// Where the stem's axis meets the ground, m.
    pub base_m: [f64; 3],
    /// Diameter at breast height, m, if it is known.
    pub dbh_m: Option<f64>,
}

/// The tree after consolidation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Consolidated {
    /// Why it was skipped, if it was; there are no points then.
    pub skipped: Option<Skipped>,
    /// Positions, m, in a sequence that does not depend on that of the input.
    pub positions_m: Vec<[f64; 3]>,
    /// Which point of the input each was.
    pub origins: Vec<u32>,
    /// Whether each was consolidated; the others lie where they lay.
    pub moved: Vec<bool>,
    /// Whether each is part of the stem.
    pub stem: Vec<bool>,
    /// What was gained.
    pub effect: Effect,
}

/// What consolidation did, measured at places whose surroundings it could change. Zeros where a tree
/// was skipped before the value was known.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Effect {
    /// Distinct points before.
    pub points_before: usize,
    /// Points after.
    pub points_after: usize,
    /// Points among these that lie where they lay.
    pub points_left_alone: usize,
    /// Median thickness of the cloud across its surface before, see [`Found::thickness_m`], m.
    pub thickness_before_m: f64,
    /// The same after, m.
    pub thickness_after_m: f64,
    /// Mean distance of the points before from the surface through the other points before, m.
    pub distance_before_m: f64,
    /// Mean distance of the points before from the surface through the points after, m.
    pub distance_after_m: f64,
}

/// Why a tree was not consolidated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Skipped {
    /// It was not asked for.
    #[error("`method` is `none`")]
    NotAsked,
    /// There are too few points.
    #[error("{found} distinct points, fewer than `min_points` = {least}")]
    FewPoints {
        /// Distinct points.
        found: usize,
        /// As many are needed.
        least: u32,
    },
    /// Hardly anywhere are points dense enough for the thickness of the branches.
    #[error(
        "too sparse: only {:.0} % of the points have neighbours enough within the radius of their \
         branch (medians: spacing {:.1} mm, branch radius {:.1} mm)",
        100.0 * .share, 1e3 * .spacing_m, 1e3 * .branch_m
    )]
    Sparse {
        /// Share of the points that could be moved.
        share: f64,
        /// Median spacing, m.
        spacing_m: f64,
        /// Median radius of branches as far as seen, m.
        branch_m: f64,
    },
    /// There is no noise to be taken away.
    #[error("thin already: {:.2} mm, below `noise_floor_m` = {:.2} mm", 1e3 * .found_m, 1e3 * .floor_m)]
    Thin {
        /// Thickness, m.
        found_m: f64,
        /// The floor, m.
        floor_m: f64,
    },
    /// The surface nearly everywhere moved away from the points.
    #[error(
        "the surface would move away from the points nearly everywhere: {:.2} mm instead of {:.2} mm",
        1e3 * .after_m, 1e3 * .before_m
    )]
    Farther {
        /// Mean distance of points from the surface before, m.
        before_m: f64,
        /// The same after, m.
        after_m: f64,
    },
}

/// Consolidates the points of one tree: stem and rest by themselves, put together again.
///
/// The radius h of every point follows the spacing of points around it and stays below the radius
/// of its branch ([`crate::local`]); where that leaves too few neighbours, points stay as they are. Of the
/// others one per cell of about a spacing is kept ([`thin`]) and moved ([`project`]). Where the surface
/// moved away from the points, in cubes of half a metre, they are put back.
///
/// # Errors
/// [`Error::Position`], [`Error::TooManyPoints`], [`Error::Params`] or [`Error::Neighbours`].
pub fn consolidate(tree: &Tree<'_>, params: &ConsolidationParams) -> Result<Consolidated, Error> {
    let wrong = params.check();
    if !wrong.is_empty() {
        return Err(Error::Params(wrong));
    }
    if tree.points_m.len() >= u32::MAX as usize {
        return Err(Error::TooManyPoints(tree.points_m.len()));
    }
    crate::error::check_positions(tree.points_m, MAX_COORDINATE_M)?;
    let cloud = Cloud::new(tree);
    let mut done = Consolidated::default();
    done.effect.points_before = cloud.points.len();
    if params.method == Method::None {
        done.skipped = Some(Skipped::NotAsked);
    } else if cloud.points.len() < params.min_points as usize {
        let (found, least) = (cloud.points.len(), params.min_points);
        done.skipped = Some(Skipped::FewPoints { found, least });
    } else {
        cloud.consolidate(params, &mut done)?;
    }
    Ok(done)
}

/// Distinct points in a sequence of their own.
struct Cloud {
    points: Vec<[f64; 3]>,
    /// Which point of the input each is.
    inputs: Vec<u32>,
    stem: Vec<bool>,
}

/// Where the points would lie: those moved, and those left alone.
struct Moved {
    /// By sample: its point and its new position.
    samples: Vec<(u32, [f64; 3])>,
    /// Whether a point belongs to what was moved, by point.
    movable: Vec<bool>,
    /// Paper's mode: the result is taken whatever it is.
    everything: bool,
}

impl Cloud {
    fn new(tree: &Tree<'_>) -> Self {
        let all = tree.points_m;
        let mut order: Vec<(u64, u32)> = (0..all.len() as u32)
            .map(|i| (morton(all[i as usize][0], all[i as usize][1]), i))
            .collect();
        order.sort_unstable_by(|a, b| {
            let (p, q) = (all[a.1 as usize], all[b.1 as usize]);
            let place =
                p[2].total_cmp(&q[2]).then(p[0].total_cmp(&q[0])).then(p[1].total_cmp(&q[1]));
            a.0.cmp(&b.0).then(place).then(a.1.cmp(&b.1))
        });
        order.dedup_by(|a, b| all[a.1 as usize] == all[b.1 as usize]);
        let inputs: Vec<u32> = order.into_iter().map(|(_, i)| i).collect();
        let points: Vec<[f64; 3]> = inputs.iter().map(|&i| all[i as usize]).collect();
        let stem = stem::stem_points(&points, tree.base_m, tree.dbh_m);
        Self { points, inputs, stem }
    }

    fn consolidate(
        &self,
        params: &ConsolidationParams,
        done: &mut Consolidated,
    ) -> Result<(), Error> {
        let radii = radii(&self.points, params)?;
        let could = radii.h_m.iter().filter(|h| **h > 0.0).count();
        let share = could as f64 / self.points.len() as f64;
        if share < FEWEST_MOVED && !params.paper {
            let [spacing_m, branch_m] =
                [&radii.spacing_m, &radii.branch_m].map(|v| median(v.clone()));
            done.skipped = Some(Skipped::Sparse { share, spacing_m, branch_m });
            return Ok(());
        }
        let queries = self.queries(&radii);
        let identity: Vec<u32> = (0..self.points.len() as u32).collect();
        let before = measure(&self.points, &identity, &queries)?;
        let found_m = median(before.iter().flatten().map(|f| f.thickness_m).collect());
        (done.effect.thickness_before_m, done.effect.thickness_after_m) = (found_m, found_m);
        if found_m < params.noise_floor_m && !params.paper {
            done.skipped = Some(Skipped::Thin { found_m, floor_m: params.noise_floor_m });
            return Ok(());
        }
        let moved = self.moved(&radii, params)?;
        let (after, origins) = self.merged(&moved);
        let verdict = judge(&queries, &before, &measure(&after, &origins, &queries)?, params);
        self.take_over(moved, verdict, done);
        Ok(())
    }

    /// Places to measure at: points that can be moved.
    fn queries(&self, radii: &Radii) -> Vec<Query> {
        let could: Vec<u32> =
            (0..self.points.len() as u32).filter(|&i| radii.h_m[i as usize] > 0.0).collect();
        let step = could.len().div_ceil(QUERIES).max(1);
        let query = |&origin: &u32| Query {
            at_m: self.points[origin as usize],
            radius_m: QUERY_RADIUS_RATIO
                * radii.h_m[origin as usize].min(radii.branch_m[origin as usize]),
            origin,
        };
        could.iter().step_by(step).map(query).collect()
    }

    /// Applies the operator to stem and rest.
    fn moved(&self, radii: &Radii, params: &ConsolidationParams) -> Result<Moved, Error> {
        let movable: Vec<bool> = radii.h_m.iter().map(|h| params.paper || *h > 0.0).collect();
        let mut samples = Vec::new();
        for is_stem in [true, false] {
            let part: Vec<u32> = (0..self.points.len() as u32)
                .filter(|&i| movable[i as usize] && self.stem[i as usize] == is_stem)
                .collect();
            let points: Vec<[f64; 3]> = part.iter().map(|&i| self.points[i as usize]).collect();
            let h_m: Vec<f64> = part.iter().map(|&i| radii.h_m[i as usize]).collect();
            let (kept, radius) = if params.paper {
                (thin::drawn(&points, params.share), Radius::Everywhere(paper_radius_m(&points)))
            } else {
                let edges: Vec<f64> = h_m.iter().map(|h| h * params.thinning_ratio).collect();
                (thin::one_per_cell(&points, &edges), Radius::OfPoints(&h_m))
            };
            let outcome = project(&points, &kept, radius, &params.settings())?;
            let origins = kept.iter().map(|&k| part[k as usize]);
            samples.extend(origins.zip(outcome.positions_m));
        }
        samples.sort_unstable_by_key(|(point, _)| *point);
        Ok(Moved { samples, movable, everything: params.paper })
    }

    /// Everything where it would lie, with the points that it was.
    fn merged(&self, moved: &Moved) -> (Vec<[f64; 3]>, Vec<u32>) {
        let alone = (0..self.points.len() as u32).filter(|&i| !moved.movable[i as usize]);
        let alone = alone.map(|i| (i, self.points[i as usize]));
        let mut all: Vec<(u32, [f64; 3])> = alone.chain(moved.samples.iter().copied()).collect();
        all.sort_unstable_by_key(|(point, _)| *point);
        all.into_iter().map(|(point, at)| (at, point)).unzip()
    }

    /// Puts points back where the verdict says so, and makes the result.
    fn take_over(&self, mut moved: Moved, verdict: Verdict, done: &mut Consolidated) {
        for (movable, point) in moved.movable.iter_mut().zip(&self.points) {
            *movable &= verdict.stands_at(*point);
        }
        moved.samples.retain(|(point, _)| moved.movable[*point as usize]);
        let stands = moved.movable.iter().filter(|m| **m).count() as f64;
        let Verdict { before_m, after_m, effect, .. } = verdict;
        done.effect = Effect { points_before: self.points.len(), ..effect };
        let worse = !moved.everything && effect.distance_after_m > effect.distance_before_m;
        if stands < FEWEST_MOVED * self.points.len() as f64 || worse {
            done.skipped = Some(Skipped::Farther { before_m, after_m });
            return;
        }
        let (positions_m, points) = self.merged(&moved);
        done.moved = points.iter().map(|&i| moved.movable[i as usize]).collect();
        done.stem = points.iter().map(|&i| self.stem[i as usize]).collect();
        done.origins = points.iter().map(|&i| self.inputs[i as usize]).collect();
        done.effect.points_after = points.len();
        done.effect.points_left_alone = done.moved.iter().filter(|m| !**m).count();
        done.positions_m = positions_m;
    }
}

/// Huang et al. 2009: h = 4 sqrt(d/m), with d the diagonal of the bounding box and m the number of
/// points, both as bare numbers of metres and points.
fn paper_radius_m(points: &[[f64; 3]]) -> f64 {
    let mut bounds = timberline_pointcloud::Bounds3::EMPTY;
    points.iter().for_each(|p| bounds.include(*p));
    let diagonal_m = thin::squared_distance(bounds.min, bounds.max).sqrt();
    let radius_m = 4.0 * (diagonal_m / points.len().max(1) as f64).sqrt();
    if radius_m.is_finite() { radius_m.clamp(RADII_M[0], RADII_M[1]) } else { RADII_M[0] }
}

/// The upper median; 0 of nothing.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Medians and means over the places that can be compared.
pub(crate) fn effect_of(pairs: &[(Found, Found)]) -> Effect {
    let mean = |distance: fn(&(Found, Found)) -> f64| {
        pairs.iter().map(distance).sum::<f64>() / pairs.len().max(1) as f64
    };
    Effect {
        thickness_before_m: median(pairs.iter().map(|(b, _)| b.thickness_m).collect()),
        thickness_after_m: median(pairs.iter().map(|(_, a)| a.thickness_m).collect()),
        distance_before_m: mean(|(b, _)| b.distance_m),
        distance_after_m: mean(|(_, a)| a.distance_m),
        ..Effect::default()
    }
}

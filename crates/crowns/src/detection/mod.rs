//! Which candidates are trees.
//!
//! A treetop comes with the probability that the points right around it give it. Its crown model
//! adds what a larger view shows: how much of its surroundings the model explains and how much it
//! does not, and how it gets on with its rivals: a bump on the surface of a higher candidate's crown
//! is a branch of it, a candidate on whose own surface others lie is likely their tree. Not the
//! width of a window decides, but what the crowns gain by standing.
//!
//! The values ([`evidence`]) give a probability by boosted decision trees ([`timberline_boosting`])
//! that were found on stands with known trees.

mod evidence;
mod model;

pub use evidence::{Evidence, LEN, evidence};

use crate::Error;
use model::MODEL;
use rayon::prelude::*;
use timberline_pointcloud::Grid2;

/// A candidate with its crown model. Positions are in any one frame, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Tree id.
    pub id: u64,
    /// Highest point.
    pub apex: [f64; 3],
    /// Its height above ground.
    pub height_m: f64,
    /// Probability that it is the top of a tree, by the points right around it.
    pub score: f64,
    /// Height of what hangs over it; 0 where nothing does.
    pub cover_m: f64,
    /// Depth of the model's surface below the apex at distance r is `b1 r + b2 r²`.
    pub coefficients: [f64; 2],
    /// Radius of the model; 0 without one.
    pub radius_m: f64,
    /// Points on the surface and, within the radius, off it.
    pub inliers: u32,
    /// See `inliers`.
    pub outliers: u32,
    /// Mean distance of the inliers from the surface, as a share of what is tolerated.
    pub residual: f64,
}

/// Candidates that can be looked up by place.
#[derive(Debug)]
pub struct Candidates {
    all: Vec<Candidate>,
    grid: Grid2,
    reach_m: f64,
}

/// Edge of the search grid's cells, m.
const GRID_CELL_M: f64 = 5.0;

impl Candidates {
    /// Candidates in any order; those further than `reach_m` from one another are no rivals.
    ///
    /// # Errors
    /// [`Error::Grid`] for positions that are none.
    pub fn new(mut all: Vec<Candidate>, reach_m: f64) -> Result<Self, Error> {
        all.sort_unstable_by_key(|candidate| candidate.id);
        let column = |axis: usize| all.iter().map(|one| one.apex[axis]).collect::<Vec<f64>>();
        let grid = Grid2::new(&column(0), &column(1), GRID_CELL_M)?;
        Ok(Self { all, grid, reach_m })
    }

    /// The candidates, sorted by id.
    #[must_use]
    pub fn all(&self) -> &[Candidate] {
        &self.all
    }

    /// Candidates within reach of one, and their distances in the plane, sorted by id.
    fn near(&self, own: &Candidate) -> Vec<(&Candidate, f64)> {
        let mut near = Vec::new();
        self.grid.candidates(own.apex[0], own.apex[1], self.reach_m, |place| {
            let other = &self.all[place];
            let (dx, dy) = (other.apex[0] - own.apex[0], other.apex[1] - own.apex[1]);
            let distance = (dx * dx + dy * dy).sqrt();
            if other.id != own.id && distance <= self.reach_m {
                near.push((other, distance));
            }
        });
        near.sort_unstable_by_key(|(other, _)| other.id);
        near
    }

    /// What speaks for and against each candidate, in their order.
    #[must_use]
    pub fn evidence(&self) -> Vec<Evidence> {
        self.all.par_iter().map(|own| evidence(own, &self.near(own))).collect()
    }

    /// The probability that each candidate is a tree, in their order.
    #[must_use]
    pub fn scores(&self) -> Vec<f64> {
        self.evidence().iter().map(|evidence| MODEL.probability(evidence)).collect()
    }

    /// The candidates that are trees: ids and scores, sorted by id. A score is compared with the
    /// least one before it is rounded.
    #[must_use]
    pub fn trees(&self, min_score: f64) -> Vec<(u64, f32)> {
        let scored = self.all.iter().zip(self.scores());
        let trees = scored.filter(|(_, score)| *score >= min_score);
        trees.map(|(candidate, score)| (candidate.id, score as f32)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A round crown of 3 m radius and 6 m depth.
    fn tree(id: u64, x: f64, z: f64, score: f64) -> Candidate {
        Candidate {
            id,
            apex: [x, 0.0, z],
            height_m: z,
            score,
            cover_m: 0.0,
            coefficients: [0.5, 0.5],
            radius_m: 3.0,
            inliers: 120,
            outliers: 12,
            residual: 0.4,
        }
    }

    fn scores(all: &[Candidate]) -> Vec<f64> {
        Candidates::new(all.to_vec(), 10.0).unwrap().scores()
    }

    #[test]
    fn a_bump_on_a_crown_is_less_of_a_tree_than_one_that_stands_apart() {
        let bump = Candidate { radius_m: 0.5, inliers: 9, ..tree(2, 1.5, 18.0, 0.5) };
        let [on, apart] = [1.5, 9.0].map(|x| {
            let bump = Candidate { apex: [x, 0.0, 18.0], ..bump };
            scores(&[tree(1, 0.0, 20.0, 0.95), bump])[1]
        });
        assert!(on < 0.5 && on < apart, "{on} on the crown, {apart} apart");
    }

    #[test]
    fn a_crown_of_its_own_makes_a_tree() {
        let [with, without] = [
            tree(1, 0.0, 20.0, 0.8),
            Candidate {
                coefficients: [0.0; 2],
                radius_m: 0.0,
                inliers: 0,
                outliers: 0,
                residual: 0.0,
                ..tree(1, 0.0, 20.0, 0.8)
            },
        ]
        .map(|one| scores(&[one])[0]);
        assert!(with > 0.8 && with > without, "{with} with a crown, {without} without");
    }

    #[test]
    fn the_model_asks_for_values_that_there_are() {
        assert!(MODEL.nodes.iter().all(|node| usize::from(node.0) < LEN));
    }

    #[test]
    fn trees_are_the_candidates_from_the_least_score_on() {
        let bump = Candidate { radius_m: 0.5, inliers: 9, ..tree(2, 1.5, 18.0, 0.5) };
        let candidates = Candidates::new(vec![bump, tree(1, 0.0, 20.0, 0.95)], 10.0).unwrap();
        let scores = candidates.scores();
        let of = |place: usize| (place as u64 + 1, scores[place] as f32);
        assert!(scores[1] < scores[0]);
        assert_eq!(candidates.trees(scores[1]), [of(0), of(1)]);
        assert_eq!(candidates.trees(scores[1].next_up()), [of(0)]);
        assert_eq!(candidates.trees(1.0), []);
    }

    #[test]
    fn neither_order_nor_frame_nor_far_trees_matter() {
        let all: Vec<Candidate> = (0..40)
            .map(|i| {
                tree(i + 1, 1.25 * i as f64, 12.0 + (i * 7 % 11) as f64, 0.3 + 0.01 * i as f64)
            })
            .collect();
        let moved =
            |one: &Candidate| Candidate { apex: [one.apex[0] + 512.0, 64.0, one.apex[2]], ..*one };
        let mut reversed: Vec<Candidate> = all.iter().map(moved).collect();
        reversed.reverse();
        assert_eq!(scores(&all), scores(&reversed));
        let near: Vec<Candidate> = all.iter().filter(|one| one.apex[0] <= 11.25).copied().collect();
        assert_eq!(scores(&all)[0], scores(&near)[0]);
    }
}

//! The points and what is known about them, and their ranking.

use crate::{Error, Params, RankBy, Returns};
use std::cmp::Ordering;
use timberline_pointcloud::frame::TICKS_PER_M;
use timberline_pointcloud::{PointCloud, order};

/// ASPRS class of ground.
const GROUND: u8 = 2;
/// ASPRS classes that are no surface: low noise, high noise.
const NOISE: [u8; 2] = [7, 18];

/// Points with their heights.
#[derive(Debug, Clone, Copy)]
pub struct Input<'a> {
    /// The points, in any frame and order.
    pub cloud: &'a PointCloud,
    /// Height above ground of every point, metres; NaN where unknown, such points do not take part.
    pub height_m: &'a [f32],
    /// Which points are ground. `None`: those of class 2.
    pub ground: Option<&'a [bool]>,
}

impl<'a> Input<'a> {
    /// Points with ground taken from their classes.
    #[must_use]
    pub fn new(cloud: &'a PointCloud, height_m: &'a [f32]) -> Self {
        Self { cloud, height_m, ground: None }
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        let points = self.cloud.len();
        if u32::try_from(points).is_err() {
            return Err(Error::TooManyPoints(points));
        }
        let lengths = [
            ("height_m", self.height_m.len()),
            ("ground", self.ground.map_or(points, <[bool]>::len)),
            ("y", self.cloud.y.len()),
            ("z", self.cloud.z.len()),
            ("return_number", self.cloud.return_number.len()),
            ("classification", self.cloud.classification.len()),
        ];
        match lengths.into_iter().find(|(_, found)| *found != points) {
            None => Ok(()),
            Some((column, found)) => Err(Error::Length { column, points, found }),
        }
    }
}

/// The points under given parameters: who takes part, who may be a top, who outranks whom.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ranked<'a> {
    pub(crate) input: &'a Input<'a>,
    pub(crate) params: &'a Params,
}

impl Ranked<'_> {
    /// Whether a point is there at all: neither noise nor beyond the height of trees.
    pub(crate) fn takes_part(&self, index: usize) -> bool {
        let height = f64::from(self.input.height_m[index]);
        height <= self.params.max_height_m
            && !NOISE.contains(&self.input.cloud.classification[index])
    }

    /// Whether a point that takes part may be a treetop.
    pub(crate) fn may_be_top(&self, index: usize) -> bool {
        let cloud = self.input.cloud;
        let ground = match self.input.ground {
            Some(ground) => ground[index],
            None => cloud.classification[index] == GROUND,
        };
        let return_fits = match self.params.returns {
            Returns::First => cloud.return_number[index] <= 1,
            Returns::All => true,
        };
        let least = self.params.min_height_m;
        !ground && return_fits && (least == 0.0 || self.height(index) >= least)
    }

    pub(crate) fn height(&self, index: usize) -> f64 {
        f64::from(self.input.height_m[index])
    }

    /// What is ranked: height, or elevation in the local frame.
    pub(crate) fn value(&self, index: usize) -> f64 {
        match self.params.rank_by {
            RankBy::Height => self.height(index),
            RankBy::Elevation => self.input.cloud.z[index],
        }
    }

    /// Whether the first point ranks above the second; of equals the first in canonical order.
    /// Points alike in everything are told apart by index.
    pub(crate) fn outranks(&self, first: usize, second: usize) -> bool {
        match self.value(first).total_cmp(&self.value(second)) {
            Ordering::Greater => true,
            Ordering::Less => false,
            Ordering::Equal => {
                let ordering = order::compare(self.input.cloud, first, second);
                ordering.then(first.cmp(&second)).is_lt()
            }
        }
    }

    /// Offset from one point to another in ticks of the world lattice, whole numbers.
    pub(crate) fn offset_ticks(&self, from: usize, to: usize) -> [f64; 2] {
        let cloud = self.input.cloud;
        let ticks = |column: &[f64]| ((column[to] - column[from]) * TICKS_PER_M).round();
        [ticks(&cloud.x), ticks(&cloud.y)]
    }
}

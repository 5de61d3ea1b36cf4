//! Candidates for treetops: points with nothing just above them.
//!
//! A window without an upper end finds the trees of the upper layer only: whatever stands below
//! another crown has higher points around it. Seen from a candidate, its own crown ends within a
//! metre or two above; what is higher still belongs to others.

use crate::Error;
use crate::evidence::{Evidence, gather};
use crate::input::Ranked;
use rayon::prelude::*;
use timberline_pointcloud::{Grid2, Grid3};

/// A point that may be the top of a tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Index of the point in the cloud.
    pub index: u32,
    /// Height of what hangs over it, metres above it; 0 where nothing does.
    pub cover_m: f64,
    /// What the points around it say.
    pub evidence: Evidence,
}

/// The points that take part, ready to be searched.
pub(crate) struct Scene<'a> {
    pub(crate) ranked: Ranked<'a>,
    pub(crate) grid: Grid2,
    /// Whether a point takes part and is no lone one.
    pub(crate) is_there: Vec<bool>,
}

/// Edge of the search grid's cells in the plane, m.
const GRID_CELL_M: f64 = 1.0;

impl<'a> Scene<'a> {
    pub(crate) fn new(ranked: Ranked<'a>) -> Result<Self, Error> {
        let cloud = ranked.input.cloud;
        let grid = Grid2::new(&cloud.x, &cloud.y, GRID_CELL_M).map_err(Error::Grid)?;
        let radius_m = ranked.params.support_radius_m;
        let space = Grid3::new(&cloud.x, &cloud.y, &cloud.z, radius_m).map_err(Error::Grid)?;
        let is_there =
            |index: usize| ranked.takes_part(index) && is_supported(&ranked, &space, index);
        let is_there = (0..cloud.len()).into_par_iter().map(is_there).collect();
        Ok(Self { ranked, grid, is_there })
    }

    /// The candidates by index: points that may be tops and above which the next `candidate_gap_m`
    /// metres are empty within `candidate_radius_m` in the plane. Of points at one elevation the
    /// first in canonical order counts.
    pub(crate) fn candidates(&self) -> Vec<Candidate> {
        let candidate = |index: u32| {
            let place = index as usize;
            let may_be = self.is_there[place] && self.ranked.may_be_top(place);
            let cover_m = may_be.then(|| self.cover(place)).flatten()?;
            Some(Candidate { index, cover_m, evidence: gather(self, place) })
        };
        (0..self.is_there.len() as u32).into_par_iter().filter_map(candidate).collect()
    }

    /// How high the points above a point reach; none when one of them is just above it.
    fn cover(&self, index: usize) -> Option<f64> {
        let (cloud, params) = (self.ranked.input.cloud, self.ranked.params);
        let (radius_m, gap_m) = (params.candidate_radius_m, params.candidate_gap_m);
        let [x, y, z] = cloud.local(index);
        let mut cover_m = Some(0.0f64);
        self.grid.candidates(x, y, radius_m, |i| {
            let Some(highest) = cover_m else { return };
            let (dx, dy, dz) = (cloud.x[i] - x, cloud.y[i] - y, cloud.z[i] - z);
            let higher = dz > 0.0 || (dz == 0.0 && i != index && self.ranked.outranks(i, index));
            if higher && dx * dx + dy * dy < radius_m * radius_m && self.is_there[i] {
                cover_m = (dz > gap_m).then_some(highest.max(dz));
            }
        });
        cover_m
    }
}

/// Whether enough other points lie in the sphere around a point.
fn is_supported(ranked: &Ranked<'_>, space: &Grid3, index: usize) -> bool {
    let (cloud, params) = (ranked.input.cloud, ranked.params);
    let (radius_m, mut missing) = (params.support_radius_m, params.support_points);
    if missing == 0 {
        return true;
    }
    let [x, y, z] = cloud.local(index);
    space.candidates([x, y, z], radius_m, |i| {
        if missing > 0 && i != index {
            let (dx, dy, dz) = (cloud.x[i] - x, cloud.y[i] - y, cloud.z[i] - z);
            let is_near = dx * dx + dy * dy + dz * dz <= radius_m * radius_m;
            missing -= u32::from(is_near && ranked.takes_part(i));
        }
    });
    missing == 0
}

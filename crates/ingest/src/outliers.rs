//! Marking outliers by the distances to their neighbours.
//!
//! After the statistical outlier removal of Rusu et al. 2008 ("Towards 3D point cloud based object maps
//! for household environments", section 4.1), which compares a point's mean distance to its k nearest
//! neighbours with the mean and the standard deviation over *all* points. That depends on what else is
//! in the cloud, so on how a campaign is cut up, and takes thin far-off parts of a scan for outliers.
//! Here the comparison is local: a point is an outlier when
//!
//! * its mean distance is more than `factor` times the median of its neighbours' mean distances, or
//! * it has fewer than half of k neighbours within reach.
//!
//! Distances beyond the reach count as the reach, so only points within twice the reach matter, and the
//! answer does not depend on the tiles. A ratio to the spacing around leaves evenly thin parts alone,
//! and finds the few points between a stem and what is behind it (mixed pixels) and those in the air.

use crate::Error;
use crate::params::TilesParams;
use rayon::prelude::*;
use timberline_pointcloud::frame::{TICK_M, ticks_from_world};
use timberline_pointcloud::{Nearest3, PointCloud, Rect};

/// Spacings below this are the noise of the ranges, which says nothing (METHODS.md: 1 to 5 mm).
const SMALLEST_SPACING_M: f64 = 1e-3;

/// What is compared with what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Outliers {
    neighbours: usize,
    factor: f64,
    reach_m: f64,
}

impl Outliers {
    /// `None` when nothing is to be marked.
    pub(crate) fn new(params: &TilesParams) -> Option<Self> {
        let neighbours = params.outlier_neighbours as usize;
        let (factor, reach_m) = (params.outlier_factor, params.outlier_reach_m);
        let on = factor > 0.0 && reach_m > 0.0 && neighbours > 0;
        on.then_some(Self { neighbours, factor, reach_m })
    }

    /// How far around a tile points matter, whole metres: its rectangle grown by it has no voxel of
    /// thinning across its border.
    pub(crate) fn halo_m(&self) -> f64 {
        (2.0 * self.reach_m).ceil()
    }

    /// Which points within `own` (in the world) are outliers among all points of the cloud, which must be
    /// in canonical order.
    ///
    /// # Errors
    /// [`Error::Params`] when the tree over the points cannot be built.
    pub(crate) fn of(&self, cloud: &PointCloud, own: &Rect) -> Result<Vec<u32>, Error> {
        // In whole ticks, so that equal distances are equal wherever in the world the points lie: which of
        // them counts is then decided by the order of points.
        let tick = |value: f64| ticks_from_world(value) as f64;
        let at: Vec<[f64; 3]> =
            (0..cloud.len()).map(|index| cloud.local(index).map(tick)).collect();
        let tree = Nearest3::new(&at).map_err(|error| Error::Params(error.to_string()))?;
        let near = own.grown(self.reach_m);
        let around = |index: usize| {
            let [x, y, _] = cloud.world(index);
            if near.contains(x, y) { self.around(&tree, &at, index) } else { self.nothing() }
        };
        let all: Vec<Around> = (0..at.len()).into_par_iter().map(around).collect();
        let is_outlier = |index: &u32| {
            let [x, y, _] = cloud.world(*index as usize);
            own.contains(x, y) && self.is_outlier(&all, *index as usize)
        };
        Ok((0..at.len() as u32).into_par_iter().filter(is_outlier).collect())
    }

    /// A point with no other within reach.
    fn nothing(&self) -> Around {
        Around { mean_m: self.reach_m, others: Vec::new() }
    }

    /// What a point has around it; `at` is in ticks.
    fn around(&self, tree: &Nearest3, at: &[[f64; 3]], index: usize) -> Around {
        let found = tree.nearest(&at[index], self.neighbours + 1).into_iter();
        let near = found
            .filter(|other| other.index != index)
            .map(|other| (other.index as u32, other.squared_m2.sqrt() * TICK_M))
            .filter(|(_, distance_m)| *distance_m <= self.reach_m);
        // Among many points of one place the point itself may not be found.
        let near: Vec<(u32, f64)> = near.take(self.neighbours).collect();
        let missing = (self.neighbours - near.len()) as f64 * self.reach_m;
        let sum: f64 = near.iter().map(|(_, distance_m)| distance_m).sum();
        let mean_m = (sum + missing) / self.neighbours as f64;
        Around { mean_m, others: near.into_iter().map(|(other, _)| other).collect() }
    }

    fn is_outlier(&self, all: &[Around], index: usize) -> bool {
        let Around { mean_m, others } = &all[index];
        if 2 * others.len() < self.neighbours {
            return true;
        }
        let mut means: Vec<f64> = others.iter().map(|&other| all[other as usize].mean_m).collect();
        means.sort_by(f64::total_cmp);
        *mean_m > self.factor * means[means.len() / 2].max(SMALLEST_SPACING_M)
    }
}

/// What a point has around it.
struct Around {
    /// Mean distance to the nearest other points, m; those beyond reach count as the reach.
    mean_m: f64,
    /// Those within reach.
    others: Vec<u32>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use timberline_pointcloud::{Frame, Point};

    const EVERYWHERE: Rect = Rect { min: [-1e6, -1e6], max: [1e6, 1e6] };

    fn outliers() -> Outliers {
        let params = TilesParams { outlier_factor: 3.0, ..TilesParams::default() };
        Outliers::new(&params).unwrap()
    }

    fn cloud(points: impl IntoIterator<Item = [f64; 3]>) -> PointCloud {
        let mut cloud = PointCloud::new(Frame::new([4, -3, 0]));
        points.into_iter().for_each(|at| cloud.push_world(at, &Point::default()));
        cloud.in_canonical_order()
    }

    /// A wall that gets thinner with height, as far parts of a scan are.
    fn wall() -> Vec<[f64; 3]> {
        let mut points = Vec::new();
        let mut z = 0.0;
        while z < 3.0 {
            let step = 0.01 + 0.02 * z;
            let count = (1.0 / step) as i32;
            points.extend((0..count).map(|i| [f64::from(i) * step, 0.0, z]));
            z += step;
        }
        points
    }

    #[test]
    fn points_in_the_air_are_marked_and_thin_parts_are_not() {
        let mut points = wall();
        assert!(outliers().of(&cloud(points.clone()), &EVERYWHERE).unwrap().is_empty());
        let noise = [[0.5, 0.12, 0.4], [0.5, -0.9, 1.0], [0.2, 3.0, 1.0], [0.2, 3.01, 1.0]];
        points.extend(noise);
        let cloud = cloud(points);
        let found = outliers().of(&cloud, &EVERYWHERE).unwrap();
        let found: Vec<f64> = found.into_iter().map(|i| cloud.world(i as usize)[1]).collect();
        assert_eq!(found.len(), noise.len(), "{found:?}");
        assert!(found.iter().all(|y| *y != 0.0));
    }

    #[test]
    fn equal_and_few_points_are_handled() {
        let same = cloud(vec![[1.0, 2.0, 3.0]; 50]);
        assert!(outliers().of(&same, &EVERYWHERE).unwrap().is_empty());
        assert_eq!(outliers().of(&cloud([[1.0; 3], [2.0; 3]]), &EVERYWHERE).unwrap(), [0, 1]);
        assert!(outliers().of(&cloud([]), &EVERYWHERE).unwrap().is_empty());
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

        /// Points beyond the halo do not matter.
        #[test]
        fn a_tile_with_its_halo_gives_what_the_whole_gives(
            points in prop::collection::vec((-2_000i32..4_000, -2_000i32..4_000, 0i32..300), 50..400),
        ) {
            let world: Vec<[f64; 3]> = points.iter().map(|p| [p.0, p.1, p.2].map(|v| f64::from(v) / 1000.0)).collect();
            let own = Rect { min: [0.0, 0.0], max: [1.0, 1.0] };
            let places = |cloud: &PointCloud| -> Vec<[f64; 3]> {
                outliers().of(cloud, &own).unwrap().into_iter().map(|i| cloud.world(i as usize)).collect()
            };
            let halo = own.grown(outliers().halo_m());
            let near = world.iter().filter(|p| halo.contains(p[0], p[1])).copied();
            prop_assert_eq!(places(&cloud(near)), places(&cloud(world.iter().rev().copied())));
        }
    }
}

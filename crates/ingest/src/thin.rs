//! Thinning: of all points in a voxel the one nearest to their centroid.
//!
//! The point is one that was measured, with its attributes; of several equally near the first in
//! canonical order. Voxels are cubes of a whole fraction of a metre, on a lattice fixed in the world:
//! tiles begin at whole metres, so no voxel lies in two tiles, and what is kept depends neither on the
//! tiles nor on the sequence of points. All is reckoned in whole ticks of 0.1 mm, so it is exact.

use timberline_pointcloud::PointCloud;
use timberline_pointcloud::frame::{TICKS_PER_M, ticks_from_world};

/// A lattice of voxels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Voxels {
    /// Voxels along a metre.
    per_m: i64,
}

impl Voxels {
    /// Voxels of at most `edge_m`: a whole number of them makes a metre. `None` for 0.
    pub(crate) fn new(edge_m: f64) -> Option<Self> {
        // Slack for edges such as 0.1, of which ten are a little more than a metre.
        let per_m = (1.0 / edge_m - 1e-9).ceil();
        (edge_m > 0.0 && per_m.is_finite()).then(|| Self { per_m: (per_m as i64).max(1) })
    }

    fn of(self, ticks: [i64; 3]) -> [i64; 3] {
        ticks.map(|ticks| (ticks * self.per_m).div_euclid(TICKS_PER_M as i64))
    }

    /// Indices of the points that are kept, ascending. The cloud must be in canonical order.
    pub(crate) fn keep(self, cloud: &PointCloud) -> Vec<u32> {
        let ticks = |index: u32| cloud.world(index as usize).map(ticks_from_world);
        // Relative to the frame's origin, which is at whole metres, voxels have 32 bits.
        let origin = cloud.frame.origin_m.map(|origin_m| origin_m * self.per_m);
        let voxel = |index: u32| {
            let voxel = self.of(ticks(index));
            let relative: [i64; 3] = std::array::from_fn(|axis| voxel[axis] - origin[axis]);
            relative.map(|place| place as i32)
        };
        let mut places: Vec<([i32; 3], u32)> =
            (0..cloud.len() as u32).map(|index| (voxel(index), index)).collect();
        places.sort_unstable();
        let mut kept: Vec<u32> = places
            .chunk_by(|a, b| a.0 == b.0)
            .filter_map(|points| {
                let mut sum = Sum::default();
                points.iter().for_each(|(_, index)| sum.add(ticks(*index)));
                // The first of several that are equally near: they come in canonical order.
                points
                    .iter()
                    .map(|(_, index)| *index)
                    .min_by_key(|i| sum.scaled_distance(ticks(*i)))
            })
            .collect();
        kept.sort_unstable();
        kept
    }
}

/// The points of a voxel, relative to the first that was met.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    count: i64,
    from: [i64; 3],
    sum: [i64; 3],
}

impl Sum {
    fn add(&mut self, at: [i64; 3]) {
        if self.count == 0 {
            self.from = at;
        }
        self.count += 1;
        (0..3).for_each(|axis| self.sum[axis] += at[axis] - self.from[axis]);
    }

    /// Squared distance to the centroid, times the square of the number of points.
    fn scaled_distance(&self, at: [i64; 3]) -> u128 {
        let axis = |axis: usize| {
            let off = (at[axis] - self.from[axis]) * self.count - self.sum[axis];
            u128::from(off.unsigned_abs()).pow(2)
        };
        axis(0) + axis(1) + axis(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use timberline_pointcloud::{Frame, Point};

    fn cloud(points: &[[f64; 3]], origin: i64) -> PointCloud {
        let mut cloud = PointCloud::new(Frame::new([origin, -origin, 0]));
        points.iter().for_each(|at| cloud.push_world(*at, &Point::default()));
        cloud.in_canonical_order()
    }

    #[test]
    fn the_point_nearest_the_centroid_is_kept() {
        let points =
            [[0.001, 0.001, 0.001], [0.012, 0.01, 0.009], [0.019, 0.019, 0.019], [0.021, 0.0, 0.0]];
        let cloud = cloud(&points, 0);
        let kept = Voxels::new(0.02).unwrap().keep(&cloud);
        let mut kept: Vec<[f64; 3]> = kept.into_iter().map(|i| cloud.world(i as usize)).collect();
        kept.sort_by(|a, b| a[0].total_cmp(&b[0]));
        assert_eq!(kept, [points[1], points[3]]);
    }

    #[test]
    fn voxels_are_fractions_of_a_metre() {
        let per_m = |edge_m: f64| Voxels::new(edge_m).unwrap().per_m;
        assert_eq!(
            [per_m(0.02), per_m(0.03), per_m(0.1), per_m(1.0), per_m(0.001)],
            [50, 34, 10, 1, 1000]
        );
        assert_eq!((Voxels::new(0.0), Voxels::new(f64::NAN)), (None, None));
    }

    proptest! {
        /// Neither the sequence of points nor the frame nor the tiles matter; one point stays of each voxel.
        #[test]
        fn thinning_is_the_same_in_tiles(
            points in prop::collection::vec((-30_000i64..30_000, -30_000i64..30_000, -900i64..900), 1..150),
            edge in prop::sample::select(vec![0.01, 0.03, 0.05, 0.3]),
        ) {
            let world: Vec<[f64; 3]> = points.iter().map(|p| [p.0, p.1, p.2].map(timberline_pointcloud::frame::world_from_ticks)).collect();
            let voxels = Voxels::new(edge).unwrap();
            let kept = |cloud: &PointCloud| -> Vec<[i64; 3]> {
                let mut kept: Vec<_> = voxels.keep(cloud).into_iter().map(|i| cloud.world(i as usize).map(ticks_from_world)).collect();
                kept.sort_unstable();
                kept
            };
            let whole = kept(&cloud(&world, 0));
            let reversed: Vec<_> = world.iter().rev().copied().collect();
            prop_assert_eq!(&kept(&cloud(&reversed, 7)), &whole);
            let mut tiles: Vec<_> = [(true, true), (true, false), (false, true), (false, false)]
                .into_iter()
                .flat_map(|(east, north)| {
                    let part: Vec<_> = world.iter().filter(|p| (p[0] >= 1.0) == east && (p[1] >= -1.0) == north).copied().collect();
                    kept(&cloud(&part, 3))
                })
                .collect();
            tiles.sort_unstable();
            prop_assert_eq!(&tiles, &whole);
            let mut voxel: Vec<_> = whole.iter().map(|at| voxels.of(*at)).collect();
            voxel.dedup();
            voxel.sort_unstable();
            voxel.dedup();
            prop_assert_eq!(voxel.len(), whole.len());
        }
    }
}

//! Counts of points in world-fixed voxels, by which isolated points are told.
//!
//! The counts of a tile's surroundings are the sum over all files, so the answer depends neither on
//! the tiles nor on the sequence of files. After the isolated voxel filter of lidR (`ivf`) and
//! LAStools (`lasnoise`). Those also take the few returns that reach the ground under an old forest,
//! and the tips of its highest trees: here only what hangs above everything, with a gap, is isolated.
//! Points below the ground are the ground filter's affair.

use crate::rules;
use timberline_pointcloud::PointCloud;

/// Edge of a voxel: lasnoise's default step (LAStools; lidR's `ivf` has 5 m).
pub(crate) const VOXEL_M: f64 = 4.0;

/// A voxel: index of its cell along x, y, z.
pub(crate) type Voxel = [i32; 3];

/// How many points must lie below, for each point that makes a voxel isolated: in sparse or empty
/// surroundings nothing is.
const MASS_FACTOR: u64 = 10;

/// The voxel of a world position.
pub(crate) fn voxel_of(world_m: [f64; 3]) -> Voxel {
    world_m.map(|value| floor(value / VOXEL_M))
}

/// The whole number at or below a value; `f64::floor` is a function call on older processors.
pub(crate) fn floor(value: f64) -> i32 {
    let cut = value as i32;
    cut - i32::from(f64::from(cut) > value)
}

/// Counts the points of a cloud by voxel, sorted.
pub(crate) fn count(cloud: &PointCloud) -> Vec<(Voxel, u32)> {
    let mut runs: Vec<(Voxel, u32)> = Vec::new();
    for index in 0..cloud.len() {
        if !rules::is_company(cloud.classification[index], cloud.flags[index]) {
            continue;
        }
        let voxel = voxel_of(cloud.world(index));
        match runs.last_mut() {
            Some((last, count)) if *last == voxel => *count += 1,
            _ => runs.push((voxel, 1)),
        }
    }
    merge(runs)
}

/// Sorts counts and adds up those of one voxel.
pub(crate) fn merge(mut counts: Vec<(Voxel, u32)>) -> Vec<(Voxel, u32)> {
    counts.sort_unstable_by_key(|entry| entry.0);
    counts.dedup_by(|next, kept| {
        let same = next.0 == kept.0;
        if same {
            kept.1 = kept.1.saturating_add(next.1);
        }
        same
    });
    counts
}

/// How far around a tile points can share the neighbourhood of a voxel with points of the tile.
pub(crate) const REACH_M: f64 = 2.0 * VOXEL_M;

/// Answers which voxels are isolated.
#[derive(Debug, Clone)]
pub(crate) struct Isolation {
    /// Sorted by x, y, z.
    counts: Vec<(Voxel, u32)>,
    limit: u64,
}

impl Isolation {
    /// Takes the merged counts of a neighbourhood and the largest number of points that is isolated.
    pub(crate) fn new(counts: Vec<(Voxel, u32)>, limit: u32) -> Self {
        Self { counts, limit: u64::from(limit) }
    }

    /// Whether the points of a voxel hang in the air above everything: a handful at most in the 9
    /// columns from the layer below the voxel upwards, then at least one empty layer, then many.
    ///
    /// The ground under a canopy has nothing below it and so is never isolated; the tip of a crown
    /// has the crown within a layer.
    pub(crate) fn is_isolated(&self, voxel: Voxel) -> bool {
        let [x, y, z] = voxel;
        let layers = |low: i32, high: i32| -> u64 {
            let columns = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy)));
            columns
                .map(|(dx, dy)| [x.saturating_add(dx), y.saturating_add(dy)])
                .map(|[x, y]| self.sum([x, y, low], [x, y, high]))
                .sum()
        };
        layers(z.saturating_sub(1), i32::MAX) <= self.limit
            && layers(z.saturating_sub(2), z.saturating_sub(2)) == 0
            && layers(i32::MIN, z.saturating_sub(3)) >= MASS_FACTOR * (self.limit + 1)
    }

    /// Points in the voxels from one to another of the same column.
    fn sum(&self, low: Voxel, high: Voxel) -> u64 {
        let first = self.counts.partition_point(|entry| entry.0 < low);
        let run = self.counts[first..].iter().take_while(|entry| entry.0 <= high);
        run.map(|entry| u64::from(entry.1)).sum()
    }

    /// Points in one voxel.
    pub(crate) fn own(&self, voxel: Voxel) -> u64 {
        self.sum(voxel, voxel)
    }

    /// The limit above which a voxel alone is company enough.
    pub(crate) fn limit(&self) -> u64 {
        self.limit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timberline_pointcloud::Point;

    fn forest(extra: &[[f64; 3]]) -> PointCloud {
        let mut cloud = PointCloud::default();
        for i in 0..20 {
            for j in 0..20 {
                let at = [f64::from(i), f64::from(j), f64::from((i * 7 + j * 3) % 15)];
                cloud.push_world(at, &Point::default());
            }
        }
        extra.iter().for_each(|at| cloud.push_world(*at, &Point::default()));
        cloud
    }

    #[test]
    fn birds_are_isolated_treetops_and_ground_are_not() {
        let cloud = forest(&[[10.0, 10.0, 36.0], [5.0, 5.0, -60.0], [8.0, 8.0, 22.9]]);
        let isolation = Isolation::new(count(&cloud), 2);
        let isolated = |index: usize| isolation.is_isolated(voxel_of(cloud.world(index)));
        assert!(isolated(400));
        assert!(!isolated(401) && !isolated(402));
        assert!((0..400).all(|index| !isolated(index)));
    }

    #[test]
    fn a_single_return_from_the_ground_under_a_canopy_stays() {
        let mut cloud = PointCloud::default();
        for i in 0..20 {
            for j in 0..20 {
                cloud.push_world([f64::from(i), f64::from(j), 40.0], &Point::default());
            }
        }
        cloud.push_world([10.0, 10.0, 0.0], &Point::default());
        let isolation = Isolation::new(count(&cloud), 2);
        assert!(!isolation.is_isolated(voxel_of([10.0, 10.0, 0.0])));
    }

    #[test]
    fn floors() {
        for value in [0.0, -0.0, 0.5, -0.5, -1.0, 7.999, -7.001, 123_456.0] {
            assert_eq!(floor(value), f64::floor(value) as i32, "{value}");
        }
    }

    #[test]
    fn a_sparse_cloud_is_left_alone() {
        let mut cloud = PointCloud::default();
        (0..50).for_each(|i| cloud.push_world([f64::from(i) * 40.0, 0.0, 0.0], &Point::default()));
        let isolation = Isolation::new(count(&cloud), 2);
        assert!((0..50).all(|i| !isolation.is_isolated(voxel_of(cloud.world(i)))));
    }

    #[test]
    fn noise_by_class_is_no_company() {
        let mut cloud = forest(&[]);
        for _ in 0..9 {
            let noise = Point { classification: 7, ..Point::default() };
            cloud.push_world([10.0, 10.0, 90.0], &noise);
        }
        let isolation = Isolation::new(count(&cloud), 2);
        assert!(isolation.is_isolated(voxel_of([10.0, 10.0, 90.0])));
    }
}

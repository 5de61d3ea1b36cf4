//! A plot thinned to the voxels of a lattice that is fixed in the world.

use crate::Error;
use timberline_pointcloud::Frame;
use timberline_pointcloud::frame::{TICKS_PER_M, ticks_from_world, world_from_ticks};

/// A point to be put into a voxel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Position in the world, m.
    pub world_m: [f64; 3],
    /// Height above ground, m; NaN where unknown.
    pub height_m: f32,
    /// Whether it is a ground point.
    pub is_ground: bool,
}

/// One occupied voxel.
///
/// Sums are kept in ticks of the world's lattice, which are whole numbers: they do not depend on the
/// order of points or on how they were cut into tiles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Voxel {
    /// Index on the lattice: the voxel begins at `index * edge` in the world.
    pub index: [i32; 3],
    /// Sum of the points' coordinates, ticks.
    sum: [i64; 3],
    /// Number of points.
    pub points: u32,
    /// Smallest height of a point above ground, m; NaN if all are unknown.
    pub height_m: f32,
    /// Elevation of the ground below that point, m; NaN if unknown.
    pub ground_m: f64,
    /// Whether a point of it is ground.
    pub is_ground: bool,
}

impl Voxel {
    /// Mean position of its points in the world, m.
    #[must_use]
    pub fn centroid_m(&self) -> [f64; 3] {
        self.sum.map(|sum| sum as f64 / (TICKS_PER_M * f64::from(self.points)))
    }

    /// Mean position of its points in a frame, m: of whole numbers, so the same bits wherever in the
    /// world voxels and frame lie.
    #[must_use]
    pub fn local_centroid_m(&self, frame: &Frame) -> [f64; 3] {
        let points = i64::from(self.points);
        std::array::from_fn(|axis| {
            let origin = frame.origin_m[axis] * (TICKS_PER_M as i64);
            (self.sum[axis] - origin * points) as f64 / (TICKS_PER_M * f64::from(self.points))
        })
    }

    fn absorb(&mut self, other: &Self) {
        (0..3).for_each(|axis| self.sum[axis] += other.sum[axis]);
        self.points += other.points;
        self.is_ground |= other.is_ground;
        // Of equal heights the ground is nearly the same; the lower one makes the choice definite.
        let key = |voxel: &Self| (voxel.height_m, voxel.ground_m);
        if self.height_m.is_nan() || key(other) < key(self) {
            (self.height_m, self.ground_m) = key(other);
        }
    }
}

/// The occupied voxels of a plot, sorted by index.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Voxels {
    /// Edge, ticks.
    edge: i64,
    /// The voxels.
    pub all: Vec<Voxel>,
}

impl Voxels {
    /// No voxels of an edge that is rounded to 0.1 mm.
    #[must_use]
    pub fn new(edge_m: f64) -> Self {
        Self { edge: ticks_from_world(edge_m).max(1), all: Vec::new() }
    }

    /// Edge, m.
    #[must_use]
    pub fn edge_m(&self) -> f64 {
        world_from_ticks(self.edge)
    }

    /// Index of the voxel a world position lies in.
    #[must_use]
    pub fn index_at(&self, world_m: [f64; 3]) -> [i32; 3] {
        world_m.map(|value| ticks_from_world(value).div_euclid(self.edge) as i32)
    }

    /// Adds the points of a tile.
    pub fn add(&mut self, samples: impl Iterator<Item = Sample>) {
        let voxel = |sample: Sample| Voxel {
            index: self.index_at(sample.world_m),
            sum: sample.world_m.map(ticks_from_world),
            points: 1,
            height_m: sample.height_m,
            ground_m: sample.world_m[2] - f64::from(sample.height_m),
            is_ground: sample.is_ground,
        };
        let mut added: Vec<Voxel> = samples.map(voxel).collect();
        merge(&mut added);
        self.all.append(&mut added);
    }

    /// Puts the voxels in order and joins those that two tiles share. To be called once after all
    /// tiles are added.
    ///
    /// # Errors
    /// [`Error::TooManyVoxels`].
    pub fn finish(mut self) -> Result<Self, Error> {
        merge(&mut self.all);
        match i32::try_from(self.all.len()) {
            Ok(_) => Ok(self),
            Err(_) => Err(Error::TooManyVoxels(self.all.len())),
        }
    }
}

fn merge(voxels: &mut Vec<Voxel>) {
    voxels.sort_by_key(|voxel| voxel.index);
    let mut kept = 0;
    for next in 0..voxels.len() {
        let voxel = voxels[next];
        if kept > 0 && voxels[kept - 1].index == voxel.index {
            voxels[kept - 1].absorb(&voxel);
        } else {
            voxels[kept] = voxel;
            kept += 1;
        }
    }
    voxels.truncate(kept);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample(world_m: [f64; 3]) -> Sample {
        Sample { world_m, height_m: world_m[2] as f32, is_ground: world_m[2] < 0.5 }
    }

    proptest! {
        #[test]
        fn tiles_and_order_do_not_matter(points in prop::collection::vec(prop::array::uniform3(0i64..40_000), 1..200), cut in 0usize..200) {
            let samples: Vec<Sample> =
                points.iter().map(|p| sample(p.map(world_from_ticks))).collect();
            let cut = cut % samples.len();
            let mut whole = Voxels::new(0.07);
            whole.add(samples.iter().copied());
            let mut parts = Voxels::new(0.07);
            parts.add(samples[cut..].iter().rev().copied());
            parts.add(samples[..cut].iter().copied());
            prop_assert_eq!(whole.finish().unwrap(), parts.finish().unwrap());
        }

        #[test]
        fn a_shift_by_whole_metres_shifts_the_index(x in -9_000i64..9_000, metres in -900i64..900) {
            let voxels = Voxels::new(0.05);
            let at = |ticks: i64| voxels.index_at([world_from_ticks(ticks), 0.0, 0.0])[0];
            prop_assert_eq!(i64::from(at(x + metres * 10_000)), i64::from(at(x)) + metres * 20);
        }
    }
}

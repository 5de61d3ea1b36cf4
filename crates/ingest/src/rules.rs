//! Which points are left out by rule.

use crate::params::{Overlap, TilesParams};
use serde::Serialize;
use timberline_pointcloud::PointCloud;

const WITHHELD: u8 = 1 << 2;
const OVERLAP: u8 = 1 << 3;
/// Low points, and noise of any kind (ASPRS LAS 1.4-R15, table 17; PDAL marks outliers so).
pub(crate) const LOW_NOISE: u8 = 7;
const HIGH_NOISE: u8 = 18;
/// Overlap in formats 0 to 5, which have no flag for it.
const CLASS_OVERLAP: u8 = 12;

/// Points left out of a tile, by rule. A point is counted by the first rule it meets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Dropped {
    /// Flagged as withheld.
    pub withheld: u64,
    /// Of class 7 or 18.
    pub noise: u64,
    /// Flagged as overlap or of class 12.
    pub overlap: u64,
    /// Isolated in space.
    pub isolated: u64,
    /// Present more than once.
    pub duplicate: u64,
    /// In a voxel with a point nearer to the centroid.
    pub thinned: u64,
}

impl Dropped {
    /// All of them.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.withheld + self.noise + self.overlap + self.isolated + self.duplicate + self.thinned
    }
}

/// Whether a point counts as company for others: neither withheld nor called noise by the supplier.
pub(crate) fn is_company(classification: u8, flags: u8) -> bool {
    flags & WITHHELD == 0 && !is_noise(classification)
}

pub(crate) fn is_noise(classification: u8) -> bool {
    matches!(classification, LOW_NOISE | HIGH_NOISE)
}

/// Keeps the points that no rule about flags and classes leaves out.
pub(crate) fn apply(cloud: PointCloud, params: &TilesParams, dropped: &mut Dropped) -> PointCloud {
    let mut kept = Vec::with_capacity(cloud.len());
    for index in 0..cloud.len() {
        let (class, flags) = (cloud.classification[index], cloud.flags[index]);
        if params.drop_withheld && flags & WITHHELD != 0 {
            dropped.withheld += 1;
        } else if params.drop_noise && is_noise(class) {
            dropped.noise += 1;
        } else if params.overlap == Overlap::Drop
            && (flags & OVERLAP != 0 || class == CLASS_OVERLAP)
        {
            dropped.overlap += 1;
        } else {
            kept.push(index as u32);
        }
    }
    if kept.len() == cloud.len() { cloud } else { cloud.select(&kept) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timberline_pointcloud::Point;

    #[test]
    fn each_point_is_counted_by_its_first_rule() {
        let mut cloud = PointCloud::default();
        for (classification, flags) in [(2, 0), (7, WITHHELD), (18, 0), (1, OVERLAP), (12, 0)] {
            cloud.push_local([0.0; 3], &Point { classification, flags, ..Point::default() });
        }
        let check = |params: &TilesParams, expected: [u64; 4]| {
            let mut dropped = Dropped::default();
            let kept = apply(cloud.clone(), params, &mut dropped).len() as u64;
            assert_eq!([kept, dropped.withheld, dropped.noise, dropped.overlap], expected);
        };
        check(&TilesParams::default(), [3, 1, 1, 0]);
        check(&TilesParams { overlap: Overlap::Drop, ..TilesParams::default() }, [1, 1, 1, 2]);
        let none =
            TilesParams { drop_withheld: false, drop_noise: false, ..TilesParams::default() };
        check(&none, [5, 0, 0, 0]);
    }
}

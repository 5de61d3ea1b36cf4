//! One total order of points in the world.

use crate::PointCloud;
use crate::frame::ticks_from_world;

/// Edge of the cells of the space-filling curve: 1/8 m, so that every world-aligned square with an
/// edge of a power of two (from 1/8 m) is one contiguous run of the order.
pub const CURVE_CELL_M: f64 = 0.125;

/// Morton (Z-order) code of the world-aligned cell of [`CURVE_CELL_M`] that holds a position.
///
/// Cell indices are shifted by 2^31 to be positive; magnitudes up to 268,000 km are distinct.
#[must_use]
pub fn morton(world_x_m: f64, world_y_m: f64) -> u64 {
    let cell = |value: f64| ((value / CURVE_CELL_M).floor() as i64 + (1 << 31)) as u32;
    interleave(cell(world_x_m)) | (interleave(cell(world_y_m)) << 1)
}

/// Spreads 32 bits over the even bits of 64 (Morton 1966; the usual magic masks).
#[must_use]
fn interleave(value: u32) -> u64 {
    let mut v = u64::from(value);
    v = (v | (v << 16)) & 0x0000_FFFF_0000_FFFF;
    v = (v | (v << 8)) & 0x00FF_00FF_00FF_00FF;
    v = (v | (v << 4)) & 0x0F0F_0F0F_0F0F_0F0F;
    v = (v | (v << 2)) & 0x3333_3333_3333_3333;
    (v | (v << 1)) & 0x5555_5555_5555_5555
}

/// The order of a cloud's points along the curve, ties broken by position and attributes, so that
/// only points alike in everything (and so exchangeable) are left to their order in the cloud.
#[must_use]
pub fn canonical_order(cloud: &PointCloud) -> Vec<u32> {
    let mut keyed: Vec<(u64, [i64; 3], u32)> = (0..cloud.len())
        .map(|index| {
            let (code, position) = key(cloud, index);
            (code, position, index as u32)
        })
        .collect();
    keyed.sort_unstable_by(|a, b| {
        (a.0, a.1)
            .cmp(&(b.0, b.1))
            .then_with(|| compare_attributes(cloud, a.2 as usize, b.2 as usize))
            .then(a.2.cmp(&b.2))
    });
    keyed.into_iter().map(|(_, _, index)| index).collect()
}

/// Compares two points of one cloud by the order of [`canonical_order`], without sorting the cloud.
///
/// Equal only for points alike in position and all attributes.
#[must_use]
pub fn compare(cloud: &PointCloud, a: usize, b: usize) -> std::cmp::Ordering {
    key(cloud, a).cmp(&key(cloud, b)).then_with(|| compare_attributes(cloud, a, b))
}

/// Code on the curve and position in ticks (z first: it differs most often within a cell).
fn key(cloud: &PointCloud, index: usize) -> (u64, [i64; 3]) {
    let world = cloud.world(index);
    let [x, y, z] = world.map(ticks_from_world);
    (morton(world[0], world[1]), [z, x, y])
}

/// Compares all attributes of two points of one cloud, extra columns included.
#[must_use]
pub fn compare_attributes(cloud: &PointCloud, a: usize, b: usize) -> std::cmp::Ordering {
    let fixed = |i: usize| {
        let p = cloud.point(i);
        (
            (p.source_id, p.return_number, p.number_of_returns, p.classification),
            (p.intensity, p.flags),
        )
    };
    cloud.gps_time[a]
        .total_cmp(&cloud.gps_time[b])
        .then_with(|| fixed(a).cmp(&fixed(b)))
        .then_with(|| cloud.scan_angle_deg[a].total_cmp(&cloud.scan_angle_deg[b]))
        .then_with(|| {
            let extra = cloud.extra.values().map(|c| c.value(a).total_cmp(&c.value(b)));
            extra.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then)
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Frame, Point};
    use proptest::prelude::*;

    #[test]
    fn a_power_of_two_square_is_one_run() {
        let codes: Vec<u64> = (0..64)
            .map(|i| morton(96.0 + f64::from(i % 8) * 0.125, 160.0 + f64::from(i / 8) * 0.125))
            .collect();
        let (low, high) = (codes.iter().min().unwrap(), codes.iter().max().unwrap());
        assert_eq!(high - low, 63);
    }

    proptest! {
        #[test]
        fn the_comparison_agrees_with_the_order(
            points in prop::collection::vec((0i32..30, 0i32..30, 0i32..3, 0u16..2), 1..60),
        ) {
            let mut cloud = PointCloud::new(Frame::new([-7, 3, 0]));
            for (x, y, z, intensity) in points {
                let world = [f64::from(x) * 0.1, f64::from(y) * 0.1, f64::from(z)];
                cloud.push_world(world, &Point { intensity, ..Point::default() });
            }
            let order = canonical_order(&cloud);
            let ascending = |pair: &[u32]| compare(&cloud, pair[0] as usize, pair[1] as usize).is_le();
            prop_assert!(order.windows(2).all(ascending));
        }

        #[test]
        fn frame_and_input_order_do_not_matter(
            points in prop::collection::vec((0i32..50, 0i32..50, 0i32..4), 1..60),
            origin in -30i64..30,
        ) {
            let build = |frame: i64, reversed: bool| {
                let mut cloud = PointCloud::new(Frame::new([frame, frame, 0]));
                let mut list = points.clone();
                if reversed { list.reverse(); }
                for (x, y, z) in list {
                    cloud.push_world([f64::from(x) * 0.1, f64::from(y) * 0.1, f64::from(z)], &Point::default());
                }
                let sorted = cloud.in_canonical_order();
                (0..sorted.len()).map(|i| sorted.world(i).map(ticks_from_world)).collect::<Vec<_>>()
            };
            prop_assert_eq!(build(0, false), build(origin, true));
        }
    }
}

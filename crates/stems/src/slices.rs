//! Horizontal slices of the stem space, and clusters of points in them.

use crate::{Error, StemsParams};
use timberline_pointcloud::Grid2;

/// A point of a slice.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct SlicePoint {
    /// Easting, m.
    pub x: f64,
    /// Northing, m.
    pub y: f64,
    /// Elevation, m.
    pub z: f64,
    /// Height above ground, m.
    pub height_m: f64,
}

/// Points of a slice that lie close together.
#[derive(Debug, Clone, PartialEq)]
pub struct Cluster {
    /// Number of the slice, from the lowest.
    pub slice: u32,
    /// The points, sorted by position.
    pub points: Vec<SlicePoint>,
}

/// The slices a height above ground lies in: none, or one where slices do not overlap.
#[must_use]
pub fn slices_of(height_m: f64, params: &StemsParams) -> std::ops::Range<u32> {
    let above = height_m - params.search_from_m;
    if !(above >= 0.0 && height_m < params.search_to_m) {
        return 0..0;
    }
    let last = (above / params.step_m).floor();
    let first = ((above - params.slice_m) / params.step_m).floor() + 1.0;
    first.max(0.0) as u32..last as u32 + 1
}

/// Height above ground of the middle of a slice, m.
#[must_use]
pub fn middle_m(slice: u32, params: &StemsParams) -> f64 {
    params.search_from_m + f64::from(slice) * params.step_m + params.slice_m / 2.0
}

/// Cuts points into slices and slices into clusters, sorted by slice and position. The order of the
/// points does not matter.
///
/// # Errors
/// [`Error::Grid`].
pub fn clusters(points: &[SlicePoint], params: &StemsParams) -> Result<Vec<Cluster>, Error> {
    let mut cut: Vec<(u32, SlicePoint)> = points
        .iter()
        .flat_map(|point| slices_of(point.height_m, params).map(|slice| (slice, *point)))
        .collect();
    cut.sort_by(|a, b| {
        let key = |(slice, p): &(u32, SlicePoint)| (*slice, [p.x, p.y, p.z]);
        let ((a, p), (b, q)) = (key(a), key(b));
        a.cmp(&b).then_with(|| p.partial_cmp(&q).unwrap_or(std::cmp::Ordering::Equal))
    });
    let mut clusters = Vec::new();
    for slice in cut.chunk_by(|a, b| a.0 == b.0) {
        split(slice, params.cluster_m, &mut clusters)?;
    }
    Ok(clusters)
}

/// Splits the points of one slice into cells that touch.
fn split(
    slice: &[(u32, SlicePoint)],
    cluster_m: f64,
    clusters: &mut Vec<Cluster>,
) -> Result<(), Error> {
    let x: Vec<f64> = slice.iter().map(|(_, point)| point.x).collect();
    let y: Vec<f64> = slice.iter().map(|(_, point)| point.y).collect();
    let grid = Grid2::new(&x, &y, cluster_m)?;
    let mut label = vec![u32::MAX; slice.len()];
    for seed in 0..slice.len() {
        if label[seed] != u32::MAX {
            continue;
        }
        let (mut open, mut members) = (vec![seed], Vec::new());
        label[seed] = seed as u32;
        while let Some(at) = open.pop() {
            members.push(at);
            grid.candidates(x[at], y[at], cluster_m, |other| {
                let [dx, dy] = [x[other] - x[at], y[other] - y[at]];
                if label[other] == u32::MAX && dx * dx + dy * dy <= cluster_m * cluster_m {
                    label[other] = seed as u32;
                    open.push(other);
                }
            });
        }
        members.sort_unstable();
        let points = members.iter().map(|&at| slice[at].1).collect();
        clusters.push(Cluster { slice: slice[seed].0, points });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, height_m: f64) -> SlicePoint {
        SlicePoint { x, y: 0.0, z: height_m, height_m }
    }

    #[test]
    fn every_height_is_in_the_slices_that_hold_it() {
        let params = StemsParams::default();
        for k in 0..700 {
            let height = f64::from(k) * 0.01 + 0.005;
            for slice in 0..40 {
                let begin = params.search_from_m + f64::from(slice) * params.step_m;
                let inside = height >= begin
                    && height < begin + params.slice_m
                    && height < params.search_to_m;
                assert_eq!(slices_of(height, &params).contains(&slice), inside, "{height} {slice}");
            }
        }
        assert!(slices_of(f64::NAN, &params).is_empty());
    }

    #[test]
    fn clusters_do_not_depend_on_the_order_of_points() {
        let mut points: Vec<_> = (0..50).map(|k| at(f64::from(k * 7 % 50) * 0.05, 1.3)).collect();
        points.extend((0..50).map(|k| at(5.0 + f64::from(k * 3 % 50) * 0.05, 1.35)));
        let once = clusters(&points, &StemsParams::default()).unwrap();
        points.reverse();
        assert_eq!(clusters(&points, &StemsParams::default()).unwrap(), once);
        let slices: std::collections::BTreeSet<u32> = once.iter().map(|c| c.slice).collect();
        assert_eq!(once.len(), 2 * slices.len());
    }
}

//! Horizontal slices of the stem space, and clusters of points in them.

use crate::StemsParams;
use crate::joined::Joined;

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
#[must_use]
pub fn clusters(points: &[SlicePoint], params: &StemsParams) -> Vec<Cluster> {
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
        split(slice, params.cluster_m, &mut clusters);
    }
    clusters
}

/// Splits the points of one slice where gaps are wider than `cluster_m`.
///
/// All points of a cell are within that distance of each other, so that dense scans cost no more than
/// their cells: of two cells one near pair is enough.
fn split(slice: &[(u32, SlicePoint)], cluster_m: f64, clusters: &mut Vec<Cluster>) {
    // Half the distance is a little less than needed (1/sqrt(2)), and rounding does not matter.
    let cell_m = 0.5 * cluster_m;
    let cell = |point: &SlicePoint| [point.x, point.y].map(|value| (value / cell_m).floor() as i64);
    let mut order: Vec<([i64; 2], u32)> =
        (0..).zip(slice).map(|(at, (_, point))| (cell(point), at)).collect();
    order.sort_unstable();
    let cells: Vec<&[([i64; 2], u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
    let mut joined = Joined::new(slice.len());
    for (place, here) in cells.iter().enumerate() {
        here.iter().for_each(|(_, at)| joined.join(here[0].1, *at));
        for there in after(&cells, place) {
            if joined.root(here[0].1) != joined.root(there[0].1)
                && touch(slice, here, there, cluster_m)
            {
                joined.join(here[0].1, there[0].1);
            }
        }
    }
    let mut members: Vec<(u32, u32)> =
        (0..slice.len() as u32).map(|at| (joined.root(at), at)).collect();
    members.sort_unstable();
    for cluster in members.chunk_by(|a, b| a.0 == b.0) {
        let points = cluster.iter().map(|(_, at)| slice[*at as usize].1).collect();
        clusters.push(Cluster { slice: slice[0].0, points });
    }
}

/// The cells after one whose points may be near its own: two rows and columns away at most.
fn after<'a>(
    cells: &'a [&'a [([i64; 2], u32)]],
    place: usize,
) -> impl Iterator<Item = &'a [([i64; 2], u32)]> {
    let [x, y] = cells[place][0].0;
    (0..=2).flat_map(move |dx| {
        let [low, high] = [-2, 2].map(|dy| [x + dx, y + dy]);
        let first = cells.partition_point(|cell| cell[0].0 < low).max(place + 1);
        let rest = cells.get(first..).unwrap_or_default().iter();
        rest.take_while(move |cell| cell[0].0 <= high).copied()
    })
}

/// Whether a point of one cell is within `cluster_m` of a point of another.
fn touch(
    slice: &[(u32, SlicePoint)],
    here: &[([i64; 2], u32)],
    there: &[([i64; 2], u32)],
    cluster_m: f64,
) -> bool {
    let point = |(_, at): &([i64; 2], u32)| slice[*at as usize].1;
    here.iter().map(point).any(|a| {
        there.iter().map(point).any(|b| {
            let (dx, dy) = (b.x - a.x, b.y - a.y);
            dx * dx + dy * dy <= cluster_m * cluster_m
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
        let once = clusters(&points, &StemsParams::default());
        points.reverse();
        assert_eq!(clusters(&points, &StemsParams::default()), once);
        let slices: std::collections::BTreeSet<u32> = once.iter().map(|c| c.slice).collect();
        assert_eq!(once.len(), 2 * slices.len());
    }

    proptest! {
        #[test]
        fn clusters_are_those_of_all_pairs(places in prop::collection::vec((0.0f64..1.0, 0.0f64..0.3), 1..60)) {
            let params = StemsParams::default();
            let points: Vec<SlicePoint> =
                places.iter().map(|&(x, y)| SlicePoint { y, ..at(x, 0.45) }).collect();
            let found: Vec<Vec<SlicePoint>> =
                clusters(&points, &params).into_iter().map(|cluster| cluster.points).collect();
            let mut group: Vec<usize> = (0..points.len()).collect();
            let near = |a: &SlicePoint, b: &SlicePoint| {
                (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) <= params.cluster_m * params.cluster_m
            };
            for a in 0..points.len() {
                for b in 0..a {
                    if near(&points[a], &points[b]) {
                        let (old, new) = (group[a], group[b]);
                        group.iter_mut().filter(|g| **g == old).for_each(|g| *g = new);
                    }
                }
            }
            let together = |a: &SlicePoint, b: &SlicePoint| {
                found.iter().any(|cluster| cluster.contains(a) && cluster.contains(b))
            };
            for a in 0..points.len() {
                for b in 0..a {
                    prop_assert_eq!(group[a] == group[b], together(&points[a], &points[b]));
                }
            }
            prop_assert_eq!(found.iter().map(Vec::len).sum::<usize>(), points.len());
        }
    }
}

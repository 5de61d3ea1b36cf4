//! One of the lowest points of every cell, for clouds with thousands of points a square metre.

/// Points this far above the lowest of a cell may lie on the same ground: noise, litter, and the slope
/// within a cell, metres.
const LAYER_M: f64 = 0.05;
/// As many points close together are no stray ones.
const SUPPORT: usize = 3;

/// Of some places in `positions` those kept, ascending: in every cell of an edge in metres the one in the
/// middle of the lowest layer. The layer begins at the lowest point with others close above it, so that a
/// single point below the ground does not hide it. An edge of 0 keeps all.
pub(crate) fn lowest_per_cell(
    places: Vec<usize>,
    positions: &[[f64; 3]],
    edge_m: f64,
) -> Vec<usize> {
    if edge_m <= 0.0 {
        return places;
    }
    let cell = |place: usize| [0, 1].map(|axis| (positions[place][axis] / edge_m).floor() as i64);
    let mut order: Vec<([i64; 2], usize)> =
        places.into_iter().map(|place| (cell(place), place)).collect();
    order.sort_unstable_by(|a, b| {
        let z = |place: usize| positions[place][2];
        a.0.cmp(&b.0).then(z(a.1).total_cmp(&z(b.1))).then(a.1.cmp(&b.1))
    });
    let mut kept: Vec<usize> = order
        .chunk_by(|a, b| a.0 == b.0)
        .map(|cell| {
            let z = |at: usize| positions[cell[at].1][2];
            let supported = |at: &usize| z(at + SUPPORT - 1) - z(*at) <= LAYER_M;
            let starts = 0..(cell.len() + 1).saturating_sub(SUPPORT);
            let low = starts.into_iter().find(supported).unwrap_or(0);
            let layer = (low..cell.len()).take_while(|at| z(*at) - z(low) <= LAYER_M).count();
            cell[low + (layer - 1) / 2].1
        })
        .collect();
    kept.sort_unstable();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_stray_point_below_does_not_hide_the_ground() {
        let z = [-1.0, 0.00, 0.01, 0.02, 0.03, 1.5, 7.0];
        let positions: Vec<[f64; 3]> = z.iter().map(|z| [0.1, 0.1, *z]).collect();
        let all: Vec<usize> = (0..positions.len()).collect();
        assert_eq!(lowest_per_cell(all.clone(), &positions, 0.25), [2]);
        assert_eq!(lowest_per_cell(all.clone(), &positions, 0.0), all);
        // Too few for a layer: the lowest.
        assert_eq!(lowest_per_cell(vec![5, 6], &positions, 0.25), [5]);
    }

    proptest! {
        #[test]
        fn every_cell_keeps_one_of_its_low_points(points in prop::collection::vec((0i32..300, 0i32..300, 0i32..200), 1..200)) {
            let positions: Vec<[f64; 3]> =
                points.iter().map(|p| [p.0, p.1, p.2].map(|v| f64::from(v) * 0.01)).collect();
            let kept = lowest_per_cell((0..positions.len()).collect(), &positions, 0.5);
            let cell = |p: &[f64; 3]| [(p[0] / 0.5).floor() as i64, (p[1] / 0.5).floor() as i64];
            let mut cells: Vec<_> = positions.iter().map(cell).collect();
            cells.sort_unstable();
            cells.dedup();
            let mut of_kept: Vec<_> = kept.iter().map(|&place| cell(&positions[place])).collect();
            of_kept.sort_unstable();
            prop_assert_eq!(of_kept, cells);
        }
    }
}

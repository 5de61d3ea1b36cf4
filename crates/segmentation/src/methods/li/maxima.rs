//! Which points are local maxima.

use super::Ranked;
use timberline_pointcloud::Grid2;

/// For every ranked point whether no higher one lies within `window_m` of it in the plane.
pub(super) fn local_maxima(ranked: &Ranked, window_m: f64) -> Vec<bool> {
    if window_m <= 0.0 {
        return vec![true; ranked.index.len()];
    }
    // Within a cell ranks ascend, so that one of the first points of a cell decides as a rule.
    let mut is_maximum = vec![false; ranked.index.len()];
    let Ok(grid) = Grid2::new(&ranked.x, &ranked.y, window_m) else {
        return is_maximum;
    };
    let cells: Vec<([i32; 2], &[u32])> = grid.occupied().collect();
    for (cell, own) in &cells {
        let around = neighbours(&cells, *cell);
        for &rank in *own {
            is_maximum[rank as usize] =
                !around.iter().any(|other| has_higher(ranked, other, rank as usize, window_m));
        }
    }
    is_maximum
}

/// The points of a cell and of the eight around it, its own first.
fn neighbours<'a>(cells: &[([i32; 2], &'a [u32])], [column, row]: [i32; 2]) -> Vec<&'a [u32]> {
    let mut found = Vec::with_capacity(9);
    for (dx, dy) in [(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
        let wanted = [column + dx, row + dy];
        if let Ok(place) = cells.binary_search_by(|(cell, _)| cell.cmp(&wanted)) {
            found.push(cells[place].1);
        }
    }
    found
}

fn has_higher(ranked: &Ranked, others: &[u32], rank: usize, window_m: f64) -> bool {
    let [x, y] = [ranked.x[rank], ranked.y[rank]];
    others.iter().take_while(|&&other| (other as usize) < rank).any(|&other| {
        let (dx, dy) = (ranked.x[other as usize] - x, ranked.y[other as usize] - y);
        dx * dx + dy * dy <= window_m * window_m
    })
}

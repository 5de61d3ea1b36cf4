//! Thinning of a crown to its surface.

use crate::Error;
use std::collections::BTreeMap;

/// The highest point of every cell of a square grid, with the cell's centre as its position
/// (Polewski et al., section 4).
///
/// `points` are world positions; cells are `floor(world / cell_m)`, so they do not move with the
/// tree or the tile. Returned relative to `anchor` (a world position), sorted by column, then row.
///
/// # Errors
/// [`Error::CellSize`] unless the cell is positive and finite.
pub fn thin(
    points: impl IntoIterator<Item = [f64; 3]>,
    anchor: [f64; 3],
    cell_m: f64,
) -> Result<Vec<[f64; 3]>, Error> {
    if !(cell_m.is_finite() && cell_m > 0.0) {
        return Err(Error::CellSize(cell_m));
    }
    let index = |value: f64| (value / cell_m).floor() as i64;
    let mut highest: BTreeMap<[i64; 2], f64> = BTreeMap::new();
    for [x, y, z] in points {
        let best = highest.entry([index(x), index(y)]).or_insert(z);
        *best = best.max(z);
    }
    let middle = |cell: i64, axis: usize| (cell as f64 + 0.5) * cell_m - anchor[axis];
    let cell = |(&[ix, iy], z): (&[i64; 2], &f64)| [middle(ix, 0), middle(iy, 1), z - anchor[2]];
    Ok(highest.iter().map(cell).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_highest_point_at_the_cell_centre() {
        let points = [[10.1, 20.1, 5.0], [10.4, 20.4, 7.0], [10.6, 20.1, 6.0], [9.9, 20.0, 1.0]];
        let cells = thin(points, [10.0, 20.0, 5.0], 0.5).unwrap();
        assert_eq!(cells, [[-0.25, 0.25, -4.0], [0.25, 0.25, 2.0], [0.75, 0.25, 1.0]]);
    }

    #[test]
    fn a_cell_of_no_size_is_refused() {
        assert_eq!(
            thin([], [0.0; 3], f64::NAN).unwrap_err().to_string(),
            "cell size NaN m is not a positive finite number"
        );
    }
}

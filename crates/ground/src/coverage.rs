//! Which cells of a world-aligned raster lie near a point.

/// Whether each cell has a point in a cell no farther than `rim_m` (centre to centre), row by row
/// from `first` (world column and row). `world` must hold the points within `rim_m` of the raster.
pub fn covered(
    world: impl Iterator<Item = [f64; 3]>,
    first: [i64; 2],
    size: [usize; 2],
    cell_m: f64,
    rim_m: f64,
) -> Vec<bool> {
    let reach = (rim_m / cell_m).floor() as i64;
    let [columns, rows] = size.map(|n| n as i64);
    let wide = (columns + 2 * reach) as usize;
    let mut occupied = vec![false; wide * (rows + 2 * reach) as usize];
    for [x, y, _] in world {
        let column = (x / cell_m).floor() as i64 - first[0] + reach;
        let row = (y / cell_m).floor() as i64 - first[1] + reach;
        if (0..wide as i64).contains(&column) && (0..rows + 2 * reach).contains(&row) {
            occupied[row as usize * wide + column as usize] = true;
        }
    }
    let steps: Vec<Vec<i64>> = occupied.chunks(wide.max(1)).map(steps_to_occupied).collect();
    let near = |column: i64, row: i64| {
        (-reach..=reach).any(|dy| {
            let dx = steps[(row + reach + dy) as usize][(column + reach) as usize];
            dx <= reach && dx * dx + dy * dy <= reach * reach
        })
    };
    (0..rows)
        .flat_map(|row| (0..columns).map(move |column| (column, row)))
        .map(|(c, r)| near(c, r))
        .collect()
}

/// For every cell of a row, the number of steps to the nearest occupied one.
fn steps_to_occupied(row: &[bool]) -> Vec<i64> {
    let mut steps = vec![i64::from(i32::MAX); row.len()];
    let mut walk = |order: &mut dyn Iterator<Item = usize>| {
        let mut since = i64::from(i32::MAX);
        for index in order {
            since = if row[index] { 0 } else { since + 1 };
            steps[index] = steps[index].min(since);
        }
    };
    walk(&mut (0..row.len()));
    walk(&mut (0..row.len()).rev());
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn as_brute_force(points in prop::collection::vec((-4f64..14., -4f64..14.), 0..6), rim in 0f64..4.) {
            let world = points.iter().map(|p| [p.0, p.1, 0.0]);
            let found = covered(world, [0, 0], [20, 16], 0.5, rim);
            let reach = (rim / 0.5).floor();
            for (index, found) in found.iter().enumerate() {
                let cell = [(index % 20) as f64, (index / 20) as f64];
                let expected = points.iter().any(|p| {
                    let (dx, dy) = ((p.0 / 0.5).floor() - cell[0], (p.1 / 0.5).floor() - cell[1]);
                    dx * dx + dy * dy <= reach * reach
                });
                prop_assert_eq!(*found, expected, "cell {}", index);
            }
        }
    }
}

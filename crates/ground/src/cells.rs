//! Lowest points of square cells, and isolated points far below everything around.

use std::collections::BTreeMap;

type Key = [i32; 2];

fn key(p: [f64; 3], cell_m: f64) -> Key {
    [(p[1] / cell_m).floor() as i32, (p[0] / cell_m).floor() as i32]
}

/// The lowest of the given points in every cell, ascending; equal elevations by index.
#[must_use]
pub fn lowest_per_cell(points: &[[f64; 3]], of: &[usize], cell_m: f64) -> Vec<usize> {
    let mut keyed: Vec<(Key, usize)> = of.iter().map(|&i| (key(points[i], cell_m), i)).collect();
    keyed.sort_unstable();
    let lowest = |run: &[(Key, usize)]| {
        let by_z = |a: &&(Key, usize), b: &&(Key, usize)| points[a.1][2].total_cmp(&points[b.1][2]);
        run.iter().min_by(by_z).map(|(_, i)| *i)
    };
    let mut found: Vec<usize> = keyed.chunk_by(|a, b| a.0 == b.0).filter_map(lowest).collect();
    found.sort_unstable();
    found
}

/// Edge of the cells in which pits are sought, metres.
const PIT_CELL_M: f64 = 4.0;
/// Cells looked at on each side.
const PIT_REACH: i32 = 2;
/// How far below the lowest point of every cell around, metres.
const PIT_DEPTH_M: f64 = 3.0;
/// Rounds: each takes the lowest point of a cell.
const PIT_ROUNDS: usize = 4;

/// Drops points that lie 3 m below the lowest point of each of the 24 cells of 4 m around them: on
/// any slope or in any channel some cell around is lower, so that only an outlier can.
#[must_use]
pub fn without_pits(points: &[[f64; 3]], mut low: Vec<usize>) -> Vec<usize> {
    for _ in 0..PIT_ROUNDS {
        let lowest: BTreeMap<Key, usize> = lowest_per_cell(points, &low, PIT_CELL_M)
            .into_iter()
            .map(|i| (key(points[i], PIT_CELL_M), i))
            .collect();
        let mut pits: Vec<usize> = lowest
            .iter()
            .filter(|(k, i)| is_pit(points, &lowest, **k, **i))
            .map(|(_, i)| *i)
            .collect();
        if pits.is_empty() {
            break;
        }
        pits.sort_unstable();
        low.retain(|i| pits.binary_search(i).is_err());
    }
    low
}

fn is_pit(points: &[[f64; 3]], lowest: &BTreeMap<Key, usize>, at: Key, index: usize) -> bool {
    let limit = points[index][2] + PIT_DEPTH_M;
    let mut around = 0;
    for row in at[0] - PIT_REACH..=at[0] + PIT_REACH {
        for column in at[1] - PIT_REACH..=at[1] + PIT_REACH {
            match lowest.get(&[row, column]) {
                Some(&other) if other != index && points[other][2] < limit => return false,
                Some(&other) if other != index => around += 1,
                _ => {}
            }
        }
    }
    around >= 3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slope(gradient: f64) -> Vec<[f64; 3]> {
        (0..1600)
            .map(|i| [f64::from(i % 40), f64::from(i / 40), gradient * f64::from(i % 40)])
            .collect()
    }

    #[test]
    fn outliers_are_found_on_flat_and_gentle_ground_and_steep_ground_is_left_whole() {
        for gradient in [0.0, 0.1, 1.0, 2.0] {
            let mut points = slope(gradient);
            let all: Vec<usize> = (0..1600).collect();
            assert_eq!(without_pits(&points, all.clone()).len(), 1600);
            if gradient < 0.2 {
                points[820][2] -= 9.0;
                points[821][2] -= 9.5;
                let kept = without_pits(&points, all);
                assert_eq!(kept.len(), 1598);
                assert!(!kept.contains(&820));
            }
        }
    }

    #[test]
    fn lowest_of_each_cell() {
        let points = [[0.1, 0.1, 5.0], [0.4, 0.2, 4.0], [1.2, 0.1, 9.0], [-0.1, 0.1, 1.0]];
        assert_eq!(lowest_per_cell(&points, &[0, 1, 2, 3], 1.0), [1, 2, 3]);
    }
}

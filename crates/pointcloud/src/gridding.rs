//! Points to rasters: the highest value of every cell, and small gaps filled.

use crate::{PointCloud, Rect, Window};

/// ASPRS classes of low and high noise: no surface.
const NOISE: [u8; 2] = [7, 18];

/// Highest value in every cell that a cloud touches; NaN where there is no point.
///
/// `values` are those of the points, heights above ground say (NaN: unknown, left out); negative
/// ones count as 0. Noise classes are left out.
#[must_use]
pub fn highest(cloud: &PointCloud, values: &[f32], cell_m: f64) -> (Window, Vec<f32>) {
    let cell = |index: usize| {
        let [x, y, _] = cloud.world(index);
        [(x / cell_m).floor() as i64, (y / cell_m).floor() as i64]
    };
    let mut rect = Rect::EMPTY;
    for index in 0..cloud.len() {
        let [x, y, _] = cloud.world(index);
        rect = rect.union(&Rect { min: [x, y], max: [x, y] });
    }
    if cloud.is_empty() {
        return (Window { column0: 0, row0: 0, columns: 0, rows: 0 }, Vec::new());
    }
    let window = Window::touching(&rect, cell_m);
    let mut highest = vec![f32::NAN; window.len()];
    for (index, value) in values.iter().enumerate().take(cloud.len()) {
        if !value.is_nan() && !NOISE.contains(&cloud.classification[index]) {
            let [column, row] = cell(index);
            let cell = &mut highest[window.index(column, row)];
            *cell = cell.max(value.max(0.0));
        }
    }
    (window, highest)
}

/// Fills small gaps: an empty cell with occupied cells within `reach` cells in at least three of the
/// four quadrants around it gets their mean, weighted by the inverse squared distance. Larger gaps
/// and the surroundings of the data stay empty.
///
/// `values` are those of `window.grown(reach)`; the result is that of `window`, so that what comes
/// out does not depend on where windows begin.
#[must_use]
pub fn fill_gaps(values: &[f32], window: Window, reach: u32) -> Vec<f32> {
    let source = window.grown(reach);
    let offsets = disc(i64::from(reach));
    let mut filled = Vec::with_capacity(window.len());
    for row in window.row0..window.end_row() {
        for column in window.column0..window.end_column() {
            let own = values[source.index(column, row)];
            let gap = own.is_nan() && reach > 0;
            filled.push(if gap { around(values, source, [column, row], &offsets) } else { own });
        }
    }
    filled
}

/// Offsets of a disc without its centre, with their squared lengths.
fn disc(reach: i64) -> Vec<[i64; 3]> {
    let square = (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| [dx, dy]));
    square
        .map(|[dx, dy]| [dx, dy, dx * dx + dy * dy])
        .filter(|[.., squared]| (1..=reach * reach).contains(squared))
        .collect()
}

fn around(values: &[f32], source: Window, [column, row]: [i64; 2], offsets: &[[i64; 3]]) -> f32 {
    let (mut sum, mut weights, mut quadrants) = (0.0_f64, 0.0_f64, 0_u8);
    for [dx, dy, squared] in offsets {
        let value = values[source.index(column + dx, row + dy)];
        if !value.is_nan() {
            let weight = 1.0 / *squared as f64;
            sum += weight * f64::from(value);
            weights += weight;
            quadrants |= 1 << quadrant(*dx, *dy);
        }
    }
    if quadrants.count_ones() >= 3 { (sum / weights) as f32 } else { f32::NAN }
}

/// Quadrant of an offset, each with one of the half-axes.
fn quadrant(dx: i64, dy: i64) -> u8 {
    if dx > 0 && dy >= 0 {
        0
    } else if dx <= 0 && dy > 0 {
        1
    } else if dx < 0 && dy <= 0 {
        2
    } else {
        3
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Frame, Point};

    #[test]
    fn the_highest_point_counts_and_noise_does_not() {
        let mut cloud = PointCloud::new(Frame::new([100, 200, 0]));
        for (x, class) in [(100.1, 1), (100.2, 5), (100.3, 18), (101.9, 2)] {
            cloud.push_world([x, 200.0, 0.0], &Point { classification: class, ..Point::default() });
        }
        let (window, values) = highest(&cloud, &[3.0, 7.0, 99.0, -0.2], 0.5);
        assert_eq!(window, Window { column0: 200, row0: 400, columns: 4, rows: 1 });
        assert_eq!((values[0], values[3]), (7.0, 0.0));
        assert!(values[1].is_nan() && values[2].is_nan());
    }

    fn holes(size: u32, hole: impl Fn(i64, i64) -> bool) -> Vec<f32> {
        let window = Window { column0: 0, row0: 0, columns: size, rows: size };
        let mut values = vec![4.0; window.len()];
        for row in 0..i64::from(size) {
            for column in 0..i64::from(size) {
                if hole(column, row) {
                    values[window.index(column, row)] = f32::NAN;
                }
            }
        }
        values
    }

    #[test]
    fn small_gaps_are_filled_large_ones_and_the_outside_not() {
        let window = Window { column0: 2, row0: 2, columns: 12, rows: 12 };
        let middle = |c: i64, r: i64| (c - 8).abs() <= 3 && (r - 8).abs() <= 3;
        let filled = fill_gaps(&holes(16, |c, r| (c, r) == (4, 4) || middle(c, r)), window, 2);
        assert_eq!(filled[window.index(4, 4)], 4.0);
        assert!(filled[window.index(8, 8)].is_nan());
        let half = fill_gaps(&holes(16, |c, _| c >= 8), window, 2);
        assert!(half[window.index(8, 8)].is_nan() && half[window.index(9, 8)].is_nan());
    }

    #[test]
    fn every_offset_has_one_quadrant() {
        let count = |q| disc(3).iter().filter(|o| quadrant(o[0], o[1]) == q).count();
        assert_eq!([count(0), count(1), count(2), count(3)], [7; 4]);
    }
}

//! Which points are kept as samples.

/// One point of every cell, the one nearest to the mean of the cell's points (of equally near ones
/// the first). Cells have edges of the power of two of metres next below `edge_m` of their points,
/// and begin at 0, so they lie the same in every frame as long as they are not above a metre. Points
/// with an edge of 0 are all kept. Returns indices, ascending.
#[must_use]
pub fn one_per_cell(points: &[[f64; 3]], edge_m: &[f64]) -> Vec<u32> {
    let mut kept = Vec::new();
    let mut keyed: Vec<(i32, [i64; 3], u32)> = Vec::new();
    for ((point, &edge), index) in points.iter().zip(edge_m).zip(0..) {
        if edge > 0.0 {
            let level = libm::frexp(edge).1 - 1;
            let cell = libm::ldexp(1.0, level);
            keyed.push((level, point.map(|value| (value / cell).floor() as i64), index));
        } else {
            kept.push(index);
        }
    }
    keyed.sort_unstable();
    for cell in keyed.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let members = || cell.iter().map(|(_, _, index)| *index);
        kept.extend(nearest_to_mean(points, members));
    }
    kept.sort_unstable();
    kept
}

fn nearest_to_mean<I: Iterator<Item = u32>>(
    points: &[[f64; 3]],
    members: impl Fn() -> I,
) -> Option<u32> {
    let mut mean = [0.0; 3];
    let count = members().count() as f64;
    members().for_each(|i| (0..3).for_each(|k| mean[k] += points[i as usize][k] / count));
    members().min_by(|&a, &b| {
        squared_distance(points[a as usize], mean)
            .total_cmp(&squared_distance(points[b as usize], mean))
            .then(a.cmp(&b))
    })
}

pub(crate) fn squared_distance(p: [f64; 3], q: [f64; 3]) -> f64 {
    let [dx, dy, dz] = [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    dx * dx + dy * dy + dz * dz
}

/// A share of the points at random, with a seed made from the points in their sequence. Returns
/// indices, ascending; at least one unless there are no points.
#[must_use]
pub fn drawn(points: &[[f64; 3]], share: f64) -> Vec<u32> {
    let seed = points.iter().flatten().fold(0, |seed, value| mix(seed ^ value.to_bits()));
    let mut lots: Vec<(u64, u32)> =
        (0..points.len() as u32).map(|i| (mix(seed.wrapping_add(u64::from(i))), i)).collect();
    lots.sort_unstable();
    let count = (share * points.len() as f64).round() as usize;
    lots.truncate(count.max(1));
    let mut kept: Vec<u32> = lots.into_iter().map(|(_, index)| index).collect();
    kept.sort_unstable();
    kept
}

/// SplitMix64 (Steele et al. 2014).
fn mix(state: u64) -> u64 {
    let mut v = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    v = (v ^ (v >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    v ^ (v >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_keeps_the_point_nearest_its_mean() {
        let points = [[0.01, 0.01, 0.0], [0.1, 0.1, 0.0], [0.2, 0.2, 0.0], [0.3, 0.0, 0.0]];
        assert_eq!(one_per_cell(&points, &[0.25; 4]), [1, 3]);
        assert_eq!(one_per_cell(&points, &[0.49; 4]), [1, 3]);
        assert_eq!(one_per_cell(&points, &[0.0, 0.25, 0.0, 0.25]), [0, 1, 2, 3]);
    }

    #[test]
    fn a_draw_has_its_size_and_follows_the_points() {
        let points: Vec<[f64; 3]> = (0..1000).map(|i| [f64::from(i), 0.0, 0.0]).collect();
        let some = drawn(&points, 0.3);
        assert_eq!(some.len(), 300);
        assert!(some.windows(2).all(|pair| pair[0] < pair[1]));
        let mean = some.iter().map(|&i| f64::from(i)).sum::<f64>() / 300.0;
        assert!((mean - 500.0).abs() < 60.0, "{mean}");
        let other: Vec<[f64; 3]> = points.iter().map(|p| [p[0], 1.0, 0.0]).collect();
        assert_ne!(drawn(&other, 0.3), some);
        assert_eq!(drawn(&points, 1.0).len(), 1000);
        assert_eq!(drawn(&[], 0.5), Vec::<u32>::new());
    }
}

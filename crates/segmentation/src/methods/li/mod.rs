//! Trees grown point by point from the top down (Li, Guo, Jakubowski and Kelly 2012, A new method
//! for segmenting individual trees from the lidar point cloud, PE&RS 78(1): 75-84).
//!
//! The highest point that has no tree yet starts one. All others without a tree are asked in turn,
//! from the highest down, whether they belong to it: a point does that lies nearer in the plane to
//! the points already taken than to those already left, unless it is a local maximum further from
//! them than a gap that depends on height. What is left over starts the next tree.
//!
//! As described the method compares every point with all others, once for each tree. Here only
//! points within the largest crown radius of a tree's top take part, and of the two distances only
//! the smaller one is ever needed: whether a point is taken depends on nothing but its nearest
//! neighbour among those already asked. That is one search in a small grid, so the cost is
//! proportional to the number of points times the number of tops within a crown radius.

mod asked;
mod growth;
mod maxima;
mod pool;
mod segmenter;

pub use segmenter::{Li, grow};

use crate::{Error, SegmentationParams, Segments, View};
use growth::Growth;
use pool::Pool;

/// Parameters of the method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LiParams {
    /// A local maximum below `split_height_m` further than this from a tree is not of it, m.
    pub gap_low_m: f64,
    /// The same from `split_height_m` up, m.
    pub gap_high_m: f64,
    /// Height from which crowns are wide enough for the larger gap, m.
    pub split_height_m: f64,
    /// A local maximum has no higher point within this radius, m; 0: every point is one.
    pub window_m: f64,
    /// Farthest a tree reaches from its top in the plane, m.
    pub max_radius_m: f64,
    /// Lowest top, m.
    pub min_top_m: f64,
    /// Lowest point of a tree, m.
    pub min_height_m: f64,
}

impl Default for LiParams {
    /// The values of the paper (section "Segmentation"; the radius and lowest top are those of
    /// other implementations).
    fn default() -> Self {
        Self {
            gap_low_m: 1.5,
            gap_high_m: 2.0,
            split_height_m: 15.0,
            window_m: 2.0,
            max_radius_m: 10.0,
            min_top_m: 2.0,
            min_height_m: 0.0,
        }
    }
}

impl LiParams {
    /// Those named `li_` among the parameters of the stage; the others, which only [`trees`] needs,
    /// by default.
    #[must_use]
    pub fn of(params: &SegmentationParams) -> Self {
        Self {
            gap_low_m: params.li_gap_low_m,
            gap_high_m: params.li_gap_high_m,
            split_height_m: params.li_split_height_m,
            max_radius_m: params.li_radius_m,
            min_height_m: params.min_height_m,
            ..Self::default()
        }
    }

    /// The gap for a point at a height.
    fn gap_m(&self, height_m: f64) -> f64 {
        if height_m > self.split_height_m { self.gap_high_m } else { self.gap_low_m }
    }
}

/// Points by height, the highest first, equal ones by index: the order in which all is done.
#[derive(Debug, Clone, Default)]
struct Ranked {
    x: Vec<f64>,
    y: Vec<f64>,
    height_m: Vec<f64>,
    /// Index of the point in the caller's slices.
    index: Vec<u32>,
}

impl Ranked {
    /// Ranks the points that are not lower than `min_height_m`.
    fn new(x: &[f64], y: &[f64], height_m: &[f32], min_height_m: f64) -> Self {
        let mut index: Vec<u32> = (0..height_m.len() as u32)
            .filter(|&i| f64::from(height_m[i as usize]) >= min_height_m)
            .collect();
        index.sort_unstable_by(|&a, &b| {
            height_m[b as usize].total_cmp(&height_m[a as usize]).then(a.cmp(&b))
        });
        let column = |values: &[f64]| index.iter().map(|&i| values[i as usize]).collect();
        let height_m = index.iter().map(|&i| f64::from(height_m[i as usize])).collect();
        Self { x: column(x), y: column(y), height_m, index }
    }
}

/// Points at least `min_top_m` high without a higher one within `window_m` in the plane, from the
/// highest down.
#[must_use]
pub fn tops(view: &View<'_>, window_m: f64, min_top_m: f64) -> Vec<u32> {
    let ranked = Ranked::new(view.x, view.y, view.height_m, min_top_m);
    let maxima = maxima::local_maxima(&ranked, window_m);
    ranked.index.iter().zip(maxima).filter(|(_, is)| *is).map(|(index, _)| *index).collect()
}

/// Finds the trees of a cloud: coordinates in metres, heights above ground (NaN: no tree).
///
/// Every tree starts at the highest point that has none (section "Segmentation" of the paper). Of
/// equal heights the lower index counts as higher.
///
/// # Errors
/// [`Error::Length`] when the slices differ in length.
pub fn trees(x: &[f64], y: &[f64], height_m: &[f32], params: &LiParams) -> Result<Segments, Error> {
    Error::check_lengths(x.len(), &[("y", y.len()), ("height", height_m.len())])?;
    let lowest = params.min_height_m.min(params.min_top_m);
    let ranked = Ranked::new(x, y, height_m, lowest);
    let maxima = maxima::local_maxima(&ranked, params.window_m);
    let mut pool = Pool::new(&ranked, params.max_radius_m);
    let mut growth = Growth::new(&ranked, &maxima, params);
    let mut tree_of = vec![Segments::NONE; ranked.index.len()];
    let mut tops = Vec::new();
    for rank in 0..ranked.index.len() {
        if ranked.height_m[rank] < params.min_top_m {
            break;
        }
        if tree_of[rank] != Segments::NONE {
            continue;
        }
        let top = [ranked.x[rank], ranked.y[rank]];
        for taken in growth.grow(&mut pool, top) {
            tree_of[*taken as usize] = tops.len() as u32;
        }
        tops.push(ranked.index[rank]);
    }
    let mut tree = vec![Segments::NONE; x.len()];
    for (rank, &of) in tree_of.iter().enumerate() {
        let low = ranked.height_m[rank] < params.min_height_m;
        tree[ranked.index[rank] as usize] = if low { Segments::NONE } else { of };
    }
    Ok(Segments { tops, tree })
}

#[cfg(test)]
mod tests {
    use super::*;

    type Columns = (Vec<f64>, Vec<f64>, Vec<f32>);

    fn columns(points: &[(i32, i32, i32)]) -> Columns {
        (
            points.iter().map(|p| 0.25 * f64::from(p.0)).collect(),
            points.iter().map(|p| 0.25 * f64::from(p.1)).collect(),
            points.iter().map(|p| 0.5 * p.2 as f32).collect(),
        )
    }

    /// Two cones, tops 6 m apart, with points every half metre.
    fn pair() -> Columns {
        let mut points = Vec::new();
        for i in -12..=36 {
            for j in -12i32..=12 {
                let to = |centre: i32| libm::hypot(f64::from(i - centre), f64::from(j)) * 0.25;
                let height = f64::max(20.0 - 2.0 * to(0), 18.0 - 2.0 * to(24));
                points.push((i, j, (2.0 * height) as i32));
            }
        }
        columns(&points)
    }

    #[test]
    fn two_cones_are_two_trees() {
        let (x, y, height) = pair();
        let found = trees(&x, &y, &height, &LiParams::default()).unwrap();
        assert_eq!(found.tops.len(), 2);
        assert_eq!([0, 1].map(|k| x[found.tops[k] as usize]), [0.0, 6.0]);
        let at = |px: f64| found.tree[(0..x.len()).find(|&i| x[i] == px && y[i] == 0.0).unwrap()];
        assert_eq!([at(-2.0), at(1.0), at(5.0), at(8.0)], [0, 0, 1, 1]);
    }

    #[test]
    fn low_points_and_unknown_heights_are_no_tree() {
        let height = [9.0, 1.0, f32::NAN, 0.4];
        let x = [0.0, 0.1, 0.2, 0.3];
        let params = LiParams { min_height_m: 0.5, ..LiParams::default() };
        let found = trees(&x, &x, &height, &params).unwrap();
        assert_eq!(found.tree, [0, 0, Segments::NONE, Segments::NONE]);
        let none = LiParams { min_top_m: 9.5, ..params };
        assert!(trees(&x, &x, &height, &none).unwrap().tops.is_empty());
        assert!(trees(&x, &x, &height[1..], &params).is_err());
    }

    #[test]
    fn beyond_the_largest_radius_is_another_tree() {
        let x: Vec<f64> = (0..60).map(|i| 0.5 * f64::from(i)).collect();
        let (y, height) =
            (vec![0.0; 60], (0..60).map(|i| 30.0 - 0.1 * i as f32).collect::<Vec<_>>());
        let params = LiParams { max_radius_m: 8.0, ..LiParams::default() };
        let found = trees(&x, &y, &height, &params).unwrap();
        assert_eq!(found.tops, [0, 17, 34, 51]);
    }
}

//! Points put in an order of their own, so that results do not depend on the order in which they came.

use crate::{Error, TreePoints};
use std::borrow::Cow;

/// Finite points in a fixed order, near ones near each other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Points {
    /// Positions, m.
    pub points_m: Vec<[f64; 3]>,
    /// How likely each is on wood; none where that is not known.
    pub wood: Option<Vec<f32>>,
    /// Number of points left out because they are not finite.
    pub not_finite: usize,
}

/// Grains in a metre. Positions are rounded to them, a micrometre, so that the last bits, which change
/// when the world is shifted by whole metres, change nothing. Every tick of the world's lattice of
/// 0.1 mm is a grain, so that none of its points is near the edge between two.
const GRAINS_PER_M: f64 = 1e6;

/// A position rounded to a micrometre.
#[must_use]
pub fn rounded(position_m: [f64; 3]) -> [f64; 3] {
    position_m.map(|value| (value * GRAINS_PER_M + 0.5).floor() / GRAINS_PER_M)
}

/// Edge of the cells that are visited one after the other, m.
const CELL_M: f64 = 0.125;

impl Points {
    /// Sorts the finite points of a tree.
    ///
    /// # Errors
    /// [`Error::Length`] and [`Error::TooManyPoints`].
    pub fn new(tree: &TreePoints<'_>) -> Result<Self, Error> {
        let points = tree.points_m.len();
        if let Some(wood) = tree.wood.filter(|wood| wood.len() != points) {
            return Err(Error::Length { points, found: wood.len() });
        }
        if u32::try_from(points).is_err() {
            return Err(Error::TooManyPoints(points));
        }
        let wood_of = |index: u32| tree.wood.map_or(0.0, |wood| wood[index as usize]);
        let position = |index: u32| rounded(tree.points_m[index as usize]);
        let finite = |index: &u32| tree.points_m[*index as usize].iter().all(|v| v.is_finite());
        let mut keyed: Vec<([i64; 3], u32)> =
            (0..points as u32).filter(finite).map(|index| (cell(position(index)), index)).collect();
        keyed.sort_unstable_by(|a, b| {
            let (p, q) = (position(a.1), position(b.1));
            let by_axis = |k: usize| p[k].total_cmp(&q[k]);
            let by_position = || by_axis(2).then_with(|| by_axis(0)).then_with(|| by_axis(1));
            let wood = || wood_of(a.1).total_cmp(&wood_of(b.1));
            a.0.cmp(&b.0).then_with(by_position).then_with(wood)
        });
        let pick = |wood: &[f32]| keyed.iter().map(|(_, index)| wood[*index as usize]).collect();
        Ok(Self {
            points_m: keyed.iter().map(|(_, index)| position(*index)).collect(),
            wood: tree.wood.map(pick),
            not_finite: points - keyed.len(),
        })
    }

    /// At most about `most` of the points, every n-th.
    #[must_use]
    pub fn thinned(&self, most: usize) -> Cow<'_, Self> {
        let stride = self.points_m.len().div_ceil(most.max(1));
        if stride <= 1 {
            return Cow::Borrowed(self);
        }
        Cow::Owned(Self {
            points_m: self.points_m.iter().copied().step_by(stride).collect(),
            wood: self.wood.as_ref().map(|wood| wood.iter().copied().step_by(stride).collect()),
            not_finite: self.not_finite,
        })
    }
}

/// The cell of a position: layers from below, in each along y.
fn cell(position_m: [f64; 3]) -> [i64; 3] {
    let [x, y, z] = position_m.map(|value| (value / CELL_M).floor() as i64);
    [z, y, x]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_does_not_matter_and_what_is_not_finite_is_counted() {
        let mut points =
            vec![[0.3, 0.125, 1.0], [f64::NAN, 0.0, 0.0], [0.2, 0.1, 1.0], [0.2, 0.1, 1.0]];
        let mut wood = vec![0.1, 0.2, 0.9, 0.4];
        let sorted = |points: &[[f64; 3]], wood: &[f32]| {
            let tree =
                TreePoints { points_m: points, wood: Some(wood), base_m: [0.0; 3], dbh_m: None };
            Points::new(&tree).unwrap()
        };
        let one = sorted(&points, &wood);
        points.reverse();
        wood.reverse();
        assert_eq!(sorted(&points, &wood), one);
        assert_eq!((one.not_finite, one.points_m.len()), (1, 3));
        assert_eq!(one.wood.as_deref(), Some(&[0.4, 0.9, 0.1][..]));
        let short =
            TreePoints { points_m: &points, wood: Some(&wood[1..]), base_m: [0.0; 3], dbh_m: None };
        assert_eq!(Points::new(&short), Err(Error::Length { points: 4, found: 3 }));
    }
}

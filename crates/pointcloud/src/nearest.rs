//! Nearest neighbours over a kiddo kd-tree, with ties decided by index.

use kiddo::{ImmutableKdTree, QueryResultItem, SquaredEuclidean};
use std::num::NonZeroUsize;

/// Points whose coordinates all coincide defeat a kd-tree's leaf limit; kiddo reports it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the kd-tree over {points} points could not be built: {reason}")]
pub struct BuildError {
    /// Number of points given.
    pub points: usize,
    /// What kiddo said.
    pub reason: String,
}

/// One neighbour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Neighbour {
    /// Index of the point in the slice the tree was built from.
    pub index: usize,
    /// Squared distance, m².
    pub squared_m2: f64,
}

/// A kd-tree over positions of `D` dimensions, in any one frame.
#[derive(Debug)]
pub struct Nearest<const D: usize> {
    tree: Option<ImmutableKdTree<f64, D>>,
    len: usize,
}

/// A kd-tree in the plane.
pub type Nearest2 = Nearest<2>;
/// A kd-tree in space.
pub type Nearest3 = Nearest<3>;

impl<const D: usize> Nearest<D> {
    /// Builds the tree. Points in [canonical order](crate::order) make it about three times faster.
    ///
    /// # Errors
    /// [`BuildError`] when kiddo refuses the points.
    pub fn new(points: &[[f64; D]]) -> Result<Self, BuildError> {
        if points.is_empty() {
            return Ok(Self { tree: None, len: 0 });
        }
        let tree = ImmutableKdTree::new_from_slice(points)
            .map_err(|error| BuildError { points: points.len(), reason: format!("{error:?}") })?;
        Ok(Self { tree: Some(tree), len: points.len() })
    }

    /// The `count` nearest points, nearest first, equal distances by ascending index.
    #[must_use]
    pub fn nearest(&self, at: &[f64; D], count: usize) -> Vec<Neighbour> {
        let Some(count) = NonZeroUsize::new(count.min(self.len)) else {
            return Vec::new();
        };
        let Some(tree) = &self.tree else {
            return Vec::new();
        };
        let found = tree.query(at).nearest_n::<SquaredEuclidean<f64>>(count).execute();
        let mut neighbours = sorted(found);
        // Which of several points at the last distance the tree returns is its own affair: ask for all.
        if let Some(last) = neighbours.last().map(|n| n.squared_m2) {
            let all = self.within_squared(at, last);
            if all.len() > neighbours.len() {
                neighbours = all;
                neighbours.truncate(count.get());
            }
        }
        neighbours
    }

    /// All points within a distance, nearest first, equal distances by ascending index.
    #[must_use]
    pub fn within(&self, at: &[f64; D], radius_m: f64) -> Vec<Neighbour> {
        self.within_squared(at, radius_m * radius_m)
    }

    fn within_squared(&self, at: &[f64; D], squared_m2: f64) -> Vec<Neighbour> {
        let Some(tree) = &self.tree else {
            return Vec::new();
        };
        let query = tree.query(at).within::<SquaredEuclidean<f64>>(squared_m2);
        sorted(query.unsorted().execute())
    }
}

fn sorted<P>(found: impl IntoIterator<Item = QueryResultItem<P, u32, f64>>) -> Vec<Neighbour> {
    let mut neighbours: Vec<Neighbour> = found
        .into_iter()
        .map(|item| Neighbour { index: item.item as usize, squared_m2: item.distance })
        .collect();
    neighbours
        .sort_unstable_by(|a, b| a.squared_m2.total_cmp(&b.squared_m2).then(a.index.cmp(&b.index)));
    neighbours
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn brute(points: &[[f64; 2]], at: [f64; 2]) -> Vec<Neighbour> {
        let mut all: Vec<Neighbour> = points
            .iter()
            .enumerate()
            .map(|(index, p)| {
                let (dx, dy) = (p[0] - at[0], p[1] - at[1]);
                Neighbour { index, squared_m2: dx * dx + dy * dy }
            })
            .collect();
        all.sort_by(|a, b| a.squared_m2.total_cmp(&b.squared_m2).then(a.index.cmp(&b.index)));
        all
    }

    proptest! {
        #[test]
        fn as_brute_force_with_many_ties(
            points in prop::collection::vec((0i32..6, 0i32..6), 0..200),
            at in (0i32..6, 0i32..6), count in 0usize..20, radius in 0u8..5,
        ) {
            let points: Vec<[f64; 2]> = points.iter().map(|p| [f64::from(p.0), f64::from(p.1)]).collect();
            let at = [f64::from(at.0), f64::from(at.1)];
            let tree = Nearest2::new(&points).unwrap();
            let expected = brute(&points, at);
            let few = expected.len().min(count);
            prop_assert_eq!(tree.nearest(&at, count), &expected[..few]);
            let r = f64::from(radius);
            let inside: Vec<_> = expected.into_iter().filter(|n| n.squared_m2 <= r * r).collect();
            prop_assert_eq!(tree.within(&at, r), inside);
        }
    }
}

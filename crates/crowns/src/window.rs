//! The points around a treetop, as distance from its axis and depth below its apex.

use timberline_pointcloud::Grid2;

/// What a crown model sees of the points around an apex, sorted by distance.
///
/// The sequence depends only on positions relative to the apex, so it is the same whichever frame
/// or sequence the points came in (points alike in position are interchangeable).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Window {
    /// Horizontal distance from the apex, m, ascending.
    pub r: Vec<f64>,
    /// Depth below the apex, m; negative above it; infinite for a point that can be in no crown
    /// (too near the ground): it counts against a model, never for it.
    pub h: Vec<f64>,
    /// Index of the point in the slices the window was gathered from.
    pub index: Vec<u32>,
}

/// One point in the making of a window: sort key and place.
type Entry = (f64, f64, [f64; 2], u32);

impl Window {
    /// A window of points given relative to the apex: `offset` is point minus apex in metres, and
    /// whether the point can be in a crown.
    #[must_use]
    pub fn new(points: impl IntoIterator<Item = (u32, [f64; 3], bool)>) -> Self {
        let entry = |(index, [dx, dy, dz], eligible): (u32, [f64; 3], bool)| -> Entry {
            let depth = if eligible { -dz } else { f64::INFINITY };
            ((dx * dx + dy * dy).sqrt(), depth, [dx, dy], index)
        };
        Self::sorted(points.into_iter().map(entry).collect())
    }

    /// The points within the square of half width `half_width_m` around the apex (closed).
    ///
    /// `accept` says for a point's index whether it is looked at at all, and if so whether it can
    /// be in a crown. `x`, `y`, `z` and the apex are in one frame.
    #[must_use]
    pub fn gather(
        [x, y, z]: [&[f64]; 3],
        grid: &Grid2,
        apex: [f64; 3],
        half_width_m: f64,
        accept: impl Fn(usize) -> Option<bool>,
    ) -> Self {
        let mut entries: Vec<(u32, [f64; 3], bool)> = Vec::new();
        grid.candidates(apex[0], apex[1], half_width_m, |i| {
            let (dx, dy) = (x[i] - apex[0], y[i] - apex[1]);
            if dx.abs().max(dy.abs()) <= half_width_m
                && let Some(eligible) = accept(i)
            {
                entries.push((i as u32, [dx, dy, z[i] - apex[2]], eligible));
            }
        });
        Self::new(entries)
    }

    fn sorted(mut entries: Vec<Entry>) -> Self {
        entries.sort_unstable_by(|a, b| {
            a.0.total_cmp(&b.0)
                .then_with(|| a.1.total_cmp(&b.1))
                .then_with(|| a.2[0].total_cmp(&b.2[0]))
                .then_with(|| a.2[1].total_cmp(&b.2[1]))
                .then(a.3.cmp(&b.3))
        });
        Self {
            r: entries.iter().map(|entry| entry.0).collect(),
            h: entries.iter().map(|entry| entry.1).collect(),
            index: entries.iter().map(|entry| entry.3).collect(),
        }
    }

    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.r.len()
    }

    /// Whether there are no points.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.r.is_empty()
    }

    /// Number of points that can be in a crown.
    #[must_use]
    pub fn eligible(&self) -> usize {
        self.h.iter().filter(|h| h.is_finite()).count()
    }

    /// At most `count` of the points, spread evenly over the sequence (so over all distances).
    #[must_use]
    pub fn thinned(&self, count: usize) -> Self {
        if self.len() <= count || count == 0 {
            return self.clone();
        }
        let places = (0..count).map(|k| k * self.len() / count);
        let mut thin = Self::default();
        for place in places {
            thin.r.push(self.r[place]);
            thin.h.push(self.h[place]);
            thin.index.push(self.index[place]);
        }
        thin
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn frame_and_order_of_points_do_not_matter(
            points in prop::collection::vec((-40i32..40, -40i32..40, -30i32..1), 1..80),
            shift in -900i32..900,
        ) {
            let see = |origin: f64, reversed: bool| {
                let mut list = points.clone();
                if reversed { list.reverse(); }
                let column = |axis: usize| -> Vec<f64> {
                    list.iter().map(|p| f64::from([p.0, p.1, p.2][axis]) * 0.25 + origin).collect()
                };
                let (x, y, z) = (column(0), column(1), column(2));
                let grid = Grid2::new(&x, &y, 2.5).unwrap();
                let apex = [origin, origin, origin];
                let window = Window::gather([&x, &y, &z], &grid, apex, 6.0, |i| Some(z[i] - origin > -5.0));
                (window.r, window.h)
            };
            prop_assert_eq!(see(0.0, false), see(f64::from(shift), true));
        }
    }

    #[test]
    fn the_square_is_closed_and_sorted_by_distance() {
        let (x, y, z) = ([3.0, 0.0, 3.0, 3.1], [3.0, 1.0, -3.0, 0.0], [5.0, 9.0, 6.0, 9.0]);
        let grid = Grid2::new(&x, &y, 2.0).unwrap();
        let window = Window::gather([&x, &y, &z], &grid, [0.0, 0.0, 10.0], 3.0, |i| Some(i != 0));
        assert_eq!(window.index, [1, 2, 0]);
        assert_eq!(window.h, [1.0, 4.0, f64::INFINITY]);
        assert_eq!(window.eligible(), 2);
    }

    #[test]
    fn thinning_spans_the_distances() {
        let window = Window::new((0..100).map(|i| (i, [f64::from(i), 0.0, -1.0], true)));
        assert_eq!(window.thinned(4).r, [0.0, 25.0, 50.0, 75.0]);
    }
}

//! The nearest of many cylinders.

use crate::bvh::{Best, Box3, Bvh};
use crate::{Cylinder, Ends};
use rayon::prelude::*;

/// Positions asked one after the other, each beginning with the answer before it.
const CHUNK: usize = 1024;

/// Finds the cylinder whose surface is nearest to a position. Exact.
///
/// Cylinders that are not finite are never found.
#[derive(Debug)]
pub struct CylinderIndex {
    cylinders: Vec<Cylinder>,
    ends: Vec<Ends>,
    bvh: Bvh,
}

impl CylinderIndex {
    /// An index of closed cylinders.
    #[must_use]
    pub fn new(cylinders: &[Cylinder]) -> Self {
        Self::with_ends(cylinders, &vec![Ends::BOTH; cylinders.len()])
    }

    /// An index of cylinders of which only some ends are closed, see [`crate::free_ends`]. Where
    /// `ends` is shorter than `cylinders`, the rest is closed.
    #[must_use]
    pub fn with_ends(cylinders: &[Cylinder], ends: &[Ends]) -> Self {
        let none = Box3 { min: [f64::NAN; 3], max: [f64::NAN; 3] };
        let boxes: Vec<Box3> = cylinders
            .iter()
            .map(|cylinder| if cylinder.is_finite() { cylinder.bounds() } else { none })
            .collect();
        let rest = std::iter::repeat(Ends::BOTH);
        let ends = ends.iter().copied().chain(rest).take(cylinders.len()).collect();
        Self { cylinders: cylinders.to_vec(), ends, bvh: Bvh::new(&boxes) }
    }

    /// Place of the nearest cylinder and the distance to its surface, m; of equally near ones the
    /// first. None without cylinders and for a position that is not finite.
    #[must_use]
    pub fn nearest(&self, position_m: [f64; 3]) -> Option<(u32, f64)> {
        self.search(position_m, None).map(|best| (best.item, best.squared.sqrt()))
    }

    /// [`CylinderIndex::nearest`] of many positions, in their order, in parallel. Positions that are
    /// neighbours in the slice are answered faster when they are neighbours in space.
    #[must_use]
    pub fn nearest_all(&self, positions_m: &[[f64; 3]]) -> Vec<Option<(u32, f64)>> {
        let chunks = positions_m.par_chunks(CHUNK).map(|chunk| {
            let mut last = None;
            let ask = |position_m: &[f64; 3]| {
                let best = self.search(*position_m, last);
                last = best.map(|best| best.item).or(last);
                best.map(|best| (best.item, best.squared.sqrt()))
            };
            chunk.iter().map(ask).collect::<Vec<_>>()
        });
        chunks.collect::<Vec<_>>().concat()
    }

    /// Whether a position lies inside another cylinder than the one named, and not just on its surface.
    #[must_use]
    pub fn is_inside_another(&self, position_m: [f64; 3], cylinder: u32) -> bool {
        /// Rounding of positions within kilometres of the frame's origin.
        const ON_THE_SURFACE_M: f64 = 1e-9;
        self.bvh.any_around(position_m, |item| {
            let other = &self.cylinders[item as usize];
            item != cylinder && other.signed_distance_m(position_m) < -ON_THE_SURFACE_M
        })
    }

    fn search(&self, position_m: [f64; 3], guess: Option<u32>) -> Option<Best> {
        if !position_m.iter().all(|value| value.is_finite()) {
            return None;
        }
        let squared = |item: u32| {
            let place = item as usize;
            let distance = self.cylinders[place].distance_to_m(position_m, self.ends[place]);
            distance * distance
        };
        let guess = guess.map(|item| Best { item, squared: squared(item) });
        self.bvh.nearest(position_m, guess, squared)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn brute(cylinders: &[Cylinder], ends: &[Ends], p: [f64; 3]) -> Option<(u32, f64)> {
        let all = (0u32..).zip(cylinders.iter().zip(ends));
        let all = all.map(|(place, (c, ends))| (place, c.distance_to_m(p, *ends)));
        all.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
    }

    fn cylinders() -> impl Strategy<Value = Vec<(Cylinder, Ends)>> {
        // Whole decimetres make ties, coincident and empty cylinders.
        let place =
            || prop::array::uniform3(-20i32..20).prop_map(|p| p.map(|v| f64::from(v) * 0.1));
        let one = (place(), place(), 0i32..8, any::<bool>(), any::<bool>());
        let one = one.prop_map(|(start_m, end_m, radius, start, end)| {
            (Cylinder { start_m, end_m, radius_m: f64::from(radius) * 0.1 }, Ends { start, end })
        });
        prop::collection::vec(one, 0..120)
    }

    proptest! {
        #[test]
        fn as_brute_force(
            all in cylinders(),
            positions in prop::collection::vec(prop::array::uniform3(-25i32..25), 1..40),
        ) {
            let (cylinders, ends): (Vec<_>, Vec<_>) = all.into_iter().unzip();
            let index = CylinderIndex::with_ends(&cylinders, &ends);
            let positions: Vec<_> =
                positions.iter().map(|p| p.map(|v| f64::from(v) * 0.1)).collect();
            let expected: Vec<_> =
                positions.iter().map(|p| brute(&cylinders, &ends, *p)).collect();
            for (position, expected) in positions.iter().zip(&expected) {
                let found = index.nearest(*position);
                prop_assert_eq!(found.map(|f| f.1), expected.map(|e| e.1));
            }
            prop_assert_eq!(&index.nearest_all(&positions).len(), &positions.len());
            for (found, expected) in index.nearest_all(&positions).iter().zip(&expected) {
                prop_assert_eq!(found.map(|f| f.1), expected.map(|e| e.1));
            }
        }
    }

    #[test]
    fn what_is_not_finite_is_never_found() {
        let good = Cylinder { start_m: [0.0; 3], end_m: [0.0, 0.0, 1.0], radius_m: 0.5 };
        let bad = Cylinder { radius_m: f64::NAN, ..good };
        let index =
            CylinderIndex::new(&[bad, good, Cylinder { start_m: [f64::INFINITY; 3], ..good }]);
        assert_eq!(index.nearest([1.0, 0.0, 0.5]), Some((1, 0.5)));
        assert_eq!(index.nearest([f64::NAN, 0.0, 0.0]), None);
        assert_eq!(CylinderIndex::new(&[bad]).nearest([0.0; 3]), None);
        assert_eq!(CylinderIndex::new(&[]).nearest([0.0; 3]), None);
    }

    #[test]
    fn coincident_cylinders_are_split_all_the_same() {
        let one = Cylinder { start_m: [0.0; 3], end_m: [0.0, 0.0, 1.0], radius_m: 0.5 };
        let index = CylinderIndex::new(&vec![one; 1000]);
        assert_eq!(index.nearest_all(&[[1.0, 0.0, 0.5]; 3]), [Some((0, 0.5)); 3]);
    }
}

//! Trees grown from given tops.

use super::growth::{Growth, Rival};
use super::pool::Pool;
use super::{LiParams, Ranked};
use crate::{Claim, Error, Marker, Segmenter, View};

/// [`super::trees`] with the trees given: each starts at its marker instead of at the highest point
/// that is left.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Li {
    /// Gaps, radius, heights; `min_top_m` does not matter.
    pub params: LiParams,
}

impl Segmenter for Li {
    fn reach_m(&self) -> f64 {
        2.0 * self.params.max_radius_m
    }

    fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, Error> {
        let tree = self.grow(view);
        let id = |&tree: &u32| view.markers.get(tree as usize).map_or(0, |m| m.crown.id);
        Ok(tree.iter().map(|t| Claim { id: id(t), score: 0.0 }).collect())
    }
}

/// How markers are honoured, for trial.
pub static VARIANT: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(0);

impl Li {
    /// For every point the index of its marker, or `u32::MAX`.
    fn grow(&self, view: &View<'_>) -> Vec<u32> {
        let variant = VARIANT.load(std::sync::atomic::Ordering::Relaxed);
        let params = &self.params;
        let ranked = Ranked::new(view.x, view.y, view.height_m, params.min_height_m);
        let maxima = super::maxima::local_maxima(&ranked, params.window_m);
        let mut pool = Pool::new(&ranked, params.max_radius_m);
        let use_max = variant & 1 == 0;
        let mut growth = Growth::new(&ranked, use_max.then_some(&maxima[..]), params);
        let seeds = seeds(view.markers, &ranked);
        let mut tree_of = vec![u32::MAX; view.x.len()];
        let mut rivals = Vec::new();
        for (place, (marker, seed)) in seeds.iter().enumerate() {
            rivals.clear();
            if variant & 2 == 0 {
                rivals.extend(seeds[place + 1..].iter().map(|(_, s)| *s).filter(|other| {
                    let (dx, dy) = (other.at[0] - seed.at[0], other.at[1] - seed.at[1]);
                    dx * dx + dy * dy <= params.max_radius_m * params.max_radius_m
                }));
            }
            for &rank in growth.grow(&mut pool, seed.at, &rivals) {
                tree_of[ranked.index[rank as usize] as usize] = *marker;
            }
        }
        tree_of
    }
}

/// The markers' tops from the highest down, equal ones by id.
fn seeds(markers: &[Marker], ranked: &Ranked) -> Vec<(u32, Rival)> {
    let mut order: Vec<u32> = (0..markers.len() as u32).collect();
    let height = |i: u32| markers[i as usize].height_m;
    order.sort_by(|&a, &b| {
        height(b).total_cmp(&height(a)).then_with(|| {
            markers[a as usize].crown.id.cmp(&markers[b as usize].crown.id)
        })
    });
    let rank = |i: u32| ranked.height_m.partition_point(|h| *h > height(i)) as u32;
    let at = |i: u32| [0, 1].map(|axis| markers[i as usize].crown.apex[axis]);
    order.into_iter().map(|i| (i, Rival { at: at(i), rank: rank(i) })).collect()
}

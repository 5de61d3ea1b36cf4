//! Growing one tree.

use super::asked::Asked;
use super::{LiParams, Pool, Ranked};

/// Label of points that the tree took; the lower one, for it wins ties.
const TAKEN: u32 = 0;
/// Label of points that it left.
const LEFT: u32 = 1;

/// Grows trees one after another, out of a pool of points.
#[derive(Debug)]
pub(super) struct Growth<'a> {
    ranked: &'a Ranked,
    /// Which points are local maxima.
    maxima: &'a [bool],
    params: LiParams,
    asked: Asked,
    candidates: Vec<u32>,
    taken: Vec<u32>,
    is_taken: Vec<bool>,
}

impl<'a> Growth<'a> {
    pub(super) fn new(ranked: &'a Ranked, maxima: &'a [bool], params: &LiParams) -> Self {
        Self {
            ranked,
            maxima,
            params: *params,
            asked: Asked::default(),
            candidates: Vec::new(),
            taken: Vec::new(),
            is_taken: vec![false; ranked.index.len()],
        }
    }

    /// Takes the points of the tree with this top out of the pool and returns their ranks.
    pub(super) fn grow(&mut self, pool: &mut Pool, top: [f64; 2]) -> &[u32] {
        self.gather(pool, top);
        let radius_m = self.params.max_radius_m;
        self.asked.reset(
            top.map(|value| value - radius_m),
            [2.0 * radius_m; 2],
            self.candidates.len(),
        );
        self.asked.insert(top, TAKEN);
        self.taken.clear();
        for &rank in &self.candidates {
            let place = rank as usize;
            let at = [self.ranked.x[place], self.ranked.y[place]];
            let belongs = self.belongs(place, at);
            self.asked.insert(at, if belongs { TAKEN } else { LEFT });
            if belongs {
                self.taken.push(rank);
                self.is_taken[place] = true;
            }
        }
        let is_taken = &self.is_taken;
        pool.cells_around(top, radius_m, |ranks| {
            ranks.retain(|&rank| !is_taken[rank as usize]);
        });
        &self.taken
    }

    /// The points of the pool within the largest radius, from the highest down.
    fn gather(&mut self, pool: &mut Pool, top: [f64; 2]) {
        let radius_m = self.params.max_radius_m;
        let (ranked, candidates) = (self.ranked, &mut self.candidates);
        candidates.clear();
        pool.cells_around(top, radius_m, |ranks| {
            candidates.extend(ranks.iter().filter(|&&rank| {
                let [dx, dy] = [ranked.x[rank as usize] - top[0], ranked.y[rank as usize] - top[1]];
                dx * dx + dy * dy <= radius_m * radius_m
            }));
        });
        candidates.sort_unstable();
    }

    /// The rules of section "Segmentation": with dmin1 the distance to the points taken and dmin2
    /// that to the points left, a local maximum belongs if dmin1 <= gap and dmin1 <= dmin2, any
    /// other point if dmin1 <= dmin2. Both need only the nearest point of either kind.
    fn belongs(&self, place: usize, at: [f64; 2]) -> bool {
        let (squared, label) = self.asked.nearest(at, f64::INFINITY);
        let nearest_is_taken = label == TAKEN;
        if !nearest_is_taken || !self.maxima[place] {
            return nearest_is_taken;
        }
        let gap_m = self.params.gap_m(self.ranked.height_m[place]);
        squared.sqrt() <= gap_m
    }
}

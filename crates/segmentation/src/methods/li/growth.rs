//! Growing one tree.

use super::{LiParams, Pool, Ranked};

/// Grows trees one after another, out of a pool of points.
#[derive(Debug)]
pub(super) struct Growth<'a> {
    ranked: &'a Ranked,
    /// Which points are local maxima; `None`: none but the rivals stands for another tree.
    maxima: Option<&'a [bool]>,
    params: LiParams,
    asked: Asked,
    candidates: Vec<u32>,
    taken: Vec<u32>,
    is_taken: Vec<bool>,
}

/// The top of a tree that is to come: its place, and the first rank that is lower.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rival {
    pub(super) at: [f64; 2],
    pub(super) rank: u32,
}

impl<'a> Growth<'a> {
    pub(super) fn new(
        ranked: &'a Ranked,
        maxima: Option<&'a [bool]>,
        params: &LiParams,
    ) -> Self {
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
    ///
    /// `rivals` are tops of later trees within the radius, by rank: they are left in any case.
    pub(super) fn grow(&mut self, pool: &mut Pool, top: [f64; 2], rivals: &[Rival]) -> &[u32] {
        self.gather(pool, top);
        self.asked.reset(top, self.params.max_radius_m, self.candidates.len() + rivals.len());
        self.asked.insert(top, true);
        self.taken.clear();
        let mut rivals = rivals.iter().peekable();
        for &rank in &self.candidates {
            while let Some(rival) = rivals.next_if(|rival| rival.rank <= rank) {
                self.asked.insert(rival.at, false);
            }
            let place = rank as usize;
            let at = [self.ranked.x[place], self.ranked.y[place]];
            let belongs = self.belongs(place, at);
            self.asked.insert(at, belongs);
            if belongs {
                self.taken.push(rank);
                self.is_taken[place] = true;
            }
        }
        let is_taken = &self.is_taken;
        pool.cells_around(top, self.params.max_radius_m, |ranks| {
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
        let (squared, nearest_is_taken) = self.asked.nearest(at);
        if !nearest_is_taken || !self.maxima.is_some_and(|maxima| maxima[place]) {
            return nearest_is_taken;
        }
        let gap_m = self.params.gap_m(self.ranked.height_m[place]);
        squared.sqrt() <= gap_m
    }
}

/// A point that was asked, in the list of its cell.
#[derive(Debug, Clone, Copy)]
struct Item {
    at: [f64; 2],
    taken: bool,
    next: u32,
}

/// End of a list.
const END: u32 = u32::MAX;
/// Points per cell of the grid if they were spread evenly.
const POINTS_PER_CELL: f64 = 2.0;

/// The points that were asked already, in a square grid around the top. It is there for speed only:
/// the nearest point is found exactly, wherever the cells lie.
#[derive(Debug, Default)]
struct Asked {
    corner: [f64; 2],
    cell_m: f64,
    inverse_cell: f64,
    side: i32,
    heads: Vec<u32>,
    items: Vec<Item>,
}

impl Asked {
    /// Empties the grid and lays it around a top for about `count` points.
    fn reset(&mut self, top: [f64; 2], radius_m: f64, count: usize) {
        self.side = ((count as f64 / POINTS_PER_CELL).sqrt() as i32).clamp(1, 256);
        self.cell_m = 2.0 * radius_m / f64::from(self.side);
        self.inverse_cell = 1.0 / self.cell_m;
        self.corner = top.map(|value| value - radius_m);
        self.items.clear();
        self.heads.clear();
        self.heads.resize((self.side * self.side) as usize, END);
    }

    fn cell(&self, at: [f64; 2]) -> [i32; 2] {
        let index = |axis: usize| ((at[axis] - self.corner[axis]) * self.inverse_cell) as i32;
        [index(0).clamp(0, self.side - 1), index(1).clamp(0, self.side - 1)]
    }

    fn insert(&mut self, at: [f64; 2], taken: bool) {
        let [column, row] = self.cell(at);
        let head = &mut self.heads[(row * self.side + column) as usize];
        let next = *head;
        *head = self.items.len() as u32;
        self.items.push(Item { at, taken, next });
    }

    /// Squared distance to the nearest point, and whether it was taken; of points equally near one
    /// that was taken counts.
    fn nearest(&self, at: [f64; 2]) -> (f64, bool) {
        let [column, row] = self.cell(at);
        let mut best = (f64::INFINITY, false);
        for ring in 0..self.side {
            // What lies in this ring is at least this far away, less what rounding may do.
            let distance = f64::from(ring - 1).max(0.0) * self.cell_m * (1.0 - 1e-9);
            if best.0 < distance * distance {
                break;
            }
            for y in (row - ring).max(0)..=(row + ring).min(self.side - 1) {
                let whole = (y - row).abs() == ring;
                let step = if whole { 1 } else { (2 * ring).max(1) };
                let mut x = column - ring;
                while x <= column + ring {
                    if (0..self.side).contains(&x) {
                        self.nearer(y * self.side + x, at, &mut best);
                    }
                    x += step;
                }
            }
        }
        best
    }

    /// Looks through one cell.
    fn nearer(&self, cell: i32, at: [f64; 2], best: &mut (f64, bool)) {
        let mut place = self.heads[cell as usize];
        while place != END {
            let item = &self.items[place as usize];
            let (dx, dy) = (item.at[0] - at[0], item.at[1] - at[1]);
            let squared = dx * dx + dy * dy;
            if squared < best.0 {
                *best = (squared, item.taken);
            } else if squared == best.0 {
                best.1 |= item.taken;
            }
            place = item.next;
        }
    }
}

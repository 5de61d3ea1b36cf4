//! The points that were asked already.

/// A point that was asked, in the list of its cell.
#[derive(Debug, Clone, Copy)]
struct Item {
    at: [f64; 2],
    label: u32,
    next: u32,
}

/// End of a list.
const END: u32 = u32::MAX;
/// Points per cell of the grid if they were spread evenly.
const POINTS_PER_CELL: f64 = 2.0;
/// Most cells along an edge of the grid.
const MOST_CELLS: f64 = 2048.0;

/// The points that were asked already, in a grid. It is there for speed only: the nearest point is found exactly, wherever the cells lie.
#[derive(Debug, Default)]
pub(super) struct Asked {
    corner: [f64; 2],
    cell_m: f64,
    inverse_cell: f64,
    columns: i32,
    rows: i32,
    heads: Vec<u32>,
    items: Vec<Item>,
}

impl Asked {
    /// An empty grid over points.
    pub(super) fn over(x: &[f64], y: &[f64]) -> Self {
        let low = [x, y].map(|values| values.iter().copied().fold(f64::INFINITY, f64::min));
        let high = [x, y].map(|values| values.iter().copied().fold(f64::NEG_INFINITY, f64::max));
        let mut asked = Self::default();
        if !x.is_empty() {
            asked.reset(low, [high[0] - low[0], high[1] - low[1]], x.len());
        }
        asked
    }

    /// Empties the grid and lays it over a rectangle for about `count` points.
    pub(super) fn reset(&mut self, corner: [f64; 2], size_m: [f64; 2], count: usize) {
        let cells = (count as f64 / POINTS_PER_CELL).max(1.0);
        let [width, depth] = size_m.map(|edge| edge.max(1e-3));
        self.cell_m = (width * depth / cells).sqrt().max(width.max(depth) / MOST_CELLS);
        self.inverse_cell = 1.0 / self.cell_m;
        self.corner = corner;
        self.columns = (width * self.inverse_cell).ceil() as i32;
        self.rows = (depth * self.inverse_cell).ceil() as i32;
        self.items.clear();
        self.heads.clear();
        self.heads.resize((self.columns * self.rows) as usize, END);
    }

    fn cell(&self, at: [f64; 2]) -> [i32; 2] {
        let index = |axis: usize| ((at[axis] - self.corner[axis]) * self.inverse_cell) as i32;
        [index(0).clamp(0, self.columns - 1), index(1).clamp(0, self.rows - 1)]
    }

    pub(super) fn insert(&mut self, at: [f64; 2], label: u32) {
        let [column, row] = self.cell(at);
        let head = &mut self.heads[(row * self.columns + column) as usize];
        let next = *head;
        *head = self.items.len() as u32;
        self.items.push(Item { at, label, next });
    }

    /// Squared distance to the nearest point, and its label; of points equally near the lowest label.
    /// Infinity where there is no point within `reach_m`; whether one further away is found is not
    /// said.
    pub(super) fn nearest(&self, at: [f64; 2], reach_m: f64) -> (f64, u32) {
        let [column, row] = self.cell(at);
        let mut best = (f64::INFINITY, u32::MAX);
        for ring in 0..self.columns.max(self.rows) {
            // What lies in this ring is at least this far away, less what rounding may do.
            let distance = f64::from(ring - 1).max(0.0) * self.cell_m * (1.0 - 1e-9);
            if best.0.min(reach_m * reach_m) < distance * distance {
                break;
            }
            for y in (row - ring).max(0)..=(row + ring).min(self.rows - 1) {
                let whole = (y - row).abs() == ring;
                let step = if whole { 1 } else { (2 * ring).max(1) };
                let mut x = column - ring;
                while x <= column + ring {
                    if (0..self.columns).contains(&x) {
                        self.nearer(y * self.columns + x, at, &mut best);
                    }
                    x += step;
                }
            }
        }
        best
    }

    /// Looks through one cell.
    fn nearer(&self, cell: i32, at: [f64; 2], best: &mut (f64, u32)) {
        let mut place = self.heads[cell as usize];
        while place != END {
            let item = &self.items[place as usize];
            let (dx, dy) = (item.at[0] - at[0], item.at[1] - at[1]);
            let squared = dx * dx + dy * dy;
            if squared < best.0 {
                *best = (squared, item.label);
            } else if squared == best.0 {
                best.1 = best.1.min(item.label);
            }
            place = item.next;
        }
    }
}

//! Which trees stand over a place: crowns sorted into the cells of a grid.

use crate::Tree;

/// Edge of a cell, m: near the radius of a crown.
const CELL_M: f64 = 4.0;
/// Cells around a cell whose tops its ceiling covers: 24 m, more than a beam 30 degrees off the
/// vertical moves sideways through a 40 m canopy.
const CEILING_CELLS: usize = 6;

/// Trees by cell, and how high they reach.
#[derive(Debug, Clone)]
pub(crate) struct Canopy {
    corner: [f64; 2],
    size: [usize; 2],
    /// `starts[c]..starts[c + 1]` are the places in `trees` of cell `c`.
    starts: Vec<u32>,
    trees: Vec<u32>,
    /// Highest top of the trees of a cell.
    tops: Vec<f64>,
    /// Highest top in the cells around.
    ceilings: Vec<f64>,
}

/// A cell, by column and row.
pub(crate) type Cell = [usize; 2];

impl Canopy {
    /// Sorts the trees, each with a margin around its crown and stem, into cells.
    pub(crate) fn new(trees: &[Tree], margin_m: f64) -> Self {
        let reach = |tree: &Tree| {
            let (low, high) = tree.crown.reach_m([tree.base_m[0], tree.base_m[1]]);
            (low.map(|v| v - margin_m), high.map(|v| v + margin_m))
        };
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (a, b) in trees.iter().map(reach) {
            low = [low[0].min(a[0]), low[1].min(a[1])];
            high = [high[0].max(b[0]), high[1].max(b[1])];
        }
        if trees.is_empty() {
            (low, high) = ([0.0; 2], [0.0; 2]);
        }
        let size = [0, 1].map(|axis| ((high[axis] - low[axis]) / CELL_M) as usize + 1);
        let mut canopy = Self {
            corner: low,
            size,
            starts: Vec::new(),
            trees: Vec::new(),
            tops: vec![f64::NEG_INFINITY; size[0] * size[1]],
            ceilings: Vec::new(),
        };
        canopy.fill(trees, reach);
        canopy.ceilings = dilated(&canopy.tops, size, CEILING_CELLS);
        canopy
    }

    fn fill(&mut self, trees: &[Tree], reach: impl Fn(&Tree) -> ([f64; 2], [f64; 2])) {
        let mut keyed: Vec<(u32, u32)> = Vec::new();
        for (index, tree) in trees.iter().enumerate() {
            let (low, high) = reach(tree);
            let (first, last) = (self.clamped(low), self.clamped(high));
            for row in first[1]..=last[1] {
                for column in first[0]..=last[0] {
                    let cell = row * self.size[0] + column;
                    keyed.push((cell as u32, index as u32));
                    self.tops[cell] = self.tops[cell].max(tree.crown.top_m[2]);
                }
            }
        }
        keyed.sort_unstable();
        self.starts = vec![0; self.tops.len() + 1];
        keyed.iter().for_each(|&(cell, _)| self.starts[cell as usize + 1] += 1);
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        self.trees = keyed.into_iter().map(|(_, index)| index).collect();
    }

    fn clamped(&self, at: [f64; 2]) -> Cell {
        [0, 1].map(|axis| {
            let index = ((at[axis] - self.corner[axis]) / CELL_M).max(0.0) as usize;
            index.min(self.size[axis] - 1)
        })
    }

    fn cell_at(&self, x: f64, y: f64) -> Option<usize> {
        let (u, v) = ((x - self.corner[0]) / CELL_M, (y - self.corner[1]) / CELL_M);
        let inside = u >= 0.0 && v >= 0.0 && u < self.size[0] as f64 && v < self.size[1] as f64;
        inside.then(|| v as usize * self.size[0] + u as usize)
    }

    fn of_cell(&self, cell: usize) -> &[u32] {
        &self.trees[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// The trees that may reach over a position, ascending.
    pub(crate) fn over(&self, x: f64, y: f64) -> &[u32] {
        self.cell_at(x, y).map_or(&[], |cell| self.of_cell(cell))
    }

    /// Highest top within 24 m or more; minus infinity where nothing grows.
    pub(crate) fn ceiling_m(&self, x: f64, y: f64) -> f64 {
        self.cell_at(x, y).map_or_else(
            || {
                let [column, row] = self.clamped([x, y]);
                self.ceilings[row * self.size[0] + column]
            },
            |cell| self.ceilings[cell],
        )
    }

    /// Calls `visit` with the trees of every cell under a segment that goes up from `from` by `way`,
    /// as long as the cell has a top above the segment's lowest point in it. Trees come repeatedly.
    pub(crate) fn along(&self, from: [f64; 3], way: [f64; 3], mut visit: impl FnMut(&[u32])) {
        // The sideways way is short: steps of half a cell with their neighbours cut off nothing,
        // because crowns are entered with a margin wider than what such a step can miss at a corner.
        let sideways = way[0].abs().max(way[1].abs());
        let steps = (sideways / (0.5 * CELL_M)).ceil().max(1.0) as usize;
        let mut last = usize::MAX;
        for step in 0..=steps {
            let share = step as f64 / steps as f64;
            let Some(cell) = self.cell_at(from[0] + share * way[0], from[1] + share * way[1])
            else {
                continue;
            };
            let lowest = from[2] + (share - 1.0 / steps as f64) * way[2];
            if cell != last && self.tops[cell] > lowest {
                visit(self.of_cell(cell));
            }
            last = cell;
        }
    }
}

/// The largest value within `reach` cells in both directions.
fn dilated(values: &[f64], size: [usize; 2], reach: usize) -> Vec<f64> {
    let highest = |values: &[f64], stride: usize, count: usize, start: usize, at: usize| {
        let (low, high) = (at.saturating_sub(reach), (at + reach).min(count - 1));
        (low..=high).map(|i| values[start + i * stride]).fold(f64::NEG_INFINITY, f64::max)
    };
    let [columns, rows] = size;
    let along_rows: Vec<f64> = (0..columns * rows)
        .map(|cell| highest(values, 1, columns, cell - cell % columns, cell % columns))
        .collect();
    (0..columns * rows)
        .map(|cell| highest(&along_rows, columns, rows, cell % columns, cell / columns))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dilation_reaches_square_neighbours_only() {
        let mut values = vec![0.0; 35];
        values[2 * 7 + 3] = 5.0;
        let wide = dilated(&values, [7, 5], 1);
        let raised: Vec<usize> = (0..35).filter(|&i| wide[i] > 0.0).collect();
        assert_eq!(raised, [9, 10, 11, 16, 17, 18, 23, 24, 25]);
    }
}

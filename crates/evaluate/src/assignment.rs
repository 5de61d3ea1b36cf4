//! Assignment on a sparse bipartite graph: as many pairs as possible, and among these matchings one
//! of least total cost.
//!
//! Successive shortest augmenting paths with node potentials (Edmonds and Karp 1972; Tomizawa 1971),
//! the sparse form of the Hungarian method: every path is the cheapest from any free row to any free
//! column, found by Dijkstra's algorithm on reduced costs. O(pairs x edges x log), exact on integers.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// An allowed pair: a column of some row, and its cost of 0 or more.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    pub(crate) column: usize,
    pub(crate) cost: i64,
}

/// The column of each row in the cheapest of the largest matchings. `edges[row]` are its choices.
/// Of equally cheap matchings the one that low rows and columns lead to; always the same.
pub(crate) fn cheapest_largest(edges: &[Vec<Edge>], columns: usize) -> Vec<Option<usize>> {
    let mut state = State {
        edges,
        row_potential: vec![0; edges.len()],
        column_potential: vec![0; columns],
        column_of: vec![None; edges.len()],
        row_of: vec![None; columns],
    };
    while state.augment() {}
    state.column_of
}

struct State<'a> {
    edges: &'a [Vec<Edge>],
    /// Least cost of reaching a row or column from a free row, as of the last search.
    row_potential: Vec<i64>,
    column_potential: Vec<i64>,
    column_of: Vec<Option<usize>>,
    row_of: Vec<Option<usize>>,
}

/// Reduced distances of one search and the row each column was reached from.
struct Search {
    row: Vec<Option<i64>>,
    column: Vec<Option<i64>>,
    from: Vec<usize>,
}

impl State<'_> {
    /// Adds one pair along the cheapest augmenting path; false when there is none.
    fn augment(&mut self) -> bool {
        let search = self.search();
        // The reduced distance plus the potential is the true cost of the path.
        let cost =
            |column: usize| Some((search.column[column]? + self.column_potential[column], column));
        let free = (0..self.row_of.len()).filter(|&column| self.row_of[column].is_none());
        let Some((_, mut column)) = free.filter_map(cost).min() else { return false };
        let raise = |potential: &mut [i64], distance: &[Option<i64>]| {
            potential.iter_mut().zip(distance).for_each(|(p, d)| *p += d.unwrap_or(0));
        };
        raise(&mut self.row_potential, &search.row);
        raise(&mut self.column_potential, &search.column);
        loop {
            let row = search.from[column];
            let next = self.column_of[row].replace(column);
            self.row_of[column] = Some(row);
            match next {
                Some(previous) => column = previous,
                None => return true,
            }
        }
    }

    /// Dijkstra from all free rows. Matched pairs lead from column to row at no reduced cost.
    fn search(&self) -> Search {
        let (rows, columns) = (self.edges.len(), self.row_of.len());
        let mut search =
            Search { row: vec![None; rows], column: vec![None; columns], from: vec![0; columns] };
        let mut best = vec![i64::MAX; columns];
        let mut queue = BinaryHeap::new();
        let free = (0..rows).filter(|&row| self.column_of[row].is_none());
        free.for_each(|row| self.expand(row, 0, &mut search, &mut best, &mut queue));
        while let Some(Reverse((distance, column))) = queue.pop() {
            if search.column[column].is_some() {
                continue;
            }
            search.column[column] = Some(distance);
            if let Some(row) = self.row_of[column] {
                self.expand(row, distance, &mut search, &mut best, &mut queue);
            }
        }
        search
    }

    fn expand(
        &self,
        row: usize,
        distance: i64,
        search: &mut Search,
        best: &mut [i64],
        queue: &mut BinaryHeap<Reverse<(i64, usize)>>,
    ) {
        search.row[row] = Some(distance);
        for edge in &self.edges[row] {
            let reduced = edge.cost + self.row_potential[row] - self.column_potential[edge.column];
            let reached = distance + reduced;
            if self.column_of[row] != Some(edge.column) && reached < best[edge.column] {
                best[edge.column] = reached;
                search.from[edge.column] = row;
                queue.push(Reverse((reached, edge.column)));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Best (pairs, -cost) over all matchings, by trying each column or none for each row.
    fn brute(edges: &[Vec<Edge>], used: &mut Vec<bool>) -> (usize, i64) {
        let Some((first, rest)) = edges.split_first() else { return (0, 0) };
        let mut best = brute(rest, used);
        for edge in first {
            if !used[edge.column] {
                used[edge.column] = true;
                let (pairs, gain) = brute(rest, used);
                best = best.max((pairs + 1, gain - edge.cost));
                used[edge.column] = false;
            }
        }
        best
    }

    proptest! {
        #[test]
        fn as_good_as_trying_everything(
            costs in prop::collection::vec(prop::collection::vec(prop::option::of(0i64..9), 5), 0..6),
        ) {
            let row = |row: &Vec<Option<i64>>| -> Vec<Edge> {
                let edge = |(column, cost): (usize, &Option<i64>)| cost.map(|cost| Edge { column, cost });
                row.iter().enumerate().filter_map(edge).collect()
            };
            let edges: Vec<Vec<Edge>> = costs.iter().map(row).collect();
            let found = cheapest_largest(&edges, 5);
            let chosen = || found.iter().enumerate().filter_map(|(r, c)| c.map(|c| (r, c)));
            let mut columns: Vec<usize> = chosen().map(|(_, c)| c).collect();
            columns.sort_unstable();
            columns.dedup();
            let total: i64 = chosen().map(|(r, c)| costs[r][c].unwrap()).sum();
            prop_assert_eq!((columns.len(), -total), brute(&edges, &mut vec![false; 5]));
        }
    }
}

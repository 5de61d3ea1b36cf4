//! Parts of a campaign that lie far apart.
//!
//! One raster or map over plots that are kilometres apart would be almost empty. Sites are found on a
//! coarse lattice fixed in the world, so they do not depend on how the campaign is cut into tiles.

use crate::Rect;
use std::collections::{BTreeMap, BTreeSet};

/// Edge of the lattice, metres: data in cells that touch, also at a corner, are one site; so data
/// closer than this always are, data further apart than three times this never.
pub const LATTICE_M: f64 = 128.0;

/// Collects where points are.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Footprint {
    cells: BTreeMap<[i64; 2], Rect>,
}

impl Footprint {
    /// Nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a position, metres.
    pub fn include(&mut self, x_m: f64, y_m: f64) {
        let cell = [(x_m / LATTICE_M).floor() as i64, (y_m / LATTICE_M).floor() as i64];
        let point = Rect { min: [x_m, y_m], max: [x_m, y_m] };
        let rect = self.cells.entry(cell).or_insert(Rect::EMPTY);
        *rect = rect.union(&point);
    }

    /// Adds another footprint.
    pub fn merge(&mut self, other: &Self) {
        for (cell, rect) in &other.cells {
            let own = self.cells.entry(*cell).or_insert(Rect::EMPTY);
            *own = own.union(rect);
        }
    }

    /// The bounds of every site, metres, by their westernmost, then southernmost lattice cell.
    #[must_use]
    pub fn sites(&self) -> Vec<Rect> {
        let mut left: BTreeSet<[i64; 2]> = self.cells.keys().copied().collect();
        let mut sites = Vec::new();
        while let Some(first) = left.pop_first() {
            let mut bounds = self.cells[&first];
            let mut open = vec![first];
            while let Some([column, row]) = open.pop() {
                for near in neighbours(column, row) {
                    if left.remove(&near) {
                        bounds = bounds.union(&self.cells[&near]);
                        open.push(near);
                    }
                }
            }
            sites.push(bounds);
        }
        sites
    }
}

fn neighbours(column: i64, row: i64) -> impl Iterator<Item = [i64; 2]> {
    (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| [column + dx, row + dy]))
}

/// Name of a site's file: `map.png` when there is one site, `map-2.png` for the second of several.
#[must_use]
pub fn file_name(stem: &str, extension: &str, site: usize, sites: usize) -> String {
    if sites == 1 {
        format!("{stem}.{extension}")
    } else {
        format!("{stem}-{}.{extension}", site + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn footprint(points: &[[f64; 2]]) -> Footprint {
        let mut footprint = Footprint::new();
        points.iter().for_each(|[x, y]| footprint.include(*x, *y));
        footprint
    }

    #[test]
    fn near_is_one_and_far_is_two() {
        let found =
            footprint(&[[10.0, 10.0], [120.0, 200.0], [-100.0, 5.0], [5000.0, 3.0]]).sites();
        assert_eq!(found.len(), 2);
        assert_eq!(found[0], Rect { min: [-100.0, 5.0], max: [120.0, 200.0] });
        assert_eq!(found[1], Rect { min: [5000.0, 3.0], max: [5000.0, 3.0] });
    }

    #[test]
    fn however_it_is_gathered() {
        let points: Vec<[f64; 2]> =
            (0..400).map(|i| [f64::from(i * 37 % 4001), f64::from(i * 61 % 3001)]).collect();
        let mut merged = footprint(&points[200..]);
        merged.merge(&footprint(&points[..200]));
        assert_eq!(merged, footprint(&points));
    }

    #[test]
    fn names() {
        assert_eq!(file_name("dtm", "tif", 0, 1), "dtm.tif");
        assert_eq!(file_name("dtm", "tif", 1, 3), "dtm-2.tif");
    }
}

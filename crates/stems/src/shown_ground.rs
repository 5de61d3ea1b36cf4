//! Whether a scan shows the ground, or what was taken for it is the foot of a tree or its crown.

use crate::space::foot_m;
use crate::voxels::Voxels;

/// Edge of the cells that are looked at for ground, m.
const CELL_M: f64 = 0.5;
/// Fewest cells of a patch of ground: wider than the foot of a tree.
const FEWEST_CELLS: usize = 8;
/// Largest step of the ground from a cell to the next, m: a slope of 50 degrees.
const STEP_M: f64 = 0.6;
/// The lowest patch of ground begins at most this much above the lowest points, m.
const BELOW_GROUND_M: f64 = 1.0;

/// A column of voxels.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    index: [i32; 2],
    /// Elevation of its lowest ground point, m; infinite without any.
    ground_m: f64,
}

impl Cell {
    fn has_ground(&self) -> bool {
        self.ground_m.is_finite()
    }
}

/// Whether a scan shows the ground: patches of ground points that hang together as a surface does make
/// up at least `least_share` of its area and hold its lowest points.
///
/// A filter for ground finds something in every cloud: of a tree alone its foot, and where that is
/// missing, the lower side of its crown.
#[must_use]
pub fn shows_ground(voxels: &Voxels, least_share: f64) -> bool {
    let cells = cells(voxels);
    let patches = patches(&cells);
    let wide = patches.iter().filter(|patch| patch.len() >= FEWEST_CELLS);
    let (mut count, mut lowest_m) = (0, f64::INFINITY);
    for place in wide.flatten() {
        count += 1;
        lowest_m = cells[*place].ground_m.min(lowest_m);
    }
    let low = lowest_m <= foot_m(voxels) + BELOW_GROUND_M;
    low && count as f64 >= least_share * cells.len() as f64
}

/// The cells with points, sorted.
fn cells(voxels: &Voxels) -> Vec<Cell> {
    let per_cell = (CELL_M / voxels.edge_m()).round().max(1.0) as i32;
    let cell = |voxel: &crate::voxels::Voxel| Cell {
        index: [voxel.index[0].div_euclid(per_cell), voxel.index[1].div_euclid(per_cell)],
        ground_m: if voxel.is_ground { voxel.centroid_m()[2] } else { f64::INFINITY },
    };
    let mut cells: Vec<Cell> = voxels.all.iter().map(cell).collect();
    cells.sort_by(|a, b| a.index.cmp(&b.index).then(a.ground_m.total_cmp(&b.ground_m)));
    cells.dedup_by_key(|cell| cell.index);
    cells
}

/// Places of cells with ground, those together that are joined by steps between neighbours.
fn patches(cells: &[Cell]) -> Vec<Vec<usize>> {
    let mut seen: Vec<bool> = cells.iter().map(|cell| !cell.has_ground()).collect();
    let mut patches = Vec::new();
    for start in 0..cells.len() {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let mut patch = vec![start];
        let mut next = 0;
        while let Some(&place) = patch.get(next) {
            next += 1;
            for other in neighbours(cells, place) {
                if !std::mem::replace(&mut seen[other], true) {
                    patch.push(other);
                }
            }
        }
        patches.push(patch);
    }
    patches
}

/// Places of the cells around one whose ground is a step away at most.
fn neighbours(cells: &[Cell], place: usize) -> impl Iterator<Item = usize> {
    let Cell { index: [x, y], ground_m } = cells[place];
    let around = (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| [x + dx, y + dy]));
    let known = around.filter_map(|index| cells.binary_search_by_key(&index, |c| c.index).ok());
    known.filter(move |other| (cells[*other].ground_m - ground_m).abs() <= STEP_M)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxels::Sample;

    /// Voxels of points with a flag that tells whether they were taken for ground.
    fn voxels(points: &[([f64; 3], bool)]) -> Voxels {
        let mut voxels = Voxels::new(0.05);
        let sample = |&(world_m, is_ground): &([f64; 3], bool)| Sample {
            world_m,
            height_m: f32::NAN,
            is_ground,
        };
        voxels.add(points.iter().map(sample));
        voxels.finish().unwrap()
    }

    /// A surface of 5 m by 5 m whose elevation follows from the place.
    fn surface(elevation_m: impl Fn(f64, f64) -> f64) -> Vec<([f64; 3], bool)> {
        let at = |i: u32| f64::from(i) * 0.25;
        let row = |i: u32| (0..20).map(move |j| (at(i), at(j)));
        (0..20).flat_map(row).map(|(x, y)| ([x, y, elevation_m(x, y)], true)).collect()
    }

    fn stem(from_m: f64) -> impl Iterator<Item = ([f64; 3], bool)> {
        (0..200).map(move |i| ([2.5, 2.5, from_m + 0.05 * f64::from(i)], false))
    }

    #[test]
    fn a_slope_under_a_stem_is_ground() {
        let mut points = surface(|x, y| 300.0 + 0.8 * x - 0.4 * y);
        points.extend(stem(301.0));
        assert!(shows_ground(&voxels(&points), 0.15));
    }

    #[test]
    fn the_foot_of_a_tree_is_not_enough() {
        let mut points: Vec<_> = surface(|_, _| 4.0).into_iter().map(|(p, _)| (p, false)).collect();
        points.iter_mut().filter(|(p, _)| p[0] < 0.8 && p[1] < 0.8).for_each(|p| p.1 = true);
        assert!(!shows_ground(&voxels(&points), 0.0));
    }

    /// The lower side of a crown, which a filter takes for ground where there is none.
    #[test]
    fn a_crown_above_a_stem_is_no_ground() {
        let mut points = surface(|x, y| 9.0 + 0.2 * x + 0.1 * y);
        assert!(shows_ground(&voxels(&points), 0.15));
        points.extend(stem(4.0));
        assert!(!shows_ground(&voxels(&points), 0.15));
        // Nor is one that is no surface, at the height of the lowest points or not.
        let cell = |value: f64| (value / CELL_M).floor();
        let ragged = surface(|x, y| 4.0 + (3.0 * cell(x) + 7.0 * cell(y)) % 11.0);
        assert!(!shows_ground(&voxels(&ragged), 0.15));
    }
}

//! Voronoi cells of the treetops, cut off (Silva et al. 2016, section 2.4).

use crate::SegmentationParams;
use crate::chm::Chm;
use crate::methods::raster::{NO_TREE, Seed};

/// The seed of every cell ([`NO_TREE`] for none): the nearest by the distance of cells, of equally
/// near ones the first, where it is within `silva_radius_share` of its height and
/// `raster_radius_m`, and the cell is no lower than `min_height_m` and `silva_least_share` of its
/// height.
#[must_use]
pub fn grow(chm: &Chm, seeds: &[Seed], params: &SegmentationParams) -> Vec<u32> {
    let mut nearest = vec![(f64::INFINITY, NO_TREE); chm.window.len()];
    for (index, seed) in seeds.iter().enumerate() {
        let [column, row] = chm.column_row(seed.cell);
        let reach = (params.raster_radius_m / chm.cell_m).ceil() as i64;
        for row in row - reach..=row + reach {
            for column in column - reach..=column + reach {
                if chm.window.contains(column, row) {
                    let cell = chm.window.index(column, row);
                    let squared_m2 = chm.squared_m2(cell, seed.cell);
                    if squared_m2 < nearest[cell].0 {
                        nearest[cell] = (squared_m2, index as u32);
                    }
                }
            }
        }
    }
    let within = |(cell, (squared_m2, index)): (usize, (f64, u32))| {
        let height_m = f64::from(chm.height_m[cell]);
        let kept = seeds.get(index as usize).is_some_and(|seed| {
            let radius_m = (params.silva_radius_share * seed.height_m).min(params.raster_radius_m);
            squared_m2 <= radius_m * radius_m
                && height_m >= (params.silva_least_share * seed.height_m).max(params.min_height_m)
        });
        if kept { index } else { NO_TREE }
    };
    nearest.into_iter().enumerate().map(within).collect()
}

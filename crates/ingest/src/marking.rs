//! Outliers of a tile, marked with the surrounding points of other tiles in view.

use crate::gather::{append, read_section, select};
use crate::outliers::Outliers;
use crate::params::TilesParams;
use crate::rules::{self, Dropped};
use crate::shard::{Sections, ShardReader};
use crate::voxels::Isolation;
use crate::{Error, Notes};
use timberline_pointcloud::order::canonical_order;
use timberline_pointcloud::{Frame, Point, PointCloud, Rect, TileGrid, TileId};

/// The points of other tiles up to whole metres around a tile, as those tiles have them.
pub(crate) fn ring<S: Sections>(
    tile: TileId,
    grid: TileGrid,
    reach_m: f64,
    shards: &mut [ShardReader<S>],
    isolation: Option<&Isolation>,
    params: &TilesParams,
) -> Result<PointCloud, Error> {
    let near = grid.neighbours(tile, reach_m);
    let rect = grid.rect(tile).grown(reach_m);
    let [x, y] = grid.corner_m(tile);
    let mut cloud = PointCloud::new(Frame::new([x, y, 0]));
    let (mut dropped, mut notes) = (Dropped::default(), Notes::default());
    for shard in shards.iter_mut() {
        let wanted = |of: TileId| of != tile && near.binary_search(&of).is_ok();
        for section in shard.index().sections_of(wanted) {
            let [x, y] = grid.corner_m(section.tile);
            let part = read_section(shard, &section, Frame::new([x, y, 0]))?;
            let is_near = |index: &u32| {
                let [x, y, _] = part.world(*index as usize);
                rect.contains(x, y)
            };
            let inside: Vec<u32> = (0..part.len() as u32).filter(is_near).collect();
            let part = rules::apply(part.select(&inside), params, &mut dropped);
            append(&mut cloud, part, &mut notes)?;
        }
    }
    Ok(select(cloud, isolation, params, &mut dropped))
}

/// Gives outliers class 7 unless they are noise already; their number.
pub(crate) fn mark(
    cloud: &mut PointCloud,
    around: &PointCloud,
    outliers: &Outliers,
    own: &Rect,
) -> Result<u64, Error> {
    // Positions only, those of the tile first.
    let mut all = PointCloud::new(cloud.frame);
    for part in [&*cloud, around] {
        (0..part.len()).for_each(|index| all.push_local(part.local(index), &Point::default()));
    }
    let order = canonical_order(&all);
    let found = outliers.of(&all.select(&order), own)?;
    let own_points = found.iter().map(|place| order[*place as usize] as usize);
    let mut marked = 0;
    for index in own_points {
        let Some(class) = cloud.classification.get_mut(index) else { continue };
        if !rules::is_noise(*class) {
            *class = rules::LOW_NOISE;
            marked += 1;
        }
    }
    if marked > 0 {
        // The class is one of the attributes that order points of one place.
        *cloud = cloud.in_canonical_order();
    }
    Ok(marked)
}

//! A world-aligned grid of square tiles.

use crate::{Error, Rect};
use serde::{Deserialize, Serialize};
use std::fmt;

/// A tile's place in its grid: column to the east, row to the north.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
pub struct TileId {
    /// Column.
    pub ix: i32,
    /// Row.
    pub iy: i32,
}

impl fmt::Display for TileId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}_{}", self.ix, self.iy)
    }
}

impl std::str::FromStr for TileId {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let parse = || {
            let (ix, iy) = text.split_once('_')?;
            Some(Self { ix: ix.parse().ok()?, iy: iy.parse().ok()? })
        };
        parse()
            .ok_or_else(|| format!("`{text}` is no tile name; expected COLUMN_ROW such as 12_-7"))
    }
}

/// Square tiles with whole-metre edges and origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TileGrid {
    /// Edge of a tile in metres.
    pub edge_m: u32,
    /// World position of a corner of tile (0, 0), whole metres.
    pub origin_m: [i64; 2],
}

impl TileGrid {
    /// A grid of the given edge.
    ///
    /// # Errors
    /// [`Error::CellSize`] for an edge of 0.
    pub fn new(edge_m: u32, origin_m: [i64; 2]) -> Result<Self, Error> {
        if edge_m == 0 { Err(Error::CellSize(0.0)) } else { Ok(Self { edge_m, origin_m }) }
    }

    /// The tile that holds a world position.
    #[must_use]
    pub fn tile_at(&self, world_x_m: f64, world_y_m: f64) -> TileId {
        let index = |value: f64, origin: i64| {
            (value.floor() as i64 - origin).div_euclid(i64::from(self.edge_m)) as i32
        };
        TileId { ix: index(world_x_m, self.origin_m[0]), iy: index(world_y_m, self.origin_m[1]) }
    }

    /// World corner of a tile with the smallest coordinates, whole metres.
    #[must_use]
    pub fn corner_m(&self, tile: TileId) -> [i64; 2] {
        let edge = i64::from(self.edge_m);
        [self.origin_m[0] + i64::from(tile.ix) * edge, self.origin_m[1] + i64::from(tile.iy) * edge]
    }

    /// The half-open world rectangle of a tile.
    #[must_use]
    pub fn rect(&self, tile: TileId) -> Rect {
        let [x, y] = self.corner_m(tile).map(|value| value as f64);
        let edge = f64::from(self.edge_m);
        Rect { min: [x, y], max: [x + edge, y + edge] }
    }

    /// The tiles that a closed rectangle touches, sorted.
    #[must_use]
    pub fn tiles_touching(&self, rect: &Rect) -> Vec<TileId> {
        let low = self.tile_at(rect.min[0], rect.min[1]);
        let high = self.tile_at(rect.max[0], rect.max[1]);
        let columns = low.ix..=high.ix;
        columns.flat_map(|ix| (low.iy..=high.iy).map(move |iy| TileId { ix, iy })).collect()
    }

    /// The tiles whose rectangle comes within `halo_m` of the given tile's, itself included, sorted.
    #[must_use]
    pub fn neighbours(&self, tile: TileId, halo_m: f64) -> Vec<TileId> {
        let reach = (halo_m / f64::from(self.edge_m)).ceil().max(0.0) as i32;
        let mut tiles = Vec::new();
        for ix in tile.ix - reach..=tile.ix + reach {
            for iy in tile.iy - reach..=tile.iy + reach {
                tiles.push(TileId { ix, iy });
            }
        }
        tiles
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_position_is_in_its_tile_only(x in -1e6f64..1e6, y in -1e6f64..1e6, edge in 1u32..500, ox in -99i64..99) {
            let grid = TileGrid::new(edge, [ox, 0]).unwrap();
            let tile = grid.tile_at(x, y);
            prop_assert!(grid.rect(tile).contains(x, y));
            prop_assert_eq!(tile, tile.to_string().parse::<TileId>().unwrap());
        }
    }

    #[test]
    fn a_halo_no_wider_than_a_tile_reaches_the_eight_around() {
        let grid = TileGrid::new(64, [0, 0]).unwrap();
        assert_eq!(grid.neighbours(TileId { ix: 0, iy: 0 }, 64.0).len(), 9);
        assert_eq!(grid.neighbours(TileId { ix: 0, iy: 0 }, 0.0).len(), 1);
    }
}

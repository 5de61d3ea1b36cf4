//! A tile with its surroundings, for stages whose windows reach beyond it.

use crate::kinds::{GroundPoints, Heights, Labels, PointTile};
use crate::stage::Inputs;
use crate::{Error, Facts, Kind};
use timberline_pointcloud::order::canonical_order;
use timberline_pointcloud::{PointCloud, Rect, TileGrid, TileId};

/// Columns that other artefacts hold for the points of a tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aligned {
    /// Height above ground, from [`Heights`].
    Height,
    /// Whether a point is ground, from [`GroundPoints`].
    Ground,
    /// Tree id and its score, from [`Labels`].
    Label,
}

/// The points of a tile and of its surroundings, in canonical order and in the frame of the tile.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surroundings {
    /// The points.
    pub cloud: PointCloud,
    /// Index in the tile of the tile's own points; `None` for the others.
    pub own: Vec<Option<u32>>,
    /// Height above ground, metres, NaN where unknown; empty unless asked for.
    pub height_m: Vec<f32>,
    /// Whether a point is ground; empty unless asked for.
    pub is_ground: Vec<bool>,
    /// Tree id, 0 for none; empty unless asked for.
    pub tree_id: Vec<u64>,
    /// Score of the tree id, 0 to 1; empty unless asked for.
    pub score: Vec<f32>,
    /// The tile's half-open rectangle in the world.
    pub tile_rect: Rect,
    /// The same in the frame of `cloud`.
    pub local_rect: Rect,
    /// The tile.
    pub tile: TileId,
    /// Number of points of the tile itself.
    pub own_len: usize,
    /// Where the tile lies: CRS, frame, bounds and grid for the headers of results.
    pub located: Facts,
}

/// Reads a tile and what lies within `halo_m` of it from the stage's inputs.
///
/// # Errors
/// What reading the artefacts says, and [`Error::Misaligned`].
pub fn gather(inputs: &Inputs, halo_m: f64, with: &[Aligned]) -> Result<Surroundings, Error> {
    let (mut all, grid) = own_tile(inputs, with)?;
    let reach = all.tile_rect.grown(halo_m);
    for other in inputs.tiles_of(PointTile::NAME) {
        if other != all.tile && grid.rect(other).touches(&reach) {
            let path = inputs.tile_path(PointTile::NAME, other)?;
            let part = PointTile::read_within(path, &reach)?;
            add_columns(&mut all, inputs, other, with, &part.index, part.tile_len)?;
            all.own.resize(all.own.len() + part.index.len(), None);
            all.cloud.append(&part.cloud)?;
        }
    }
    Ok(sorted(all))
}

/// The tile itself: all of its points, in its own frame.
fn own_tile(inputs: &Inputs, with: &[Aligned]) -> Result<(Surroundings, TileGrid), Error> {
    let tile = inputs.tile()?;
    let path = inputs.own_path(PointTile::NAME)?;
    let (header, PointTile { cloud }) = crate::read::<PointTile>(path)?;
    let grid = header.facts.grid.ok_or_else(|| Error::corrupt(path, "header", "no tile grid"))?;
    let tile_rect = grid.rect(tile);
    let [x, y, _] = cloud.frame.origin_m.map(|value| -(value as f64));
    let index: Vec<u32> = (0..cloud.len() as u32).collect();
    let mut all = Surroundings {
        own: index.iter().map(|&index| Some(index)).collect(),
        own_len: cloud.len(),
        cloud,
        tile_rect,
        local_rect: tile_rect.moved([x, y]),
        tile,
        located: Facts::located_like(&header.facts),
        ..Surroundings::default()
    };
    add_columns(&mut all, inputs, tile, with, &index, index.len())?;
    Ok((all, grid))
}

/// Adds the values of some points of a tile (`index`) to the columns asked for.
fn add_columns(
    all: &mut Surroundings,
    inputs: &Inputs,
    tile: TileId,
    with: &[Aligned],
    index: &[u32],
    expected: usize,
) -> Result<(), Error> {
    fn pick<T: Copy>(values: &[T], index: &[u32]) -> impl Iterator<Item = T> {
        index.iter().map(|&i| values[i as usize])
    }
    let check = |kind: &'static str, found: usize| {
        let unit = format!("tile:{tile}");
        let misaligned = Error::Misaligned { kind, unit, expected, found };
        if found == expected { Ok(()) } else { Err(misaligned) }
    };
    if with.contains(&Aligned::Height) {
        let Heights { height_m } = inputs.of_tile(tile)?;
        check(Heights::NAME, height_m.len())?;
        all.height_m.extend(pick(&height_m, index));
    }
    if with.contains(&Aligned::Ground) {
        let GroundPoints { ground, .. } = inputs.of_tile(tile)?;
        all.is_ground.extend(index.iter().map(|i| ground.binary_search(i).is_ok()));
    }
    if with.contains(&Aligned::Label) {
        let Labels { tree_id, score } = inputs.of_tile(tile)?;
        check(Labels::NAME, tree_id.len().min(score.len()))?;
        all.tree_id.extend(pick(&tree_id, index));
        all.score.extend(pick(&score, index));
    }
    Ok(())
}

/// Brings everything into canonical order.
fn sorted(all: Surroundings) -> Surroundings {
    fn pick<T: Copy>(values: &[T], order: &[u32]) -> Vec<T> {
        if values.is_empty() {
            return Vec::new();
        }
        order.iter().map(|&i| values[i as usize]).collect()
    }
    let order = canonical_order(&all.cloud);
    Surroundings {
        cloud: all.cloud.select(&order),
        own: pick(&all.own, &order),
        height_m: pick(&all.height_m, &order),
        is_ground: pick(&all.is_ground, &order),
        tree_id: pick(&all.tree_id, &order),
        score: pick(&all.score, &order),
        ..all
    }
}

impl Surroundings {
    /// The values of the tile's own points, in the tile's order.
    #[must_use]
    pub fn own_values<T: Copy + Default>(&self, values: &[T]) -> Vec<T> {
        let mut own = vec![T::default(); self.own_len];
        for (place, value) in self.own.iter().zip(values) {
            if let Some(index) = place {
                own[*index as usize] = *value;
            }
        }
        own
    }
}

//! A tile with its surroundings, for stages whose windows reach beyond it.

use crate::kinds::{GroundPoints, Heights, Labels, PointTile};
use crate::stage::Inputs;
use crate::{Error, Facts, Kind};
use timberline_pointcloud::order::canonical_order;
use timberline_pointcloud::{PointCloud, Rect, TileId};

/// Columns that other artefacts hold for the points of a tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aligned {
    /// Height above ground, from [`Heights`].
    Height,
    /// Whether a point is ground, from [`GroundPoints`].
    Ground,
    /// Tree id, from [`Labels`].
    Tree,
    /// Score of the tree id, from [`Labels`].
    Score,
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
    let tile = inputs.tile()?;
    let own_path = inputs.own_path(PointTile::NAME)?;
    let located = Facts::located_like(&crate::read_header(own_path)?.facts);
    let grid = located.grid.ok_or_else(|| Error::corrupt(own_path, "header", "no tile grid"))?;
    let frame = located.frame.unwrap_or_default();
    let tile_rect = grid.rect(tile);
    let corner = [-(frame.origin_m[0] as f64), -(frame.origin_m[1] as f64)];
    let mut all = Surroundings {
        cloud: PointCloud::new(frame),
        tile_rect,
        local_rect: tile_rect.moved(corner),
        tile,
        located,
        ..Surroundings::default()
    };
    for other in inputs.tiles_of(PointTile::NAME) {
        if grid.rect(other).touches(&tile_rect.grown(halo_m)) {
            add_tile(&mut all, inputs, other, halo_m, with)?;
        }
    }
    Ok(sorted(all))
}

fn add_tile(
    all: &mut Surroundings,
    inputs: &Inputs,
    other: TileId,
    halo_m: f64,
    with: &[Aligned],
) -> Result<(), Error> {
    let path = inputs.tile_path(PointTile::NAME, other)?;
    let is_own = other == all.tile;
    let reach = if is_own { f64::INFINITY } else { halo_m };
    let (header, part) = PointTile::read_within(path, &all.tile_rect.grown(reach))?;
    let expected = header.facts.counts.get("points").map_or(part.index.len(), |n| *n as usize);
    if is_own {
        all.own_len = part.index.len();
    }
    all.own.extend(part.index.iter().map(|&i| is_own.then_some(i)));
    all.cloud.append(&part.cloud)?;
    for column in with {
        add_column(all, inputs, other, *column, &part.index, expected)?;
    }
    Ok(())
}

fn add_column(
    all: &mut Surroundings,
    inputs: &Inputs,
    other: TileId,
    column: Aligned,
    index: &[u32],
    expected: usize,
) -> Result<(), Error> {
    let check = |kind: &'static str, found: usize| {
        let unit = format!("tile:{other}");
        let misaligned = Error::Misaligned { kind, unit, expected, found };
        if found == expected { Ok(()) } else { Err(misaligned) }
    };
    match column {
        Aligned::Height => {
            let heights = inputs.of_tile::<Heights>(other)?;
            check(Heights::NAME, heights.height_m.len())?;
            all.height_m.extend(index.iter().map(|&i| heights.height_m[i as usize]));
        }
        Aligned::Tree => {
            let labels = inputs.of_tile::<Labels>(other)?;
            check(Labels::NAME, labels.tree_id.len())?;
            all.tree_id.extend(index.iter().map(|&i| labels.tree_id[i as usize]));
        }
        Aligned::Score => {
            let labels = inputs.of_tile::<Labels>(other)?;
            check(Labels::NAME, labels.score.len())?;
            all.score.extend(index.iter().map(|&i| labels.score[i as usize]));
        }
        Aligned::Ground => {
            let ground = inputs.of_tile::<GroundPoints>(other)?.ground;
            all.is_ground.extend(index.iter().map(|i| ground.binary_search(i).is_ok()));
        }
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

//! The points of one tile from the shards of several files.

use crate::marking::{mark, ring};
use crate::outliers::Outliers;
use crate::params::TilesParams;
use crate::rules::{self, Dropped};
use crate::segment;
use crate::shard::{Section, Sections, ShardReader};
use crate::thin::Voxels;
use crate::voxels::{self, Isolation, voxel_of};
use crate::{Error, Notes};
use std::collections::BTreeMap;
use timberline_artefact::Crs;
use timberline_artefact::kinds::PointTile;
use timberline_pointcloud::order::compare_attributes;
use timberline_pointcloud::{Column, Frame, PointCloud, TileGrid, TileId};

/// The points of a tile.
#[derive(Debug, Clone)]
pub struct Gathered {
    /// In canonical order, in the frame of the tile.
    pub cloud: PointCloud,
    /// Points left out, by rule.
    pub dropped: Dropped,
    /// Points of the tile in the shards.
    pub given: u64,
    /// Points marked as outliers, by class 7.
    pub marked: u64,
    /// The CRS of the files.
    pub crs: Crs,
    /// What a reader should know.
    pub notes: Vec<String>,
}

/// Reads a tile's points from shards, applies the rules, sorts, drops what is there twice, thins and
/// marks outliers.
///
/// The shards should be those of all files with points within [`halo_m`] of the tile; their sequence
/// does not matter.
///
/// # Errors
/// [`Error::Shard`] when a shard is not what was written, [`Error::Params`] when shards of
/// different grids are mixed.
pub fn gather<S: Sections>(
    tile: TileId,
    grid: TileGrid,
    shards: &mut [ShardReader<S>],
    params: &TilesParams,
) -> Result<Gathered, Error> {
    let mut notes = Notes::default();
    check_same(grid, shards)?;
    let crs = common_crs(shards, tile, &mut notes);
    let outliers = Outliers::new(params);
    let reach_m = outliers.map_or(0.0, |outliers| outliers.halo_m());
    let isolation = (params.isolated_points > 0)
        .then(|| neighbourhood(tile, grid, reach_m, shards))
        .transpose()?
        .map(|counts| Isolation::new(counts, params.isolated_points));
    let [x, y] = grid.corner_m(tile);
    let mut cloud = PointCloud::new(Frame::new([x, y, 0]));
    let mut dropped = Dropped::default();
    let mut given = 0;
    for shard in shards.iter_mut() {
        for section in shard.index().sections_of(|of| of == tile) {
            let part = read_section(shard, &section, cloud.frame)?;
            given += part.len() as u64;
            append(&mut cloud, rules::apply(part, params, &mut dropped), &mut notes)?;
        }
    }
    add_columns(&mut cloud, shards, tile);
    let mut cloud = select(cloud, isolation.as_ref(), params, &mut dropped);
    let mut marked = 0;
    if let Some(outliers) = outliers.filter(|_| !cloud.is_empty()) {
        let around = ring(tile, grid, reach_m, shards, isolation.as_ref(), params)?;
        marked = mark(&mut cloud, &around, &outliers, &grid.rect(tile))?;
    }
    let lowest = cloud.z.iter().copied().fold(f64::INFINITY, f64::min);
    let cloud = cloud.in_frame(PointTile::frame(&grid, tile, lowest));
    Ok(Gathered { cloud, dropped, given, marked, crs, notes: notes.into_messages() })
}

/// How far around a tile points matter for it, metres.
#[must_use]
pub fn halo_m(params: &TilesParams) -> f64 {
    let isolation_m = if params.isolated_points == 0 { 0.0 } else { ISOLATION_REACH_M };
    isolation_m + Outliers::new(params).map_or(0.0, |outliers| outliers.halo_m())
}

/// Drops isolated points and duplicates, and thins; what is left in canonical order. Each of these
/// decides by what lies in one place or voxel, never in two tiles.
pub(crate) fn select(
    cloud: PointCloud,
    isolation: Option<&Isolation>,
    params: &TilesParams,
    dropped: &mut Dropped,
) -> PointCloud {
    let cloud = match isolation {
        Some(isolation) if !cloud.is_empty() => drop_isolated(cloud, isolation, dropped),
        _ => cloud,
    };
    let cloud = drop_duplicates(&cloud.in_canonical_order(), dropped);
    let Some(voxels) = Voxels::new(params.thin_m) else { return cloud };
    let kept = voxels.keep(&cloud);
    dropped.thinned += (cloud.len() - kept.len()) as u64;
    cloud.select(&kept)
}

/// How far around a tile points can decide whether one of the tile's is isolated, metres.
pub const ISOLATION_REACH_M: f64 = voxels::REACH_M;

fn check_same<S: Sections>(grid: TileGrid, shards: &[ShardReader<S>]) -> Result<(), Error> {
    match shards.iter().map(|shard| shard.index().grid).find(|other| *other != grid) {
        None => Ok(()),
        Some(other) => Err(Error::Params(format!(
            "shards of tiles of {} m from {:?}, expected {} m from {:?}; run the stage `scatter` \
             again",
            other.edge_m, other.origin_m, grid.edge_m, grid.origin_m
        ))),
    }
}

/// The system of the files with points in the tile. The first by name wins where they differ.
fn common_crs<S: Sections>(shards: &[ShardReader<S>], tile: TileId, notes: &mut Notes) -> Crs {
    let holds = |shard: &&ShardReader<S>| shard.index().holds(tile);
    let mut known: Vec<&Crs> = shards
        .iter()
        .filter(holds)
        .map(|shard| &shard.index().crs)
        .filter(|crs| !crs.is_unknown())
        .collect();
    let order = |crs: &Crs| (crs.epsg.is_none(), crs.epsg, crs.wkt.is_none(), crs.name.clone());
    known.sort_by_cached_key(|crs| order(crs));
    let first = known.first().copied().cloned();
    for other in &known {
        if let Some(first) = &first
            && let (Some(a), Some(b)) = (first.epsg, other.epsg)
            && a != b
        {
            notes.say(format!(
                "files of EPSG:{a} and of EPSG:{b} have points here; they are put together as they \
                 are: reproject one of them if the systems really differ"
            ));
        }
    }
    first.unwrap_or_else(|| {
        shards.iter().find(holds).map(|shard| shard.index().crs.clone()).unwrap_or_default()
    })
}

pub(crate) fn read_section<S: Sections>(
    shard: &mut ShardReader<S>,
    section: &Section,
    frame: Frame,
) -> Result<PointCloud, Error> {
    let bytes = shard.part(section.tile, section.data)?;
    let fail = |problem: String| Error::Shard { tile: format!("tile {}", section.tile), problem };
    let cloud = segment::decode(&bytes, frame).map_err(fail)?;
    if cloud.len() == section.points as usize {
        return Ok(cloud);
    }
    Err(fail(format!("{} points, expected {}", cloud.len(), section.points)))
}

/// Appends points; columns whose types differ between files become `f64`.
pub(crate) fn append(
    cloud: &mut PointCloud,
    mut part: PointCloud,
    notes: &mut Notes,
) -> Result<(), Error> {
    for (name, theirs) in &mut part.extra {
        let Some(ours) = cloud.extra.get_mut(name) else { continue };
        if ours.type_name() == theirs.type_name() {
            continue;
        }
        notes.say(format!("the files give different types to `{name}`; it becomes f64"));
        *ours = widen(ours);
        *theirs = widen(theirs);
    }
    cloud.append(&part).map_err(Error::from)
}

/// Makes a column of `f64` of any column.
fn widen(column: &Column) -> Column {
    Column::F64((0..column.len()).map(|index| column.value(index)).collect())
}

/// Adds the columns that a file has elsewhere: which columns a tile has does not depend on where
/// in it their values are zero.
fn add_columns<S: Sections>(cloud: &mut PointCloud, shards: &[ShardReader<S>], tile: TileId) {
    let len = cloud.len();
    for shard in shards {
        let index = shard.index();
        if !index.holds(tile) {
            continue;
        }
        for name in &index.columns {
            let column = cloud.extra.entry(name.clone()).or_insert_with(|| Column::U8(Vec::new()));
            column.pad(len);
        }
    }
}

/// Voxel counts of what decides about points up to `around_m` from a tile, over all shards.
fn neighbourhood<S: Sections>(
    tile: TileId,
    grid: TileGrid,
    around_m: f64,
    shards: &mut [ShardReader<S>],
) -> Result<Vec<(voxels::Voxel, u32)>, Error> {
    let reach_m = ISOLATION_REACH_M + around_m;
    let near = grid.neighbours(tile, reach_m);
    let own = grid.rect(tile).grown(reach_m);
    let [low, high] = [own.min, own.max].map(|corner| voxel_of([corner[0], corner[1], 0.0]));
    let within =
        |v: &voxels::Voxel| (0..2).all(|axis| v[axis] >= low[axis] && v[axis] <= high[axis]);
    let mut counts = Vec::new();
    for shard in shards {
        for section in shard.index().sections_of(|tile| near.binary_search(&tile).is_ok()) {
            let bytes = shard.part(section.tile, section.voxels)?;
            let found = segment::decode_voxels(&bytes).map_err(|problem| Error::Shard {
                tile: format!("tile {}", section.tile),
                problem,
            })?;
            counts.extend(found.into_iter().filter(|(voxel, _)| within(voxel)));
        }
    }
    Ok(voxels::merge(counts))
}

fn drop_isolated(cloud: PointCloud, isolation: &Isolation, dropped: &mut Dropped) -> PointCloud {
    let mut known: BTreeMap<voxels::Voxel, bool> = BTreeMap::new();
    let mut last = None;
    let mut is_isolated = |index: usize| {
        let voxel = voxel_of(cloud.world(index));
        if let Some((before, answer)) = last
            && before == voxel
        {
            return answer;
        }
        let answer = *known.entry(voxel).or_insert_with(|| {
            isolation.own(voxel) <= isolation.limit() && isolation.is_isolated(voxel)
        });
        last = Some((voxel, answer));
        answer
    };
    let keep: Vec<u32> = (0..cloud.len()).filter(|i| !is_isolated(*i)).map(|i| i as u32).collect();
    dropped.isolated += (cloud.len() - keep.len()) as u64;
    if keep.len() == cloud.len() { cloud } else { cloud.select(&keep) }
}

/// Keeps the last of several points of one echo: attributes that a file does not know are zero, so
/// the last in canonical order says most.
fn drop_duplicates(cloud: &PointCloud, dropped: &mut Dropped) -> PointCloud {
    let last = cloud.len().saturating_sub(1);
    let keep: Vec<u32> = (0..cloud.len())
        .filter(|i| *i == last || !same_echo(cloud, *i, *i + 1))
        .map(|i| i as u32)
        .collect();
    dropped.duplicate += (cloud.len() - keep.len()) as u64;
    cloud.select(&keep)
}

/// Whether two points are one echo: same place, time, flight line and return. Without a time all
/// attributes must agree.
fn same_echo(cloud: &PointCloud, a: usize, b: usize) -> bool {
    let same_place = cloud.local(a) == cloud.local(b);
    let time = cloud.gps_time[a];
    let same_time = time.to_bits() == cloud.gps_time[b].to_bits();
    if !(same_place && same_time) {
        return false;
    }
    if time.is_nan() || time == 0.0 {
        return compare_attributes(cloud, a, b).is_eq();
    }
    cloud.source_id[a] == cloud.source_id[b] && cloud.return_number[a] == cloud.return_number[b]
}

//! One pass over a file: its points bucketed by tile, in bounded memory.

use crate::extra::ExtraField;
use crate::observe::Observed;
use crate::params::{Damaged, ScatterParams};
use crate::scan::Scan;
use crate::segment;
use crate::shard::{Section, ShardIndex, ShardWriter};
use crate::voxels;
use crate::{Error, Notes};
use std::collections::BTreeMap;
use std::io::Write;
use timberline_artefact::Crs;
use timberline_pointcloud::{Column, Frame, PointCloud, Rect, TileGrid, TileId};

/// Points kept in buffers: some 70 MB. The largest buffers are written when there are more.
const BUFFERED_POINTS: usize = 1 << 20;
/// Elevations are held as 32-bit ticks from 0: beyond this they are no elevations.
const MAX_ELEVATION_M: f64 = 200_000.0;
/// Columns that are kept only when they hold something other than zero.
const OPTIONAL: [&str; 2] = ["scanner_channel", "user_data"];

/// What became of a file.
#[derive(Debug, Clone)]
pub struct Scattered {
    /// The index that stands at the end of the payload.
    pub index: ShardIndex,
    /// Points left out because their coordinates are not finite, beyond 67,000 km, or more than
    /// 200 km above or below 0.
    pub outside: u64,
    /// Points lost to damage.
    pub lost: u64,
    /// Points whose return number is 0.
    pub zero_returns: u64,
    /// Points of class 2.
    pub ground: u64,
    /// Whether elevations look like heights above ground.
    pub is_normalised: bool,
    /// What a reader should know.
    pub notes: Vec<String>,
}

/// Reads all points of a file and writes them to `out`, bucketed by tile.
///
/// `progress` is called with the number of points of each batch; its error ends the pass.
///
/// # Errors
/// [`Error::Damaged`] unless damaged files are to be kept, [`Error::Io`] of file or `out`, and what
/// `progress` returns.
pub fn scatter<W: Write>(
    file: impl Into<Box<dyn Scan>>,
    grid: TileGrid,
    params: &ScatterParams,
    out: W,
    mut progress: impl FnMut(u64) -> Result<(), Error>,
) -> Result<(W, Scattered), Error> {
    let mut file = file.into();
    let mut buckets = Buckets::new(grid, out);
    let mut observed = Observed::new(file.stated_bounds_m());
    let mut outside = 0;
    while let Some(batch) = file.next_batch()? {
        progress(batch.len() as u64)?;
        // A refused file is read on only to say how much of it is left.
        if params.damaged == Damaged::Refuse && !file.damages().is_empty() {
            continue;
        }
        let batch = keep_elevations(batch, &mut outside);
        observed.add(&batch);
        buckets.add(&batch)?;
    }
    let notes = judge(file.as_ref(), &observed, outside + file.outside(), params.damaged)?;
    let (out, index) = buckets.finish(file.crs(), file.extra(), &observed)?;
    let scattered = Scattered {
        index,
        outside: outside + file.outside(),
        lost: file.damages().iter().map(|damage| damage.lost).sum(),
        zero_returns: observed.zero_returns,
        ground: observed.ground,
        is_normalised: observed.is_normalised(),
        notes: notes.into_messages(),
    };
    Ok((out, scattered))
}

/// Decides whether what was read will do, and collects what to say about it.
fn judge(
    file: &dyn Scan,
    observed: &Observed,
    outside: u64,
    damaged: Damaged,
) -> Result<Notes, Error> {
    let mut notes = file.notes().clone();
    check_damage(file, damaged, &mut notes)?;
    if outside > 0 && observed.points == 0 {
        return Err(file.nowhere(outside));
    }
    if outside > 0 {
        let first = file.first_outside().map(|first| format!(" (the first: {first})"));
        notes.say(format!(
            "{outside} points lie outside of what coordinates can be and are left out{}",
            first.unwrap_or_default()
        ));
    }
    note_scale(file, &mut notes);
    observed.report(file.has_returns(), &mut notes);
    Ok(notes)
}

fn check_damage(file: &dyn Scan, damaged: Damaged, notes: &mut Notes) -> Result<(), Error> {
    let Some(error) = file.damage() else { return Ok(()) };
    if damaged == Damaged::Refuse {
        return Err(error);
    }
    for damage in file.damages() {
        notes.say(format!("{}: {}; {} points are lost", damage.place, damage.problem, damage.lost));
    }
    Ok(())
}

/// Says when positions are rounded to the lattice.
fn note_scale(file: &dyn Scan, notes: &mut Notes) {
    let Some(finest) = file.finest_step_m() else { return };
    // Half a tick of slack: scales are written with errors of their own.
    if finest < 0.95 * timberline_pointcloud::frame::TICK_M {
        notes.say(format!(
            "the scale of {finest} m is finer than 0.1 mm, to which positions are rounded"
        ));
    }
}

fn keep_elevations(batch: PointCloud, outside: &mut u64) -> PointCloud {
    if batch.z.iter().all(|z| z.abs() <= MAX_ELEVATION_M) {
        return batch;
    }
    let keep: Vec<u32> =
        (0..batch.len() as u32).filter(|i| batch.z[*i as usize].abs() <= MAX_ELEVATION_M).collect();
    *outside += (batch.len() - keep.len()) as u64;
    batch.select(&keep)
}

/// Points waiting to be written, by tile.
struct Buckets<W: Write> {
    grid: TileGrid,
    writer: ShardWriter<W>,
    waiting: BTreeMap<TileId, PointCloud>,
    count: usize,
    sections: Vec<Section>,
    columns: BTreeMap<String, bool>,
}

impl<W: Write> Buckets<W> {
    fn new(grid: TileGrid, out: W) -> Self {
        Self {
            grid,
            writer: ShardWriter::new(out),
            waiting: BTreeMap::new(),
            count: 0,
            sections: Vec::new(),
            columns: BTreeMap::new(),
        }
    }

    fn add(&mut self, batch: &PointCloud) -> Result<(), Error> {
        self.note_columns(batch);
        for (tile, indices) in self.by_tile(batch) {
            let [x, y] = self.grid.corner_m(tile);
            let frame = Frame::new([x, y, 0]);
            let waiting = self.waiting.entry(tile).or_insert_with(|| PointCloud::new(frame));
            waiting.append(&batch.select(&indices))?;
            self.count += indices.len();
            if waiting.len() >= segment::max_points(waiting.extra.len()) {
                self.flush(tile)?;
            }
        }
        self.flush_largest()
    }

    fn note_columns(&mut self, batch: &PointCloud) {
        for (name, column) in &batch.extra {
            let seen =
                self.columns.entry(name.clone()).or_insert(!OPTIONAL.contains(&name.as_str()));
            *seen = *seen || !is_zero(column);
        }
    }

    fn by_tile(&self, batch: &PointCloud) -> BTreeMap<TileId, Vec<u32>> {
        let mut by_tile: BTreeMap<TileId, Vec<u32>> = BTreeMap::new();
        let mut run: (Option<TileId>, Vec<u32>) = (None, Vec::new());
        let mut rect = Rect::EMPTY;
        for index in 0..batch.len() {
            let (x, y) = (batch.x[index], batch.y[index]);
            if !rect.contains(x, y) {
                let tile = self.grid.tile_at(x, y);
                rect = self.grid.rect(tile);
                if let Some(before) = run.0.replace(tile) {
                    by_tile.entry(before).or_default().append(&mut run.1);
                }
            }
            run.1.push(index as u32);
        }
        if let Some(last) = run.0 {
            by_tile.entry(last).or_default().append(&mut run.1);
        }
        by_tile
    }

    fn flush_largest(&mut self) -> Result<(), Error> {
        if self.count <= BUFFERED_POINTS {
            return Ok(());
        }
        let mut by_size: Vec<(usize, TileId)> =
            self.waiting.iter().map(|(tile, cloud)| (cloud.len(), *tile)).collect();
        by_size.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        for (_, tile) in by_size {
            if self.count <= BUFFERED_POINTS / 2 {
                break;
            }
            self.flush(tile)?;
        }
        Ok(())
    }

    fn flush(&mut self, tile: TileId) -> Result<(), Error> {
        let Some(cloud) = self.waiting.remove(&tile) else { return Ok(()) };
        self.count -= cloud.len();
        let most = segment::max_points(cloud.extra.len());
        if cloud.len() <= most {
            return self.write(tile, &cloud);
        }
        let indices: Vec<u32> = (0..cloud.len() as u32).collect();
        indices.chunks(most).try_for_each(|part| self.write(tile, &cloud.select(part)))
    }

    fn write(&mut self, tile: TileId, cloud: &PointCloud) -> Result<(), Error> {
        let shard = |problem: String| Error::Shard { tile: format!("tile {tile}"), problem };
        let data = segment::encode(cloud, &OPTIONAL).map_err(shard)?;
        let counts = voxels::count(cloud);
        let counts = segment::encode_voxels(&counts).map_err(shard)?;
        let io = |error: std::io::Error| shard(format!("cannot write: {error}"));
        let section = Section {
            tile,
            points: cloud.len() as u32,
            data: self.writer.part(&data).map_err(io)?,
            voxels: self.writer.part(&counts).map_err(io)?,
        };
        self.sections.push(section);
        Ok(())
    }

    fn finish(
        mut self,
        crs: &Crs,
        extra: &[ExtraField],
        observed: &Observed,
    ) -> Result<(W, ShardIndex), Error> {
        let tiles: Vec<TileId> = self.waiting.keys().copied().collect();
        tiles.into_iter().try_for_each(|tile| self.flush(tile))?;
        let columns = self.columns.iter().filter(|(_, kept)| **kept);
        let index = ShardIndex {
            grid: self.grid,
            crs: crs.clone(),
            points: observed.points,
            bounds: (!observed.bounds.is_empty()).then_some(observed.bounds),
            columns: columns.map(|(name, _)| name.clone()).collect(),
            extra: extra.to_vec(),
            sections: self.sections,
        };
        let out = self.writer.finish(&index).map_err(|error| Error::Shard {
            tile: "all tiles".to_owned(),
            problem: format!("cannot write the index: {error}"),
        })?;
        Ok((out, index))
    }
}

/// Whether all values are zero.
pub(crate) fn is_zero(column: &Column) -> bool {
    match column {
        Column::U8(values) => values.iter().all(|value| *value == 0),
        other => (0..other.len()).all(|index| other.value(index) == 0.0),
    }
}

//! The payload of a `shards` artefact: one file's points bucketed by tile.
//!
//! ```text
//! sections     one after the other: the points of one tile, and the voxel counts of those points
//! index        JSON: what the file is, and where the sections are
//! 24 bytes     offset of the index, its length, its xxh3
//! ```
//! Every section's xxh3 stands in the index, so a tile reads and checks only its own.

use crate::Error;
use crate::extra::ExtraField;
use serde::{Deserialize, Serialize};
use timberline_artefact::Crs;
use timberline_artefact::container::ContainerReader;
use timberline_pointcloud::{Bounds3, TileGrid, TileId};
use xxhash_rust::xxh3::xxh3_64;

const FOOTER_LEN: u64 = 24;

/// A part of the payload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// Where it begins.
    pub at: u64,
    /// Its length.
    pub len: u64,
    /// Its xxh3.
    pub check: u64,
}

/// Some of the points of one tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Section {
    /// The tile.
    pub tile: TileId,
    /// Number of points.
    pub points: u32,
    /// The points.
    pub data: Part,
    /// Their voxel counts.
    pub voxels: Part,
}

/// What a shard file is made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShardIndex {
    /// The tile grid.
    pub grid: TileGrid,
    /// The file's CRS.
    pub crs: Crs,
    /// Number of points.
    pub points: u64,
    /// World bounds of the points, metres; `None` without points.
    pub bounds: Option<Bounds3>,
    /// Names of the extra columns: those of the format and the extra bytes, and the optional ones
    /// that hold something other than zero.
    pub columns: Vec<String>,
    /// What the file says about its extra bytes.
    pub extra: Vec<ExtraField>,
    /// The sections, in the order they were written.
    pub sections: Vec<Section>,
}

impl ShardIndex {
    /// The tiles with points, sorted.
    #[must_use]
    pub fn tiles(&self) -> Vec<TileId> {
        let mut tiles: Vec<TileId> = self.sections.iter().map(|section| section.tile).collect();
        tiles.sort_unstable();
        tiles.dedup();
        tiles
    }

    /// Whether there are points of a tile.
    pub(crate) fn holds(&self, tile: TileId) -> bool {
        self.sections.iter().any(|section| section.tile == tile)
    }

    /// The sections of the tiles that are wanted.
    pub(crate) fn sections_of(&self, wanted: impl Fn(TileId) -> bool) -> Vec<Section> {
        self.sections.iter().filter(|section| wanted(section.tile)).copied().collect()
    }
}

/// Writes the payload.
pub(crate) struct ShardWriter<W: std::io::Write> {
    out: W,
    at: u64,
}

impl<W: std::io::Write> ShardWriter<W> {
    pub(crate) fn new(out: W) -> Self {
        Self { out, at: 0 }
    }

    pub(crate) fn part(&mut self, bytes: &[u8]) -> std::io::Result<Part> {
        self.out.write_all(bytes)?;
        let part = Part { at: self.at, len: bytes.len() as u64, check: xxh3_64(bytes) };
        self.at += part.len;
        Ok(part)
    }

    pub(crate) fn finish(mut self, index: &ShardIndex) -> std::io::Result<W> {
        let bytes = serde_json::to_vec(index)?;
        let part = self.part(&bytes)?;
        for number in [part.at, part.len, part.check] {
            self.out.write_all(&number.to_le_bytes())?;
        }
        Ok(self.out)
    }
}

/// A payload that can be read in parts.
pub trait Sections {
    /// Number of bytes.
    fn byte_len(&self) -> u64;

    /// A part of them.
    ///
    /// # Errors
    /// Why it cannot be read.
    fn bytes(&mut self, at: u64, len: u64) -> Result<Vec<u8>, String>;
}

impl Sections for ContainerReader {
    fn byte_len(&self) -> u64 {
        self.payload_len()
    }

    fn bytes(&mut self, at: u64, len: u64) -> Result<Vec<u8>, String> {
        self.section(at, len).map_err(|error| error.to_string())
    }
}

impl Sections for &[u8] {
    fn byte_len(&self) -> u64 {
        self.len() as u64
    }

    fn bytes(&mut self, at: u64, len: u64) -> Result<Vec<u8>, String> {
        let range =
            usize::try_from(at).ok().zip(at.checked_add(len).and_then(|e| e.try_into().ok()));
        let part = range.and_then(|(from, to): (usize, usize)| self.get(from..to));
        part.map(<[u8]>::to_vec).ok_or_else(|| format!("bytes {at}+{len} lie outside"))
    }
}

/// An open shard file.
#[derive(Debug)]
pub struct ShardReader<S> {
    source: S,
    index: ShardIndex,
}

impl<S: Sections> ShardReader<S> {
    /// Reads and checks the index.
    ///
    /// # Errors
    /// [`Error::Shard`].
    pub fn new(mut source: S) -> Result<Self, Error> {
        let index = read_index(&mut source)
            .map_err(|problem| Error::Shard { tile: "a file".to_owned(), problem })?;
        Ok(Self { source, index })
    }

    /// The index.
    #[must_use]
    pub fn index(&self) -> &ShardIndex {
        &self.index
    }

    /// The bytes of a part of a tile's data, checked.
    ///
    /// # Errors
    /// [`Error::Shard`].
    pub(crate) fn part(&mut self, tile: TileId, part: Part) -> Result<Vec<u8>, Error> {
        read_part(&mut self.source, part)
            .map_err(|problem| Error::Shard { tile: format!("tile {tile}"), problem })
    }
}

fn read_part(source: &mut impl Sections, part: Part) -> Result<Vec<u8>, String> {
    let bytes = source.bytes(part.at, part.len)?;
    let found = xxh3_64(&bytes);
    if found == part.check {
        return Ok(bytes);
    }
    Err(format!("checksum {found:016x} at byte {}, expected {:016x}", part.at, part.check))
}

fn read_index(source: &mut impl Sections) -> Result<ShardIndex, String> {
    let len = source.byte_len();
    let at = len.checked_sub(FOOTER_LEN).ok_or("too short for an index")?;
    let footer = source.bytes(at, FOOTER_LEN)?;
    let number = |i: usize| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&footer[8 * i..8 * i + 8]);
        u64::from_le_bytes(bytes)
    };
    let part = Part { at: number(0), len: number(1), check: number(2) };
    if part.at.checked_add(part.len) != Some(at) {
        return Err(format!("the index of {} bytes at {} does not fit", part.len, part.at));
    }
    serde_json::from_slice(&read_part(source, part)?).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_byte_is_found() {
        let mut writer = ShardWriter::new(Vec::new());
        let data = writer.part(b"points").unwrap();
        let tile = TileId { ix: 1, iy: -1 };
        let section = Section { tile, points: 1, data, voxels: data };
        let index = ShardIndex {
            grid: TileGrid { edge_m: 64, origin_m: [0, 0] },
            crs: Crs::default(),
            points: 1,
            bounds: None,
            columns: Vec::new(),
            extra: Vec::new(),
            sections: vec![section],
        };
        let bytes = writer.finish(&index).unwrap();
        let mut reader = ShardReader::new(bytes.as_slice()).unwrap();
        assert_eq!((reader.index(), reader.index().tiles()), (&index, vec![tile]));
        assert_eq!(reader.part(tile, data).unwrap(), b"points");
        for place in [0, 10, bytes.len() - 1] {
            let mut changed = bytes.clone();
            changed[place] ^= 1;
            let read = ShardReader::new(changed.as_slice()).and_then(|mut r| r.part(tile, data));
            assert!(read.is_err(), "byte {place}");
        }
    }
}

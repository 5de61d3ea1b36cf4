//! How the compressed points of a LAZ file are laid out, checked before the `laz` crate sees them.
//!
//! LASzip's record (Isenburg 2013, and `laszip.hpp`): compressor `u16` (1 one stream, 2 chunks,
//! 3 chunks of layers), coder `u16`, version 4 bytes, options `u32`, chunk size `u32` (2^32-1:
//! variable), two `i64` of special records, number of items `u16`, items of type, size, version.

use crate::contain::contained;
use crate::gps_time::{GpsTimes, Point14};
use crate::header::Header;
use crate::source::Source;
use crate::vlr::RecordData;
use crate::{Error, Notes};
use laz::las::{v3, v4};
use laz::laszip::ChunkTable;
use laz::record::{
    LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor,
};
use laz::{DecompressionSelection, LazItem, LazItemType, LazVlr};
use std::io::{Cursor, Read, Seek};

const RECORD: &str = "laszip encoded/22204";
const REPAIR: &str = "the file is damaged or was written by an unknown compressor: get it again, \
                      or decompress it to LAS with its own program";
const VARIABLE: u32 = u32::MAX;
/// Bytes of the offset to the chunk table, before the first chunk.
const TABLE_OFFSET_LEN: u64 = 8;

/// A run of points that can be decompressed by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Chunk {
    pub(crate) at: u64,
    pub(crate) len: u64,
    pub(crate) points: u64,
}

/// How to get at the points.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Plan {
    /// Chunk by chunk, in any order.
    Chunks(Vec<Chunk>),
    /// One after the other from a byte on, starting afresh every so many points.
    Stream { at: u64, restart: u64 },
}

/// LASzip's record, checked against the header.
#[derive(Debug, Clone)]
pub(crate) struct Laszip {
    vlr: LazVlr,
    layered: bool,
    compressor: u16,
}

/// A decompressor of one run of points.
pub(crate) enum Decompressor<R: Read + Seek> {
    /// Items that follow one another for every point.
    Items(SequentialPointRecordDecompressor<'static, R>),
    /// Layers.
    Layers(LayeredPointRecordDecompressor<'static, R>),
}

impl<R: Read + Seek> Decompressor<R> {
    /// Decompresses the next record.
    ///
    /// # Errors
    /// What the `laz` crate refuses.
    pub(crate) fn next(&mut self, record: &mut [u8]) -> std::io::Result<()> {
        match self {
            Self::Items(items) => items.decompress_next(record),
            Self::Layers(layers) => layers.decompress_next(record),
        }
    }
}

fn refuse(data: &RecordData, problem: impl Into<String>) -> Error {
    Error::Record {
        record: RECORD.to_owned(),
        offset: data.at,
        problem: problem.into(),
        remedy: REPAIR,
    }
}

impl Laszip {
    /// Checks the record.
    ///
    /// # Errors
    /// [`Error::Record`] when it is missing or does not describe the header's point format.
    pub(crate) fn parse(data: Option<&RecordData>, header: &Header) -> Result<Self, Error> {
        let Some(data) = data else {
            let none = RecordData { at: header.header_len, bytes: Vec::new() };
            return Err(refuse(&none, "missing, though the header says the points are compressed"));
        };
        let field =
            |at: usize| data.bytes.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
        let (Some(compressor), Some(count)) = (field(0), field(32)) else {
            return Err(refuse(data, format!("{} bytes, expected at least 34", data.bytes.len())));
        };
        let needed = 34 + 6 * usize::from(count);
        if data.bytes.len() < needed || count == 0 {
            let have = data.bytes.len();
            return Err(refuse(
                data,
                format!("{count} items need {needed} bytes, there are {have}"),
            ));
        }
        let vlr = contained(|| LazVlr::from_buffer(&data.bytes))
            .map_err(|panic| refuse(data, panic))?
            .map_err(|error| refuse(data, error.to_string()))?;
        let layered = check_items(vlr.items(), header).map_err(|problem| refuse(data, problem))?;
        let fits = matches!((compressor, layered), (1 | 2, false) | (3, true));
        if !fits {
            return Err(refuse(data, format!("compressor {compressor} does not fit its items")));
        }
        Ok(Self { vlr, layered, compressor })
    }

    /// Finds out where the points are.
    ///
    /// # Errors
    /// [`Error::Record`] when they cannot be told apart; [`Error::Io`].
    pub(crate) fn plan(
        &self,
        source: &mut dyn Source,
        header: &Header,
        notes: &mut Notes,
    ) -> Result<Plan, Error> {
        let data = header.points_at;
        if self.compressor == 1 {
            return Ok(Plan::Stream { at: data, restart: u64::MAX });
        }
        if header.points == 0 {
            return Ok(Plan::Chunks(Vec::new()));
        }
        match self.read_table(source, header) {
            Ok(chunks) => return Ok(Plan::Chunks(chunks)),
            Err(problem) => notes.say(format!(
                "the chunk table cannot be used ({problem}); the chunks are read one after the other"
            )),
        }
        if self.layered {
            return self.walk(source, header).map(Plan::Chunks);
        }
        if self.vlr.chunk_size() == VARIABLE {
            let record = RecordData { at: data, bytes: Vec::new() };
            return Err(refuse(&record, "chunks of variable size without a usable chunk table"));
        }
        Ok(Plan::Stream { at: data + TABLE_OFFSET_LEN, restart: u64::from(self.vlr.chunk_size()) })
    }

    /// Reads the chunk table; the message says why it cannot be used.
    fn read_table(&self, source: &mut dyn Source, header: &Header) -> Result<Vec<Chunk>, String> {
        let (data, end) = (header.points_at + TABLE_OFFSET_LEN, header.file_len);
        let table = table_offset(source, header)?;
        let mut head = [0; 8];
        source.read_at(table, &mut head, "the chunk table").map_err(|error| error.to_string())?;
        let count = u64::from(u32::from_le_bytes([head[4], head[5], head[6], head[7]]));
        // Every chunk begins with one uncompressed record.
        let most = (table - data) / u64::from(header.record_len);
        if count > most {
            return Err(format!("it promises {count} chunks, there is room for {most}"));
        }
        let mut bytes = vec![0; (end - table).min(16 + 16 * count) as usize];
        source.read_at(table, &mut bytes, "the chunk table").map_err(|error| error.to_string())?;
        let chunk_size = self.vlr.chunk_size();
        let variable = chunk_size == VARIABLE;
        let read = || ChunkTable::read(&mut Cursor::new(bytes), variable);
        let entries = contained(read)?.map_err(|error| error.to_string())?;
        let size = |points: u64| if variable { points } else { u64::from(chunk_size) };
        let entries = entries.as_ref().iter().map(|e| (e.byte_count, size(e.point_count)));
        place_chunks(entries, data, table, header.points)
    }

    /// Finds layered chunks by the sizes they carry themselves.
    fn walk(&self, source: &mut dyn Source, header: &Header) -> Result<Vec<Chunk>, Error> {
        let mut chunks = Vec::new();
        let (mut at, mut left) = (header.points_at + TABLE_OFFSET_LEN, header.points);
        let head_len = u64::from(header.record_len) + 4 + 4 * self.layers() as u64;
        while left > 0 && at + head_len <= header.file_len {
            let mut head = vec![0; head_len as usize];
            source.read_at(at, &mut head, "a chunk of layers")?;
            let (count, layers) = self.layer_head(&head, header.record_len);
            let len = head_len + layers;
            if count == 0 || len > header.file_len - at {
                break;
            }
            let points = count.min(left);
            chunks.push(Chunk { at, len, points });
            left -= points;
            at += len;
        }
        Ok(chunks)
    }

    /// Number of layers of a chunk: each has a size of four bytes in the chunk's head.
    fn layers(&self) -> usize {
        let layers = |item: &LazItem| match item.item_type() {
            LazItemType::Point14 => 9,
            LazItemType::RGBNIR14 => 2,
            LazItemType::Byte14(count) => usize::from(count),
            _ => 1,
        };
        self.vlr.items().iter().map(layers).sum()
    }

    /// Number of points and bytes of all layers, from a chunk's head.
    fn layer_head(&self, head: &[u8], record_len: u16) -> (u64, u64) {
        let mut numbers = head[usize::from(record_len)..]
            .chunks_exact(4)
            .map(|b| u64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])));
        let count = numbers.next().unwrap_or(0);
        (count, numbers.take(self.layers()).sum())
    }

    /// Checks that a layered chunk's sizes lie within it, so that they can be allocated.
    ///
    /// # Errors
    /// What does not fit.
    pub(crate) fn check_chunk(&self, bytes: &[u8], points: u64, len: u16) -> Result<(), String> {
        if !self.layered {
            return Ok(());
        }
        let head_len = usize::from(len) + 4 + 4 * self.layers();
        if bytes.len() < head_len {
            return Err(format!("{} bytes do not hold the chunk's head", bytes.len()));
        }
        let (count, layers) = self.layer_head(&bytes[..head_len], len);
        if count < points {
            return Err(format!("it holds {count} points, expected {points}"));
        }
        let room = (bytes.len() - head_len) as u64;
        if layers > room {
            return Err(format!("its layers need {layers} bytes, there are {room}"));
        }
        Ok(())
    }

    /// A decompressor at the beginning of a chunk.
    ///
    /// # Errors
    /// What the `laz` crate does not support.
    pub(crate) fn decompressor<R>(&self, input: R) -> Result<Decompressor<R>, String>
    where
        R: Read + Seek + Send + Sync + 'static,
    {
        if self.layered {
            let mut layers = LayeredPointRecordDecompressor::new(input);
            self.add_layers(&mut layers)?;
            return Ok(Decompressor::Layers(layers));
        }
        let mut items = SequentialPointRecordDecompressor::new(input);
        self.add_items(&mut items)?;
        Ok(Decompressor::Items(items))
    }

    /// Brings a decompressor to the beginning of the next chunk of its stream.
    ///
    /// # Errors
    /// As [`Self::decompressor`].
    pub(crate) fn restart<R>(&self, decompressor: &mut Decompressor<R>) -> Result<(), String>
    where
        R: Read + Seek + Send + Sync + 'static,
    {
        match decompressor {
            Decompressor::Items(items) => {
                items.reset();
                self.add_items(items)
            }
            Decompressor::Layers(layers) => {
                layers.reset();
                self.add_layers(layers)
            }
        }
    }

    fn add_items<R>(
        &self,
        decompressor: &mut SequentialPointRecordDecompressor<'static, R>,
    ) -> Result<(), String>
    where
        R: Read + 'static,
    {
        for item in self.vlr.items() {
            match (item.item_type(), item.version()) {
                (LazItemType::GpsTime, 2) => decompressor.add_field_decompressor(GpsTimes::new()),
                _ => decompressor.set_fields_from(&vec![*item]).map_err(|e| e.to_string())?,
            }
        }
        Ok(())
    }

    fn add_layers<R>(
        &self,
        decompressor: &mut LayeredPointRecordDecompressor<'static, R>,
    ) -> Result<(), String>
    where
        R: Read + Seek + 'static,
    {
        for item in self.vlr.items() {
            match (item.item_type(), item.version()) {
                (LazItemType::Point14, 3) => decompressor
                    .add_field_decompressor(Point14::new(v3::LasPoint6Decompressor::default())),
                (LazItemType::Point14, 4) => decompressor
                    .add_field_decompressor(Point14::new(v4::LasPoint6Decompressor::default())),
                _ => decompressor.set_fields_from(&vec![*item]).map_err(|e| e.to_string())?,
            }
        }
        decompressor.set_selection(DecompressionSelection::all());
        Ok(())
    }
}

/// Where the chunk table stands; a writer that could not seek back leaves the place to the last bytes.
fn table_offset(source: &mut dyn Source, header: &Header) -> Result<u64, String> {
    let (first, last) = (header.points_at, header.file_len.saturating_sub(TABLE_OFFSET_LEN));
    let valid = (first + TABLE_OFFSET_LEN)..=last;
    let mut found = 0;
    for at in [first, last] {
        let mut bytes = [0; 8];
        source
            .read_at(at, &mut bytes, "the place of the chunk table")
            .map_err(|error| error.to_string())?;
        found = u64::from_le_bytes(bytes);
        if valid.contains(&found) {
            return Ok(found);
        }
    }
    Err(format!("its place, byte {found}, lies outside the file of {} bytes", header.file_len))
}

/// Gives every chunk its place and number of points.
fn place_chunks(
    entries: impl Iterator<Item = (u64, u64)>,
    data: u64,
    table: u64,
    points: u64,
) -> Result<Vec<Chunk>, String> {
    let (mut at, mut left) = (data, points);
    let mut chunks = Vec::new();
    for (len, size) in entries {
        if len > table - at {
            return Err(format!("chunk {} of {len} bytes reaches into the table", chunks.len()));
        }
        let points = size.min(left);
        chunks.push(Chunk { at, len, points });
        at += len;
        left -= points;
    }
    if left > 0 {
        return Err(format!("its chunks hold {} of {points} points", points - left));
    }
    chunks.retain(|chunk| chunk.points > 0);
    Ok(chunks)
}

/// Checks that the items make up the header's record and go together; whether they are layered.
fn check_items(items: &[LazItem], header: &Header) -> Result<bool, String> {
    let layered = header.layout.extended;
    let mut total = 0u32;
    for (index, item) in items.iter().enumerate() {
        let (expected, is_layered) = match item.item_type() {
            LazItemType::Point10 => (20, false),
            LazItemType::GpsTime => (8, false),
            LazItemType::RGB12 => (6, false),
            LazItemType::WavePacket13 => (29, false),
            LazItemType::Byte(size) => (size, false),
            LazItemType::Point14 => (30, true),
            LazItemType::RGB14 => (6, true),
            LazItemType::RGBNIR14 => (8, true),
            LazItemType::WavePacket14 => (29, true),
            LazItemType::Byte14(size) => (size, true),
        };
        let first = matches!(item.item_type(), LazItemType::Point10 | LazItemType::Point14);
        let version = if is_layered { 3..=4 } else { 1..=2 };
        let fits = item.size() == expected
            && expected > 0
            && first == (index == 0)
            && is_layered == layered
            && version.contains(&item.version());
        if !fits {
            let (kind, size, version) = (item.item_type(), item.size(), item.version());
            return Err(format!(
                "item {index} ({kind:?}, {size} bytes, version {version}) does not fit point \
                 format {}",
                header.layout.format
            ));
        }
        total += u32::from(expected);
    }
    if total == u32::from(header.record_len) {
        return Ok(layered);
    }
    Err(format!("its items make {total} bytes, the header says {} a point", header.record_len))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_must_end_before_the_table() {
        let chunks = place_chunks([(30, 5), (20, 5)].into_iter(), 100, 150, 8).unwrap();
        assert_eq!(chunks[1], Chunk { at: 130, len: 20, points: 3 });
        assert!(place_chunks([(51, 5)].into_iter(), 100, 150, 5).is_err());
        assert!(place_chunks([(u64::MAX, 5)].into_iter(), 100, 150, 5).is_err());
        let short = place_chunks([(30, 5)].into_iter(), 100, 150, 8).unwrap_err();
        assert!(short.contains("5 of 8 points"), "{short}");
    }
}

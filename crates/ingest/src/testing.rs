//! Small LAS files made byte by byte, for tests of what no writer would write.

use crate::format::Layout;
use laz::record::{RecordCompressor, SequentialPointRecordCompressor};
use std::io::{Cursor, Seek, SeekFrom};

/// Builds the bytes of an uncompressed LAS file.
#[derive(Debug, Clone)]
pub(crate) struct LasBytes {
    version: (u8, u8),
    format: u8,
    extra_len: u16,
    encoding: u16,
    scale: f64,
    vlrs: Vec<u8>,
    vlr_count: u32,
    evlrs: Vec<u8>,
    evlr_count: u32,
    records: Vec<Vec<u8>>,
}

impl LasBytes {
    pub(crate) fn new(version: (u8, u8), format: u8) -> Self {
        Self {
            version,
            format,
            extra_len: 0,
            encoding: 0,
            scale: 0.01,
            vlrs: Vec::new(),
            vlr_count: 0,
            evlrs: Vec::new(),
            evlr_count: 0,
            records: Vec::new(),
        }
    }

    pub(crate) fn extra_len(mut self, len: u16) -> Self {
        self.extra_len = len;
        self
    }

    pub(crate) fn encoding(mut self, bits: u16) -> Self {
        self.encoding = bits;
        self
    }

    pub(crate) fn record_len(&self) -> usize {
        usize::from(Layout::of(self.format).unwrap().len + self.extra_len)
    }

    fn head(user: &str, id: u16) -> Vec<u8> {
        let mut head = vec![0; 20];
        head[2..2 + user.len()].copy_from_slice(user.as_bytes());
        head[18..20].copy_from_slice(&id.to_le_bytes());
        head
    }

    pub(crate) fn vlr(mut self, user: &str, id: u16, data: &[u8]) -> Self {
        self.vlrs.extend(Self::head(user, id));
        self.vlrs.extend((data.len() as u16).to_le_bytes());
        self.vlrs.extend([0; 32]);
        self.vlrs.extend(data);
        self.vlr_count += 1;
        self
    }

    pub(crate) fn evlr(mut self, user: &str, id: u16, data: &[u8]) -> Self {
        self.evlrs.extend(Self::head(user, id));
        self.evlrs.extend((data.len() as u64).to_le_bytes());
        self.evlrs.extend([0; 32]);
        self.evlrs.extend(data);
        self.evlr_count += 1;
        self
    }

    /// Adds points at (i, 2 i, 3 i) hundredths, single returns.
    pub(crate) fn points(mut self, count: i32) -> Self {
        for i in 0..count {
            let record = self.record([i, 2 * i, 3 * i]);
            self.records.push(record);
        }
        self
    }

    /// A record with a position and return 1 of 1.
    pub(crate) fn record(&self, xyz: [i32; 3]) -> Vec<u8> {
        let mut record = vec![0; self.record_len()];
        for axis in 0..3 {
            record[4 * axis..4 * axis + 4].copy_from_slice(&xyz[axis].to_le_bytes());
        }
        record[14] = if self.format >= 6 { 0x11 } else { 0x09 };
        record
    }

    pub(crate) fn push(mut self, record: Vec<u8>) -> Self {
        self.records.push(record);
        self
    }

    /// The same points compressed, with a chunk table, in chunks of the given number of points.
    pub(crate) fn build_laz(self, chunk_size: u32) -> Vec<u8> {
        let builder = laz::LazVlrBuilder::default()
            .with_point_format(self.format, self.extra_len)
            .unwrap()
            .with_fixed_chunk_size(chunk_size);
        let vlr = builder.build();
        let mut data = Vec::new();
        vlr.write_to(&mut data).unwrap();
        let (count, records) = (self.records.len(), self.records.concat());
        let mut empty = self.vlr("laszip encoded", 22204, &data);
        empty.records.clear();
        let mut bytes = empty.build();
        bytes[104] |= 0x80;
        bytes[107..111].copy_from_slice(&(count as u32).to_le_bytes());
        if bytes[25] >= 4 {
            bytes[247..255].copy_from_slice(&(count as u64).to_le_bytes());
        }
        let mut out = Cursor::new(bytes);
        out.seek(SeekFrom::End(0)).unwrap();
        let mut compressor = laz::LasZipCompressor::new(out, vlr).unwrap();
        compressor.compress_many(&records).unwrap();
        compressor.done().unwrap();
        compressor.into_inner().into_inner()
    }

    /// The same points (formats 0 to 5) as one stream without a chunk table, as LASzip 1 wrote them.
    pub(crate) fn build_laz_stream(self) -> Vec<u8> {
        let records = self.records.clone();
        let mut bytes = self.build_laz(50_000);
        let points_at = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize;
        let vlr_at = points_at - 34 - 6 * usize::from(bytes[points_at_items(&bytes)]);
        bytes.truncate(points_at);
        let vlr = laz::LazVlr::from_buffer(&bytes[vlr_at..]).unwrap();
        bytes[vlr_at..vlr_at + 2].copy_from_slice(&1u16.to_le_bytes());
        bytes[vlr_at + 12..vlr_at + 16].copy_from_slice(&0u32.to_le_bytes());
        let mut out = SequentialPointRecordCompressor::new(bytes);
        out.set_fields_from(vlr.items()).unwrap();
        records.iter().for_each(|record| out.compress_next(record).unwrap());
        out.done().unwrap();
        RecordCompressor::into_inner(out)
    }

    pub(crate) fn build(self) -> Vec<u8> {
        let header_len: usize = match self.version.1 {
            0..=2 => 227,
            3 => 235,
            _ => 375,
        };
        let points_at = header_len + self.vlrs.len();
        let points: Vec<u8> = self.records.concat();
        let mut out = vec![0; header_len];
        let mut put = |at: usize, bytes: &[u8]| {
            if at + bytes.len() <= header_len {
                out[at..at + bytes.len()].copy_from_slice(bytes);
            }
        };
        put(0, b"LASF");
        put(6, &self.encoding.to_le_bytes());
        put(24, &[self.version.0, self.version.1]);
        put(94, &(header_len as u16).to_le_bytes());
        put(96, &(points_at as u32).to_le_bytes());
        put(100, &self.vlr_count.to_le_bytes());
        put(104, &[self.format]);
        put(105, &(self.record_len() as u16).to_le_bytes());
        put(107, &(self.records.len() as u32).to_le_bytes());
        (0..3).for_each(|axis| put(131 + 8 * axis, &self.scale.to_le_bytes()));
        put(235, &((points_at + points.len()) as u64).to_le_bytes());
        put(243, &self.evlr_count.to_le_bytes());
        put(247, &(self.records.len() as u64).to_le_bytes());
        [out, self.vlrs, points, self.evlrs].concat()
    }
}

/// Where the number of items stands in the record of LASzip, the last before the points.
fn points_at_items(bytes: &[u8]) -> usize {
    let mut name = b"laszip encoded".to_vec();
    name.resize(16, 0);
    let user = bytes.windows(16).position(|window| window == name).unwrap();
    user - 2 + 54 + 32
}

/// Makes the checksums of an E57 file's pages right again: CRC-32C of the first 1020 of 1024 bytes,
/// most significant byte first.
pub(crate) fn seal_e57(bytes: &mut [u8]) {
    const POLYNOMIAL: u32 = 0x82F6_3B78;
    for page in bytes.chunks_exact_mut(1024) {
        let mut crc = u32::MAX;
        for byte in &page[..1020] {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = (crc >> 1) ^ (POLYNOMIAL & (crc & 1).wrapping_neg());
            }
        }
        page[1020..].copy_from_slice(&(!crc).to_be_bytes());
    }
}

//! The public header block, read byte by byte and checked against the file's size.
//!
//! ASPRS LAS 1.0 to 1.4-R15, table 3. Nothing after the header is read before it has been checked
//! here: a file that lies about a length or a count is refused or cut to what is there.

use crate::format::Layout;
use crate::source::Source;
use crate::{Error, Notes};
use timberline_artefact::Crs;
use timberline_pointcloud::Bounds3;

/// Bytes of the smallest header (LAS 1.0 to 1.2).
pub const MIN_HEADER_LEN: u64 = 227;
const SIGNATURE: [u8; 4] = *b"LASF";
/// Bit 7 of the point format marks LAZ; bit 6 was used by early compressors (LASzip, `laszip.hpp`).
const COMPRESSED_BIT: u8 = 0x80;
const FORMAT_MASK: u8 = 0x3F;
/// Bit 4 of the global encoding: the CRS is given as WKT (LAS 1.4-R15, table 4).
const WKT_BIT: u16 = 1 << 4;

/// What the header says, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Major and minor version.
    pub version: (u8, u8),
    /// See the specification; bit 4 is the WKT bit.
    pub global_encoding: u16,
    /// Layout of a point record.
    pub layout: Layout,
    /// Whether the points are compressed.
    pub compressed: bool,
    /// Bytes of a point record, extra bytes included.
    pub record_len: u16,
    /// Number of points promised.
    pub points: u64,
    /// Metres or feet in one step of x, y, z.
    pub scale: [f64; 3],
    /// Added after scaling.
    pub offset: [f64; 3],
    /// Smallest and largest coordinates as stated, in file units; not checked against the points.
    pub bounds: [[f64; 3]; 2],
    /// Bytes of the header block: where the variable length records begin.
    pub header_len: u64,
    /// Where the points begin.
    pub points_at: u64,
    /// Number of variable length records promised.
    pub vlrs: u32,
    /// Where the extended variable length records begin, and how many there are.
    pub evlrs: Option<(u64, u32)>,
    /// Bytes of the whole file.
    pub file_len: u64,
}

impl Header {
    /// Reads and checks the header of a file.
    ///
    /// # Errors
    /// [`Error::Foreign`] for other kinds of files, [`Error::Header`] for fields that cannot be right.
    pub fn read(source: &mut dyn Source, notes: &mut Notes) -> Result<Self, Error> {
        let file_len = source.byte_len()?;
        let mut bytes = [0; 375];
        let have = file_len.min(375) as usize;
        source.read_at(0, &mut bytes[..have], "the header")?;
        check_signature(&bytes[..have])?;
        if file_len < MIN_HEADER_LEN {
            return Err(refuse("file length", 0, file_len, "at least 227 bytes", GET_AGAIN));
        }
        Self::parse(&Fields(&bytes[..have]), file_len, notes)
    }

    fn parse(fields: &Fields<'_>, file_len: u64, notes: &mut Notes) -> Result<Self, Error> {
        let version = check_version(fields)?;
        let (layout, compressed) = check_format(fields)?;
        let (header_len, points_at) = check_offsets(fields, version, file_len)?;
        let record_len = check_record_len(fields, layout)?;
        Ok(Self {
            version,
            global_encoding: fields.u16(6),
            layout,
            compressed,
            record_len,
            points: count_points(fields, version, header_len, notes),
            scale: check_scale(fields)?,
            offset: check_offset(fields)?,
            bounds: [
                [fields.f64(187), fields.f64(203), fields.f64(219)],
                [fields.f64(179), fields.f64(195), fields.f64(211)],
            ],
            header_len,
            points_at,
            vlrs: fields.u32(100),
            evlrs: evlrs(fields, version, header_len, file_len, notes),
            file_len,
        })
    }

    /// Whether the WKT bit of the global encoding is set.
    #[must_use]
    pub fn says_wkt(&self) -> bool {
        self.global_encoding & WKT_BIT != 0
    }

    /// For uncompressed files: how many whole records there is room for.
    #[must_use]
    pub fn points_that_fit(&self) -> u64 {
        self.file_len.saturating_sub(self.points_at) / u64::from(self.record_len)
    }

    /// Position in file units of a record's integers.
    #[must_use]
    pub fn position(&self, raw: [i32; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| f64::from(raw[axis]) * self.scale[axis] + self.offset[axis])
    }

    /// The stated bounds where they can be believed: finite and in order.
    #[must_use]
    pub fn stated_bounds(&self) -> Option<[[f64; 3]; 2]> {
        let [min, max] = self.bounds;
        let sane = (0..3).all(|a| min[a].is_finite() && max[a].is_finite() && min[a] <= max[a]);
        sane.then_some(self.bounds)
    }

    /// As [`Header::stated_bounds`] in the world, metres.
    pub(crate) fn stated_bounds_m(&self, crs: &Crs) -> Option<Bounds3> {
        let [min, max] = self.stated_bounds()?.map(|corner| crs.world_from_crs(corner));
        Some(Bounds3 { min, max })
    }
}

const GET_AGAIN: &str = "the file is cut off or damaged: get it again from its supplier";
const REWRITE: &str = "the header is damaged: get the file again, or repair the header";

/// Little-endian fields of the header's bytes; bytes that are not there read as zero.
struct Fields<'a>(&'a [u8]);

impl Fields<'_> {
    fn bytes<const N: usize>(&self, at: usize) -> [u8; N] {
        let mut out = [0; N];
        if let Some(found) = self.0.get(at..at + N) {
            out.copy_from_slice(found);
        }
        out
    }
    fn u8(&self, at: usize) -> u8 {
        self.bytes::<1>(at)[0]
    }
    fn u16(&self, at: usize) -> u16 {
        u16::from_le_bytes(self.bytes(at))
    }
    fn u32(&self, at: usize) -> u32 {
        u32::from_le_bytes(self.bytes(at))
    }
    fn u64(&self, at: usize) -> u64 {
        u64::from_le_bytes(self.bytes(at))
    }
    fn f64(&self, at: usize) -> f64 {
        f64::from_le_bytes(self.bytes(at))
    }
}

fn refuse(
    field: &'static str,
    offset: u64,
    value: impl ToString,
    expected: impl ToString,
    remedy: &'static str,
) -> Error {
    let (value, expected) = (value.to_string(), expected.to_string());
    Error::Header { field, offset, value, expected, remedy }
}

fn check_signature(bytes: &[u8]) -> Result<(), Error> {
    if bytes.starts_with(&SIGNATURE) {
        return Ok(());
    }
    Err(Error::Foreign { found: crate::sniff::describe(bytes) })
}

fn check_version(fields: &Fields<'_>) -> Result<(u8, u8), Error> {
    let version = (fields.u8(24), fields.u8(25));
    if version.0 == 1 && version.1 <= 4 {
        return Ok(version);
    }
    let found = format!("{}.{}", version.0, version.1);
    Err(refuse("version", 24, found, "1.0 to 1.4", "convert the file to LAS 1.4"))
}

fn check_format(fields: &Fields<'_>) -> Result<(Layout, bool), Error> {
    let byte = fields.u8(104);
    let layout = Layout::of(byte & FORMAT_MASK).ok_or_else(|| {
        let found = byte & FORMAT_MASK;
        refuse("point data record format", 104, found, "0 to 10", "convert the file to LAS 1.4")
    })?;
    Ok((layout, byte & COMPRESSED_BIT != 0))
}

fn check_offsets(
    fields: &Fields<'_>,
    version: (u8, u8),
    file_len: u64,
) -> Result<(u64, u64), Error> {
    let header_len = u64::from(fields.u16(94));
    let least = match version.1 {
        0..=2 => MIN_HEADER_LEN,
        3 => 235,
        _ => 375,
    };
    if header_len < least || header_len > file_len {
        let expected = format!("{least} to the file's {file_len} bytes");
        return Err(refuse("header size", 94, header_len, expected, REWRITE));
    }
    let points_at = u64::from(fields.u32(96));
    if points_at < header_len || points_at > file_len {
        let expected = format!("{header_len} to the file's {file_len} bytes");
        return Err(refuse("offset to point data", 96, points_at, expected, GET_AGAIN));
    }
    Ok((header_len, points_at))
}

fn check_record_len(fields: &Fields<'_>, layout: Layout) -> Result<u16, Error> {
    let found = fields.u16(105);
    if found >= layout.len {
        return Ok(found);
    }
    let expected = format!("at least {} for point format {}", layout.len, layout.format);
    Err(refuse("point data record length", 105, found, expected, REWRITE))
}

fn check_scale(fields: &Fields<'_>) -> Result<[f64; 3], Error> {
    let names = ["x scale factor", "y scale factor", "z scale factor"];
    let mut scale = [0.0; 3];
    for axis in 0..3 {
        let at = 131 + 8 * axis;
        let value = fields.f64(at);
        // A negative scale mirrors the cloud; no writer does it, and zero puts all points in one place.
        if !(value.is_finite() && value > 0.0) {
            let expected = "a positive finite number";
            return Err(refuse(names[axis], at as u64, value, expected, REWRITE));
        }
        scale[axis] = value;
    }
    Ok(scale)
}

fn check_offset(fields: &Fields<'_>) -> Result<[f64; 3], Error> {
    let names = ["x offset", "y offset", "z offset"];
    let mut offset = [0.0; 3];
    for axis in 0..3 {
        let at = 155 + 8 * axis;
        let value = fields.f64(at);
        if !value.is_finite() {
            return Err(refuse(names[axis], at as u64, value, "a finite number", REWRITE));
        }
        offset[axis] = value;
    }
    Ok(offset)
}

/// LAS 1.4 counts in 64 bits and keeps the old field for old readers, where it may be zero.
fn count_points(fields: &Fields<'_>, version: (u8, u8), header_len: u64, notes: &mut Notes) -> u64 {
    let legacy = u64::from(fields.u32(107));
    if version.1 < 4 || header_len < 375 {
        return legacy;
    }
    let count = fields.u64(247);
    if count == 0 {
        return legacy;
    }
    if legacy != 0 && legacy != count {
        notes.say(format!(
            "the header counts {count} points (byte 247) and {legacy} in the field for old readers \
             (byte 107); the first is taken"
        ));
    }
    count
}

fn evlrs(
    fields: &Fields<'_>,
    version: (u8, u8),
    header_len: u64,
    file_len: u64,
    notes: &mut Notes,
) -> Option<(u64, u32)> {
    if version.1 < 4 || header_len < 375 {
        return None;
    }
    let (at, count) = (fields.u64(235), fields.u32(243));
    if count == 0 {
        return None;
    }
    if at < header_len || at >= file_len {
        notes.say(format!(
            "the {count} extended records at byte {at} (header byte 235) lie outside the file of \
             {file_len} bytes and are left out"
        ));
        return None;
    }
    Some((at, count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::LasBytes;

    fn header(bytes: &[u8]) -> Result<(Header, Vec<String>), Error> {
        let mut notes = Notes::default();
        let header = Header::read(&mut std::io::Cursor::new(bytes.to_vec()), &mut notes)?;
        Ok((header, notes.into_messages()))
    }

    fn refused(bytes: &[u8], expected: &str) {
        let message = header(bytes).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }

    #[test]
    fn a_plain_header() {
        let (found, notes) = header(&LasBytes::new((1, 2), 1).points(3).build()).unwrap();
        assert_eq!((found.points, found.record_len, found.points_at), (3, 28, 227));
        assert!(notes.is_empty());
    }

    #[test]
    fn lengths_that_cannot_be_are_named_with_their_byte() {
        let good = LasBytes::new((1, 4), 6).points(2).build();
        let with = |at: usize, bytes: &[u8]| {
            let mut copy = good.clone();
            copy[at..at + bytes.len()].copy_from_slice(bytes);
            copy
        };
        refused(&with(94, &100u16.to_le_bytes()), "`header size` (byte 94) is 100");
        refused(&with(96, &9_000_000u32.to_le_bytes()), "`offset to point data` (byte 96)");
        refused(&with(96, &10u32.to_le_bytes()), "`offset to point data` (byte 96)");
        refused(&with(105, &12u16.to_le_bytes()), "at least 30 for point format 6");
        refused(&with(104, &[33]), "`point data record format` (byte 104) is 33");
        refused(&with(24, &[2, 0]), "is 2.0, expected 1.0 to 1.4");
    }

    #[test]
    fn scales_and_offsets_must_be_usable() {
        let good = LasBytes::new((1, 2), 0).points(1).build();
        for (at, value) in [(131, 0.0), (139, f64::NAN), (147, -0.01), (163, f64::INFINITY)] {
            let mut bytes = good.clone();
            bytes[at..at + 8].copy_from_slice(&f64::to_le_bytes(value));
            refused(&bytes, &format!("(byte {at})"));
        }
    }

    #[test]
    fn a_header_cut_off() {
        refused(&LasBytes::new((1, 2), 0).build()[..200], "at least 227 bytes");
        refused(b"", "an empty file");
    }

    #[test]
    fn the_long_count_wins_over_the_old_one() {
        let mut bytes = LasBytes::new((1, 4), 6).points(2).build();
        bytes[107..111].copy_from_slice(&7u32.to_le_bytes());
        let (found, notes) = header(&bytes).unwrap();
        assert_eq!(found.points, 2);
        assert!(notes[0].contains("7 in the field for old readers"));
    }
}

//! Variable length records, before the points and (LAS 1.4) behind them.
//!
//! ASPRS LAS 1.4-R15, tables 5 and 18. The walk never leaves the file, never trusts a count, and
//! loads only the records it knows.

use crate::header::Header;
use crate::source::Source;
use crate::{Error, Notes};

/// Bytes of a record's head: before the points 54, behind them 60.
const HEAD: u64 = 54;
const EXTENDED_HEAD: u64 = 60;
/// No file seen has more than some hundreds; a walk over more is a walk over garbage.
const MAX_RECORDS: u32 = 65_536;
/// A WKT of more bytes than this is no WKT.
const MAX_DATA: u64 = 1 << 20;

/// User id of LAS's own records and of the CRS.
const PROJECTION: &str = "LASF_Projection";
const SPEC: &str = "LASF_Spec";
const LASZIP: &str = "laszip encoded";
const GEO_KEYS: u16 = 34735;
pub(crate) const GEO_DOUBLES: u16 = 34736;
pub(crate) const GEO_ASCII: u16 = 34737;
const WKT: u16 = 2112;
const EXTRA_BYTES: u16 = 4;
const LASZIP_ID: u16 = 22204;

/// A record's data and where they stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RecordData {
    /// Byte of the file at which the data begin.
    pub at: u64,
    /// The data.
    pub bytes: Vec<u8>,
}

/// The records ingest understands.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Records {
    /// GeoTIFF key directory (34735).
    pub geo_keys: Option<RecordData>,
    /// GeoTIFF double parameters (34736).
    pub geo_doubles: Option<RecordData>,
    /// GeoTIFF text parameters (34737).
    pub geo_ascii: Option<RecordData>,
    /// CRS as well-known text (2112).
    pub wkt: Option<RecordData>,
    /// LASzip's record (22204).
    pub laszip: Option<RecordData>,
    /// Extra byte descriptions (4); some writers use one record for each.
    pub extra_bytes: Vec<RecordData>,
    /// Whether the file says it is a COPC file.
    pub copc: bool,
}

/// One head, common to both kinds.
struct Head {
    user: String,
    id: u16,
    at: u64,
    len: u64,
}

impl Records {
    /// Reads the records of a file whose header has been checked.
    ///
    /// Records that run out of their place end the walk with a note: points can be read without
    /// them, or the missing one is named when it is needed.
    ///
    /// # Errors
    /// [`Error::Io`] only.
    pub fn read(
        source: &mut dyn Source,
        header: &Header,
        notes: &mut Notes,
    ) -> Result<Self, Error> {
        let mut records = Self::default();
        let place = Walk { from: header.header_len, to: header.points_at, head: HEAD };
        place.walk(source, header.vlrs, "variable length", notes, &mut records)?;
        if let Some((at, count)) = header.evlrs {
            let place = Walk { from: at, to: header.file_len, head: EXTENDED_HEAD };
            place.walk(source, count, "extended variable length", notes, &mut records)?;
        }
        Ok(records)
    }

    fn keep(&mut self, source: &mut dyn Source, head: &Head) -> Result<(), Error> {
        let known = match (head.user.as_str(), head.id) {
            (PROJECTION, GEO_KEYS) => Some(&mut self.geo_keys),
            (PROJECTION, GEO_DOUBLES) => Some(&mut self.geo_doubles),
            (PROJECTION, GEO_ASCII) => Some(&mut self.geo_ascii),
            (PROJECTION, WKT) => Some(&mut self.wkt),
            (LASZIP, LASZIP_ID) => Some(&mut self.laszip),
            _ => None,
        };
        // The first of several records of one kind counts, as in PDAL and lasR.
        if let Some(slot) = known {
            if slot.is_none() {
                *slot = load(source, head)?;
            }
            return Ok(());
        }
        match (head.user.as_str(), head.id) {
            (SPEC, EXTRA_BYTES) => self.extra_bytes.extend(load(source, head)?),
            ("copc", 1) => self.copc = true,
            _ => {}
        }
        Ok(())
    }
}

/// Where a list of records stands.
struct Walk {
    from: u64,
    to: u64,
    head: u64,
}

impl Walk {
    fn walk(
        &self,
        source: &mut dyn Source,
        count: u32,
        what: &str,
        notes: &mut Notes,
        records: &mut Records,
    ) -> Result<(), Error> {
        let mut at = self.from;
        for index in 0..count {
            let room = self.to.saturating_sub(at);
            let head = if room < self.head || index == MAX_RECORDS {
                None
            } else {
                Some(self.read_head(source, at)?)
            };
            match head.filter(|head| head.len <= room - self.head) {
                None => {
                    notes.say(format!(
                        "the header promises {count} {what} records, record {} at byte {at} does \
                         not fit before byte {}; it and all after it are left out",
                        index + 1,
                        self.to
                    ));
                    return Ok(());
                }
                Some(head) => {
                    at = head.at + head.len;
                    records.keep(source, &head)?;
                }
            }
        }
        Ok(())
    }

    fn read_head(&self, source: &mut dyn Source, at: u64) -> Result<Head, Error> {
        let mut bytes = [0; EXTENDED_HEAD as usize];
        let bytes = &mut bytes[..self.head as usize];
        source.read_at(at, bytes, "a variable length record")?;
        let name = bytes[2..18].split(|byte| *byte == 0).next().unwrap_or_default();
        let mut len = [0; 8];
        let size = if self.head == HEAD { 2 } else { 8 };
        len[..size].copy_from_slice(&bytes[20..20 + size]);
        Ok(Head {
            user: String::from_utf8_lossy(name).into_owned(),
            id: u16::from_le_bytes([bytes[18], bytes[19]]),
            at: at + self.head,
            len: u64::from_le_bytes(len),
        })
    }
}

fn load(source: &mut dyn Source, head: &Head) -> Result<Option<RecordData>, Error> {
    if head.len > MAX_DATA {
        return Ok(None);
    }
    let mut bytes = vec![0; head.len as usize];
    source.read_at(head.at, &mut bytes, &format!("record {}/{}", head.user, head.id))?;
    Ok(Some(RecordData { at: head.at, bytes }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::LasBytes;

    fn records(bytes: Vec<u8>) -> (Records, Vec<String>) {
        let mut notes = Notes::default();
        let mut source = std::io::Cursor::new(bytes);
        let header = Header::read(&mut source, &mut notes).unwrap();
        let records = Records::read(&mut source, &header, &mut notes).unwrap();
        (records, notes.into_messages())
    }

    #[test]
    fn known_records_are_kept_and_others_skipped() {
        let bytes = LasBytes::new((1, 2), 1)
            .vlr("someone", 7, &[1; 300])
            .vlr(PROJECTION, WKT, b"LOCAL_CS[\"x\"]\0")
            .build();
        let (records, notes) = records(bytes);
        assert_eq!(records.wkt.unwrap().bytes, b"LOCAL_CS[\"x\"]\0");
        assert!(notes.is_empty());
    }

    /// A count of a thousand million makes other readers loop for minutes.
    #[test]
    fn a_garbage_count_of_records_ends_at_once() {
        let mut bytes = LasBytes::new((1, 2), 0).points(2).build();
        bytes[100..104].copy_from_slice(&1_069_128_089u32.to_le_bytes());
        let (found, notes) = records(bytes);
        assert_eq!(found, Records::default());
        assert!(notes[0].contains("promises 1069128089"), "{notes:?}");
    }

    #[test]
    fn a_record_longer_than_its_place_is_left_out() {
        let mut bytes = LasBytes::new((1, 2), 0).vlr(PROJECTION, WKT, b"abc").points(1).build();
        bytes[227 + 20..227 + 22].copy_from_slice(&60_000u16.to_le_bytes());
        let (found, notes) = records(bytes);
        assert!(found.wkt.is_none());
        assert!(
            notes[0].contains("record 1 at byte 227 does not fit before byte 284"),
            "{notes:?}"
        );
    }

    #[test]
    fn extended_records_are_read_too() {
        let (found, _) =
            records(LasBytes::new((1, 4), 6).points(1).evlr(PROJECTION, WKT, b"PROJCS[]").build());
        assert_eq!(found.wkt.unwrap().bytes, b"PROJCS[]");
    }
}

//! GeoTIFF keys of a LAS file.
//!
//! Ritter and Ruth, GeoTIFF 1.0, section 2.4 and appendix 6; in LAS the three TIFF tags are the
//! records 34735 to 34737.

use crate::crs::{Said, UnitChoice, exact_unit};
use crate::epsg::{self, INTERNATIONAL_FOOT_M, US_SURVEY_FOOT_M};
use crate::params::LengthUnit;
use crate::vlr::{GEO_ASCII, GEO_DOUBLES, Records};
use crate::{Error, Notes};
use std::collections::BTreeMap;

const MODEL: u16 = 1024;
const CITATION: u16 = 1026;
const GEOGRAPHIC: u16 = 2048;
const GEOGRAPHIC_CITATION: u16 = 2049;
const PROJECTED: u16 = 3072;
const PROJECTED_CITATION: u16 = 3073;
const LINEAR_UNITS: u16 = 3076;
const LINEAR_UNIT_SIZE: u16 = 3077;
const VERTICAL: u16 = 4096;
const VERTICAL_UNITS: u16 = 4099;
const MODEL_GEOGRAPHIC: u16 = 2;
const MODEL_GEOCENTRIC: u16 = 3;
const USER_DEFINED: u16 = 32767;
/// EPSG codes of units of length lie in this range.
const EPSG_UNITS: std::ops::RangeInclusive<u16> = 9001..=9099;

#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    location: u16,
    count: u16,
    value: u16,
}

/// The keys of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct GeoKeys {
    entries: BTreeMap<u16, Entry>,
    doubles: Vec<f64>,
    ascii: Vec<u8>,
}

impl GeoKeys {
    /// The keys of a file; `None` when there are none.
    pub(crate) fn parse(records: &Records, notes: &mut Notes) -> Option<Self> {
        let directory = records.geo_keys.as_ref()?;
        let shorts: Vec<u16> =
            directory.bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        let promised = usize::from(*shorts.get(3)?);
        let rows = shorts[4..].chunks_exact(4);
        if promised > rows.len() {
            notes.say(format!(
                "the GeoTIFF key directory (byte {}) promises {promised} keys and holds {}",
                directory.at,
                rows.len()
            ));
        }
        let mut keys = Self::default();
        for row in rows.take(promised) {
            let entry = Entry { location: row[1], count: row[2], value: row[3] };
            keys.entries.entry(row[0]).or_insert(entry);
        }
        let bytes = |data: &Option<crate::vlr::RecordData>| {
            data.as_ref().map(|data| data.bytes.clone()).unwrap_or_default()
        };
        keys.ascii = bytes(&records.geo_ascii);
        let double =
            |b: &[u8]| f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]]);
        keys.doubles = bytes(&records.geo_doubles).chunks_exact(8).map(double).collect();
        (!keys.entries.is_empty()).then_some(keys)
    }

    fn short(&self, key: u16) -> Option<u16> {
        self.entries.get(&key).filter(|entry| entry.location == 0).map(|entry| entry.value)
    }

    /// A code; 0 (undefined) and 32767 (user-defined) are none.
    fn code(&self, key: u16) -> Option<u32> {
        self.short(key).filter(|code| !matches!(*code, 0 | USER_DEFINED)).map(u32::from)
    }

    fn double(&self, key: u16) -> Option<f64> {
        let entry = self.entries.get(&key).filter(|entry| entry.location == GEO_DOUBLES)?;
        self.doubles.get(usize::from(entry.value)).copied()
    }

    fn text(&self, key: u16) -> Option<String> {
        let entry = self.entries.get(&key).filter(|entry| entry.location == GEO_ASCII)?;
        let from = usize::from(entry.value);
        let to = (from + usize::from(entry.count)).min(self.ascii.len());
        let text = String::from_utf8_lossy(self.ascii.get(from..to)?);
        let text = text.trim_matches(|c: char| matches!(c, '\0' | '|') || c.is_whitespace());
        (!text.is_empty()).then(|| text.to_owned())
    }

    /// What the keys say; `None` when they say nothing about the system.
    ///
    /// # Errors
    /// [`Error::Unit`] for units other than metres and feet.
    pub(crate) fn said(&self, units: UnitChoice, notes: &mut Notes) -> Result<Option<Said>, Error> {
        let (projected, geographic) = (self.code(PROJECTED), self.code(GEOGRAPHIC));
        let known = projected.or(geographic).is_some()
            || self.entries.contains_key(&LINEAR_UNITS)
            || self.entries.contains_key(&PROJECTED);
        if !known && self.short(MODEL).is_none() {
            return Ok(None);
        }
        let not_projected = match self.short(MODEL) {
            Some(MODEL_GEOGRAPHIC) => Some("geographic (degrees)"),
            Some(MODEL_GEOCENTRIC) => Some("geocentric"),
            // Some writers leave out the model and give only the geographic system.
            None if projected.is_none() && geographic.is_some() => Some("geographic (degrees)"),
            _ => None,
        };
        let code = if not_projected.is_some() { geographic } else { projected };
        let mut said = Said { name: self.name(code), epsg: code, not_projected, ..Said::default() };
        if not_projected.is_none() {
            said.horizontal = self.horizontal(projected, units.horizontal, notes)?;
            said.vertical_epsg = self.code(VERTICAL);
            said.vertical = self.vertical(units.vertical, notes)?;
        }
        Ok(Some(said))
    }

    fn name(&self, code: Option<u32>) -> String {
        let citation = self
            .text(PROJECTED_CITATION)
            .or_else(|| self.text(CITATION))
            .or_else(|| self.text(GEOGRAPHIC_CITATION));
        match (citation, code) {
            (Some(text), Some(code)) => format!("{text} (EPSG:{code})"),
            (Some(text), None) => text,
            (None, Some(code)) => format!("EPSG:{code}"),
            (None, None) => "user-defined".to_owned(),
        }
    }

    fn horizontal(
        &self,
        code: Option<u32>,
        choice: LengthUnit,
        notes: &mut Notes,
    ) -> Result<Option<f64>, Error> {
        if let Some(metres) = choice.metres() {
            return Ok(Some(metres));
        }
        let by_code = code.map(epsg::unit_of);
        let stated = match self.unit(LINEAR_UNITS, "horizontal_unit", notes)? {
            Some(metres) => Some(metres),
            None => self.unit_size()?,
        };
        if let Some(metres) = stated {
            if by_code.is_some_and(|by_code| by_code != Some(metres)) {
                notes.say(format!(
                    "the keys give EPSG:{} and a unit of x and y that is not that system's \
                     ({metres} m); the unit is taken, the code may be wrong",
                    code.unwrap_or_default()
                ));
            }
            return Ok(Some(metres));
        }
        let unknown = || Error::Unit {
            place: "ProjectedCSTypeGeoKey (3072)".to_owned(),
            unit: format!("that of EPSG:{}", code.unwrap_or_default()),
            param: "horizontal_unit",
        };
        by_code.map(|by_code| by_code.ok_or_else(unknown)).transpose()
    }

    /// A unit given by its size instead of a code.
    fn unit_size(&self) -> Result<Option<f64>, Error> {
        let Some(size) = self.double(LINEAR_UNIT_SIZE) else { return Ok(None) };
        let unknown = || Error::Unit {
            place: "ProjLinearUnitSizeGeoKey (3077)".to_owned(),
            unit: format!("{size} m"),
            param: "horizontal_unit",
        };
        exact_unit(size).ok_or_else(unknown).map(Some)
    }

    /// A unit given by its EPSG code. Numbers that are no code of a unit are passed over: some
    /// writers put the code of the system there, or all bits set.
    fn unit(&self, key: u16, param: &'static str, notes: &mut Notes) -> Result<Option<f64>, Error> {
        match self.short(key) {
            None | Some(0 | USER_DEFINED) => Ok(None),
            Some(9001) => Ok(Some(1.0)),
            Some(9002) => Ok(Some(INTERNATIONAL_FOOT_M)),
            Some(9003) => Ok(Some(US_SURVEY_FOOT_M)),
            Some(code) if EPSG_UNITS.contains(&code) => {
                let (place, unit) = (format!("GeoTIFF key {key}"), format!("EPSG unit {code}"));
                Err(Error::Unit { place, unit, param })
            }
            Some(code) => {
                notes.say(format!("GeoTIFF key {key} gives the unit {code}, which is no unit"));
                Ok(None)
            }
        }
    }

    fn vertical(&self, choice: LengthUnit, notes: &mut Notes) -> Result<Option<f64>, Error> {
        if let Some(metres) = choice.metres() {
            return Ok(Some(metres));
        }
        if let Some(metres) = self.unit(VERTICAL_UNITS, "vertical_unit", notes)? {
            return Ok(Some(metres));
        }
        Ok(self.code(VERTICAL).and_then(|code| match code {
            // GeoTIFF 1.0's own vertical codes say nothing about the unit.
            ..=5199 => None,
            code => Some(epsg::vertical_foot(code).unwrap_or(1.0)),
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vlr::RecordData;

    fn record(bytes: Vec<u8>) -> Option<RecordData> {
        Some(RecordData { at: 281, bytes })
    }

    fn directory(values: &[u16]) -> Option<RecordData> {
        record(values.iter().flat_map(|v| v.to_le_bytes()).collect())
    }

    #[test]
    fn names_and_sizes_come_from_the_other_two_records() {
        let records = Records {
            geo_keys: directory(&[1, 1, 0, 3, 1024, 0, 1, 1, 3073, 34737, 7, 0, 3077, 34736, 1, 0]),
            geo_doubles: record(0.3048f64.to_le_bytes().to_vec()),
            geo_ascii: record(b"Zone 5|\0".to_vec()),
            ..Records::default()
        };
        let keys = GeoKeys::parse(&records, &mut Notes::default()).unwrap();
        let said = keys.said(UnitChoice::default(), &mut Notes::default()).unwrap().unwrap();
        assert_eq!((said.name.as_str(), said.horizontal), ("Zone 5", Some(0.3048)));
    }

    #[test]
    fn a_directory_that_lies_is_cut() {
        let records =
            Records { geo_keys: directory(&[1, 1, 0, 900, 1024, 0, 1, 1]), ..Records::default() };
        let mut notes = Notes::default();
        let keys = GeoKeys::parse(&records, &mut notes).unwrap();
        assert_eq!(keys.entries.len(), 1);
        assert!(notes.messages()[0].contains("promises 900 keys and holds 1"));
    }

    #[test]
    fn empty_directories_say_nothing() {
        for values in [&[][..], &[1, 1, 0][..], &[1, 1, 0, 0][..]] {
            let records = Records { geo_keys: directory(values), ..Records::default() };
            assert_eq!(GeoKeys::parse(&records, &mut Notes::default()), None);
        }
    }

    #[test]
    fn a_unit_that_is_none_is_passed_over_and_one_that_contradicts_is_said() {
        let said = |values: &[u16]| {
            let records = Records { geo_keys: directory(values), ..Records::default() };
            let mut notes = Notes::default();
            let keys = GeoKeys::parse(&records, &mut notes).unwrap();
            let said = keys.said(UnitChoice::default(), &mut notes).unwrap().unwrap();
            (said.horizontal, notes.into_messages())
        };
        let (unit, notes) = said(&[1, 1, 0, 2, 1024, 0, 1, 1, 3076, 0, 1, 32632]);
        assert_eq!(unit, None);
        assert!(notes[0].contains("unit 32632, which is no unit"), "{notes:?}");
        let (unit, notes) = said(&[1, 1, 0, 2, 3072, 0, 1, 26995, 3076, 0, 1, 9003]);
        assert_eq!(unit, Some(US_SURVEY_FOOT_M));
        assert!(notes[0].contains("EPSG:26995"), "{notes:?}");
    }

    #[test]
    fn keys_that_point_outside_are_none() {
        let records = Records {
            geo_keys: directory(&[1, 1, 0, 2, 3073, 34737, 9, 60000, 3077, 34736, 1, 77]),
            ..Records::default()
        };
        let keys = GeoKeys::parse(&records, &mut Notes::default()).unwrap();
        assert_eq!((keys.text(3073), keys.double(3077)), (None, None));
    }
}

//! GeoTIFF keys (OGC 19-008r4), as used by GeoTIFF files and by LAS files before 1.4.

use crate::crs::{Horizontal, unit_code};
use timberline_artefact::Crs;

/// Keys, by number, as the standard's annex lists them.
mod key {
    pub(super) const MODEL_TYPE: u16 = 1024;
    pub(super) const RASTER_TYPE: u16 = 1025;
    pub(super) const CITATION: u16 = 1026;
    pub(super) const GEODETIC_CRS: u16 = 2048;
    pub(super) const PROJECTED_CRS: u16 = 3072;
    pub(super) const PROJECTED_CITATION: u16 = 3073;
    pub(super) const LINEAR_UNITS: u16 = 3076;
    pub(super) const VERTICAL_CRS: u16 = 4096;
    pub(super) const VERTICAL_UNITS: u16 = 4099;
}

/// The value that says "user-defined".
const USER_DEFINED: u16 = 32767;
/// EPSG code of the metre.
const METRE: u16 = 9001;
/// TIFF tag and LAS record of the ASCII parameters.
const ASCII_PARAMS: u16 = 34737;

/// The key directory and the text it points into.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GeoKeys {
    /// `GeoKeyDirectoryTag`: header of four, then four numbers a key.
    pub directory: Vec<u16>,
    /// `GeoAsciiParamsTag`: texts, each ended by `|`.
    pub ascii: String,
}

/// What the keys describe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Purpose {
    /// Whether they belong to a raster (then cells are areas).
    pub raster: bool,
    /// Whether values or z are elevations, so that a vertical system belongs to them.
    pub elevation: bool,
}

impl GeoKeys {
    /// The keys of a CRS.
    ///
    /// Without an EPSG code the system is user-defined and its text goes into the citation, in the
    /// form `ESRI PE String = WKT` that GDAL and Esri's programs read.
    #[must_use]
    pub fn of(crs: &Crs, purpose: Purpose) -> Self {
        let mut keys = Builder::default();
        let system = Horizontal::of(crs);
        let code = system.epsg.and_then(|code| u16::try_from(code).ok());
        keys.number(key::MODEL_TYPE, if system.geographic { 2 } else { 1 });
        if purpose.raster {
            keys.number(key::RASTER_TYPE, 1);
        }
        keys.text(key::CITATION, &system.name);
        if system.geographic {
            keys.number(key::GEODETIC_CRS, code.unwrap_or(USER_DEFINED));
        } else {
            keys.number(key::PROJECTED_CRS, code.unwrap_or(USER_DEFINED));
            if let (None, Some(wkt)) = (code, &system.wkt) {
                keys.text(key::PROJECTED_CITATION, &format!("ESRI PE String = {wkt}"));
            }
            keys.number(key::LINEAR_UNITS, unit_code(crs.horizontal_m_per_unit));
        }
        let vertical = crs.vertical_epsg.and_then(|code| u16::try_from(code).ok());
        let vertical_unit = unit_code(crs.vertical_m_per_unit);
        if let (true, Some(vertical)) = (purpose.elevation, vertical) {
            keys.number(key::VERTICAL_CRS, vertical);
        }
        // Metres need no saying: the key alone makes readers invent a vertical system.
        if purpose.elevation && (vertical.is_some() || vertical_unit != METRE) {
            keys.number(key::VERTICAL_UNITS, vertical_unit);
        }
        keys.finish()
    }
}

#[derive(Default)]
struct Builder {
    entries: Vec<[u16; 4]>,
    ascii: String,
}

impl Builder {
    fn number(&mut self, key: u16, value: u16) {
        self.entries.push([key, 0, 1, value]);
    }

    /// Texts are ASCII and separated by `|`, which therefore cannot occur in them.
    fn text(&mut self, key: u16, text: &str) {
        let clean = |c: char| if c.is_ascii_graphic() || c == ' ' { c } else { '?' };
        let text: String =
            text.chars().map(clean).map(|c| if c == '|' { '/' } else { c }).collect();
        let (length, offset) = (text.len() + 1, self.ascii.len());
        if let (Ok(length), Ok(offset)) = (u16::try_from(length), u16::try_from(offset)) {
            self.entries.push([key, ASCII_PARAMS, length, offset]);
            self.ascii.push_str(&text);
            self.ascii.push('|');
        }
    }

    fn finish(self) -> GeoKeys {
        // Version 1, revision 1.1 (GeoTIFF 1.1), then the number of keys.
        let mut directory = vec![1, 1, 1, self.entries.len() as u16];
        directory.extend(self.entries.iter().flatten());
        GeoKeys { directory, ascii: self.ascii }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DTM: Purpose = Purpose { raster: true, elevation: true };

    #[test]
    fn a_coded_system() {
        let crs = Crs { epsg: Some(3005), vertical_epsg: Some(5703), ..Crs::default() };
        let keys = GeoKeys::of(&crs, DTM);
        assert_eq!(keys.ascii, "NAD83 / BC Albers|");
        let expected = [
            1, 1, 1, 7, 1024, 0, 1, 1, 1025, 0, 1, 1, 1026, 34737, 18, 0, 3072, 0, 1, 3005, 3076,
            0, 1, 9001, 4096, 0, 1, 5703, 4099, 0, 1, 9001,
        ];
        assert_eq!(keys.directory, expected);
    }

    #[test]
    fn a_text_without_a_code_is_cited() {
        let wkt = "PROJCS[\"mine\",GEOGCS[\"g\"],UNIT[\"metre\",1]]".to_owned();
        let keys = GeoKeys::of(&Crs { wkt: Some(wkt), ..Crs::default() }, DTM);
        assert!(keys.ascii.contains("ESRI PE String = PROJCS["));
        assert!(keys.directory.windows(4).any(|entry| entry == [3072, 0, 1, 32767]));
    }

    #[test]
    fn keys_ascend() {
        let keys = GeoKeys::of(&Crs { epsg: Some(4326), ..Crs::default() }, DTM);
        let ids: Vec<u16> = keys.directory[4..].chunks(4).map(|entry| entry[0]).collect();
        assert!(ids.is_sorted());
    }
}

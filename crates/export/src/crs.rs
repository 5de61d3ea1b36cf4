//! What the formats need to know about a CRS: its horizontal part, EPSG code and text.
//!
//! A [`Crs`] is kept as it came from the files. Rasters and layers are two-dimensional, so of a
//! compound system they carry the horizontal part. Where the files gave only a code, the text comes
//! from the public EPSG definitions in the crate `crs-definitions`.

use timberline_artefact::Crs;

/// A CRS seen from the plane.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Horizontal {
    /// EPSG code, when there is one.
    pub epsg: Option<u32>,
    /// Well-known text of the horizontal system, when known.
    pub wkt: Option<String>,
    /// Whether coordinates are degrees.
    pub geographic: bool,
    /// A name for people.
    pub name: String,
}

/// Keywords that begin a horizontal system in WKT 1 and 2.
const HORIZONTAL: [&str; 8] = [
    "PROJCS[",
    "PROJCRS[",
    "PROJECTEDCRS[",
    "GEOGCS[",
    "GEOGCRS[",
    "GEODCRS[",
    "GEOGRAPHICCRS[",
    "LOCAL_CS[",
];

impl Horizontal {
    /// The horizontal part of a CRS.
    #[must_use]
    pub fn of(crs: &Crs) -> Self {
        let given = crs.wkt.as_deref().map(clean).and_then(horizontal_part);
        let epsg = given.and_then(authority).or(crs.epsg.filter(|_| !is_compound(crs)));
        let defined = || Some(crs_definitions::from_code(u16::try_from(epsg?).ok()?)?.wkt);
        let wkt = given.or_else(defined).map(str::to_owned);
        let geographic = wkt.as_deref().is_some_and(|text| text.starts_with("GEO"));
        let name = wkt.as_deref().and_then(quoted_name).unwrap_or(&crs.name).to_owned();
        Self { epsg, wkt, geographic, name }
    }
}

/// The text that a LAS file carries: as it came, or the public definition of the code.
#[must_use]
pub fn full_wkt(crs: &Crs) -> Option<String> {
    match crs.wkt.as_deref().map(clean) {
        Some(text) if !text.is_empty() => Some(text.to_owned()),
        _ => Horizontal::of(crs).wkt,
    }
}

/// Code of a length unit in the EPSG register (metre, foot, US survey foot), by its size.
#[must_use]
pub fn unit_code(m_per_unit: f64) -> u16 {
    const FOOT: f64 = 0.3048;
    const SURVEY_FOOT: f64 = 1200.0 / 3937.0;
    if (m_per_unit - SURVEY_FOOT).abs() < 1e-8 {
        9003
    } else if (m_per_unit - FOOT).abs() < 1e-8 {
        9002
    } else {
        9001
    }
}

/// Name of a length unit, by its size.
#[must_use]
pub fn unit_name(m_per_unit: f64) -> &'static str {
    match unit_code(m_per_unit) {
        9002 => "foot",
        9003 => "US survey foot",
        _ => "metre",
    }
}

fn clean(text: &str) -> &str {
    text.trim_end_matches('\0').trim()
}

fn is_compound(crs: &Crs) -> bool {
    crs.wkt.as_deref().is_some_and(|text| clean(text).starts_with("COMP"))
}

/// The first horizontal system inside a text, brackets balanced.
fn horizontal_part(text: &str) -> Option<&str> {
    let start = HORIZONTAL.iter().filter_map(|keyword| text.find(keyword)).min()?;
    let text = &text[start..];
    let (mut depth, mut quoted) = (0_u32, false);
    for (place, byte) in text.bytes().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b'[' if !quoted => depth += 1,
            b']' if !quoted => {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return Some(&text[..=place]);
                }
            }
            _ => {}
        }
    }
    None
}

/// The EPSG code of a system: the last `AUTHORITY["EPSG","n"]` or `ID["EPSG",n]` at its own level.
fn authority(system: &str) -> Option<u32> {
    let body = system.strip_suffix(']')?;
    let start = [body.rfind("AUTHORITY["), body.rfind("ID[")].into_iter().flatten().max()?;
    let tail = &body[start..];
    let depth_before = body[..start].matches('[').count() - body[..start].matches(']').count();
    if depth_before != 1 || !tail.contains("\"EPSG\"") {
        return None;
    }
    let digits: String = tail.rsplit(',').next()?.chars().filter(char::is_ascii_digit).collect();
    digits.parse().ok()
}

fn quoted_name(system: &str) -> Option<&str> {
    system.split('"').nth(1).filter(|name| !name.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crs(wkt: Option<&str>, epsg: Option<u32>) -> Crs {
        Crs { wkt: wkt.map(str::to_owned), epsg, ..Crs::default() }
    }

    #[test]
    fn a_code_alone_gets_its_public_text() {
        let found = Horizontal::of(&crs(None, Some(32610)));
        assert_eq!((found.epsg, found.geographic), (Some(32610), false));
        assert_eq!(found.name, "WGS 84 / UTM zone 10N");
        assert!(found.wkt.unwrap().starts_with("PROJCS["));
    }

    #[test]
    fn of_a_compound_system_the_horizontal_part_is_taken() {
        let text = "COMPD_CS[\"a + b\",PROJCS[\"a [x]\",GEOGCS[\"g\",AUTHORITY[\"EPSG\",\"4269\"]],\
                    AUTHORITY[\"EPSG\",\"26911\"]],VERT_CS[\"b\",AUTHORITY[\"EPSG\",\"5703\"]],\
                    AUTHORITY[\"EPSG\",\"9999\"]]\0";
        let found = Horizontal::of(&crs(Some(text), Some(9999)));
        assert_eq!((found.epsg, found.name.as_str()), (Some(26911), "a [x]"));
        assert!(found.wkt.unwrap().ends_with("\"26911\"]]"));
        assert_eq!(full_wkt(&crs(Some(text), None)).unwrap(), text.trim_end_matches('\0'));
    }

    #[test]
    fn a_system_without_a_code_keeps_its_text() {
        let text = "PROJCS[\"mine\",GEOGCS[\"g\",AUTHORITY[\"EPSG\",\"4269\"]],UNIT[\"metre\",1]]";
        let found = Horizontal::of(&crs(Some(text), None));
        assert_eq!((found.epsg, found.wkt.as_deref()), (None, Some(text)));
    }

    #[test]
    fn wkt_2_and_degrees() {
        let text = "GEOGCRS[\"WGS 84\",DATUM[\"d\",ELLIPSOID[\"e\",1,2]],ID[\"EPSG\",4326]]";
        let found = Horizontal::of(&crs(Some(text), None));
        assert_eq!((found.epsg, found.geographic), (Some(4326), true));
    }

    #[test]
    fn nothing_known() {
        let found = Horizontal::of(&Crs::default());
        assert_eq!((found.epsg, found.wkt), (None, None));
        assert_eq!(
            [unit_code(1.0), unit_code(0.3048), unit_code(1200.0 / 3937.0)],
            [9001, 9002, 9003]
        );
    }
}

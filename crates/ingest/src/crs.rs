//! The coordinate reference system of a file and the units of its coordinates.

use crate::epsg::{self, INTERNATIONAL_FOOT_M, US_SURVEY_FOOT_M};
use crate::geokeys::GeoKeys;
use crate::header::Header;
use crate::params::LengthUnit;
use crate::vlr::Records;
use crate::wkt::Node;
use crate::{Error, Notes};
use timberline_artefact::Crs;

/// What one record says about the system.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Said {
    pub(crate) name: String,
    pub(crate) epsg: Option<u32>,
    pub(crate) vertical_epsg: Option<u32>,
    /// Metres in a unit of x and y.
    pub(crate) horizontal: Option<f64>,
    /// Metres in a unit of z.
    pub(crate) vertical: Option<f64>,
    /// Set when the system is not projected: what it is instead.
    pub(crate) not_projected: Option<&'static str>,
}

/// Units given by the user in place of the file's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UnitChoice {
    /// Unit of x and y.
    pub horizontal: LengthUnit,
    /// Unit of z.
    pub vertical: LengthUnit,
}

/// The system of a file: from WKT where the header says so or nothing else is there, else from
/// GeoTIFF keys (LAS 1.4-R15, section 2.4).
///
/// A file without any is taken to be in metres, with a note.
///
/// # Errors
/// [`Error::NotProjected`] for longitude and latitude; [`Error::Unit`] for unknown units.
pub fn crs_of(
    header: &Header,
    records: &Records,
    units: UnitChoice,
    notes: &mut Notes,
) -> Result<Crs, Error> {
    let text = wkt_text(records);
    let by_wkt = match text.as_deref().map(|text| (text, Node::parse(text))) {
        Some((_, Some(node))) => Some(said_by_wkt(&node, units)?),
        Some((text, None)) => {
            let start: String = text.chars().take(40).collect();
            notes.say(format!("the WKT record cannot be understood (`{start}...`)"));
            None
        }
        None => None,
    };
    let keys = GeoKeys::parse(records, notes);
    let by_keys = keys.map(|keys| keys.said(units, notes)).transpose()?.flatten();
    let wkt_first = header.says_wkt() || by_keys.is_none();
    let agree = compare(by_wkt.as_ref(), by_keys.as_ref(), wkt_first, notes);
    // A text that was not understood, or was overruled, must not come out again with the results.
    let text = text.filter(|_| by_wkt.is_some() && (wkt_first || agree));
    let (first, second) = if wkt_first { (by_wkt, by_keys) } else { (by_keys, by_wkt) };
    let Some(said) = first.or(second) else {
        notes.say("the file names no coordinate reference system; metres are assumed");
        return Ok(with_units(Crs::default(), units));
    };
    if let Some(what) = said.not_projected {
        return Err(Error::NotProjected { name: said.name, what });
    }
    Ok(build(said, text, units, notes))
}

/// The system that a text names, for formats that have nothing else; unknown for other texts.
///
/// # Errors
/// [`Error::NotProjected`] for longitude and latitude; [`Error::Unit`] for unknown units.
pub(crate) fn crs_of_wkt(text: &str, units: UnitChoice, notes: &mut Notes) -> Result<Crs, Error> {
    let text = text.trim();
    let Some(node) = Node::parse(text) else {
        if !text.is_empty() {
            let start: String = text.chars().take(40).collect();
            notes.say(format!("the coordinate system cannot be understood (`{start}`)"));
        }
        return Ok(with_units(Crs::default(), units));
    };
    let said = said_by_wkt(&node, units)?;
    match said.not_projected {
        Some(what) => Err(Error::NotProjected { name: said.name, what }),
        None => Ok(build(said, Some(text.to_owned()), units, notes)),
    }
}

fn wkt_text(records: &Records) -> Option<String> {
    let data = records.wkt.as_ref()?;
    let text = String::from_utf8_lossy(&data.bytes);
    let text = text.trim_matches(|c: char| c == '\0' || c.is_whitespace());
    (!text.is_empty()).then(|| text.to_owned())
}

fn build(said: Said, wkt: Option<String>, units: UnitChoice, notes: &mut Notes) -> Crs {
    let horizontal = said.horizontal.unwrap_or_else(|| {
        notes.say("the unit of x and y is not given; metres are assumed");
        1.0
    });
    let vertical = said.vertical.unwrap_or_else(|| {
        if horizontal != 1.0 && units.vertical == LengthUnit::Auto {
            notes.say(format!(
                "the unit of z is not given; that of x and y ({horizontal} m) is taken, set \
                 `vertical_unit` if the heights are in another"
            ));
        }
        horizontal
    });
    let crs = Crs {
        wkt,
        epsg: said.epsg,
        vertical_epsg: said.vertical_epsg,
        name: said.name,
        horizontal_m_per_unit: horizontal,
        vertical_m_per_unit: vertical,
    };
    with_units(crs, units)
}

pub(crate) fn with_units(mut crs: Crs, units: UnitChoice) -> Crs {
    if let Some(metres) = units.horizontal.metres() {
        crs.horizontal_m_per_unit = metres;
    }
    if let Some(metres) = units.vertical.metres() {
        crs.vertical_m_per_unit = metres;
    }
    crs
}

/// Says where two records of one file disagree; whether they agree.
fn compare(wkt: Option<&Said>, keys: Option<&Said>, wkt_first: bool, notes: &mut Notes) -> bool {
    let (Some(wkt), Some(keys)) = (wkt, keys) else { return true };
    let mut agree = true;
    let taken = if wkt_first { "WKT" } else { "GeoTIFF keys" };
    let mut differ = |what: &str, a: String, b: String| {
        agree = false;
        notes.say(format!("{what}: WKT says {a}, GeoTIFF keys say {b}; the {taken} are taken"));
    };
    if let (Some(a), Some(b)) = (wkt.horizontal, keys.horizontal)
        && a != b
    {
        differ("unit of x and y", format!("{a} m"), format!("{b} m"));
    }
    if let (Some(a), Some(b)) = (wkt.vertical, keys.vertical)
        && a != b
    {
        differ("unit of z", format!("{a} m"), format!("{b} m"));
    }
    if let (Some(a), Some(b)) = (wkt.epsg, keys.epsg)
        && a != b
    {
        differ("system", format!("EPSG:{a}"), format!("EPSG:{b}"));
    }
    agree
}

const PROJECTED: [&str; 3] = ["PROJCS", "PROJCRS", "PROJECTEDCRS"];
const GEOGRAPHIC: [&str; 5] = ["GEOGCS", "GEOGCRS", "GEOGRAPHICCRS", "GEODCRS", "GEODETICCRS"];
const VERTICAL: [&str; 3] = ["VERT_CS", "VERTCRS", "VERTICALCRS"];
const LENGTH_UNIT: [&str; 2] = ["LENGTHUNIT", "UNIT"];

fn said_by_wkt(node: &Node, units: UnitChoice) -> Result<Said, Error> {
    match node.key.as_str() {
        "COMPD_CS" | "COMPOUNDCRS" => said_by_compound(node, units),
        "BOUNDCRS" => match node.child(&["SOURCECRS"]).and_then(|source| source.children.first()) {
            Some(inner) => said_by_wkt(inner, units),
            None => Ok(Said { name: node.name().to_owned(), ..Said::default() }),
        },
        _ => said_by_horizontal(node, units),
    }
}

fn said_by_compound(node: &Node, units: UnitChoice) -> Result<Said, Error> {
    let is_vertical = |child: &&Node| VERTICAL.contains(&child.key.as_str());
    let systems = || {
        node.children.iter().filter(|child| {
            !matches!(child.key.as_str(), "AUTHORITY" | "ID" | "EXTENSION" | "REMARK")
        })
    };
    let mut said = match systems().find(|child| !is_vertical(child)) {
        Some(horizontal) => said_by_wkt(horizontal, units)?,
        None => Said::default(),
    };
    said.epsg = said.epsg.or_else(|| node.epsg());
    said.name = node.name().to_owned();
    if let Some(vertical) = systems().find(is_vertical) {
        said.vertical_epsg = vertical.epsg();
        said.vertical = unit_of_node(vertical, "vertical_unit", units.vertical)?;
    }
    Ok(said)
}

fn said_by_horizontal(node: &Node, units: UnitChoice) -> Result<Said, Error> {
    let key = node.key.as_str();
    let mut said = Said { name: node.name().to_owned(), epsg: node.epsg(), ..Said::default() };
    if VERTICAL.contains(&key) {
        said.vertical_epsg = said.epsg.take();
        said.vertical = unit_of_node(node, "vertical_unit", units.vertical)?;
        return Ok(said);
    }
    if key == "GEOCCS" || is_geocentric(node) {
        said.not_projected = Some("geocentric");
    } else if GEOGRAPHIC.contains(&key) {
        said.not_projected = Some("geographic (degrees)");
    } else {
        said.horizontal = unit_of_node(node, "horizontal_unit", units.horizontal)?;
        if said.horizontal.is_none() && PROJECTED.contains(&key) {
            said.horizontal = said.epsg.and_then(epsg::unit_of);
        }
    }
    Ok(said)
}

fn is_geocentric(node: &Node) -> bool {
    let cartesian =
        node.child(&["CS"]).is_some_and(|cs| cs.name().eq_ignore_ascii_case("cartesian"));
    GEOGRAPHIC.contains(&node.key.as_str()) && cartesian
}

/// The unit of a system: its own, or that of its first axis (WKT 2 allows both).
fn unit_of_node(
    node: &Node,
    param: &'static str,
    choice: LengthUnit,
) -> Result<Option<f64>, Error> {
    if let Some(metres) = choice.metres() {
        return Ok(Some(metres));
    }
    let axis = || node.child(&["AXIS"]).and_then(|axis| axis.child(&LENGTH_UNIT));
    let Some(unit) = node.child(&LENGTH_UNIT).or_else(axis) else { return Ok(None) };
    let factor = unit.values.get(1).and_then(|value| value.parse().ok());
    match factor.and_then(exact_unit) {
        Some(metres) => Ok(Some(metres)),
        None => Err(Error::Unit {
            place: format!("WKT of `{}`", node.name()),
            unit: unit.values.join(", "),
            param,
        }),
    }
}

/// Metres in a unit written with few digits: the exact value of those in use; `None` for others.
pub(crate) fn exact_unit(metres: f64) -> Option<f64> {
    // Writers give 0.3048006 to 0.30480060960121924; the two feet differ by 6e-7.
    const DIGITS: f64 = 5e-8;
    [1.0, INTERNATIONAL_FOOT_M, US_SURVEY_FOOT_M]
        .into_iter()
        .find(|known| (known - metres).abs() <= DIGITS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::LasBytes;

    fn crs(bytes: Vec<u8>, units: UnitChoice) -> Result<(Crs, Vec<String>), Error> {
        let mut notes = Notes::default();
        let mut source = std::io::Cursor::new(bytes);
        let header = Header::read(&mut source, &mut notes)?;
        let records = Records::read(&mut source, &header, &mut notes)?;
        let crs = crs_of(&header, &records, units, &mut notes)?;
        Ok((crs, notes.into_messages()))
    }

    fn with_wkt(wkt: &str) -> LasBytes {
        LasBytes::new((1, 4), 6).encoding(16).vlr("LASF_Projection", 2112, wkt.as_bytes())
    }

    fn keys(entries: &[[u16; 4]]) -> Vec<u8> {
        let head = [[1, 1, 0, entries.len() as u16]];
        head.iter().chain(entries).flatten().flat_map(|v| v.to_le_bytes()).collect()
    }

    #[test]
    fn a_projected_system_in_metres() {
        let wkt = r#"PROJCS["NAD83 / UTM 10N",GEOGCS["NAD83",UNIT["degree",0.0174]],UNIT["metre",1],AUTHORITY["EPSG","26910"]]"#;
        let (found, notes) = crs(with_wkt(wkt).build(), UnitChoice::default()).unwrap();
        assert_eq!((found.epsg, found.horizontal_m_per_unit), (Some(26910), 1.0));
        assert_eq!((found.wkt.as_deref(), notes.len()), (Some(wkt), 0));
    }

    #[test]
    fn a_compound_of_two_feet() {
        let wkt = r#"COMPD_CS["both",PROJCS["p",UNIT["foot",0.3048]],VERT_CS["v",UNIT["US survey foot",0.3048006],AUTHORITY["EPSG","6360"]]]"#;
        let (found, _) = crs(with_wkt(wkt).build(), UnitChoice::default()).unwrap();
        assert_eq!(found.horizontal_m_per_unit, 0.3048);
        assert_eq!(found.vertical_m_per_unit, 1200.0 / 3937.0);
        assert_eq!(found.vertical_epsg, Some(6360));
    }

    #[test]
    fn degrees_are_refused_with_what_to_do() {
        let wkt = r#"GEOGCRS["WGS 84",CS[ellipsoidal,2],ANGLEUNIT["degree",0.0174]]"#;
        let message = crs(with_wkt(wkt).build(), UnitChoice::default()).unwrap_err().to_string();
        assert!(message.contains("`WGS 84` is geographic") && message.contains("reproject"));
        let bytes = LasBytes::new((1, 2), 0)
            .vlr("LASF_Projection", 34735, &keys(&[[1024, 0, 1, 2], [2048, 0, 1, 4326]]))
            .build();
        let message = crs(bytes, UnitChoice::default()).unwrap_err().to_string();
        assert!(message.contains("EPSG:4326"), "{message}");
    }

    #[test]
    fn an_unknown_unit_can_be_overridden() {
        let las = with_wkt(r#"PROJCS["p",UNIT["fathom",1.8288]]"#).build();
        let message = crs(las.clone(), UnitChoice::default()).unwrap_err().to_string();
        assert!(message.contains("fathom") && message.contains("`horizontal_unit`"), "{message}");
        let units = UnitChoice { horizontal: LengthUnit::Metre, vertical: LengthUnit::Auto };
        assert_eq!(crs(las, units).unwrap().0.horizontal_m_per_unit, 1.0);
    }

    #[test]
    fn keys_in_feet_by_code_and_by_unit() {
        let las = |entries: &[[u16; 4]]| {
            LasBytes::new((1, 2), 0).vlr("LASF_Projection", 34735, &keys(entries)).build()
        };
        let by_code = crs(las(&[[1024, 0, 1, 1], [3072, 0, 1, 2994]]), UnitChoice::default());
        let (found, notes) = by_code.unwrap();
        assert_eq!((found.horizontal_m_per_unit, found.vertical_m_per_unit), (0.3048, 0.3048));
        assert!(notes[0].contains("`vertical_unit`"));
        let by_unit = las(&[[1024, 0, 1, 1], [3076, 0, 1, 9003], [4099, 0, 1, 9001]]);
        let (found, _) = crs(by_unit, UnitChoice::default()).unwrap();
        assert_eq!(found.horizontal_m_per_unit, 1200.0 / 3937.0);
        assert_eq!(found.vertical_m_per_unit, 1.0);
    }

    #[test]
    fn a_conflict_of_records_is_said() {
        let bytes = LasBytes::new((1, 2), 0)
            .vlr("LASF_Projection", 34735, &keys(&[[1024, 0, 1, 1], [3072, 0, 1, 26910]]))
            .vlr("LASF_Projection", 2112, br#"PROJCS["p",UNIT["foot",0.3048]]"#)
            .build();
        let (found, notes) = crs(bytes, UnitChoice::default()).unwrap();
        assert_eq!((found.epsg, found.horizontal_m_per_unit), (Some(26910), 1.0));
        assert!(notes[0].contains("WKT says 0.3048 m, GeoTIFF keys say 1 m"), "{notes:?}");
        assert_eq!(found.wkt, None);
    }

    #[test]
    fn no_record_at_all_means_metres() {
        let (found, notes) = crs(LasBytes::new((1, 2), 0).build(), UnitChoice::default()).unwrap();
        assert!(found.is_unknown());
        assert!(notes[0].contains("metres are assumed"));
    }
}

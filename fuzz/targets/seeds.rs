//! Small LAS and LAZ files to begin from.

use las::point::Format;
use las::{Builder, Color, Point, Version, Vlr, Writer};
use std::error::Error;
use std::io::Cursor;
use std::path::Path;

const WKT: &str = r#"PROJCS["NAD83 / UTM 10N",GEOGCS["NAD83",UNIT["degree",0.0174]],UNIT["metre",1],AUTHORITY["EPSG","26910"]]"#;

/// Writes one file of every version and point format, where the folder does not hold it yet.
pub fn write(folder: &Path) -> Result<(), Box<dyn Error>> {
    std::fs::create_dir_all(folder)?;
    for (minor, formats) in [(0u8, 0..=1u8), (2, 0..=3), (3, 4..=5), (4, 6..=10)] {
        for format in formats {
            for compressed in [false, true] {
                let path = folder.join(format!("1{minor}-{format}-{compressed}"));
                if !path.exists() {
                    std::fs::write(path, file(minor, format, compressed)?)?;
                }
            }
        }
    }
    Ok(())
}

fn file(minor: u8, format: u8, compressed: bool) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut builder = Builder::from(Version::new(1, minor));
    let mut format = Format::new(format)?;
    format.is_compressed = compressed;
    format.extra_bytes = 4;
    builder.point_format = format;
    builder.has_wkt_crs = minor == 4;
    builder.vlrs.push(vlr("LASF_Projection", 2112, WKT.as_bytes().to_vec()));
    let keys: [u16; 12] = [1, 1, 0, 2, 1024, 0, 1, 1, 3072, 0, 1, 26910];
    let keys = keys.iter().flat_map(|key| key.to_le_bytes()).collect();
    builder.vlrs.push(vlr("LASF_Projection", 34735, keys));
    let mut description = vec![0; 192];
    description[2..9].copy_from_slice(&[4, 24, b'd', b'e', b'p', b't', b'h']);
    description[112..120].copy_from_slice(&0.5f64.to_le_bytes());
    builder.vlrs.push(vlr("LASF_Spec", 4, description));
    let mut writer = Writer::new(Cursor::new(Vec::new()), builder.into_header()?)?;
    for i in 0..40 {
        let f = f64::from(i);
        writer.write_point(Point {
            x: f * 3.1,
            y: f * f,
            z: f,
            return_number: 1,
            number_of_returns: 2,
            gps_time: format.has_gps_time.then_some(f),
            color: format.has_color.then(|| Color::new(1, 2, 3)),
            nir: format.has_nir.then_some(7),
            waveform: format.has_waveform.then(Default::default),
            extra_bytes: vec![1, 2, 3, i as u8],
            ..Point::default()
        })?;
    }
    Ok(writer.into_inner()?.into_inner())
}

fn vlr(user: &str, record_id: u16, data: Vec<u8>) -> Vlr {
    Vlr { user_id: user.to_owned(), record_id, data, ..Vlr::default() }
}

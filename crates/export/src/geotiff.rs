//! GeoTIFF (OGC 19-008r4): one band of 32-bit floats, tiled, deflated, with predictor 3.

use crate::geokeys::{GeoKeys, Purpose};
use crate::{Error, Window};
use flate2::{Compression, write::ZlibEncoder};
use std::io::{Seek, Write};
use std::path::Path;
use tiff::encoder::{DirectoryEncoder, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard};
use tiff::tags::Tag;
use timberline_artefact::Crs;

/// What stands for "no value" in files: the usual choice, far outside of elevations and heights.
pub const NODATA: f32 = -9999.0;
/// Edge of a tile inside the file, in cells (a multiple of 16 by TIFF 6.0, section 15).
const TILE: u32 = 256;
/// Deflate level: the default of zlib, as GDAL uses it.
const LEVEL: u32 = 6;
/// Uncompressed size above which the offsets of classic TIFF might not do.
const CLASSIC_LIMIT: u64 = 3 << 30;

/// What a raster file says about itself.
#[derive(Debug, Clone, Copy)]
pub struct RasterSpec<'a> {
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// The cells.
    pub window: Window,
    /// The CRS.
    pub crs: &'a Crs,
    /// Name of the band for people.
    pub description: &'a str,
    /// Unit of the values.
    pub unit: &'a str,
    /// Whether values are elevations in the vertical system of the CRS.
    pub elevation: bool,
}

/// Where a raster's values come from: those of a window, row by row from the south, NaN for none.
pub type Source<'a> = dyn FnMut(Window) -> Result<Vec<f32>, Error> + 'a;

/// Writes a raster, asking for one tile of 256 x 256 cells after the other; `path` is for messages.
///
/// Windows asked for may reach beyond the raster's: cells there must be NaN.
///
/// # Errors
/// [`Error::RasterSize`], [`Error::Tiff`], or what the source returns.
pub fn write_raster(
    out: impl Write + Seek,
    path: &Path,
    spec: &RasterSpec<'_>,
    source: &mut Source<'_>,
) -> Result<(), Error> {
    let Window { columns, rows, .. } = spec.window;
    if spec.window.is_empty() {
        return Err(Error::RasterSize { columns: columns.into(), rows: rows.into() });
    }
    let fail = Error::tiff(path);
    if u64::from(columns) * u64::from(rows) * 4 > CLASSIC_LIMIT {
        let mut encoder = TiffEncoder::new_big(out).map_err(&fail)?;
        write::<_, TiffKindBig>(encoder.image_directory().map_err(&fail)?, path, spec, source)
    } else {
        let mut encoder = TiffEncoder::new(out).map_err(&fail)?;
        write::<_, TiffKindStandard>(encoder.image_directory().map_err(&fail)?, path, spec, source)
    }
}

fn write<W: Write + Seek, K: TiffKind>(
    mut directory: DirectoryEncoder<'_, W, K>,
    path: &Path,
    spec: &RasterSpec<'_>,
    source: &mut Source<'_>,
) -> Result<(), Error> {
    let fail = Error::tiff(path);
    let tiles = write_tiles(&mut directory, path, spec.window, source)?;
    describe_image(&mut directory, spec.window).map_err(&fail)?;
    let offset = |value: u64| K::convert_offset(value);
    let offsets: Vec<_> =
        tiles.iter().map(|tile| offset(tile.0)).collect::<Result<_, _>>().map_err(&fail)?;
    let counts: Vec<_> =
        tiles.iter().map(|tile| offset(tile.1)).collect::<Result<_, _>>().map_err(&fail)?;
    directory.write_tag(Tag::TileOffsets, K::convert_slice(&offsets)).map_err(&fail)?;
    directory.write_tag(Tag::TileByteCounts, K::convert_slice(&counts)).map_err(&fail)?;
    describe_place(&mut directory, spec).map_err(&fail)?;
    directory.finish().map_err(&fail)
}

/// Writes all tiles, north to south, west to east; returns offset and length of each. Empty tiles
/// are all one, so that a raster's gaps take no room.
fn write_tiles<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    path: &Path,
    window: Window,
    source: &mut Source<'_>,
) -> Result<Vec<(u64, u64)>, Error> {
    let mut tiles = Vec::new();
    let mut empty = None;
    for down in 0..window.rows.div_ceil(TILE) {
        for across in 0..window.columns.div_ceil(TILE) {
            let values = source(Window {
                column0: window.column0 + i64::from(across * TILE),
                row0: window.end_row() - i64::from((down + 1) * TILE),
                columns: TILE,
                rows: TILE,
            })?;
            let is_empty = values.iter().all(|value| value.is_nan());
            if let (true, Some(place)) = (is_empty, empty) {
                tiles.push(place);
                continue;
            }
            let bytes = compress(&values).map_err(Error::io(path, "compress"))?;
            let offset = directory.write_data(bytes.as_slice()).map_err(Error::tiff(path))?;
            let place = (offset, bytes.len() as u64);
            if is_empty {
                empty = Some(place);
            }
            tiles.push(place);
        }
    }
    Ok(tiles)
}

/// A tile's bytes: rows from the north, each predicted, all deflated.
fn compress(values: &[f32]) -> std::io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(LEVEL));
    for row in values.chunks_exact(TILE as usize).rev() {
        encoder.write_all(&predicted(row))?;
    }
    encoder.finish()
}

/// Predictor 3 (Adobe Photoshop TIFF Technical Note 3): the bytes of a row by significance, highest
/// first, then differences of consecutive bytes.
fn predicted(row: &[f32]) -> Vec<u8> {
    let words: Vec<[u8; 4]> = row
        .iter()
        .map(|value| if value.is_nan() { NODATA } else { *value }.to_be_bytes())
        .collect();
    let planes = (0..4).flat_map(|plane| words.iter().map(move |word| word[plane]));
    let mut last = 0_u8;
    planes.map(|byte| byte.wrapping_sub(std::mem::replace(&mut last, byte))).collect()
}

/// The tags of TIFF 6.0.
fn describe_image<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    window: Window,
) -> tiff::TiffResult<()> {
    directory.write_tag(Tag::ImageWidth, window.columns)?;
    directory.write_tag(Tag::ImageLength, window.rows)?;
    directory.write_tag(Tag::BitsPerSample, 32_u16)?;
    directory.write_tag(Tag::Compression, 8_u16)?; // Adobe deflate
    directory.write_tag(Tag::PhotometricInterpretation, 1_u16)?; // black is zero
    directory.write_tag(Tag::SamplesPerPixel, 1_u16)?;
    directory.write_tag(Tag::PlanarConfiguration, 1_u16)?;
    directory.write_tag(Tag::Predictor, 3_u16)?;
    directory.write_tag(Tag::TileWidth, TILE)?;
    directory.write_tag(Tag::TileLength, TILE)?;
    directory.write_tag(Tag::SampleFormat, 3_u16) // IEEE floats
}

/// The tags of GeoTIFF and of GDAL.
fn describe_place<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    spec: &RasterSpec<'_>,
) -> tiff::TiffResult<()> {
    const GDAL_METADATA: u16 = 42112;
    let transform = geo_transform(spec);
    directory.write_tag(Tag::ModelPixelScaleTag, &[transform[1], -transform[5], 0.0][..])?;
    let tie = [0.0, 0.0, 0.0, transform[0], transform[3], 0.0];
    directory.write_tag(Tag::ModelTiepointTag, &tie[..])?;
    if !spec.crs.is_unknown() {
        let keys = GeoKeys::of(spec.crs, Purpose { raster: true, elevation: spec.elevation });
        directory.write_tag(Tag::GeoKeyDirectoryTag, keys.directory.as_slice())?;
        directory.write_tag(Tag::GeoAsciiParamsTag, keys.ascii.as_str())?;
    }
    let metadata = format!(
        "<GDALMetadata>\n  <Item name=\"DESCRIPTION\" sample=\"0\" role=\"description\">{}</Item>\n  \
         <Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">{}</Item>\n</GDALMetadata>\n",
        spec.description, spec.unit
    );
    directory.write_tag(Tag::Unknown(GDAL_METADATA), metadata.as_str())?;
    directory.write_tag(Tag::GdalNodata, NODATA.to_string().as_str())
}

/// GDAL's six numbers: west edge, cell width, 0, north edge, 0, minus cell height; in CRS units.
#[must_use]
pub fn geo_transform(spec: &RasterSpec<'_>) -> [f64; 6] {
    let per_unit = spec.crs.horizontal_m_per_unit;
    let edge = |index: i64| index as f64 * spec.cell_m / per_unit;
    let cell = spec.cell_m / per_unit;
    [edge(spec.window.column0), cell, 0.0, edge(spec.window.end_row()), 0.0, -cell]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;
    use tiff::decoder::{Decoder, DecodingResult};

    fn spec(crs: &Crs, columns: u32, rows: u32) -> RasterSpec<'_> {
        let window = Window { column0: 10, row0: 100, columns, rows };
        RasterSpec {
            cell_m: 0.5,
            window,
            crs,
            description: "test",
            unit: "metre",
            elevation: false,
        }
    }

    fn value(column: i64, row: i64) -> f32 {
        if column % 7 == 0 { f32::NAN } else { column as f32 * 0.25 - row as f32 }
    }

    fn write(spec: &RasterSpec<'_>) -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        let window = spec.window;
        let mut source = |w: Window| {
            let cells = (w.row0..w.end_row())
                .flat_map(|row| (w.column0..w.end_column()).map(move |column| (column, row)));
            let inside = |(c, r)| if window.contains(c, r) { value(c, r) } else { f32::NAN };
            Ok(cells.map(inside).collect())
        };
        write_raster(&mut out, Path::new("t.tif"), spec, &mut source).unwrap();
        out.into_inner()
    }

    #[test]
    fn values_come_back_from_the_north() {
        let crs = Crs { epsg: Some(3005), ..Crs::default() };
        let spec = spec(&crs, 300, 270);
        let mut decoder = Decoder::new(Cursor::new(write(&spec))).unwrap();
        assert_eq!(decoder.dimensions().unwrap(), (300, 270));
        let DecodingResult::F32(values) = decoder.read_image().unwrap() else { panic!("not f32") };
        for (place, found) in values.iter().enumerate() {
            let (column, row) = (10 + place as i64 % 300, 369 - place as i64 / 300);
            let expected = value(column, row);
            assert_eq!(*found, if expected.is_nan() { NODATA } else { expected });
        }
        assert_eq!(geo_transform(&spec), [5.0, 0.5, 0.0, 185.0, 0.0, -0.5]);
    }

    #[test]
    fn nothing_is_not_a_raster() {
        let crs = Crs::default();
        let spec = spec(&crs, 0, 3);
        let mut source = |w: Window| Ok(vec![f32::NAN; w.len()]);
        let done = write_raster(Cursor::new(Vec::new()), Path::new("t"), &spec, &mut source);
        assert!(matches!(done, Err(Error::RasterSize { columns: 0, rows: 3 })));
    }

    #[test]
    fn feet() {
        let crs = Crs { horizontal_m_per_unit: 0.25, ..Crs::default() };
        assert_eq!(geo_transform(&spec(&crs, 4, 4)), [20.0, 2.0, 0.0, 208.0, 0.0, -2.0]);
    }
}

//! LAS and LAZ files: 1.4 for what users take away, 1.2 for programs that know no better.
//!
//! Records are laid out here byte by byte (ASPRS LAS 1.4 R15, tables 7 to 18) and handed to the
//! `las` crate in slabs, which compresses them in parallel; chunks have a fixed number of points, so
//! the bytes do not depend on the number of threads. No date of creation is recorded.

mod extra_bytes;
mod record;
mod sink;

pub use extra_bytes::{Dimension, DimensionType};

use crate::Error;
use crate::crs::full_wkt;
use crate::geokeys::{GeoKeys, Purpose};
use ::las::point::Format;
use ::las::{Builder, GpsTimeType, PointDataBuilder, Transform, Vector, Vlr, Writer};
use record::Layout;
use sink::{Failure, Sink};
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use timberline_artefact::Crs;
use timberline_pointcloud::PointCloud;

/// Points handed over at once: several of the chunks of 50,000 that are compressed side by side.
const SLAB: usize = 400_000;
/// The user id and record of the extra bytes description.
const SPEC_USER: &str = "LASF_Spec";
const PROJECTION_USER: &str = "LASF_Projection";

/// How a file is laid out.
#[derive(Debug, Clone, PartialEq)]
pub struct LasOptions {
    /// Version 1.4 (point formats 6, 7, 8) or 1.2 (1, 3).
    pub version: LasVersion,
    /// Smallest step of a coordinate, in the units of the CRS.
    pub scale: f64,
    /// Offset of coordinates, in the units of the CRS.
    pub offset: [f64; 3],
    /// The program that is named in the header (at most 32 bytes).
    pub software: String,
    /// Whether GPS times are adjusted standard time (else seconds of the week).
    pub gps_standard_time: bool,
    /// Whether the extra columns `red`, `green`, `blue` (and `nir`) are written as colours.
    pub colour: Colour,
    /// Extra dimensions: extra columns of the clouds that are written, by name.
    pub dimensions: Vec<Dimension>,
}

impl Default for LasOptions {
    fn default() -> Self {
        Self {
            version: LasVersion::V1_4,
            scale: 0.001,
            offset: [0.0; 3],
            software: "Timberline".to_owned(),
            gps_standard_time: true,
            colour: Colour::None,
            dimensions: Vec::new(),
        }
    }
}

/// Version of the format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LasVersion {
    /// LAS 1.2: CRS by GeoTIFF keys, whole degrees of scan angle, classes to 31, 7 returns.
    V1_2,
    /// LAS 1.4: CRS by WKT, angles in 0.006 degrees, all classes, 15 returns.
    V1_4,
}

/// Whether an extra column has a place of its own in a record (colours, user data, scanner channel)
/// and so must not be a [`Dimension`].
#[must_use]
pub fn is_standard_field(column: &str) -> bool {
    record::COLOURS.contains(&column)
        || [record::USER_DATA, record::SCANNER_CHANNEL].contains(&column)
}

/// Which colours a file has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Colour {
    /// None.
    None,
    /// Red, green, blue.
    Rgb,
    /// And near infrared (in 1.2 left out).
    RgbNir,
}

/// A file being written cloud by cloud. Ends with [`LasWriter::finish`].
#[allow(missing_debug_implementations, reason = "the writer of the las crate has no Debug")]
pub struct LasWriter {
    writer: Writer<Sink<BufWriter<File>>>,
    failure: Failure,
    layout: Layout,
    crs: Crs,
    path: PathBuf,
}

impl LasWriter {
    /// Begins a file, compressed or not.
    ///
    /// # Errors
    /// [`Error::DimensionName`], [`Error::Las`].
    pub fn new(
        file: File,
        path: &Path,
        compressed: bool,
        crs: &Crs,
        options: &LasOptions,
    ) -> Result<Self, Error> {
        let layout = Layout::new(options);
        let header = header(&layout, compressed, crs, options)?.into_header();
        let header = header.map_err(Error::las(path))?;
        let (sink, failure) = Sink::new(file);
        let writer = Writer::new(sink, header).map_err(Error::las(path))?;
        Ok(Self { writer, failure, layout, crs: crs.clone(), path: path.to_path_buf() })
    }

    /// Writes all points of a cloud, in its order. A dimension that the cloud lacks is written as 0.
    ///
    /// # Errors
    /// [`Error::CoordinateRange`], [`Error::FieldRange`], [`Error::DimensionType`], [`Error::Las`].
    pub fn write(&mut self, cloud: &PointCloud) -> Result<(), Error> {
        cloud.validate()?;
        let columns = self.layout.columns(cloud, &self.path)?;
        for first in (0..cloud.len()).step_by(SLAB) {
            let points = first..(first + SLAB).min(cloud.len());
            let mut bytes = Vec::with_capacity(points.len() * self.layout.record_len());
            for index in points {
                self.layout.push(&mut bytes, cloud, index, &columns, &self.crs, &self.path)?;
            }
            let slab = PointDataBuilder::new().for_header(self.writer.header());
            let slab = slab.build_from_bytes(bytes).map_err(Error::las(&self.path))?;
            self.writer.write_points(&slab).map_err(Error::las(&self.path))?;
            self.failure.check().map_err(Error::io(&self.path, "write"))?;
        }
        Ok(())
    }

    /// Number of points written so far.
    #[must_use]
    pub fn points(&self) -> u64 {
        self.writer.header().number_of_points()
    }

    /// Completes the file.
    ///
    /// # Errors
    /// [`Error::Las`], [`Error::Io`].
    pub fn finish(mut self) -> Result<u64, Error> {
        let points = self.points();
        self.writer.close().map_err(Error::las(&self.path))?;
        let mut sink = self.writer.into_inner().map_err(Error::las(&self.path))?;
        std::io::Write::flush(&mut sink).map_err(Error::io(&self.path, "write"))?;
        self.failure.check().map_err(Error::io(&self.path, "write"))?;
        Ok(points)
    }
}

/// Writes clouds to one file, `.laz` by its ending compressed, whole or not at all.
///
/// # Errors
/// As [`LasWriter::new`] and [`LasWriter::write`].
pub fn write_las(
    path: &Path,
    clouds: &[PointCloud],
    crs: &Crs,
    options: &LasOptions,
) -> Result<u64, Error> {
    let compressed = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("laz"));
    let mut staged = timberline_artefact::publish::Staged::new(path)?;
    let file = staged.file().try_clone().map_err(Error::io(path, "open"))?;
    let mut writer = LasWriter::new(file, path, compressed, crs, options)?;
    for cloud in clouds {
        writer.write(cloud)?;
    }
    let points = writer.finish()?;
    staged.publish()?;
    Ok(points)
}

fn header(
    layout: &Layout,
    compressed: bool,
    crs: &Crs,
    options: &LasOptions,
) -> Result<Builder, Error> {
    let modern = options.version == LasVersion::V1_4;
    let format = Format {
        has_gps_time: true,
        is_extended: modern,
        has_color: layout.colour > Colour::None,
        has_nir: layout.colour == Colour::RgbNir,
        extra_bytes: layout.extra_len() as u16,
        is_compressed: compressed,
        ..Format::default()
    };
    let transform = |axis: usize| Transform { scale: options.scale, offset: options.offset[axis] };
    let time = if options.gps_standard_time { GpsTimeType::Standard } else { GpsTimeType::Week };
    let mut builder = Builder::from((1, if modern { 4 } else { 2 }));
    builder.point_format = format;
    builder.transforms = Vector { x: transform(0), y: transform(1), z: transform(2) };
    builder.generating_software = options.software.chars().take(32).collect();
    "EXTRACTION".clone_into(&mut builder.system_identifier);
    builder.gps_time_type = time;
    builder.vlrs = records(crs, options)?;
    Ok(builder)
}

/// The variable length records: CRS, then extra bytes.
fn records(crs: &Crs, options: &LasOptions) -> Result<Vec<Vlr>, Error> {
    let record = |user: &str, id: u16, description: &str, data: Vec<u8>| Vlr {
        user_id: user.to_owned(),
        record_id: id,
        description: description.to_owned(),
        data,
    };
    let mut records = Vec::new();
    if options.version == LasVersion::V1_4 {
        if let Some(wkt) = full_wkt(crs) {
            let data = [wkt.as_bytes(), b"\0"].concat();
            records.push(record(PROJECTION_USER, 2112, "OGC WKT", data));
        }
    } else if !crs.is_unknown() {
        let keys = GeoKeys::of(crs, Purpose { raster: false, elevation: true });
        let directory = keys.directory.iter().flat_map(|number| number.to_le_bytes()).collect();
        let ascii = [keys.ascii.as_bytes(), b"\0"].concat();
        records.push(record(PROJECTION_USER, 34735, "GeoTIFF keys", directory));
        records.push(record(PROJECTION_USER, 34737, "GeoTIFF texts", ascii));
    }
    if !options.dimensions.is_empty() {
        let data =
            options.dimensions.iter().map(Dimension::descriptor).collect::<Result<Vec<_>, _>>()?;
        records.push(record(SPEC_USER, 4, "Extra bytes", data.concat()));
    }
    Ok(records)
}

/// An offset for a file whose points lie in the given corner and beyond: a round number below it,
/// in units of the CRS, so that the same data get the same file however they were gathered.
#[must_use]
pub fn offset_for(crs: &Crs, low_m: [f64; 3]) -> [f64; 3] {
    crs.crs_from_world(low_m)
        .map(|value| if value.is_finite() { (value / 1000.0).floor() * 1000.0 } else { 0.0 })
}

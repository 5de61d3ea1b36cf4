//! A file of points of any format, opened by what is in it.

use crate::assemble::{Assembler, Batch};
use crate::crs::{UnitChoice, with_units};
use crate::damages::Damages;
use crate::extra::ExtraField;
use crate::file::open_file;
use crate::points::Damage;
use crate::sniff::{self, Format};
use crate::source::Source;
use crate::{Error, LasFile, Notes};
use std::path::Path;
use timberline_artefact::Crs;
use timberline_pointcloud::{Bounds3, PointCloud};

/// An open file whose points come in batches of bounded size.
pub trait Scan {
    /// `LAS`, `LAZ`, `COPC`, `E57`, `PLY`, `PCD` or `text`.
    fn container(&self) -> &'static str;

    /// The coordinate reference system; points are already in metres.
    fn crs(&self) -> &Crs;

    /// What the file says about extra bytes (LAS).
    fn extra(&self) -> &[ExtraField] {
        &[]
    }

    /// What a reader should know, so far.
    fn notes(&self) -> &Notes;

    /// The bounds that the file states, metres; `None` where it states none.
    fn stated_bounds_m(&self) -> Option<Bounds3> {
        None
    }

    /// The smallest step between coordinates, metres, where the file states one.
    fn finest_step_m(&self) -> Option<f64> {
        None
    }

    /// Whether points know which return of their pulse they are.
    fn has_returns(&self) -> bool;

    /// The next points in the world frame (origin 0, metres); `None` after the last.
    ///
    /// # Errors
    /// [`Error::Io`], and what makes going on impossible. Damage does not end the reading: see
    /// [`Scan::damage`].
    fn next_batch(&mut self) -> Result<Option<PointCloud>, Error>;

    /// Points read so far whose coordinates are not finite or beyond 67,000 km, and were left out.
    fn outside(&self) -> u64;

    /// The first of them, with its value, where that is known.
    fn first_outside(&self) -> Option<&str> {
        None
    }

    /// Why not a single point of so many can be used.
    fn nowhere(&self, points: u64) -> Error;

    /// Places found so far where points were lost.
    fn damages(&self) -> &[Damage];

    /// The first damage as an error, with the numbers of points read and promised. To be asked
    /// after the last batch.
    fn damage(&self) -> Option<Error>;
}

/// Opens a file of any known format.
///
/// `crs` replaces what the file says, `units` only its units.
///
/// # Errors
/// [`Error::File`] naming the file and what is wrong with it.
pub fn open(path: &Path, units: UnitChoice, crs: Option<&Crs>) -> Result<Box<dyn Scan>, Error> {
    let open = || from_source(Box::new(open_file(path)?), units, crs);
    open().map_err(|error| error.in_file(path))
}

/// As [`open`] for bytes from anywhere.
///
/// # Errors
/// What is wrong with them.
pub fn from_source(
    mut source: Box<dyn Source>,
    units: UnitChoice,
    crs: Option<&Crs>,
) -> Result<Box<dyn Scan>, Error> {
    let crs_or_units = || crs.cloned().unwrap_or_else(|| with_units(Crs::default(), units));
    match sniff::format(source.as_mut())? {
        Format::E57 => crate::e57::open(source, units, crs).map(boxed),
        Format::Ply => crate::ply::open(source, crs_or_units()).map(boxed),
        Format::Pcd => crate::pcd::open(source, crs_or_units()).map(boxed),
        Format::Text => crate::text::open(source, crs_or_units()).map(boxed),
        Format::Las => Ok(Box::new(LasFile::from_source(source, units, crs)?)),
    }
}

fn boxed(scan: ColumnScan) -> Box<dyn Scan> {
    Box::new(scan)
}

impl From<LasFile> for Box<dyn Scan> {
    fn from(file: LasFile) -> Self {
        Box::new(file)
    }
}

/// Something that gives the rows of a file as columns, one for each role of its assembler.
pub(crate) trait Rows {
    /// The next rows; `None` after the last. A batch can be empty.
    ///
    /// # Errors
    /// [`Error::Io`], and what makes going on impossible; lost points are `damages`.
    fn next(&mut self, damages: &mut Damages, notes: &mut Notes) -> Result<Option<Batch>, Error>;
}

/// An open file of a format without fixed fields.
pub(crate) struct ColumnScan {
    pub(crate) container: &'static str,
    pub(crate) crs: Crs,
    pub(crate) notes: Notes,
    pub(crate) assembler: Assembler,
    pub(crate) damages: Damages,
    pub(crate) rows: Box<dyn Rows>,
}

impl Scan for ColumnScan {
    fn container(&self) -> &'static str {
        self.container
    }

    fn crs(&self) -> &Crs {
        &self.crs
    }

    fn notes(&self) -> &Notes {
        &self.notes
    }

    fn has_returns(&self) -> bool {
        self.assembler.roles.contains(&crate::attributes::Role::ReturnNumber)
    }

    fn next_batch(&mut self) -> Result<Option<PointCloud>, Error> {
        while let Some(batch) = self.rows.next(&mut self.damages, &mut self.notes)? {
            let cloud = self.assembler.points(batch);
            if !cloud.is_empty() {
                return Ok(Some(cloud));
            }
        }
        Ok(None)
    }

    fn outside(&self) -> u64 {
        self.assembler.outside
    }

    fn first_outside(&self) -> Option<&str> {
        self.assembler.first_outside.as_deref()
    }

    fn nowhere(&self, points: u64) -> Error {
        let first = self.first_outside().unwrap_or("their elevations are beyond 200 km").to_owned();
        Error::NoPlace { points, first }
    }

    fn damages(&self) -> &[Damage] {
        self.damages.list()
    }

    fn damage(&self) -> Option<Error> {
        let first = self.damages().first()?;
        Some(Error::Damaged {
            place: first.place.clone(),
            problem: first.problem.clone(),
            readable: self.assembler.read,
            expected: self.assembler.read + self.damages.lost(),
        })
    }
}

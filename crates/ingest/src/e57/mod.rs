//! E57 (ASTM E2807): several scans, each with a pose.
//!
//! All points come in the frame of the file; the number of their scan, from 1, is their source id.
//! Points marked as invalid are left out. A scan that is damaged gives what comes before the damage,
//! and the next scan follows. The decoding is that of the `e57` crate, on a thread of its own: its
//! readers borrow from the file and cannot be kept.

mod layout;
mod pose;
mod reader;

use crate::assemble::{Assembler, Batch};
use crate::contain::contained;
use crate::crs::{UnitChoice, crs_of_wkt, with_units};
use crate::damages::Damages;
use crate::records::note_steps;
use crate::scan::{ColumnScan, Rows};
use crate::source::Source;
use crate::{Error, Notes};
use ::e57::{E57Reader, PointCloud, Record, RecordDataType, RecordName};
use layout::{Attribute, file_roles};
use reader::{Found, read_all};
use std::sync::mpsc::{Receiver, sync_channel};
use timberline_artefact::Crs;

/// Batches that wait to be fetched.
const WAITING: usize = 2;
const REMEDY: &str = "get the file again, or export it anew from the scanner's program";

/// Opens an E57 file.
///
/// Its coordinates are metres by definition, whatever the unit of its coordinate system; only units
/// given by the user change that.
///
/// # Errors
/// [`Error::Content`] when header or XML cannot be read, [`Error::NotProjected`] for systems of
/// degrees, [`Error::Io`].
pub(crate) fn open(
    mut source: Box<dyn Source>,
    units: UnitChoice,
    crs: Option<&Crs>,
) -> Result<ColumnScan, Error> {
    source.rewind().map_err(Error::io("the header"))?;
    let file = match contained(|| E57Reader::new(source)) {
        Ok(Ok(file)) => file,
        Ok(Err(error)) => return Err(refuse(error.to_string())),
        Err(panic) => return Err(refuse(panic)),
    };
    let mut notes = Notes::default();
    let crs = match (crs, file.coordinate_metadata()) {
        (Some(given), _) => given.clone(),
        (None, Some(text)) => crs_of_wkt(text, units, &mut notes)?,
        (None, None) => with_units(Crs::default(), units),
    };
    let scans = file.pointclouds();
    if scans.iter().all(|scan| scan.records == 0) {
        notes.say(format!("none of {} scans has points", scans.len()));
    }
    scans.iter().for_each(|scan| note_coarse(scan, &mut notes));
    let roles = file_roles(&scans);
    let in_metres = with_units(Crs::default(), units);
    let assembler = Assembler::new(roles.iter().map(Attribute::role).collect(), &in_metres);
    let (send, receive) = sync_channel(WAITING);
    std::thread::Builder::new()
        .name("e57".to_owned())
        .spawn(move || read_all(file, &scans, &roles, &send))
        .map_err(Error::io("scans (no thread)"))?;
    let rows = Box::new(ThreadRows { receive });
    Ok(ColumnScan { container: "E57", crs, notes, assembler, damages: Damages::default(), rows })
}

/// Says when 32-bit coordinates of a scan are too large to tell a millimetre.
fn note_coarse(scan: &PointCloud, notes: &mut Notes) {
    let is_single = |record: &Record| {
        record.name == RecordName::CartesianX
            && matches!(record.data_type, RecordDataType::Single { .. })
    };
    if let Some(b) = scan.cartesian_bounds.as_ref().filter(|_| scan.prototype.iter().any(is_single))
    {
        let bounds = [b.x_min, b.x_max, b.y_min, b.y_max, b.z_min, b.z_max];
        note_steps(
            bounds.into_iter().flatten().fold(0.0, |most, value| most.max(value.abs())),
            notes,
        );
    }
}

fn refuse(problem: String) -> Error {
    Error::Content { place: "E57 header".to_owned(), problem, remedy: REMEDY }
}

/// Takes what the reading thread finds.
struct ThreadRows {
    receive: Receiver<Found>,
}

impl Rows for ThreadRows {
    fn next(&mut self, damages: &mut Damages, notes: &mut Notes) -> Result<Option<Batch>, Error> {
        loop {
            match self.receive.recv() {
                Ok(Found::Batch(batch)) => return Ok(Some(batch)),
                Ok(Found::Note(note)) => notes.say(note),
                Ok(Found::Damage { place, problem, lost }) => damages.add(place, problem, lost),
                // The thread is done.
                Err(_) => return Ok(None),
            }
        }
    }
}

#[cfg(test)]
mod tests;

//! The thread that reads the scans of a file one after the other.

use super::layout::{Attribute, Layout};
use crate::assemble::{Batch, Numbers};
use crate::contain::contained;
use crate::source::Source;
use ::e57::{E57Reader, PointCloud};
use std::sync::mpsc::SyncSender;
use timberline_pointcloud::Column;

/// Points in a batch.
const BATCH: usize = 1 << 16;

/// Something found by the thread.
pub(super) enum Found {
    Batch(Batch),
    Note(String),
    Damage { place: String, problem: String, lost: u64 },
}

/// Nobody waits for what is read any more.
struct Unwanted;

/// Reads all scans. Ends early when nobody takes what is found.
pub(super) fn read_all(
    mut file: E57Reader<Box<dyn Source>>,
    scans: &[PointCloud],
    columns: &[Attribute],
    send: &SyncSender<Found>,
) {
    for (index, scan) in scans.iter().enumerate() {
        let mut reading = Reading::new(index + 1, columns, send);
        let result = contained(|| reading.scan(&mut file, scan));
        let problem = match result {
            Ok(Ok(problem)) => problem,
            Ok(Err(Unwanted)) => return,
            Err(panic) => Some(panic),
        };
        if reading.end(scan, problem).is_err() {
            return;
        }
    }
}

/// One scan being read.
struct Reading<'a> {
    /// From 1.
    number: usize,
    columns: &'a [Attribute],
    send: &'a SyncSender<Found>,
    values: Vec<Vec<f64>>,
    records: Vec<u64>,
    read: u64,
    invalid: u64,
}

impl<'a> Reading<'a> {
    fn new(number: usize, columns: &'a [Attribute], send: &'a SyncSender<Found>) -> Self {
        let values = vec![Vec::new(); columns.len()];
        Self { number, columns, send, values, records: Vec::new(), read: 0, invalid: 0 }
    }

    fn say(&self, found: Found) -> Result<(), Unwanted> {
        self.send.send(found).map_err(|_| Unwanted)
    }

    /// Reads a scan as far as it goes; why not to its end.
    fn scan(
        &mut self,
        file: &mut E57Reader<Box<dyn Source>>,
        scan: &PointCloud,
    ) -> Result<Option<String>, Unwanted> {
        if scan.records == 0 {
            return Ok(None);
        }
        let layout = match Layout::of(scan, self.columns) {
            Ok((layout, said)) => {
                for said in said {
                    self.say(Found::Note(format!("scan {}: {said}", self.number)))?;
                }
                layout
            }
            Err(problem) => return Ok(Some(problem)),
        };
        let points = match file.pointcloud_raw(scan) {
            Ok(points) => points,
            Err(error) => return Ok(Some(error.to_string())),
        };
        for point in points {
            let point = match point {
                Ok(point) => point,
                Err(error) => return Ok(Some(error.to_string())),
            };
            match layout.position(&point) {
                Some(at) => {
                    (0..3).for_each(|axis| self.values[axis].push(at[axis]));
                    layout.others(&point, &mut self.values[3..]);
                    self.records.push(self.read);
                }
                None => self.invalid += 1,
            }
            self.read += 1;
            if self.records.len() == BATCH {
                self.flush()?;
            }
        }
        Ok(None)
    }

    fn flush(&mut self) -> Result<(), Unwanted> {
        // A panic may have come between two columns of a point.
        let rows = self.values.iter().map(Vec::len).min().unwrap_or(0).min(self.records.len());
        let take = |values: &mut Vec<f64>| {
            values.truncate(rows);
            std::mem::take(values)
        };
        let values = self.values.iter_mut().map(take);
        let columns: Vec<Column> =
            self.columns.iter().zip(values).map(|(column, values)| column.column(values)).collect();
        self.records.truncate(rows);
        let numbers = Numbers::Each(std::mem::take(&mut self.records));
        let noun = format!("scan {}, record", self.number);
        let source_id = u16::try_from(self.number).unwrap_or(u16::MAX);
        self.say(Found::Batch(Batch { columns, noun, numbers, source_id }))
    }

    /// Hands on the rest, and says what was lost and left out.
    fn end(&mut self, scan: &PointCloud, problem: Option<String>) -> Result<(), Unwanted> {
        self.flush()?;
        if let Some(problem) = problem {
            let place = format!("scan {}, record {}", self.number, self.read);
            self.say(Found::Damage { place, problem, lost: scan.records - self.read })?;
        }
        if self.invalid > 0 {
            let (number, invalid, all) = (self.number, self.invalid, scan.records);
            self.say(Found::Note(format!(
                "scan {number}: {invalid} of {all} points are marked as invalid and left out"
            )))?;
        }
        Ok(())
    }
}

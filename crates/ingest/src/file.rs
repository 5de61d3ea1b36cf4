//! A LAS, LAZ or COPC file: opened, checked, read in batches.

use crate::crs::{UnitChoice, crs_of};
use crate::decode::Decoder;
use crate::extra::{self, ExtraField};
use crate::header::Header;
use crate::points::{Damage, PointReader};
use crate::scan::Scan;
use crate::source::Source;
use crate::vlr::Records;
use crate::{Error, Notes};
use std::fs::File;
use std::path::Path;
use timberline_artefact::Crs;
use timberline_pointcloud::{Bounds3, PointCloud};

/// An open file. Points come in batches of about half a million, whatever the file's size.
pub struct LasFile {
    container: &'static str,
    header: Header,
    crs: Crs,
    extra: Vec<ExtraField>,
    notes: Notes,
    reader: PointReader,
    decoder: Decoder,
    buffer: Vec<u8>,
    outside: u64,
    read: u64,
}

impl LasFile {
    /// Opens a file and checks all that precedes its points.
    ///
    /// `crs` replaces what the file says, `units` only its units.
    ///
    /// # Errors
    /// [`Error::File`] naming the file and what is wrong with it.
    pub fn open(path: &Path, units: UnitChoice, crs: Option<&Crs>) -> Result<Self, Error> {
        let open = || {
            let file = open_file(path)?;
            Self::from_source(Box::new(file), units, crs)
        };
        open().map_err(|error| error.in_file(path))
    }

    /// As [`LasFile::open`] for bytes from anywhere.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn from_source(
        mut source: Box<dyn Source>,
        units: UnitChoice,
        crs: Option<&Crs>,
    ) -> Result<Self, Error> {
        let mut notes = Notes::default();
        let (header, records, crs) = read_head(source.as_mut(), units, crs, &mut notes)?;
        note_header(&header, &crs, &mut notes);
        let (from, to) = (usize::from(header.layout.len), usize::from(header.record_len));
        let extra = extra::fields(&records.extra_bytes, from, to, &mut notes);
        let reader = PointReader::new(source, &header, &records, &mut notes)?;
        let decoder = Decoder::new(&header, &crs, extra.clone());
        Ok(Self {
            container: container(&header, &records),
            header,
            crs,
            extra,
            notes,
            reader,
            decoder,
            buffer: Vec::new(),
            outside: 0,
            read: 0,
        })
    }

    /// The header.
    #[must_use]
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// The coordinate reference system; points are already in metres.
    #[must_use]
    pub fn crs(&self) -> &Crs {
        &self.crs
    }

    /// The extra attributes.
    #[must_use]
    pub fn extra(&self) -> &[ExtraField] {
        &self.extra
    }

    /// What a reader should know, so far.
    #[must_use]
    pub fn notes(&self) -> &Notes {
        &self.notes
    }

    /// The next points in the world frame (origin 0, metres); `None` after the last.
    ///
    /// # Errors
    /// [`Error::Io`]. Damage does not end the reading: see [`LasFile::damage`].
    pub fn next_batch(&mut self) -> Result<Option<PointCloud>, Error> {
        while self.reader.next(&mut self.buffer)? {
            let decoded = self.decoder.decode(&self.buffer);
            self.outside += decoded.outside;
            self.read += decoded.cloud.len() as u64 + decoded.outside;
            if !decoded.cloud.is_empty() {
                return Ok(Some(decoded.cloud));
            }
        }
        Ok(None)
    }

    /// Points read so far whose coordinates are not finite or beyond 67,000 km, and were left out.
    #[must_use]
    pub fn outside(&self) -> u64 {
        self.outside
    }

    /// Places found so far where points were lost.
    #[must_use]
    pub fn damages(&self) -> &[Damage] {
        self.reader.damages()
    }

    /// The first damage as an error, with the numbers of points read and promised. To be asked
    /// after the last batch.
    #[must_use]
    pub fn damage(&self) -> Option<Error> {
        let first = self.damages().first()?;
        Some(Error::Damaged {
            place: first.place.clone(),
            problem: first.problem.clone(),
            readable: self.read,
            expected: self.header.points,
        })
    }
}

impl Scan for LasFile {
    fn container(&self) -> &'static str {
        self.container
    }

    fn crs(&self) -> &Crs {
        &self.crs
    }

    fn extra(&self) -> &[ExtraField] {
        &self.extra
    }

    fn notes(&self) -> &Notes {
        &self.notes
    }

    fn stated_bounds_m(&self) -> Option<Bounds3> {
        self.header.stated_bounds_m(&self.crs)
    }

    fn finest_step_m(&self) -> Option<f64> {
        let Crs { horizontal_m_per_unit: h, vertical_m_per_unit: v, .. } = self.crs;
        let scale = self.header.scale;
        Some((scale[0] * h).min(scale[1] * h).min(scale[2] * v))
    }

    fn has_returns(&self) -> bool {
        true
    }

    fn next_batch(&mut self) -> Result<Option<PointCloud>, Error> {
        Self::next_batch(self)
    }

    fn outside(&self) -> u64 {
        self.outside
    }

    fn nowhere(&self, points: u64) -> Error {
        Error::Nowhere { points, bounds: self.header.bounds[0] }
    }

    fn damages(&self) -> &[Damage] {
        self.reader.damages()
    }

    fn damage(&self) -> Option<Error> {
        Self::damage(self)
    }
}

/// `LAS`, `LAZ` or `COPC`.
pub(crate) fn container(header: &Header, records: &Records) -> &'static str {
    match (header.compressed, records.copc) {
        (true, true) => "COPC",
        (true, false) => "LAZ",
        (false, _) => "LAS",
    }
}

/// Opens what is a file and no folder or device.
pub(crate) fn open_file(path: &Path) -> Result<File, Error> {
    let file = File::open(path).map_err(Error::io("the file"))?;
    if file.metadata().is_ok_and(|metadata| metadata.is_file()) {
        return Ok(file);
    }
    Err(Error::Foreign { found: "a folder or device".to_owned() })
}

/// Reads what precedes the points; a CRS that is given replaces the file's.
pub(crate) fn read_head(
    source: &mut dyn Source,
    units: UnitChoice,
    crs: Option<&Crs>,
    notes: &mut Notes,
) -> Result<(Header, Records, Crs), Error> {
    let header = Header::read(source, notes)?;
    let records = Records::read(source, &header, notes)?;
    let crs = match crs {
        Some(given) => given.clone(),
        None => crs_of(&header, &records, units, notes)?,
    };
    Ok((header, records, crs))
}

fn note_header(header: &Header, crs: &Crs, notes: &mut Notes) {
    if header.points == 0 {
        let bytes = header.file_len - header.points_at;
        notes.say(format!(
            "the header counts no points (byte 107){}",
            if bytes >= u64::from(header.record_len) && !header.compressed {
                format!(", though {bytes} bytes follow it; they are left out")
            } else {
                String::new()
            }
        ));
    }
    if header.layout.waveform.is_some() {
        notes.say("waveform packets are not kept");
    }
    if header.stated_bounds().is_none() {
        notes.say("the header's bounds (bytes 179 to 226) are not in order and are not used");
    }
    let looks_geographic = |bounds: [[f64; 3]; 2]| {
        let within = |axis: usize, limit: f64| {
            bounds[0][axis] >= -limit && bounds[1][axis] <= limit && bounds[1][axis] != 0.0
        };
        within(0, 180.0) && within(1, 90.0) && header.scale[0] <= 1e-5
    };
    if crs.is_unknown() && header.stated_bounds().is_some_and(looks_geographic) {
        notes.say(
            "the coordinates look like degrees and are taken as lengths; if they are, reproject the \
             file to a projected system",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::LasBytes;

    fn open(bytes: Vec<u8>) -> Result<LasFile, Error> {
        LasFile::from_source(Box::new(std::io::Cursor::new(bytes)), UnitChoice::default(), None)
    }

    #[test]
    fn a_file_cut_off_gives_its_whole_records_and_says_so() {
        let mut bytes = LasBytes::new((1, 2), 1).points(10).build();
        bytes.truncate(227 + 28 * 7 + 5);
        let mut file = open(bytes).unwrap();
        assert_eq!(file.next_batch().unwrap().unwrap().len(), 7);
        assert!(file.next_batch().unwrap().is_none());
        let message = file.damage().unwrap().to_string();
        assert!(message.contains("record 7 (byte 423)"), "{message}");
        assert!(message.contains("7 of 10 points can be read"), "{message}");
    }

    #[test]
    fn a_header_without_any_points_promised_data() {
        let mut bytes = LasBytes::new((1, 2), 0).points(3).build();
        bytes.truncate(227);
        let mut file = open(bytes).unwrap();
        assert!(file.next_batch().unwrap().is_none());
        assert!(file.damage().unwrap().to_string().contains("0 of 3"));
    }

    #[test]
    fn no_points_are_no_error() {
        let mut file = open(LasBytes::new((1, 4), 6).build()).unwrap();
        assert!(file.next_batch().unwrap().is_none());
        assert!(file.damage().is_none());
        assert!(file.notes().messages().iter().any(|note| note.contains("counts no points")));
    }

    #[test]
    fn a_laz_file_without_its_record_is_refused() {
        let mut bytes = LasBytes::new((1, 2), 0).points(3).build();
        bytes[104] |= 0x80;
        let message = open(bytes).map(drop).unwrap_err().to_string();
        assert!(message.contains("`laszip encoded/22204`") && message.contains("missing"));
    }
}

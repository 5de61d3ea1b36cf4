//! Raw point records of a LAS or LAZ file, in batches of bounded size.

use crate::contain::contained;
use crate::header::Header;
use crate::laszip::{Chunk, Decompressor, Laszip, Plan};
use crate::source::Source;
use crate::vlr::Records;
use crate::{Error, Notes};
use rayon::prelude::*;
use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};

/// Bytes of records in a batch: about half a million points, ten LAZ chunks of the usual 50,000.
const BATCH_BYTES: u64 = 1 << 24;

/// A place where points could not be read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Damage {
    /// Where: a record or chunk, with its byte.
    pub place: String,
    /// What is wrong there.
    pub problem: String,
    /// Points lost.
    pub lost: u64,
}

/// Reads the records of one file from first to last.
pub(crate) struct PointReader {
    header: Header,
    batch: u64,
    mode: Mode,
    damages: Vec<Damage>,
}

type Boxed = Box<dyn Source>;

enum Mode {
    Plain { source: Boxed, next: u64 },
    Chunks { source: Boxed, laszip: Laszip, chunks: Vec<Chunk>, next: usize, open: Option<Open> },
    Stream { laszip: Laszip, input: Decompressor<BufReader<Boxed>>, next: u64, restart: u64 },
    Done,
}

/// A chunk too large for one batch, being decompressed.
struct Open {
    input: Decompressor<Cursor<Vec<u8>>>,
    left: u64,
}

impl PointReader {
    /// Gets ready to read the points.
    ///
    /// # Errors
    /// [`Error::Record`] when they cannot be decompressed at all; [`Error::Io`].
    pub(crate) fn new(
        mut source: Boxed,
        header: &Header,
        records: &Records,
        notes: &mut Notes,
    ) -> Result<Self, Error> {
        let batch = (BATCH_BYTES / u64::from(header.record_len)).max(1);
        let mut reader =
            Self { header: header.clone(), batch, mode: Mode::Done, damages: Vec::new() };
        if !header.compressed {
            reader.note_truncation();
            reader.mode = Mode::Plain { source, next: 0 };
            return Ok(reader);
        }
        let laszip = Laszip::parse(records.laszip.as_ref(), header)?;
        reader.mode = match laszip.plan(source.as_mut(), header, notes)? {
            Plan::Chunks(chunks) => {
                reader.note_missing(&chunks);
                Mode::Chunks { source, laszip, chunks, next: 0, open: None }
            }
            Plan::Stream { at, restart } => {
                source.seek(SeekFrom::Start(at)).map_err(Error::io("the first point"))?;
                let input = laszip
                    .decompressor(BufReader::with_capacity(1 << 16, source))
                    .map_err(|problem| reader.whole_file(problem))?;
                Mode::Stream { laszip, input, next: 0, restart }
            }
        };
        Ok(reader)
    }

    fn whole_file(&self, problem: String) -> Error {
        let place = format!("point 0 (byte {})", self.header.points_at);
        Error::Damaged { place, problem, readable: 0, expected: self.header.points }
    }

    fn note_truncation(&mut self) {
        let (expected, fits) = (self.header.points, self.header.points_that_fit());
        if fits < expected {
            let at = self.header.points_at + fits * u64::from(self.header.record_len);
            self.damages.push(Damage {
                place: format!("record {fits} (byte {at})"),
                problem: format!("the file ends at byte {}", self.header.file_len),
                lost: expected - fits,
            });
        }
    }

    fn note_missing(&mut self, chunks: &[Chunk]) {
        let found: u64 = chunks.iter().map(|chunk| chunk.points).sum();
        if found < self.header.points {
            let end = chunks.last().map_or(self.header.points_at, |chunk| chunk.at + chunk.len);
            self.damages.push(Damage {
                place: format!("chunk {} (byte {end})", chunks.len()),
                problem: format!(
                    "no chunk begins there and the file ends at {}",
                    self.header.file_len
                ),
                lost: self.header.points - found,
            });
        }
    }

    /// Places where points were lost, so far.
    pub(crate) fn damages(&self) -> &[Damage] {
        &self.damages
    }

    /// Replaces `bytes` by the next records; `false` after the last. A batch can be empty.
    ///
    /// # Errors
    /// [`Error::Io`]; damage is collected instead.
    pub(crate) fn next(&mut self, bytes: &mut Vec<u8>) -> Result<bool, Error> {
        bytes.clear();
        match &mut self.mode {
            Mode::Done => return Ok(false),
            Mode::Plain { source, next } => {
                let left = self.header.points.min(self.header.points_that_fit()) - *next;
                let count = left.min(self.batch);
                let len = u64::from(self.header.record_len);
                bytes.resize((count * len) as usize, 0);
                let at = self.header.points_at + *next * len;
                source.read_at(at, bytes, &format!("record {next}"))?;
                *next += count;
                if count == left {
                    self.mode = Mode::Done;
                }
            }
            Mode::Chunks { chunks, next, open, .. } => {
                if open.is_none() && *next == chunks.len() {
                    self.mode = Mode::Done;
                    return Ok(false);
                }
                self.next_chunks(bytes)?;
            }
            Mode::Stream { .. } => self.next_of_stream(bytes),
        }
        Ok(true)
    }

    fn next_chunks(&mut self, bytes: &mut Vec<u8>) -> Result<(), Error> {
        let Mode::Chunks { source, laszip, chunks, next, open } = &mut self.mode else {
            return Ok(());
        };
        if open.is_some() {
            self.next_of_open(bytes);
            return Ok(());
        }
        let len = self.header.record_len;
        if chunks[*next].points > self.batch {
            let chunk = chunks[*next];
            match open_chunk(source.as_mut(), laszip, chunk, len)? {
                Ok(opened) => *open = Some(opened),
                Err(problem) => self.damages.push(damage(*next, chunk, 0, problem)),
            }
            *next += 1;
            return Ok(());
        }
        let group = group(&chunks[*next..], self.batch);
        let results = decompress_all(source.as_mut(), laszip, group, len, bytes)?;
        let runs = group.iter().zip(&results).map(|(chunk, done)| (chunk.points, done.points));
        keep_good(bytes, runs, usize::from(len));
        for (index, (chunk, done)) in group.iter().zip(results).enumerate() {
            if let Some(problem) = done.problem {
                self.damages.push(damage(*next + index, *chunk, done.points, problem));
            }
        }
        *next += group.len();
        Ok(())
    }

    /// Goes on with a chunk larger than a batch.
    fn next_of_open(&mut self, bytes: &mut Vec<u8>) {
        let Mode::Chunks { chunks, next, open, .. } = &mut self.mode else { return };
        let Some(opened) = open else { return };
        let len = self.header.record_len;
        let count = opened.left.min(self.batch);
        bytes.resize(count as usize * usize::from(len), 0);
        let done = decompress(&mut opened.input, bytes, len);
        bytes.truncate(done.points as usize * usize::from(len));
        opened.left -= count;
        if let Some(problem) = done.problem {
            let chunk = chunks[*next - 1];
            let read = chunk.points - opened.left - (count - done.points);
            self.damages.push(damage(*next - 1, chunk, read, problem));
            opened.left = 0;
        }
        if opened.left == 0 {
            *open = None;
        }
    }

    fn next_of_stream(&mut self, bytes: &mut Vec<u8>) {
        let Mode::Stream { laszip, input, next, restart } = &mut self.mode else { return };
        let len = usize::from(self.header.record_len);
        let total = self.header.points;
        let until_restart = *restart - *next % *restart;
        let count = (total - *next).min(self.batch).min(until_restart);
        bytes.resize(count as usize * len, 0);
        let mut done = decompress(input, bytes, self.header.record_len);
        bytes.truncate(done.points as usize * len);
        *next += done.points;
        if done.problem.is_none() && *next % *restart == 0 {
            done.problem = laszip.restart(input).err();
        }
        if let Some(problem) = done.problem {
            let place =
                format!("point {next} (compressed data from byte {})", self.header.points_at);
            self.damages.push(Damage { place, problem, lost: total - *next });
            self.mode = Mode::Done;
        } else if *next == total {
            self.mode = Mode::Done;
        }
    }
}

fn damage(index: usize, chunk: Chunk, read: u64, problem: String) -> Damage {
    Damage {
        place: format!("chunk {index} (bytes {} to {})", chunk.at, chunk.at + chunk.len),
        problem,
        lost: chunk.points - read,
    }
}

/// Moves what could be read of each run of records (points expected, points read) together.
fn keep_good(bytes: &mut Vec<u8>, runs: impl Iterator<Item = (u64, u64)>, len: usize) {
    let (mut from, mut kept) = (0, 0);
    for (expected, read) in runs {
        let good = read as usize * len;
        bytes.copy_within(from..from + good, kept);
        kept += good;
        from += expected as usize * len;
    }
    bytes.truncate(kept);
}

/// As many whole chunks as fit a batch, at least one.
fn group(chunks: &[Chunk], batch: u64) -> &[Chunk] {
    let mut points = 0;
    let fits = |chunk: &&Chunk| {
        points += chunk.points;
        points <= batch
    };
    let count = chunks.iter().take_while(fits).count().max(1);
    &chunks[..count.min(chunks.len())]
}

fn load(source: &mut dyn Source, chunk: Chunk) -> Result<Vec<u8>, Error> {
    let mut bytes = vec![0; chunk.len as usize];
    source.read_at(chunk.at, &mut bytes, "a compressed chunk")?;
    Ok(bytes)
}

fn open_chunk(
    source: &mut dyn Source,
    laszip: &Laszip,
    chunk: Chunk,
    record_len: u16,
) -> Result<Result<Open, String>, Error> {
    let bytes = load(source, chunk)?;
    let opened = laszip.check_chunk(&bytes, chunk.points, record_len).and_then(|()| {
        let input = laszip.decompressor(Cursor::new(bytes))?;
        Ok(Open { input, left: chunk.points })
    });
    Ok(opened)
}

/// What came of decompressing a run of points.
#[derive(Debug, Default)]
struct Done {
    points: u64,
    problem: Option<String>,
}

/// Decompresses whole chunks side by side into consecutive parts of `bytes`.
fn decompress_all(
    source: &mut dyn Source,
    laszip: &Laszip,
    chunks: &[Chunk],
    record_len: u16,
    bytes: &mut Vec<u8>,
) -> Result<Vec<Done>, Error> {
    let points: u64 = chunks.iter().map(|chunk| chunk.points).sum();
    bytes.resize(points as usize * usize::from(record_len), 0);
    let mut rest = bytes.as_mut_slice();
    let mut tasks = Vec::new();
    for chunk in chunks {
        let (part, after) = rest.split_at_mut(chunk.points as usize * usize::from(record_len));
        rest = after;
        tasks.push((*chunk, load(source, *chunk)?, part));
    }
    let run = |(chunk, data, part): (Chunk, Vec<u8>, &mut [u8])| {
        let checked = laszip.check_chunk(&data, chunk.points, record_len);
        match checked.and_then(|()| laszip.decompressor(Cursor::new(data))) {
            Ok(mut input) => decompress(&mut input, part, record_len),
            Err(problem) => Done { points: 0, problem: Some(problem) },
        }
    };
    Ok(tasks.into_par_iter().map(run).collect())
}

/// Fills `out` with records; a failure or panic ends the run.
fn decompress<R: Read + Seek>(
    input: &mut Decompressor<R>,
    out: &mut [u8],
    record_len: u16,
) -> Done {
    let mut points = 0;
    let result = contained(|| {
        for record in out.chunks_exact_mut(usize::from(record_len)) {
            input.next(record)?;
            points += 1;
        }
        Ok(())
    });
    let problem = match result {
        Ok(Ok(())) => None,
        Ok(Err(error)) => Some(describe(&error)),
        Err(panic) => Some(format!("the compressed data are damaged ({panic})")),
    };
    Done { points, problem }
}

fn describe(error: &std::io::Error) -> String {
    if error.kind() == std::io::ErrorKind::UnexpectedEof {
        "the compressed data end too early".to_owned()
    } else {
        format!("the compressed data are damaged ({error})")
    }
}

#[cfg(test)]
mod tests;

//! A file that remembers its first failure.
//!
//! The writer of the `las` crate completes the file when it is dropped and panics if that fails, as
//! on a full disk. So failures do not reach it: they are kept here, and everything after is swallowed.

use std::fs::File;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The first failure of a sink, shared with whoever asks for it.
#[derive(Debug, Clone, Default)]
pub(super) struct Failure(Arc<Mutex<Option<io::Error>>>);

impl Failure {
    /// The failure, if there was one; asked again, the same failure by kind.
    pub(super) fn check(&self) -> io::Result<()> {
        self.lock()
            .as_ref()
            .map_or(Ok(()), |error| Err(io::Error::new(error.kind(), error.to_string())))
    }

    fn has_failed(&self) -> bool {
        self.lock().is_some()
    }

    fn lock(&self) -> MutexGuard<'_, Option<io::Error>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The value, or a stand-in after noting the failure.
    fn note<T>(&self, result: io::Result<T>, instead: T) -> T {
        result.unwrap_or_else(|error| {
            self.lock().get_or_insert(error);
            instead
        })
    }
}

/// The file.
#[derive(Debug)]
pub(super) struct Sink<W: Write> {
    inner: W,
    failure: Failure,
}

impl Sink<BufWriter<File>> {
    pub(super) fn new(file: File) -> (Self, Failure) {
        Sink::over(BufWriter::with_capacity(1 << 20, file))
    }
}

impl<W: Write> Sink<W> {
    fn over(inner: W) -> (Self, Failure) {
        let failure = Failure::default();
        (Self { inner, failure: failure.clone() }, failure)
    }
}

impl<W: Write> Write for Sink<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.failure.has_failed() {
            return Ok(bytes.len());
        }
        let written = self.inner.write(bytes);
        Ok(self.failure.note(written, bytes.len()))
    }

    fn flush(&mut self) -> io::Result<()> {
        if !self.failure.has_failed() {
            let flushed = self.inner.flush();
            self.failure.note(flushed, ());
        }
        Ok(())
    }
}

impl<W: Write + Seek> Seek for Sink<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        if self.failure.has_failed() {
            return Ok(0);
        }
        let place = self.inner.seek(to);
        Ok(self.failure.note(place, 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    /// A disk with room for a few bytes.
    struct Small(Cursor<Vec<u8>>, usize);

    impl Write for Small {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.0.position() as usize + bytes.len() > self.1 {
                return Err(io::Error::new(io::ErrorKind::StorageFull, "disk full"));
            }
            self.0.write(bytes)
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Small {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.0.seek(to)
        }
    }

    #[test]
    fn a_full_disk_is_an_error_and_no_panic() {
        for room in [10, 230, 400] {
            let (sink, failure) = Sink::over(Small(Cursor::new(Vec::new()), room));
            let mut builder = las::Builder::from((1, 4));
            builder.point_format = las::point::Format::new(6).unwrap();
            let mut writer = las::Writer::new(sink, builder.into_header().unwrap()).unwrap();
            for _ in 0..9 {
                writer
                    .write_point(las::Point { gps_time: Some(0.0), ..Default::default() })
                    .unwrap();
            }
            drop(writer);
            assert_eq!(failure.check().unwrap_err().kind(), io::ErrorKind::StorageFull);
        }
    }
}

//! Bytes to read from: a file, or a slice in tests and fuzzing.

use crate::Error;
use std::io::{Read, Seek, SeekFrom};

/// Anything that can be read at any place.
pub trait Source: Read + Seek + Send + Sync {
    /// Number of bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    fn byte_len(&mut self) -> Result<u64, Error> {
        self.seek(SeekFrom::End(0)).map_err(Error::io("the file's length"))
    }

    /// Fills a buffer from a place; `what` names it in errors.
    ///
    /// # Errors
    /// [`Error::Io`].
    fn read_at(&mut self, at: u64, bytes: &mut [u8], what: &str) -> Result<(), Error> {
        let read = self.seek(SeekFrom::Start(at)).and_then(|_| self.read_exact(bytes));
        read.map_err(|source| {
            let place = format!("{what} ({} bytes at byte {at})", bytes.len());
            Error::Io { place, source }
        })
    }
}

impl<T: Read + Seek + Send + Sync> Source for T {}

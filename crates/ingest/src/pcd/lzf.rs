//! LZF, the compression of PCD files, decoded piece by piece.
//!
//! M. Lehmann's LibLZF: a control byte below 32 is followed by that many and one more literal bytes;
//! any other copies 2 to 264 bytes from at most 8192 bytes back (3 bits length, 13 bits distance; a
//! length of 7 is followed by a byte that is added). So a state is small enough to be kept: each field
//! of a PCD file, which holds one field after the other, is read by a decoder of its own.

use crate::Error;
use crate::source::Source;

/// The farthest that a copy reaches back.
const WINDOW: usize = 1 << 13;
/// Compressed bytes read at once.
const BUFFER: u64 = 1 << 16;

/// A decoder and all it needs to go on.
#[derive(Clone)]
pub(crate) struct Lzf {
    /// Next compressed byte in the file, and the end of them.
    at: u64,
    end: u64,
    /// The last bytes given, each at its place modulo the window's size.
    window: Vec<u8>,
    /// Bytes given.
    given: u64,
    literal: usize,
    copy: usize,
    distance: usize,
    buffer: Vec<u8>,
    buffer_at: u64,
}

impl Lzf {
    /// Decodes what is compressed from one byte of the file to another.
    pub(crate) fn new(at: u64, end: u64) -> Self {
        Self {
            at,
            end,
            window: vec![0; WINDOW],
            given: 0,
            literal: 0,
            copy: 0,
            distance: 0,
            buffer: Vec::new(),
            buffer_at: at,
        }
    }

    /// Where in the file the decoder is.
    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    /// The decoder without its buffer of compressed bytes.
    pub(crate) fn bookmark(&self) -> Self {
        Self { buffer: Vec::new(), buffer_at: self.at, ..self.clone() }
    }

    fn byte(&mut self, source: &mut dyn Source) -> Result<Option<u8>, Error> {
        if self.at >= self.end {
            return Ok(None);
        }
        let mut place = (self.at - self.buffer_at) as usize;
        if place >= self.buffer.len() {
            self.buffer.resize((self.end - self.at).min(BUFFER) as usize, 0);
            source.read_at(self.at, &mut self.buffer, "compressed points")?;
            self.buffer_at = self.at;
            place = 0;
        }
        self.at += 1;
        Ok(Some(self.buffer[place]))
    }

    fn give(&mut self, byte: u8, out: &mut u8) {
        self.window[self.given as usize % WINDOW] = byte;
        self.given += 1;
        *out = byte;
    }

    /// Fills `out`; the number of bytes given, fewer where the data end or cannot be decoded.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn read(&mut self, source: &mut dyn Source, out: &mut [u8]) -> Result<usize, Error> {
        let mut done = 0;
        while done < out.len() {
            if self.literal > 0 {
                let Some(byte) = self.byte(source)? else { return Ok(done) };
                self.literal -= 1;
                self.give(byte, &mut out[done]);
                done += 1;
            } else if self.copy > 0 {
                self.copy -= 1;
                let byte = self.window[(self.given - self.distance as u64) as usize % WINDOW];
                self.give(byte, &mut out[done]);
                done += 1;
            } else if !self.control(source)? {
                return Ok(done);
            }
        }
        Ok(done)
    }

    /// Reads what comes next; `false` at the end or for a copy from before the beginning.
    fn control(&mut self, source: &mut dyn Source) -> Result<bool, Error> {
        let Some(control) = self.byte(source)?.map(usize::from) else { return Ok(false) };
        if control < 32 {
            self.literal = control + 1;
            return Ok(true);
        }
        let mut len = control >> 5;
        if len == 7 {
            let Some(more) = self.byte(source)? else { return Ok(false) };
            len += usize::from(more);
        }
        let Some(low) = self.byte(source)? else { return Ok(false) };
        self.distance = ((control & 31) << 8 | usize::from(low)) + 1;
        self.copy = len + 2;
        let inside = self.distance as u64 <= self.given;
        if !inside {
            // Nothing after this can be right.
            (self.copy, self.end) = (0, self.at);
        }
        Ok(inside)
    }
}

/// A plain compressor, for tests: literals, and copies of the last like three bytes.
#[cfg(test)]
pub(crate) fn compress(bytes: &[u8]) -> Vec<u8> {
    use std::collections::BTreeMap;
    let (mut out, mut literals) = (Vec::new(), Vec::new());
    let mut seen: BTreeMap<[u8; 3], usize> = BTreeMap::new();
    let flush = |out: &mut Vec<u8>, literals: &mut Vec<u8>| {
        for run in literals.chunks(32) {
            out.push(run.len() as u8 - 1);
            out.extend(run);
        }
        literals.clear();
    };
    let mut at = 0;
    while at < bytes.len() {
        let three = bytes.get(at..at + 3).map(|b| [b[0], b[1], b[2]]);
        let found =
            three.and_then(|three| seen.insert(three, at)).filter(|from| at - from <= WINDOW);
        let Some(from) = found else {
            literals.push(bytes[at]);
            at += 1;
            continue;
        };
        flush(&mut out, &mut literals);
        let same = (0..264)
            .take_while(|i| bytes.get(at + i) == bytes.get(from + i) && at + i < bytes.len());
        let (len, back) = (same.count(), at - from - 1);
        let short = (len - 2).min(7);
        out.push((short << 5 | back >> 8) as u8);
        if short == 7 {
            out.push((len - 9) as u8);
        }
        out.push(back as u8);
        at += len;
    }
    flush(&mut out, &mut literals);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Cursor;

    /// Decodes in steps, and from a bookmark.
    fn decode(packed: &[u8], steps: usize, len: usize) -> Vec<u8> {
        let mut source = Cursor::new(packed.to_vec());
        let mut lzf = Lzf::new(0, packed.len() as u64);
        let mut out = Vec::new();
        loop {
            let mut part = vec![0; steps.min(len - out.len())];
            let done = lzf.read(&mut source, &mut part).unwrap();
            out.extend(&part[..done]);
            if done < part.len() || out.len() == len {
                return out;
            }
            lzf = lzf.bookmark();
        }
    }

    proptest! {
        #[test]
        fn what_is_compressed_comes_back(
            bytes in prop::collection::vec(0u8..3, 0..3000), steps in 1usize..700,
        ) {
            prop_assert_eq!(decode(&compress(&bytes), steps, bytes.len()), bytes);
        }

        #[test]
        fn any_bytes_end(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            prop_assert!(decode(&bytes, 97, 100_000).len() <= 100_000);
        }
    }

    /// Bytes made by hand after LibLZF's description: "abc", then 9 bytes from 3 back.
    #[test]
    fn a_copy_may_reach_into_itself() {
        assert_eq!(decode(&[2, b'a', b'b', b'c', 7 << 5, 0, 2], 5, 12), b"abcabcabcabc");
        assert_eq!(decode(&[0, b'a', 1 << 5, 9], 5, 12), b"a");
    }
}

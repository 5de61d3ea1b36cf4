//! A text file in blocks of whole lines.

use crate::Error;
use crate::source::Source;

/// Bytes read at once.
const BLOCK_BYTES: usize = 1 << 22;
/// A row of 256 columns of 24 characters has 6 kB; nothing that is a row has more than this.
const MAX_LINE_BYTES: usize = 1 << 20;

/// Reads a source from a place to its end.
pub(crate) struct Blocks {
    source: Box<dyn Source>,
    at: u64,
    end: u64,
    rest: Vec<u8>,
    newline: u8,
    block_bytes: usize,
}

impl Blocks {
    /// Blocks from byte `at` on; lines end with `newline`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn new(mut source: Box<dyn Source>, at: u64, newline: u8) -> Result<Self, Error> {
        let end = source.byte_len()?;
        let block_bytes = BLOCK_BYTES;
        Ok(Self { source, at, end, rest: Vec::new(), newline, block_bytes })
    }

    #[cfg(test)]
    pub(crate) fn of(mut self, block_bytes: usize) -> Self {
        self.block_bytes = block_bytes;
        self
    }

    /// The next whole lines; the very last may lack its end. `None` at the end.
    ///
    /// # Errors
    /// [`Error::Io`], and [`Error::Content`] for a line that is no row of numbers by its length.
    pub(crate) fn next(&mut self) -> Result<Option<Vec<u8>>, Error> {
        loop {
            let left = self.end.saturating_sub(self.at);
            if left == 0 {
                return Ok(Some(std::mem::take(&mut self.rest)).filter(|rest| !rest.is_empty()));
            }
            let (old, more) = (self.rest.len(), left.min(self.block_bytes as u64) as usize);
            let mut block = std::mem::take(&mut self.rest);
            block.resize(old + more, 0);
            self.source.read_at(self.at, &mut block[old..], "lines of text")?;
            self.at += more as u64;
            if let Some(last) = block.iter().rposition(|byte| *byte == self.newline) {
                self.rest = block.split_off(last + 1);
                return Ok(Some(block));
            }
            if block.len() > MAX_LINE_BYTES {
                return Err(Error::Content {
                    place: format!("byte {}", self.at - block.len() as u64),
                    problem: format!("no line ends within {} bytes", block.len()),
                    remedy: "check that this is a point cloud as text, one point a line",
                });
            }
            self.rest = block;
        }
    }
}

/// Cuts whole lines into pieces of at least about so many bytes, each of whole lines.
pub(crate) fn pieces(block: &[u8], newline: u8, bytes: usize) -> Vec<&[u8]> {
    let mut pieces = Vec::new();
    let mut rest = block;
    while rest.len() > bytes {
        let end = rest[bytes..].iter().position(|byte| *byte == newline);
        let Some(end) = end else { break };
        let (piece, after) = rest.split_at(bytes + end + 1);
        pieces.push(piece);
        rest = after;
    }
    if !rest.is_empty() {
        pieces.push(rest);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Cursor;

    proptest! {
        #[test]
        fn no_byte_is_lost_and_no_line_is_cut(text in "[a\n]{0,60}", size in 1usize..20, at in 0u64..5) {
            let at = at.min(text.len() as u64);
            let source = Box::new(Cursor::new(text.clone().into_bytes()));
            let mut blocks = Blocks::new(source, at, b'\n').unwrap().of(size);
            let mut all = Vec::new();
            while let Some(block) = blocks.next().unwrap() {
                prop_assert!(block.ends_with(b"\n") || blocks.at == blocks.end);
                let cut = pieces(&block, b'\n', 3);
                prop_assert_eq!(cut.concat(), block.clone());
                prop_assert!(cut.iter().rev().skip(1).all(|piece| piece.ends_with(b"\n")));
                all.extend(block);
            }
            prop_assert_eq!(&all[..], &text.as_bytes()[at as usize..]);
        }
    }

    #[test]
    fn a_line_without_end_is_refused() {
        let source = Box::new(Cursor::new(vec![b'a'; 3 << 20]));
        let mut blocks = Blocks::new(source, 0, b'\n').unwrap().of(1 << 19);
        let message = blocks.next().unwrap_err().to_string();
        assert!(message.contains("no line ends"), "{message}");
    }
}

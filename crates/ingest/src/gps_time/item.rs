//! Times as an item of the stream.

use super::sequences::{Coding, Sequences};
use laz::decoders::ArithmeticDecoder;
use laz::record::FieldDecompressor;
use std::io::{Read, Result};

/// The item `GpsTime`, version 2.
pub(crate) struct GpsTimes(Sequences);

impl GpsTimes {
    pub(crate) fn new() -> Self {
        Self(Sequences::new(Coding::Item, 0))
    }
}

impl<R: Read> FieldDecompressor<R> for GpsTimes {
    fn size_of_field(&self) -> usize {
        size_of::<f64>()
    }

    fn decompress_first(&mut self, source: &mut R, first: &mut [u8]) -> Result<()> {
        let mut bytes = [0; 8];
        source.read_exact(&mut bytes)?;
        first.copy_from_slice(&bytes);
        self.0 = Sequences::new(Coding::Item, i64::from_le_bytes(bytes));
        Ok(())
    }

    fn decompress_with(
        &mut self,
        decoder: &mut ArithmeticDecoder<R>,
        field: &mut [u8],
    ) -> Result<()> {
        self.0.advance(decoder)?;
        field.copy_from_slice(&self.0.bits().to_le_bytes());
        Ok(())
    }
}

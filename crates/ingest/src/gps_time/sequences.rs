//! The four sequences of times and what their symbols mean.

use laz::decoders::ArithmeticDecoder;
use laz::decompressors::{IntegerDecompressor, IntegerDecompressorBuilder};
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use std::io::{Read, Result};

/// How times are coded. The symbols of items begin with one more, for a time that stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    /// In the stream of all items (point formats 1 to 5, version 2).
    Item,
    /// In a layer of its own (point formats 6 to 10, versions 3 and 4).
    Layer,
}

/// Symbols that are factors of the last difference go up to this; those after it are negative.
const LARGEST_FACTOR: i32 = 500;
/// Smallest factor.
const SMALLEST_FACTOR: i32 = -10;
/// The first symbol that is no factor: one for each of 0 to 500, and of -1 to -10.
const NO_FACTOR: i32 = LARGEST_FACTOR - SMALLEST_FACTOR + 1;
/// Factors below this have a context of their own.
const SMALL_FACTOR: i32 = 10;
/// So many unusual differences after one another become the usual one.
const MOST_UNUSUAL: u8 = 3;
/// Sequences.
const COUNT: usize = 4;

/// Where a decoder of times stands.
pub(super) struct Sequences {
    coding: Coding,
    /// Symbols after a difference of 0.
    at_rest: ArithmeticModel,
    /// Symbols after any other.
    moving: ArithmeticModel,
    integers: IntegerDecompressor,
    /// Bits of the last time of each sequence.
    bits: [i64; COUNT],
    differences: [i32; COUNT],
    unusual: [u8; COUNT],
    current: usize,
    newest: usize,
}

/// What a symbol asks for.
enum Step {
    Stay,
    /// A difference near the last one times a factor; the context of its corrector; whether it is
    /// unusual.
    Add(i32, u32, bool),
    New,
    Switch(i32),
}

impl Sequences {
    /// Begins with the bits of the first time.
    pub(super) fn new(coding: Coding, first: i64) -> Self {
        let extra = u32::from(coding == Coding::Item);
        Self {
            coding,
            at_rest: ArithmeticModelBuilder::new(5 + extra).build(),
            moving: ArithmeticModelBuilder::new(NO_FACTOR as u32 + COUNT as u32 + extra).build(),
            integers: IntegerDecompressorBuilder::new().bits(32).contexts(9).build_initialized(),
            bits: [first, 0, 0, 0],
            differences: [0; COUNT],
            unusual: [0; COUNT],
            current: 0,
            newest: 0,
        }
    }

    /// Bits of the present time.
    pub(super) fn bits(&self) -> i64 {
        self.bits[self.current]
    }

    /// Decodes the next time.
    pub(super) fn advance<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<()> {
        loop {
            let at_rest = self.differences[self.current] == 0;
            let step = if at_rest { self.resting(decoder)? } else { self.moving(decoder)? };
            match step {
                Step::Stay => return Ok(()),
                Step::Add(factor, context, unusual) => {
                    return self.add(decoder, factor, context, unusual);
                }
                Step::New => return self.begin(decoder),
                Step::Switch(by) => self.current = (self.current + by as usize) % COUNT,
            }
        }
    }

    fn resting<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<Step> {
        let symbol = decoder.decode_symbol(&mut self.at_rest)? as i32;
        Ok(match symbol - i32::from(self.coding == Coding::Item) {
            -1 => Step::Stay,
            0 => {
                let difference = self.integers.decompress(decoder, 0, 0)?;
                self.differences[self.current] = difference;
                self.move_by(difference);
                self.unusual[self.current] = 0;
                Step::Stay
            }
            1 => Step::New,
            by => Step::Switch(by - 1),
        })
    }

    fn moving<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<Step> {
        let symbol = decoder.decode_symbol(&mut self.moving)? as i32;
        let first_special = NO_FACTOR + i32::from(self.coding == Coding::Item);
        Ok(match symbol {
            0 => Step::Add(0, 7, true),
            1 => Step::Add(1, 1, false),
            _ if symbol < SMALL_FACTOR => Step::Add(symbol, 2, false),
            _ if symbol < LARGEST_FACTOR => Step::Add(symbol, 3, false),
            LARGEST_FACTOR => Step::Add(symbol, 4, true),
            _ if symbol < NO_FACTOR => match LARGEST_FACTOR - symbol {
                SMALLEST_FACTOR => Step::Add(SMALLEST_FACTOR, 6, true),
                factor => Step::Add(factor, 5, false),
            },
            _ if symbol < first_special => Step::Stay,
            _ if symbol == first_special => Step::New,
            _ => Step::Switch(symbol - first_special),
        })
    }

    fn add<R: Read>(
        &mut self,
        decoder: &mut ArithmeticDecoder<R>,
        factor: i32,
        context: u32,
        unusual: bool,
    ) -> Result<()> {
        let expected = factor.wrapping_mul(self.differences[self.current]);
        let difference = self.integers.decompress(decoder, expected, context)?;
        let count = &mut self.unusual[self.current];
        if factor == 1 {
            *count = 0;
        } else if unusual {
            *count += 1;
            if *count > MOST_UNUSUAL {
                *count = 0;
                self.differences[self.current] = difference;
            }
        }
        self.move_by(difference);
        Ok(())
    }

    fn move_by(&mut self, difference: i32) {
        let bits = &mut self.bits[self.current];
        *bits = bits.wrapping_add(i64::from(difference));
    }

    /// A time that no sequence is near to begins another, in place of the oldest.
    fn begin<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<()> {
        let expected = (self.bits() >> 32) as i32;
        let high = self.integers.decompress(decoder, expected, 8)?;
        let low = decoder.read_int()?;
        self.newest = (self.newest + 1) % COUNT;
        self.current = self.newest;
        self.bits[self.current] = (i64::from(high) << 32) | i64::from(low);
        self.differences[self.current] = 0;
        self.unusual[self.current] = 0;
        Ok(())
    }
}

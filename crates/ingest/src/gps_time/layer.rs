//! Times as a layer of a chunk.
//!
//! Whether a point has a new time stands in the layer of channels, returns and x and y, which is
//! therefore read here as well as by `laz`: its symbols only, not what they make of the points.

use super::sequences::{Coding, Sequences};
use laz::DecompressionSelection;
use laz::decoders::ArithmeticDecoder;
use laz::decompressors::{IntegerDecompressor, IntegerDecompressorBuilder};
use laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use laz::record::LayeredFieldDecompressor;
use std::io::{Cursor, Error, Read, Result, Seek, SeekFrom};
use std::ops::Range;

/// Layers of the item; the first is that of returns, the last that of times.
const LAYERS: usize = 9;
/// Scanner channels.
const CHANNELS: usize = 4;
/// The byte of a record with return number and number of returns, and those of the time.
const RETURNS: usize = 14;
const TIME: Range<usize> = 22..30;

/// What a symbol says of a point in comparison with the one before it in its channel: bits, the lowest
/// two of which tell the return number.
const RETURN_COUNT_CHANGES: u32 = 1 << 2;
const TIME_CHANGES: u32 = 1 << 4;
const CHANNEL_CHANGES: u32 = 1 << 6;

type Layer = ArithmeticDecoder<Cursor<Vec<u8>>>;

/// The item `Point14` (versions 3 and 4), its times decoded here and all else by `inner`.
pub(crate) struct Point14<P> {
    inner: P,
    sizes: [u32; LAYERS],
    returns: Layer,
    times: Layer,
    channels: [Option<Channel>; CHANNELS],
    current: usize,
}

impl<P> Point14<P> {
    pub(crate) fn new(inner: P) -> Self {
        let layer = || Layer::new(Cursor::default());
        let channels = [const { None }; CHANNELS];
        Self { inner, sizes: [0; LAYERS], returns: layer(), times: layer(), channels, current: 0 }
    }

    /// Reads what the layer of returns says of the next point: whether its time is new.
    fn next_is_new(&mut self) -> Result<bool> {
        let last = begun(&mut self.channels, self.current)?;
        let context = last.context();
        let changes = self.returns.decode_symbol(&mut last.changes[context])?;
        if changes & CHANNEL_CHANGES != 0 {
            let by = self.returns.decode_symbol(&mut last.next_channel)?;
            let (returns, bits) = (last.returns, last.times.bits());
            self.current = (self.current + by as usize + 1) % CHANNELS;
            self.channels[self.current].get_or_insert_with(|| Channel::new(returns, bits));
        }
        begun(&mut self.channels, self.current)?.follow(changes, &mut self.returns)
    }
}

fn begun(channels: &mut [Option<Channel>; CHANNELS], current: usize) -> Result<&mut Channel> {
    channels[current].as_mut().ok_or_else(|| Error::other("a point before the first one"))
}

impl<R: Read + Seek, P: LayeredFieldDecompressor<R>> LayeredFieldDecompressor<R> for Point14<P> {
    fn size_of_field(&self) -> usize {
        self.inner.size_of_field()
    }

    fn set_selection(&mut self, selection: DecompressionSelection) {
        self.inner.set_selection(selection.skip_gps_time());
    }

    fn init_first_point(
        &mut self,
        source: &mut R,
        first: &mut [u8],
        context: &mut usize,
    ) -> Result<()> {
        self.inner.init_first_point(source, first, context)?;
        let mut bits = [0; 8];
        bits.copy_from_slice(&first[TIME]);
        let [count, number] = [first[RETURNS] >> 4, first[RETURNS] & 0x0F].map(u32::from);
        self.current = *context;
        self.channels = [const { None }; CHANNELS];
        let channel = Channel::new([number, count], i64::from_le_bytes(bits));
        self.channels[self.current] = Some(channel);
        Ok(())
    }

    fn decompress_field_with(&mut self, point: &mut [u8], context: &mut usize) -> Result<()> {
        let is_new = self.next_is_new()?;
        self.inner.decompress_field_with(point, context)?;
        let times = &mut begun(&mut self.channels, self.current)?.times;
        if is_new && self.sizes[LAYERS - 1] > 0 {
            times.advance(&mut self.times)?;
        }
        point[TIME].copy_from_slice(&times.bits().to_le_bytes());
        Ok(())
    }

    fn read_layers_sizes(&mut self, source: &mut R) -> Result<()> {
        let begin = source.stream_position()?;
        for size in &mut self.sizes {
            let mut bytes = [0; 4];
            source.read_exact(&mut bytes)?;
            *size = u32::from_le_bytes(bytes);
        }
        source.seek(SeekFrom::Start(begin))?;
        self.inner.read_layers_sizes(source)
    }

    fn read_layers(&mut self, source: &mut R) -> Result<()> {
        let begin = source.stream_position()?;
        self.returns = layer(source, self.sizes[0])?;
        let between: u64 = self.sizes[1..LAYERS - 1].iter().copied().map(u64::from).sum();
        source.seek(SeekFrom::Start(begin + u64::from(self.sizes[0]) + between))?;
        self.times = layer(source, self.sizes[LAYERS - 1])?;
        source.seek(SeekFrom::Start(begin))?;
        self.inner.read_layers(source)
    }
}

fn layer<R: Read>(source: &mut R, size: u32) -> Result<Layer> {
    let mut bytes = vec![0; size as usize];
    source.read_exact(&mut bytes)?;
    let mut layer = Layer::new(Cursor::new(bytes));
    if size > 0 {
        layer.read_init_bytes()?;
    }
    Ok(layer)
}

/// Symbols of a nibble, and what decodes them by the value before.
const NIBBLE: u32 = 16;
type ByNibble = [Option<ArithmeticModel>; NIBBLE as usize];

/// What the points of a scanner channel have in common.
struct Channel {
    changes: Vec<ArithmeticModel>,
    next_channel: ArithmeticModel,
    counts: ByNibble,
    numbers: ByNibble,
    numbers_at_one_time: ArithmeticModel,
    dx: IntegerDecompressor,
    dy: IntegerDecompressor,
    /// Return number and number of returns of the last point.
    returns: [u32; 2],
    last_is_new: bool,
    times: Sequences,
}

impl Channel {
    fn new(returns: [u32; 2], bits: i64) -> Self {
        let model = |symbols| ArithmeticModelBuilder::new(symbols).build();
        let integers = |contexts| {
            IntegerDecompressorBuilder::new().bits(32).contexts(contexts).build_initialized()
        };
        Self {
            changes: (0..8).map(|_| model(128)).collect(),
            next_channel: model(3),
            counts: [const { None }; NIBBLE as usize],
            numbers: [const { None }; NIBBLE as usize],
            numbers_at_one_time: model(13),
            dx: integers(2),
            dy: integers(22),
            returns,
            last_is_new: false,
            times: Sequences::new(Coding::Layer, bits),
        }
    }

    /// Which model tells what changes: by whether the last point was a first or a last return, and new
    /// in time.
    fn context(&self) -> usize {
        let [number, count] = self.returns;
        usize::from(number == 1)
            + 2 * usize::from(number >= count)
            + 4 * usize::from(self.last_is_new)
    }

    /// Reads the rest of a point; whether its time is new.
    fn follow(&mut self, changes: u32, layer: &mut Layer) -> Result<bool> {
        let is_new = changes & TIME_CHANGES != 0;
        let [last_number, last_count] = self.returns;
        let count = if changes & RETURN_COUNT_CHANGES == 0 {
            last_count
        } else {
            layer.decode_symbol(nibble(&mut self.counts, last_count))?
        };
        let number = match changes & 3 {
            0 => last_number,
            1 => last_number + 1,
            2 => last_number + NIBBLE - 1,
            _ if is_new => layer.decode_symbol(nibble(&mut self.numbers, last_number))?,
            _ => last_number + 2 + layer.decode_symbol(&mut self.numbers_at_one_time)?,
        };
        self.returns = [number % NIBBLE, count];
        self.last_is_new = is_new;
        self.skip_position(u32::from(count == 1), layer)?;
        Ok(is_new)
    }

    /// What x and y are does not matter here, but their symbols have to be read.
    fn skip_position(&mut self, only: u32, layer: &mut Layer) -> Result<()> {
        /// Contexts of y: one for every two bits that x differs by, up to 20.
        const MOST_BITS: u32 = 20;
        self.dx.decompress(layer, 0, only)?;
        let bits = self.dx.k().min(MOST_BITS) & !1;
        self.dy.decompress(layer, 0, only + bits)?;
        Ok(())
    }
}

fn nibble(models: &mut ByNibble, value: u32) -> &mut ArithmeticModel {
    models[(value % NIBBLE) as usize]
        .get_or_insert_with(|| ArithmeticModelBuilder::new(NIBBLE).build())
}

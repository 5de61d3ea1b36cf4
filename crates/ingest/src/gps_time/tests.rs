//! Against the compressors of the `laz` crate, and what its decompressors cannot survive.

use super::sequences::{Coding, Sequences};
use super::{GpsTimes, Point14};
use laz::LazItem;
use laz::decoders::ArithmeticDecoder;
use laz::encoders::ArithmeticEncoder;
use laz::las::{Point6, v3, v4};
use laz::laszip::LazItemRecordBuilder;
use laz::models::ArithmeticModelBuilder;
use laz::record::{
    LayeredPointRecordCompressor, LayeredPointRecordDecompressor, RecordCompressor,
    RecordDecompressor, SequentialPointRecordCompressor, SequentialPointRecordDecompressor,
};
use proptest::prelude::*;
use std::io::Cursor;

/// How a time follows the one before: steps of one length, of odd ones, jumps between flight lines
/// (sequences) and to anywhere, and standing still. Their bits stay below 2^62: in debug builds the
/// compressor of `laz` stops where their difference overflows.
fn times() -> impl Strategy<Value = Vec<f64>> {
    let step = prop_oneof![
        4 => Just((0, 1)),
        2 => (0..4_usize, -12..600_i64),
        1 => (0..4_usize, Just(0)),
        1 => (0..4_usize, -3_000_000_000..3_000_000_000_i64),
        1 => (0..6_usize, any::<i64>()),
    ];
    prop::collection::vec(step, 1..400).prop_map(|steps| {
        let mut lines: [i64; 6] =
            std::array::from_fn(|line| (1.5e5 + 1e4 * line as f64).to_bits() as i64);
        let mut bits = |(line, step): (usize, i64)| {
            lines[line] = lines[line].wrapping_add(step.wrapping_mul(1_000_003)) & (i64::MAX >> 1);
            f64::from_bits(lines[line] as u64)
        };
        steps.into_iter().map(&mut bits).collect()
    })
}

fn decoded<R>(
    mut decompressor: impl RecordDecompressor<R>,
    len: usize,
    count: usize,
) -> Vec<Vec<u8>> {
    let mut next = |_| {
        let mut record = vec![0; len];
        decompressor.decompress_next(&mut record).unwrap();
        record
    };
    (0..count).map(&mut next).collect()
}

fn items_of(records: &[Vec<u8>], items: &Vec<LazItem>) -> Vec<Vec<u8>> {
    let mut compressor = SequentialPointRecordCompressor::new(Cursor::new(Vec::new()));
    compressor.set_fields_from(items).unwrap();
    records.iter().for_each(|record| compressor.compress_next(record).unwrap());
    compressor.done().unwrap();
    let input = Cursor::new(compressor.into_inner().into_inner());
    let mut decompressor = SequentialPointRecordDecompressor::new(input);
    decompressor.set_fields_from(&vec![items[0]]).unwrap();
    decompressor.add_field_decompressor(GpsTimes::new());
    decoded(decompressor, 28, records.len())
}

fn layers_of(records: &[Vec<u8>], items: &Vec<LazItem>) -> Vec<Vec<u8>> {
    let mut compressor = LayeredPointRecordCompressor::new(Cursor::new(Vec::new()));
    compressor.set_fields_from(items).unwrap();
    records.iter().for_each(|record| compressor.compress_next(record).unwrap());
    compressor.done().unwrap();
    let input = Cursor::new(compressor.into_inner().into_inner());
    let mut decompressor = LayeredPointRecordDecompressor::new(input);
    if items[0].version() == 3 {
        decompressor.add_field_decompressor(Point14::new(v3::LasPoint6Decompressor::default()));
    } else {
        decompressor.add_field_decompressor(Point14::new(v4::LasPoint6Decompressor::default()));
    }
    decompressor.set_selection(laz::DecompressionSelection::all());
    decoded(decompressor, 30, records.len())
}

/// Records of noise with these times. Noise holds what a file can: every channel and return.
fn records(times: &[f64], len: usize, time_at: usize, noise: &[u8]) -> Vec<Vec<u8>> {
    let record = |(index, time): (usize, &f64)| {
        let mut record: Vec<u8> =
            (0..len).map(|at| noise[(index * 7 + at) % noise.len()]).collect();
        record[time_at..time_at + 8].copy_from_slice(&time.to_le_bytes());
        record
    };
    times.iter().enumerate().map(record).collect()
}

proptest! {
    #[test]
    fn items_come_back(times in times(), noise in prop::collection::vec(any::<u8>(), 1..900)) {
        let items = LazItemRecordBuilder::version_2_of::<laz::las::Point1>(0);
        let records = records(&times, 28, 20, &noise);
        prop_assert_eq!(items_of(&records, &items), records);
    }

    #[test]
    fn layers_come_back(times in times(), noise in prop::collection::vec(any::<u8>(), 1..900)) {
        let records = records(&times, 30, 22, &noise);
        for items in [
            LazItemRecordBuilder::version_3_of::<Point6>(0),
            LazItemRecordBuilder::version_4_of::<Point6>(0),
        ] {
            prop_assert_eq!(&layers_of(&records, &items), &records);
        }
    }
}

/// Found by fuzzing: such a stream made the decompressor of `laz` call itself until the stack was full.
#[test]
fn a_million_switches_are_a_loop() {
    for (coding, symbols, switch) in [(Coding::Item, 6, 3), (Coding::Layer, 5, 2)] {
        let mut encoder = ArithmeticEncoder::new(Cursor::new(Vec::new()));
        let mut model = ArithmeticModelBuilder::new(symbols).with_compression(true).build();
        for _ in 0..1_000_000 {
            encoder.encode_symbol(&mut model, switch).unwrap();
        }
        encoder.done().unwrap();
        let bytes = encoder.into_inner().into_inner();
        assert!(bytes.len() < 1000, "{}", bytes.len());
        let mut decoder = ArithmeticDecoder::new(Cursor::new(bytes));
        decoder.read_init_bytes().unwrap();
        let mut sequences = Sequences::new(coding, 7);
        // What comes after the switches is noise: a time or the end of the data.
        let _ = sequences.advance(&mut decoder);
    }
}

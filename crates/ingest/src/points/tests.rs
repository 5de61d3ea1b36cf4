//! Compressed files as no writer should write them.

use crate::testing::LasBytes;
use crate::{Error, LasFile, UnitChoice};
use proptest::prelude::*;
use std::io::Cursor;

/// Points with some variety, so that compressed bytes matter.
fn las(version: (u8, u8), format: u8, count: i32) -> LasBytes {
    let mut las = LasBytes::new(version, format);
    for i in 0..count {
        let mut record = las.record([i * 7 % 1000, i * i % 997, (i * 31) % 313]);
        record[12] = (i % 251) as u8;
        record[17] = (i % 5) as u8;
        las = las.push(record);
    }
    las
}

fn open(bytes: Vec<u8>) -> Result<LasFile, Error> {
    LasFile::from_source(Box::new(Cursor::new(bytes)), UnitChoice::default(), None)
}

/// Number of points read, a sum over them, and the error at the end.
fn read(bytes: Vec<u8>) -> (usize, f64, Option<String>) {
    let mut file = open(bytes).unwrap();
    let (mut count, mut sum) = (0, 0.0);
    while let Some(cloud) = file.next_batch().unwrap() {
        count += cloud.len();
        sum += cloud.x.iter().chain(&cloud.z).sum::<f64>();
        sum += cloud.intensity.iter().map(|v| f64::from(*v)).sum::<f64>();
    }
    (count, (sum * 100.0).round(), file.damage().map(|error| error.to_string()))
}

fn points_at(bytes: &[u8]) -> usize {
    u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize
}

#[test]
fn chunks_are_read_side_by_side_in_their_sequence() {
    for format in [0, 1, 3, 6, 7, 8] {
        let version = if format < 6 { (1, 2) } else { (1, 4) };
        let plain = read(las(version, format, 1000).build());
        assert_eq!(read(las(version, format, 1000).build_laz(64)), plain, "format {format}");
    }
}

/// One chunk of more than a batch, as some writers make of a whole file.
#[test]
fn a_chunk_larger_than_a_batch_is_read_in_parts() {
    let las = |format: u8, version: (u8, u8)| {
        let mut las = LasBytes::new(version, format).extra_len(6000);
        for i in 0..4000 {
            let record = las.record([i, i * 3, 7 * i]);
            las = las.push(record);
        }
        las
    };
    for (format, version) in [(0, (1, 2)), (6, (1, 4))] {
        let plain = read(las(format, version).build());
        assert_eq!(plain.0, 4000);
        let mut file = open(las(format, version).build_laz(50_000)).unwrap();
        let first = file.next_batch().unwrap().unwrap().len();
        assert!(first < 4000, "{first}");
        assert_eq!(read(las(format, version).build_laz(50_000)), plain);
    }
}

/// The stream of LASzip 1: the `laz` crate panics on it, "variable-size chunks, but no chunk table".
#[test]
fn a_stream_without_chunks_is_read() {
    for format in [0, 1, 3] {
        let plain = read(las((1, 2), format, 500).build());
        assert_eq!(read(las((1, 2), format, 500).build_laz_stream()), plain, "format {format}");
    }
}

#[test]
fn a_stream_cut_off_gives_what_was_there() {
    let mut bytes = las((1, 2), 1, 500).build_laz_stream();
    bytes.truncate(points_at(&bytes) + 900);
    let (count, _, damage) = read(bytes);
    let damage = damage.unwrap();
    assert!(count > 50 && count < 500, "{count}");
    assert!(damage.contains(&format!("{count} of 500 points can be read")), "{damage}");
}

/// A file that was never finished: no chunk table, its place still -1.
#[test]
fn chunks_without_a_table_are_read_one_after_the_other() {
    for (version, format) in [((1, 2), 1), ((1, 4), 7)] {
        let plain = read(las(version, format, 1000).build());
        let mut bytes = las(version, format, 1000).build_laz(64);
        let at = points_at(&bytes);
        let table = u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
        bytes.truncate(table as usize);
        bytes[at..at + 8].fill(0xFF);
        let mut file = open(bytes.clone()).unwrap();
        assert!(file.notes().messages().iter().any(|note| note.contains("chunk table")));
        assert!(file.next_batch().unwrap().is_some());
        assert_eq!(read(bytes), plain, "format {format}");
    }
}

#[test]
fn a_table_of_four_thousand_million_chunks_is_not_allocated() {
    let plain = read(las((1, 2), 1, 300).build());
    let mut bytes = las((1, 2), 1, 300).build_laz(64);
    let at = points_at(&bytes);
    let table = u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
    bytes[table + 4..table + 8].fill(0xFF);
    assert_eq!(read(bytes), plain);
}

/// Layers that claim gigabytes would be allocated by the `laz` crate before it reads them.
#[test]
fn layers_larger_than_their_chunk_are_damage() {
    let mut bytes = las((1, 4), 6, 300).build_laz(100);
    let sizes = points_at(&bytes) + 8 + 30 + 4;
    bytes[sizes..sizes + 4].fill(0xF0);
    let (count, _, damage) = read(bytes);
    assert_eq!(count, 200);
    let damage = damage.unwrap();
    assert!(damage.contains("chunk 0") && damage.contains("its layers need"), "{damage}");
}

#[test]
fn a_damaged_chunk_costs_its_own_points_only() {
    let mut bytes = las((1, 4), 6, 300).build_laz(100);
    let at = points_at(&bytes) + 8;
    bytes[at + 30..at + 34].copy_from_slice(&7u32.to_le_bytes());
    let (count, _, damage) = read(bytes);
    assert_eq!(count, 200);
    assert!(damage.unwrap().contains("it holds 7 points, expected 100"));
}

#[test]
fn extra_bytes_nobody_describes_are_kept_by_number() {
    let build = |format: u8, version: (u8, u8)| {
        let las = LasBytes::new(version, format).extra_len(2);
        let mut record = las.record([1, 2, 3]);
        let at = record.len() - 2;
        record[at..].copy_from_slice(&[5, 9]);
        las.push(record).build_laz(10)
    };
    for bytes in [build(1, (1, 2)), build(7, (1, 4))] {
        let cloud = open(bytes).unwrap().next_batch().unwrap().unwrap();
        assert_eq!(cloud.extra["extra_bytes_2"].value(0), 9.0);
    }
}

#[test]
fn items_must_make_up_the_record() {
    let mut bytes = las((1, 2), 1, 10).build_laz(64);
    bytes[105..107].copy_from_slice(&40u16.to_le_bytes());
    let message = open(bytes).map(drop).unwrap_err().to_string();
    assert!(message.contains("28 bytes, the header says 40"), "{message}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    /// Whatever is changed in a file, it is read or refused.
    #[test]
    fn changed_bytes_never_panic(
        format in prop::sample::select(vec![0u8, 1, 3, 6, 7]),
        changes in prop::collection::vec((0usize..4000, any::<u8>()), 1..8),
        cut in prop::option::of(0usize..4000),
        stream in any::<bool>(),
    ) {
        let version = if format < 6 { (1, 2) } else { (1, 4) };
        let las = las(version, format, 150);
        let mut bytes =
            if stream && format < 6 { las.build_laz_stream() } else { las.build_laz(40) };
        for (place, value) in changes {
            let place = place % bytes.len();
            bytes[place] = value;
        }
        bytes.truncate(cut.map_or(bytes.len(), |cut| cut % bytes.len()));
        // A promise of millions of points costs time, not memory; keep it to thousands here.
        bytes.iter_mut().skip(109).take(2).for_each(|byte| *byte = 0);
        bytes.iter_mut().skip(249).take(6).for_each(|byte| *byte = 0);
        if let Ok(mut file) = open(bytes) {
            let mut batches = 0;
            while let Ok(Some(_)) = file.next_batch() {
                batches += 1;
                if batches == 3 { break }
            }
        }
    }
}

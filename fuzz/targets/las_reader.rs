//! Any bytes as a LAS, LAZ or COPC file.
#![no_main]

mod seeds;

use libfuzzer_sys::fuzz_target;
use std::io::Cursor;
use timberline_ingest::scatter::scatter;
use timberline_ingest::{Damaged, Error, LasFile, ScatterParams, UnitChoice, survey};
use timberline_pointcloud::TileGrid;

/// A few bytes may promise thousands of millions of points; that costs time, not memory.
const MAX_POINTS: u64 = 200_000;

fuzz_target!(
    init: {
        // The corpus is read after this.
        if let Err(error) = seeds::write(std::path::Path::new("corpus/las_reader")) {
            eprintln!("no seeds: {error}");
        }
    },
    |bytes: &[u8]| run(bytes)
);

fn run(bytes: &[u8]) {
    let units = UnitChoice::default();
    let _ = survey::survey_source(&mut Cursor::new(bytes), units, None);
    let source = Box::new(Cursor::new(bytes.to_vec()));
    let Ok(file) = LasFile::from_source(source, units, None) else { return };
    let Ok(grid) = TileGrid::new(64, [0, 0]) else { return };
    let params = ScatterParams { damaged: Damaged::Keep, ..ScatterParams::default() };
    let mut points = 0;
    let progress = |count: u64| {
        points += count;
        if points > MAX_POINTS { Err(Error::Params("enough".to_owned())) } else { Ok(()) }
    };
    let _ = scatter(file, grid, &params, std::io::sink(), progress);
}

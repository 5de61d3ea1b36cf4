//! What the targets of point cloud formats share.

use std::io::Cursor;
use std::path::Path;
use timberline_ingest::scatter::scatter;
use timberline_ingest::{Damaged, Error, ScatterParams, UnitChoice, scan, survey};
use timberline_pointcloud::TileGrid;

/// A few bytes may promise thousands of millions of points; that costs time, not memory.
const MAX_POINTS: u64 = 200_000;

/// Reads bytes as a point cloud of whatever format they are.
pub fn run(bytes: &[u8]) {
    let units = UnitChoice::default();
    let open = || scan::from_source(Box::new(Cursor::new(bytes.to_vec())), units, None);
    if bytes.len() < 4096
        && let Ok(mut file) = open()
    {
        let _ = survey::survey_scan(file.as_mut());
    }
    let Ok(file) = open() else { return };
    let Ok(grid) = TileGrid::new(64, [0, 0]) else { return };
    let params = ScatterParams { damaged: Damaged::Keep, ..ScatterParams::default() };
    let mut points = 0;
    let progress = |count: u64| {
        points += count;
        if points > MAX_POINTS { Err(Error::Params("enough".to_owned())) } else { Ok(()) }
    };
    let _ = scatter(file, grid, &params, std::io::sink(), progress);
}

/// Writes files to begin from, where the folder does not hold them yet.
pub fn write_seeds(target: &str, seeds: &[(&str, Vec<u8>)]) {
    let folder = Path::new("corpus").join(target);
    let write = || -> std::io::Result<()> {
        std::fs::create_dir_all(&folder)?;
        for (name, bytes) in seeds {
            let path = folder.join(name);
            if !path.exists() {
                std::fs::write(path, bytes)?;
            }
        }
        Ok(())
    };
    // The corpus is read after this.
    if let Err(error) = write() {
        eprintln!("no seeds: {error}");
    }
}

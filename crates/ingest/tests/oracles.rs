//! Files of independent writers: libE57 (through pye57), plyfile, laspy and numpy.
//!
//! The environment variable `TIMBERLINE_ORACLE` names a Python interpreter that has the packages of
//! `.ci/requirements.txt`:
//!
//! `TIMBERLINE_ORACLE=python3 cargo test -p timberline-ingest --test oracles -- --ignored --nocapture`
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "test code")]

use std::path::Path;
use std::process::Command;
use timberline_ingest::{UnitChoice, scan};
use timberline_pointcloud::PointCloud;
use timberline_pointcloud::frame::ticks_from_world;

/// Position in ticks, intensity, colours of 8 bits.
type Row = ([i64; 3], i64, [i64; 3]);

fn expected(folder: &Path) -> Vec<Row> {
    let text = std::fs::read_to_string(folder.join("expected.csv")).unwrap();
    let mut rows: Vec<Row> = text
        .lines()
        .map(|line| {
            let values: Vec<f64> = line.split(',').map(|value| value.parse().unwrap()).collect();
            let at = [values[0], values[1], values[2]].map(ticks_from_world);
            (at, values[3] as i64, [values[4], values[5], values[6]].map(|value| value as i64))
        })
        .collect();
    rows.sort_unstable();
    rows
}

fn read(path: &Path) -> Vec<Row> {
    let mut file = scan::open(path, UnitChoice::default(), None).unwrap();
    let mut cloud = PointCloud::default();
    while let Some(batch) = file.next_batch().unwrap() {
        cloud.append(&batch).unwrap();
    }
    assert!(file.damage().is_none(), "{}: {:?}", path.display(), file.damages());
    println!("{}: {} points, {:?}", path.display(), cloud.len(), file.notes().messages());
    let colour = |name: &str, index: usize| cloud.extra[name].value(index) as i64 / 257;
    let mut rows: Vec<Row> = (0..cloud.len())
        .map(|index| {
            let at = cloud.world(index).map(ticks_from_world);
            let colours = ["red", "green", "blue"].map(|name| colour(name, index));
            (at, i64::from(cloud.intensity[index]), colours)
        })
        .collect();
    rows.sort_unstable();
    rows
}

#[test]
#[ignore = "needs TIMBERLINE_ORACLE"]
fn files_of_other_writers_are_read_exactly() {
    let python = std::env::var("TIMBERLINE_ORACLE").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle/write_clouds.py");
    let ran = Command::new(python).arg(script).arg(folder.path()).output().unwrap();
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    println!("{}", String::from_utf8_lossy(&ran.stdout));
    let expected = expected(folder.path());
    for name in
        ["blanks.xyz", "header.csv", "commas.txt", "text.ply", "little.ply", "big.ply", "cloud.laz"]
    {
        assert!(read(&folder.path().join(name)) == expected, "{name}");
    }
    // A turned scan is right to a rounding; intensities are stretched to the limits of each scan.
    let found = read(&folder.path().join("cloud.e57"));
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        let off = (0..3).map(|axis| (found.0[axis] - expected.0[axis]).abs()).max().unwrap();
        assert!(off <= 1, "{found:?} {expected:?}");
        assert!(
            (found.1 - expected.1).abs() < 100 && found.2 == expected.2,
            "{found:?} {expected:?}"
        );
    }
}

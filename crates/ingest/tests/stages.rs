//! The two stages through the stage contract, as the orchestrator runs them.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "test code")]

use las::{Builder, Point, Writer};
use std::path::Path;
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::PointTile;
use timberline_artefact::stage::{Campaign, RawFile};
use timberline_artefact::{UnitId, read, read_header};
use timberline_ingest::stage::{Scatter, Tiles};
use timberline_ingest::{ScatterParams, TilesParams};
use timberline_pointcloud::TileGrid;

fn write(path: &Path, points: i32) {
    let mut writer = Writer::from_path(path, Builder::from((1, 2)).into_header().unwrap()).unwrap();
    for i in 0..points {
        let at = f64::from(i) * 0.5;
        let point = Point {
            x: at,
            y: 3.0,
            z: 10.0 + at % 3.0,
            return_number: 1,
            number_of_returns: 1,
            ..Point::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.close().unwrap();
}

fn alone(folder: &Path) -> Alone {
    let grid = Some(TileGrid::new(64, [0, 0]).unwrap());
    Alone::new(folder, Campaign { grid, ..Campaign::default() })
}

#[test]
fn a_file_becomes_tiles() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.laz");
    write(&path, 200);
    let mut alone = alone(folder.path());
    let raw = RawFile { name: "a.laz".into(), path };
    let unit = UnitId::File("a.laz".into());
    let shards = alone.run::<Scatter>(unit, Some(raw), &ScatterParams::default()).unwrap();
    let header = read_header(&shards).unwrap();
    assert_eq!(header.facts.counts["points"], 200);
    assert_eq!(header.facts.parts.len(), 2);
    assert!(
        header.warnings.iter().any(|w| w.subject == "file a.laz" && w.message.contains("metres"))
    );
    let mut total = 0;
    for tile in header.facts.parts {
        let made = alone.run::<Tiles>(UnitId::Tile(tile), None, &TilesParams::default()).unwrap();
        let (header, tile) = read::<PointTile>(&made).unwrap();
        assert_eq!(header.facts.counts["points"], tile.cloud.len() as u64);
        assert_eq!(header.facts.frame, Some(tile.cloud.frame));
        total += tile.cloud.len();
    }
    assert_eq!(total, 200);
}

#[test]
fn a_refused_file_is_named_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.las");
    write(&path, 200);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() - 30]).unwrap();
    let mut alone = alone(folder.path());
    let raw = RawFile { name: "cut.las".into(), path: path.clone() };
    let run =
        alone.run::<Scatter>(UnitId::File("cut.las".into()), Some(raw), &ScatterParams::default());
    let message = run.unwrap_err().to_string();
    assert!(message.contains("cut.las: record 198"), "{message}");
    assert!(message.contains("`damaged = \"keep\"`"), "{message}");
    assert!(alone.files.is_empty());
}

//! Any bytes as an artefact, and as the payload of a sealed artefact of every kind.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::io::Write;
use timberline_artefact::container::ContainerWriter;
use timberline_artefact::kinds::{
    CrownModels, GroundModel, GroundPoints, Heights, Labels, Outputs, PointTile, Treetops, Trees,
};
use timberline_artefact::{Facts, Header, Kind, UnitId, codec, read, read_header};
use timberline_ingest::TilesParams;
use timberline_ingest::gather::gather;
use timberline_ingest::shard::ShardReader;
use timberline_pointcloud::{TileGrid, TileId};

fuzz_target!(|bytes: &[u8]| {
    let Some((choice, rest)) = bytes.split_first() else { return };
    match choice % 11 {
        0 => as_file(rest),
        1 => sealed::<CrownModels>(rest),
        2 => sealed::<GroundModel>(rest),
        3 => sealed::<GroundPoints>(rest),
        4 => sealed::<Heights>(rest),
        5 => sealed::<Labels>(rest),
        6 => sealed::<Outputs>(rest),
        7 => sealed::<Treetops>(rest),
        8 => sealed::<Trees>(rest),
        9 => shards(rest),
        _ => drop(codec::decode::<Vec<(u64, String)>>(rest)),
    }
});

fn as_file(bytes: &[u8]) {
    let Ok(mut file) = tempfile::NamedTempFile::new() else { return };
    if file.write_all(bytes).is_ok() {
        let _ = read_header(file.path());
        let _ = read::<PointTile>(file.path());
        let _ = read::<Trees>(file.path());
    }
}

fn header<K: Kind>(kind_version: u32) -> Header {
    Header {
        kind: K::NAME.to_owned(),
        kind_version,
        key: "0".repeat(32),
        stage: "fuzz".to_owned(),
        stage_version: 1,
        unit: UnitId::Campaign,
        params: serde_json::Value::Null,
        inputs: Vec::new(),
        tool_version: "0".to_owned(),
        facts: Facts::default(),
        warnings: Vec::new(),
    }
}

fn sealed<K: Kind>(payload: &[u8]) {
    K::READABLE.iter().for_each(|version| sealed_as::<K>(*version, payload));
}

fn sealed_as<K: Kind>(version: u32, payload: &[u8]) {
    let Ok(mut file) = tempfile::NamedTempFile::new() else { return };
    let Ok(json) = header::<K>(version).to_json() else { return };
    let written = ContainerWriter::new(&mut file).and_then(|mut writer| {
        writer.write_all(payload)?;
        writer.finish(&json).map(drop)
    });
    if written.is_ok() {
        let _ = read::<K>(file.path());
    }
}

fn shards(payload: &[u8]) {
    let Ok(mut reader) = ShardReader::new(payload) else { return };
    let Ok(grid) = TileGrid::new(64, [0, 0]) else { return };
    let tile = reader.index().tiles().first().copied().unwrap_or(TileId { ix: 0, iy: 0 });
    let _ = gather(tile, grid, std::slice::from_mut(&mut reader), &TilesParams::default());
}

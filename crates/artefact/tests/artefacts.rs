//! Round trips, determinism, corruption and the golden files.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use proptest::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};
use timberline_artefact::alone::Alone;
use timberline_artefact::container::ContainerWriter;
use timberline_artefact::kinds::*;
use timberline_artefact::stage::{Campaign, Context, Inputs, Params, Stage, StageError, StageInfo};
use timberline_artefact::{
    Aligned, Error, Kind, Opened, UnitId, UnitKind, gather, read, read_header,
};
use timberline_pointcloud::{Frame, PointCloud, Rect, TileId, frame::quantise};

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden")
}

/// The golden file of a kind in its present version.
fn golden_file(kind: &str) -> PathBuf {
    let info = info(kind).unwrap();
    golden().join(format!("{kind}-v{}.{}", info.version, info.extension))
}

/// Reads an artefact of any kind in full.
fn read_any(kind: &str, path: &Path) -> Result<(), Error> {
    fn full<K: Kind>(path: &Path) -> Result<(), Error> {
        read::<K>(path).map(drop)
    }
    match kind {
        "points" => full::<PointTile>(path),
        "ground-points" => full::<GroundPoints>(path),
        "ground-model" => full::<GroundModel>(path),
        "heights" => full::<Heights>(path),
        "treetops" => full::<Treetops>(path),
        "crown-models" => full::<CrownModels>(path),
        "detections" => full::<Detections>(path),
        "labels" => full::<Labels>(path),
        "trees" => full::<Trees>(path),
        "outputs" => full::<Outputs>(path),
        "stems" => full::<Stems>(path),
        "tree-cloud" => full::<TreeCloud>(path),
        "consolidated" => full::<Consolidated>(path),
        "skeletons" => full::<Skeletons>(path),
        "qsm" => full::<Qsm>(path),
        "model-files" => full::<ModelFiles>(path),
        "picture-files" => full::<PictureFiles>(path),
        _ => unreachable!("{kind}"),
    }
}

#[test]
fn points_come_back_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let (_, path) = common::write_all(folder.path()).remove(0);
    let (header, tile) = read::<PointTile>(&path).unwrap();
    assert_eq!(tile.cloud, common::cloud());
    assert_eq!(header.unit, common::unit());
    assert_eq!(header.facts.counts["points"], 500);
}

#[test]
fn a_part_holds_the_points_of_the_rectangle_and_their_indices() {
    let folder = tempfile::tempdir().unwrap();
    let (_, path) = common::write_all(folder.path()).remove(0);
    let rect = Rect { min: [470.0, -110.0], max: [490.0, -90.0] };
    let part = PointTile::read_within(&path, &rect).unwrap();
    let whole = common::cloud();
    let expected: Vec<u32> = (0..500u32)
        .filter(|&i| {
            let [x, y, _] = whole.world(i as usize);
            (470.0..=490.0).contains(&x) && (-110.0..=-90.0).contains(&y)
        })
        .collect();
    assert_eq!(part.index, expected);
    assert_eq!(part.cloud, whole.select(&expected));
}

/// Two tiles side by side; a height of every point is its index in its tile.
fn two_tiles(folder: &Path) -> (Inputs, PointCloud) {
    let east = common::cloud();
    let west = PointCloud { frame: Frame::new([448 - 64, -128, 1]), ..east.clone() };
    let mut store = Alone::new(folder, Campaign::default());
    for (ix, cloud) in [(6, &west), (7, &east)] {
        let unit = UnitId::Tile(TileId { ix, iy: -2 });
        let height_m = (0..cloud.len()).map(|i| i as f32).collect();
        let facts = common::facts(cloud.frame);
        store.put(unit.clone(), &PointTile { cloud: cloud.clone() }, facts.clone()).unwrap();
        store.put(unit, &Heights { height_m }, facts).unwrap();
    }
    (Inputs::new(common::unit(), None, store.files), west)
}

#[test]
fn a_tile_is_gathered_with_what_lies_in_the_halo() {
    let folder = tempfile::tempdir().unwrap();
    let (inputs, west) = two_tiles(folder.path());
    let all = gather(&inputs, 5.0, &[Aligned::Height]).unwrap();
    let east = common::cloud();
    let in_halo = west.x.iter().filter(|x| **x >= 64.0 - 5.0).count();
    assert!(in_halo > 0 && in_halo < west.len());
    assert_eq!((all.own_len, all.cloud.len()), (east.len(), east.len() + in_halo));
    assert_eq!(all.cloud, all.cloud.in_canonical_order());
    for (place, own) in all.own.iter().enumerate() {
        let index = all.height_m[place] as usize;
        let source = if own.is_some() { &east } else { &west };
        assert_eq!(all.cloud.world(place), source.world(index));
        assert!(own.is_none_or(|own| own as usize == index));
    }
    let own: Vec<f32> = (0..east.len()).map(|i| i as f32).collect();
    assert_eq!(all.own_values(&all.height_m), own);
}

#[test]
fn a_column_of_another_length_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let (inputs, _) = two_tiles(folder.path());
    let mut store = Alone::new(folder.path(), Campaign::default());
    let west = UnitId::Tile(TileId { ix: 6, iy: -2 });
    let short = Heights { height_m: vec![0.0; 499] };
    store.put(west, &short, common::facts(common::cloud().frame)).unwrap();
    let error = gather(&inputs, 5.0, &[Aligned::Height]).unwrap_err().to_string();
    assert!(error.contains("`heights` of tile:6_-2 has 499 values for 500 points"), "{error}");
}

#[test]
fn a_stage_must_write_what_it_declares() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Alone::new(folder.path(), Campaign::default());
    let error = store.run::<Silent>(common::unit(), None, &Nothing::default()).unwrap_err();
    assert!(error.to_string().contains("wrote [] but declares [\"trees\"]"), "{error}");
}

#[derive(Clone, Default, Serialize, Deserialize, JsonSchema)]
struct Nothing {}

impl Params for Nothing {}

/// Declares trees and writes nothing.
struct Silent;

impl Stage for Silent {
    type Params = Nothing;

    fn info() -> StageInfo {
        StageInfo {
            name: "silent",
            version: 1,
            summary: "",
            unit: UnitKind::Tile,
            inputs: &[],
            outputs: &[Trees::NAME],
        }
    }

    fn run(_: &Nothing, _: &Inputs, _: &Context<'_>) -> Result<(), StageError> {
        Ok(())
    }
}

#[test]
fn elevations_beyond_f32_are_kept_exactly() {
    let mut cloud = common::cloud();
    cloud.z[3] = quantise(4321.0987) - 1.0;
    let folder = tempfile::tempdir().unwrap();
    let mut store = timberline_artefact::alone::Alone::new(folder.path(), Default::default());
    let facts = common::facts(cloud.frame);
    let path = store.put(common::unit(), &PointTile { cloud: cloud.clone() }, facts).unwrap();
    assert_eq!(read::<PointTile>(&path).unwrap().1.cloud, cloud);
}

#[test]
fn writing_twice_gives_the_same_bytes() {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    for ((kind, left), (_, right)) in
        common::write_all(a.path()).iter().zip(common::write_all(b.path()))
    {
        assert_eq!(std::fs::read(left).unwrap(), std::fs::read(right).unwrap(), "{kind}");
    }
}

#[test]
fn another_kind_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let paths = common::write_all(folder.path());
    let (_, heights) = &paths[3];
    let error = read::<Trees>(heights).unwrap_err().to_string();
    assert!(error.contains("holds `heights`, expected `trees`"), "{error}");
}

#[test]
fn foreign_files_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for bytes in
        [&b""[..], b"LASF", b"LASF0123456789012345678901234567890123456789012345678901234567"]
    {
        let path = folder.path().join("x");
        std::fs::write(&path, bytes).unwrap();
        assert!(matches!(read::<Trees>(&path), Err(Error::Foreign { .. })));
    }
}

#[test]
fn every_truncation_is_detected() {
    let folder = tempfile::tempdir().unwrap();
    for (kind, path) in common::write_all(folder.path()) {
        let bytes = std::fs::read(&path).unwrap();
        let step = (bytes.len() / 300).max(1);
        for len in (0..bytes.len()).step_by(step).chain([bytes.len() - 1]) {
            std::fs::write(&path, &bytes[..len]).unwrap();
            assert!(read_any(kind, &path).is_err(), "{kind} cut to {len} bytes was read");
        }
        let longer = [&bytes[..], b"x"].concat();
        std::fs::write(&path, longer).unwrap();
        assert!(read_any(kind, &path).is_err(), "{kind} with a byte more was read");
    }
}

#[test]
fn every_changed_byte_is_detected() {
    let folder = tempfile::tempdir().unwrap();
    for (kind, path) in common::write_all(folder.path()) {
        let bytes = std::fs::read(&path).unwrap();
        let step = (bytes.len() / 400).max(1);
        for at in (0..bytes.len()).step_by(step).chain(bytes.len().saturating_sub(120)..bytes.len())
        {
            for bit in [0, 3, 7] {
                let mut changed = bytes.clone();
                changed[at] ^= 1 << bit;
                std::fs::write(&path, &changed).unwrap();
                assert!(
                    read_any(kind, &path).is_err(),
                    "{kind}: bit {bit} of byte {at} of {}",
                    bytes.len()
                );
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn rubbish_is_refused_without_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..400), mcap: bool) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x");
        let magic: &[u8] = if mcap { b"\x89MCAP0\r\n" } else { b"TMBRLINE\x01\0\0\0" };
        std::fs::write(&path, [magic, &bytes].concat()).unwrap();
        prop_assert!(Opened::open(&path).is_err());
    }
}

/// Raise a kind's version: add its file to the folder by `--ignored write_golden_files`, keep the old.
#[test]
fn golden_files_stay_readable() {
    for kind in all().iter().filter(|kind| kind.name != Shards::NAME) {
        let path = golden_file(kind.name);
        assert!(path.exists(), "{} is missing", path.display());
        read_any(kind.name, &path).unwrap();
    }
}

/// Reads the golden file of every older version of a kind: whole where it is migrated, else refused
/// by a message that names both versions.
fn read_older<K: Kind>() {
    for version in 1..K::VERSION {
        let path = golden().join(format!("{}-v{version}.{}", K::NAME, K::EXTENSION));
        assert!(path.exists(), "{} is missing", path.display());
        let known = K::READABLE.contains(&version);
        match read::<K>(&path) {
            Ok((header, _)) => assert!(known && header.kind_version == version),
            Err(error) => {
                let text = error.to_string();
                assert!(!known && text.contains(&format!("version {version}")), "{text}");
            }
        }
    }
}

#[test]
fn golden_files_of_older_versions_are_migrated_or_refused_by_name() {
    read_older::<PointTile>();
    read_older::<GroundPoints>();
    read_older::<GroundModel>();
    read_older::<Heights>();
    read_older::<Treetops>();
    read_older::<CrownModels>();
    read_older::<Detections>();
    read_older::<Labels>();
    read_older::<Trees>();
    read_older::<Outputs>();
    read_older::<Stems>();
    read_older::<TreeCloud>();
    read_older::<Consolidated>();
    read_older::<Skeletons>();
    read_older::<Qsm>();
    read_older::<ModelFiles>();
    read_older::<PictureFiles>();
    assert_eq!(Trees::READABLE, [1, 2, 3]);
    assert_eq!(Treetops::READABLE, [1, 2]);
}

/// A tree of a time when detection had no scores.
fn undetected() -> Tree {
    Tree { score: f32::NAN, origin: Origin::Surface, ..common::tree() }
}

#[test]
fn trees_of_version_2_are_migrated() {
    let (_, table) = read::<Trees>(&golden().join("trees-v2.tmbr")).unwrap();
    assert_eq!(format!("{:?}", table.trees), format!("{:?}", [undetected()]));
}

#[test]
fn treetops_of_version_1_are_migrated() {
    let (_, table) = read::<Treetops>(&golden().join("treetops-v1.tmbr")).unwrap();
    let [top] = table.tops[..] else { panic!("{table:?}") };
    assert_eq!((top.id, top.prominence_m, top.score, top.cover_m), (42, 1.25, 1.0, 0.0));
}

/// What version 1 kept is there; what it did not keep is missing and not zero.
#[test]
fn trees_of_version_1_are_migrated() {
    let (_, table) = read::<Trees>(&golden().join("trees-v1.tmbr")).unwrap();
    let expected = Tree {
        position_extent_m: f64::NAN,
        surface_apex_m: f64::NAN,
        semi_axes_m: [1.5, 1.5],
        rotation_deg: f64::NAN,
        fit_cells: 0,
        fit_objective_m: f64::NAN,
        fit_gap: f64::NAN,
        fit_nodes: 0,
        ..undetected()
    };
    // As text, where not-a-number is equal to itself.
    assert_eq!(format!("{:?}", table.trees), format!("{:?}", [expected]));
}

#[test]
fn a_version_that_cannot_be_read_names_those_that_can() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.tmbr");
    let mut header = read_header(&golden_file("trees")).unwrap();
    header.kind_version = 9;
    let mut writer = ContainerWriter::new(std::fs::File::create(&path).unwrap()).unwrap();
    writer.write_all(b"of the future").unwrap();
    writer.finish(&header.to_json().unwrap()).unwrap();
    let error = read::<Trees>(&path).unwrap_err().to_string();
    assert!(error.contains("`trees` version 9, this program reads version 1, 2 or 3"), "{error}");
}

#[test]
fn golden_files_hold_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    for (kind, written) in common::write_all(folder.path()) {
        let kept = golden_file(kind);
        assert_eq!(std::fs::read(kept).unwrap(), std::fs::read(written).unwrap(), "{kind}");
    }
}

#[test]
fn a_newer_container_names_both_versions_and_the_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.tmbr");
    let mut bytes = std::fs::read(golden().join("trees-v1.tmbr")).unwrap();
    bytes[8] = 9;
    std::fs::write(&path, bytes).unwrap();
    let error = read::<Trees>(&path).unwrap_err().to_string();
    assert!(
        error.contains("version 9") && error.contains("version 1") && error.contains("run"),
        "{error}"
    );
}

#[test]
#[ignore = "writes golden files of new versions into the source tree"]
fn write_golden_files() {
    let folder = tempfile::tempdir().unwrap();
    for (kind, written) in common::write_all(folder.path()) {
        let kept = golden_file(kind);
        if !kept.exists() {
            std::fs::copy(written, kept).unwrap();
        }
    }
}

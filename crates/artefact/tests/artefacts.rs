//! Round trips, determinism, corruption and the golden files.

#![allow(clippy::unwrap_used, missing_docs)]

mod common;

use proptest::prelude::*;
use std::path::{Path, PathBuf};
use timberline_artefact::kinds::*;
use timberline_artefact::{Error, Kind, Opened, read};
use timberline_pointcloud::{Rect, frame::quantise};

fn golden() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden")
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
        "labels" => full::<Labels>(path),
        "trees" => full::<Trees>(path),
        "outputs" => full::<Outputs>(path),
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
    let (_, part) = PointTile::read_within(&path, &rect).unwrap();
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
    for (kind, version, _) in all() {
        if kind == Shards::NAME {
            continue;
        }
        let extension = extension(kind).unwrap();
        let path = golden().join(format!("{kind}-v{version}.{extension}"));
        assert!(path.exists(), "{} is missing", path.display());
        read_any(kind, &path).unwrap();
    }
}

#[test]
fn golden_files_hold_what_was_written() {
    let folder = tempfile::tempdir().unwrap();
    for (kind, written) in common::write_all(folder.path()) {
        let version = all().iter().find(|(name, ..)| *name == kind).unwrap().1;
        let extension = extension(kind).unwrap();
        let kept = golden().join(format!("{kind}-v{version}.{extension}"));
        assert_eq!(std::fs::read(kept).unwrap(), std::fs::read(written).unwrap(), "{kind}");
    }
}

#[test]
fn a_newer_version_names_both_and_the_remedy() {
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
        let version = all().iter().find(|(name, ..)| *name == kind).unwrap().1;
        let kept = golden().join(format!("{kind}-v{version}.{}", extension(kind).unwrap()));
        if !kept.exists() {
            std::fs::copy(written, kept).unwrap();
        }
    }
}

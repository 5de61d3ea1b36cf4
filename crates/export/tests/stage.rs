//! The stage `export` over a small campaign.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod scene;

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use timberline_artefact::kinds::{Labels, Outputs, Trees};
use timberline_artefact::{Kind, UnitId};
use timberline_export::stage::{ExportStage, Params};

/// Runs the stage; returns the manifest and the contents of all files in the outputs folder.
fn export(
    folder: &Path,
    edge_m: u32,
    origin_m: [i64; 2],
    plots: usize,
) -> (Outputs, BTreeMap<String, Vec<u8>>) {
    let mut alone = scene::campaign(folder, edge_m, origin_m, plots);
    let manifest = alone.run::<ExportStage>(UnitId::Campaign, None, &Params::default()).unwrap();
    let (header, outputs) = timberline_artefact::read::<Outputs>(&manifest).unwrap();
    assert_eq!(header.kind, Outputs::NAME);
    let entries = std::fs::read_dir(alone.outputs()).unwrap().map(Result::unwrap);
    let files = entries
        .map(|e| (e.file_name().into_string().unwrap(), std::fs::read(e.path()).unwrap()))
        .collect();
    (outputs, files)
}

#[test]
fn one_plot() {
    let folder = tempfile::tempdir().unwrap();
    let (outputs, files) = export(folder.path(), 64, [0, 0], 1);
    let expected =
        ["chm.tif", "dtm.tif", "points.laz", "trees.csv", "trees.dictionary.csv", "trees.gpkg"];
    assert_eq!(files.keys().collect::<Vec<_>>(), expected);
    let listed: Vec<_> = outputs.files.iter().map(|file| (&file.name, file.bytes)).collect();
    let found: Vec<_> = files.iter().map(|(name, bytes)| (name, bytes.len() as u64)).collect();
    assert_eq!(listed, found);
    assert_eq!((outputs.totals["trees"], outputs.totals["points"]), (49, 30_000));
    let rows = String::from_utf8(files["trees.csv"].clone()).unwrap();
    assert_eq!(rows.lines().count(), 50);
    if let Ok(keep) = std::env::var("TIMBERLINE_KEEP_OUTPUTS") {
        std::fs::create_dir_all(&keep).unwrap();
        files
            .iter()
            .for_each(|(name, bytes)| std::fs::write(Path::new(&keep).join(name), bytes).unwrap());
    }
}

/// Files kept under `golden/`: text as it is, the others by their hash. A difference that is meant
/// raises the version of the stage; `TIMBERLINE_WRITE_GOLDEN=1` then writes them anew.
#[test]
fn the_files_are_those_of_this_version() {
    let folder = tempfile::tempdir().unwrap();
    let (outputs, files) = export(folder.path(), 64, [0, 0], 2);
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    // The GeoPackage names the version of the program.
    let hashed = outputs.files.iter().filter(|file| file.name != "trees.gpkg");
    let lines = hashed.map(|file| format!("{}  {}\n", file.hash, file.name));
    let mut expected = BTreeMap::from([("hashes.txt".to_owned(), lines.collect::<String>())]);
    for name in ["trees.csv", "trees.dictionary.csv", "dtm.vrt"] {
        expected.insert(name.to_owned(), String::from_utf8(files[name].clone()).unwrap());
    }
    for (name, text) in expected {
        let path = golden.join(&name);
        if std::env::var_os("TIMBERLINE_WRITE_GOLDEN").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        assert!(
            std::fs::read_to_string(&path).unwrap() == text,
            "{name} differs from the golden file"
        );
    }
}

#[test]
fn two_plots_far_apart_get_a_raster_each() {
    let folder = tempfile::tempdir().unwrap();
    let (outputs, files) = export(folder.path(), 64, [0, 0], 2);
    for name in ["dtm-1.tif", "dtm-2.tif", "dtm.vrt", "chm-1.tif", "chm-2.tif", "chm.vrt"] {
        assert!(files.contains_key(name), "{name}");
    }
    assert!(!files.contains_key("dtm.tif"));
    assert_eq!(outputs.totals["sites"], 2);
    if let Ok(keep) = std::env::var("TIMBERLINE_KEEP_OUTPUTS") {
        let keep = Path::new(&keep).join("two");
        std::fs::create_dir_all(&keep).unwrap();
        files.iter().for_each(|(name, bytes)| std::fs::write(keep.join(name), bytes).unwrap());
    }
}

#[test]
fn how_the_campaign_is_cut_does_not_matter() {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let (_, reference) = export(a.path(), 32, [0, 0], 1);
    let (_, larger) = export(b.path(), 128, [0, 0], 1);
    for (name, bytes) in &reference {
        assert!(larger[name] == *bytes, "{name} differs");
    }
    let c = tempfile::tempdir().unwrap();
    let (_, shifted) = export(c.path(), 50, [7, -13], 1);
    for name in ["chm.tif", "dtm.tif", "trees.csv", "trees.gpkg"] {
        assert!(shifted[name] == reference[name], "{name} differs");
    }
}

/// A stage that fails on a tile loses its trees; the tiles around it keep theirs.
#[test]
fn no_point_names_a_tree_that_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let mut alone = scene::campaign(folder.path(), 32, [0, 0], 1);
    let with_trees: Vec<UnitId> =
        alone.files.iter().filter(|f| f.kind == Trees::NAME).map(|f| f.unit.clone()).collect();
    let lost = with_trees[with_trees.len() / 2].clone();
    let Trees { trees } = alone.read(lost.clone()).unwrap();
    let gone: BTreeSet<u64> = trees.iter().map(|tree| tree.id).collect();
    let named = |unit: &UnitId| {
        let Labels { tree_id, .. } = alone.read(unit.clone()).unwrap();
        tree_id.iter().filter(|id| gone.contains(id)).count()
    };
    let around: usize = with_trees.iter().filter(|unit| **unit != lost).map(named).sum();
    assert!(around > 0, "no other tile has points of its trees");

    alone.files.retain(|file| file.kind != Trees::NAME || file.unit != lost);
    alone.run::<ExportStage>(UnitId::Campaign, None, &Params::default()).unwrap();
    let table = std::fs::read_to_string(alone.outputs().join("trees.csv")).unwrap();
    let told: BTreeSet<u64> =
        table.lines().skip(1).map(|row| row.split(',').next().unwrap().parse().unwrap()).collect();
    assert!(told.len() < 49 && told.is_disjoint(&gone));
    let mut reader = las::Reader::from_path(alone.outputs().join("points.laz")).unwrap();
    let points = reader.read_all().unwrap();
    let tree = |point: las::Result<las::Point>| {
        // After the height above ground, 4 bytes.
        f64::from_le_bytes(point.unwrap().extra_bytes[4..12].try_into().unwrap()) as u64
    };
    let mut found: BTreeSet<u64> = points.points().map(tree).collect();
    assert!(found.remove(&0));
    assert_eq!(found, told);
}

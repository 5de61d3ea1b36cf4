//! The stage `map` over the small campaign that `export` is tested with.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

#[path = "../../export/tests/scene/mod.rs"]
mod scene;

use std::collections::BTreeMap;
use timberline_artefact::UnitId;
use timberline_report::stage::{MapStage, Params};

/// Runs the stage and returns the pictures.
fn maps(edge_m: u32, origin_m: [i64; 2], plots: usize) -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let mut alone = scene::campaign(folder.path(), edge_m, origin_m, plots);
    alone.run::<MapStage>(UnitId::Campaign, None, &Params::default()).unwrap();
    let entries = std::fs::read_dir(alone.outputs()).unwrap().map(Result::unwrap);
    entries
        .map(|e| (e.file_name().into_string().unwrap(), std::fs::read(e.path()).unwrap()))
        .collect()
}

#[test]
fn a_map_for_every_site_however_the_campaign_is_cut() {
    let reference = maps(64, [0, 0], 2);
    assert_eq!(reference.keys().collect::<Vec<_>>(), ["map-1.png", "map-2.png"]);
    assert!(maps(50, [7, -13], 2) == reference);
    if let Ok(keep) = std::env::var("TIMBERLINE_KEEP_OUTPUTS") {
        std::fs::create_dir_all(&keep).unwrap();
        for (name, bytes) in &reference {
            std::fs::write(std::path::Path::new(&keep).join(name), bytes).unwrap();
        }
    }
}

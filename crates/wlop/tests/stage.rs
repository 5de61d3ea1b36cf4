//! The stage on a made-up tree.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{BaseSource, Consolidated, Stem, TreeCloud};
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Facts, UnitId};
use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::{Column, Frame, Point, PointCloud};
use timberline_wlop::stage::ConsolidationStage;
use timberline_wlop::{ConsolidationParams, Method};

/// A repeatable number in 0 to 1 (SplitMix64, Steele et al. 2014).
fn uniform(seed: u64) -> f64 {
    let mut v = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    v = (v ^ (v >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((v ^ (v >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A rough stem of 12 cm radius and 1 m, at a place in the world.
fn tree(at: [f64; 3]) -> TreeCloud {
    let mut cloud = PointCloud::new(Frame::near(at));
    for i in 0..8000u16 {
        let seed = 3 * u64::from(i);
        let angle = std::f64::consts::TAU * uniform(seed);
        let radius = 0.12 + 0.008 * (uniform(seed + 1) - 0.5);
        let local = [radius * libm::cos(angle), radius * libm::sin(angle), uniform(seed + 2)];
        let world = [0, 1, 2].map(|k| quantise(at[k] + local[k]));
        cloud.push_world(world, &Point { intensity: i, ..Point::default() });
    }
    cloud.extra.insert(TreeCloud::WOOD.to_owned(), Column::F32(vec![0.75; cloud.len()]));
    let (base_source, bounds) = (BaseSource::Ground, cloud.bounds());
    let stem = Stem { tree_id: 7, base_m: at, base_source, dbh_m: f64::NAN, bounds };
    TreeCloud { stem, cloud: cloud.in_canonical_order() }
}

fn run(tree: &TreeCloud, params: &ConsolidationParams) -> Consolidated {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Alone::new(folder.path(), Campaign::default());
    let unit = UnitId::Tree(tree.stem.tree_id);
    let facts = Facts { frame: Some(tree.cloud.frame), ..Facts::default() };
    store.put(unit.clone(), tree, facts).unwrap();
    let path = store.run::<ConsolidationStage>(unit, None, params).unwrap();
    let (header, made) = timberline_artefact::read::<Consolidated>(&path).unwrap();
    assert_eq!(header.facts.frame, Some(tree.cloud.frame));
    assert_eq!(
        header.warnings.len(),
        usize::from(params.min_points > 8000),
        "{:?}",
        header.warnings
    );
    made
}

#[test]
fn a_tree_is_consolidated_with_its_attributes() {
    let here = tree([12.5, 7.5, 3.0]);
    let made = run(&here, &ConsolidationParams::default());
    let told = &made.consolidation;
    assert_eq!((&told.skipped, told.points_before), (&None, 8000));
    assert_eq!(told.points_after as usize, made.cloud.len());
    assert!(told.thickness_after_m < told.thickness_before_m, "{told:?}");
    assert!(told.mean_shift_m <= told.distance_before_m, "{told:?}");
    let Column::U8(stem) = &made.cloud.extra[Consolidated::STEM] else { unreachable!() };
    assert!(stem.iter().filter(|s| **s == 1).count() * 10 > 9 * stem.len());
    assert_eq!(made.cloud.extra[TreeCloud::WOOD].value(0), 0.75);
    // Each point is still near the one that it was.
    let was = |i: usize| {
        (0..here.cloud.len()).find(|&j| here.cloud.intensity[j] == made.cloud.intensity[i])
    };
    for i in (0..made.cloud.len()).step_by(97) {
        let (p, q) = (made.cloud.local(i), here.cloud.local(was(i).unwrap()));
        assert!((0..3).all(|k| (p[k] - q[k]).abs() < 0.05), "{p:?} {q:?}");
    }
}

#[test]
fn a_shift_of_the_world_by_whole_metres_changes_less_than_a_millimetre() {
    let params = ConsolidationParams::default();
    let here = run(&tree([12.5, 7.5, 3.0]), &params);
    let there = run(&tree([500_012.5, 5_000_007.5, 1003.0]), &params);
    assert_eq!(here.cloud.len(), there.cloud.len());
    let by_mark = |made: &Consolidated| {
        let mut all: Vec<(u16, [f64; 3])> =
            (0..made.cloud.len()).map(|i| (made.cloud.intensity[i], made.cloud.local(i))).collect();
        all.sort_by_key(|(mark, _)| *mark);
        all
    };
    for ((a, p), (b, q)) in by_mark(&here).into_iter().zip(by_mark(&there)) {
        assert_eq!(a, b);
        assert!((0..3).all(|k| (p[k] - q[k]).abs() < 1e-3), "{p:?} {q:?}");
    }
}

#[test]
fn a_skipped_tree_says_why_and_has_no_points() {
    let few = ConsolidationParams { min_points: 9000, ..ConsolidationParams::default() };
    let none = ConsolidationParams { method: Method::None, ..ConsolidationParams::default() };
    let here = tree([0.0; 3]);
    for (params, word) in [(few, "9000"), (none, "`none`")] {
        let made = run(&here, &params);
        assert!(made.cloud.is_empty());
        assert!(made.consolidation.skipped.unwrap().contains(word));
    }
}

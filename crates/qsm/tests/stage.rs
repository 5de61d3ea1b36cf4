//! The stage `cylinders` on a post: complete, the same wherever it stands and with any number of threads.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{
    BaseSource, Consolidated, Consolidation, Qsm, RadiusSource, Skeleton, SkeletonNode, Skeletons,
    Stem, TreeCloud,
};
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Facts, UnitId, read};
use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::{Bounds3, Column, Frame, Point, PointCloud};
use timberline_qsm::Params;
use timberline_qsm::stage::CylindersStage;

const TREE: u64 = 4711;
const BASE: [f64; 3] = [500_000.25, 5_000_000.5, 812.0];

/// A tapering post of 4 m with a limb at 2 m, its points in canonical order.
fn cloud(shift: [f64; 3]) -> PointCloud {
    let base: [f64; 3] = std::array::from_fn(|k| BASE[k] + shift[k]);
    let mut cloud = PointCloud::new(Frame::near(base));
    // Points of a campaign lie on the lattice of 0.1 mm; none here lies between two of its places.
    let mut push = |at: [f64; 3]| cloud.push_world(at.map(quantise), &Point::default());
    for i in 0..6000 {
        let (sin, cos) = libm::sincos(f64::from(i) * 2.4);
        let z = f64::from(i) / 1500.0;
        let radius = 0.12 - 0.01 * z + 0.002 * libm::sin(f64::from(i) * 12.9);
        push([base[0] + radius * cos, base[1] + radius * sin, base[2] + z]);
        if i % 3 == 0 {
            let (x, radius) = (0.100_03 + 0.9 * f64::from(i) / 6000.0, 0.03);
            let at = [base[0] + x, base[1] + radius * cos, base[2] + 2.0 + radius * sin];
            push(at);
        }
    }
    let mut cloud = cloud.in_canonical_order();
    cloud.extra.insert(TreeCloud::WOOD.to_owned(), Column::F32(vec![0.9; cloud.len()]));
    cloud
}

fn skeleton(frame: &Frame, base: [f64; 3]) -> Skeleton {
    let local = frame.local_from_world(base);
    let node = |x: f64, z: f64, parent, radius_m| SkeletonNode {
        position_m: [local[0] + x, local[1], local[2] + z],
        parent,
        radius_m,
        points: 100,
    };
    Skeleton {
        nodes: vec![
            node(0.02, 0.0, None, 0.2),
            node(0.0, 2.0, Some(0), 0.2),
            node(0.0, 4.0, Some(1), 0.1),
            node(1.0, 2.0, Some(1), 0.06),
        ],
    }
}

/// The model, its facts and its warnings.
fn run(
    shift: [f64; 3],
    threads: usize,
    skipped: bool,
    params: &Params,
) -> (Qsm, Facts, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Alone::new(folder.path(), Campaign::default());
    let unit = UnitId::Tree(TREE);
    let cloud = cloud(shift);
    let base_m: [f64; 3] = std::array::from_fn(|k| BASE[k] + shift[k]);
    let facts = Facts { frame: Some(cloud.frame), ..Facts::default() };
    let raw = skeleton(&cloud.frame, base_m);
    let stem = Stem {
        tree_id: TREE,
        base_m,
        base_source: BaseSource::Ground,
        dbh_m: f64::NAN,
        bounds: Bounds3 { min: base_m, max: base_m },
    };
    let reason = skipped.then(|| "too few points".to_owned());
    let consolidated = Consolidated {
        consolidation: Consolidation { skipped: reason, ..Consolidation::default() },
        cloud: PointCloud::new(cloud.frame),
    };
    let other = (!skipped).then(|| raw.clone());
    store.put(unit.clone(), &TreeCloud { stem, cloud }, facts.clone()).unwrap();
    store.put(unit.clone(), &consolidated, facts.clone()).unwrap();
    store.put(unit.clone(), &Skeletons { raw, consolidated: other }, facts).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let path = pool.install(|| store.run::<CylindersStage>(unit, None, params)).unwrap();
    let (header, qsm) = read::<Qsm>(&path).unwrap();
    let warnings =
        header.warnings.iter().map(|w| format!("{}: {}", w.subject, w.message)).collect();
    (qsm, header.facts, warnings)
}

#[test]
fn a_tree_is_complete() {
    let (qsm, facts, warnings) = run([0.0; 3], 2, true, &Params::default());
    assert_eq!((qsm.tree_id, qsm.base_m, qsm.base_source), (TREE, BASE, BaseSource::Ground));
    let dbh = qsm.metrics.dbh.unwrap();
    assert!((dbh.diameter_m - 0.214).abs() < 0.004, "{dbh:?}");
    assert_eq!(dbh.source, RadiusSource::Measured);
    assert!((qsm.metrics.height_m - 4.0).abs() < 0.01);
    assert_eq!(qsm.branches.len(), 2);
    assert_eq!(facts.counts["cylinders"], qsm.cylinders.len() as u64);
    assert_eq!(facts.counts["branch-orders"], 2);
    assert!(facts.counts["cylinders-measured"] > 10, "{facts:?}");
    assert!(facts.frame.is_some());
    assert_eq!(warnings, Vec::<String>::new());
    assert!(!qsm.consolidation.used && qsm.consolidation.consolidated_mean_m.is_nan());
    assert_eq!(qsm.consolidation.reason, "consolidation was skipped: too few points");
    assert!((qsm.consolidation.raw_mean_m - qsm.cloud_to_model.mean_m).abs() < 1e-12);
    for (place, cylinder) in qsm.cylinders.iter().enumerate() {
        assert_eq!(cylinder.parent.is_none(), place == 0);
        assert!(cylinder.parent.is_none_or(|parent| (parent as usize) < place));
    }
}

#[test]
fn an_equally_good_consolidated_skeleton_is_taken() {
    let (qsm, facts, _) = run([0.0; 3], 2, false, &Params::default());
    assert!(qsm.consolidation.used && qsm.consolidation.reason.is_empty());
    assert_eq!(qsm.consolidation.consolidated_mean_m, qsm.consolidation.raw_mean_m);
    assert_eq!(facts.counts["consolidated"], 1);
}

#[test]
fn place_and_threads_change_nothing() {
    let (one, ..) = run([0.0; 3], 1, false, &Params::default());
    let (two, ..) = run([0.0; 3], 2, false, &Params::default());
    assert_eq!(one, two);
    let shift = [123_456.0, -654_321.0, 1000.0];
    let (moved, ..) = run(shift, 2, false, &Params::default());
    assert_eq!(moved.cylinders, one.cylinders);
    let back: [f64; 3] = std::array::from_fn(|k| moved.base_m[k] - shift[k]);
    assert_eq!(back, one.base_m);
    assert_eq!(moved.metrics, one.metrics);
}

#[test]
fn a_stem_below_breast_height_is_a_warning() {
    let params = Params { breast_height_m: 4.5, ..Params::default() };
    let (qsm, _, warnings) = run([0.0; 3], 2, true, &params);
    assert!(qsm.metrics.dbh.is_none());
    assert_eq!(warnings, ["tree 4711: the stem does not reach breast height: no diameter"]);
}

#[test]
fn the_skeleton_s_radii_are_kept_on_request() {
    let (qsm, ..) = run([0.0; 3], 2, true, &Params::adtree());
    assert!(qsm.cylinders.iter().all(|c| c.source == RadiusSource::Inferred));
    let radii: Vec<f64> = qsm.cylinders.iter().map(|c| c.radius_m).collect();
    assert_eq!(radii, [0.2, 0.1, 0.06]);
}

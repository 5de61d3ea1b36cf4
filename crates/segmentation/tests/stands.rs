//! Segmenters on simulated stands whose points know their tree.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

use std::collections::BTreeMap;
use timberline_pointcloud::Rect;
use timberline_pointcloud::order::canonical_order;
use timberline_segmentation::methods::ncut;
use timberline_segmentation::{
    Claim, Crown, Marker, Piece, SegmentMethod, SegmentationParams, segment_in_blocks, segmenter,
};
use timberline_synth::{Scene, Stand, StandParams, benchmark};

/// Points, the tree of each (0: none), and a marker at the highest point of every tree in sight.
fn stand(params: StandParams, seed: u64) -> (Piece, Vec<u32>) {
    let mut scene = benchmark::stand(1000, seed);
    let corner = scene.area.min;
    scene.area = Rect { min: corner, max: corner.map(|value| value + 40.0) };
    let Rect { min, max } = scene.area.grown(10.0);
    let boundary_m = vec![min, [max[0], min[1]], max, [min[0], max[1]]];
    scene.stands = vec![Stand { name: "stand".into(), boundary_m, params }];
    let scene = Scene::new(scene).unwrap();
    let (cloud, labels) = scene.labelled_points_in(&scene.params().area);
    let truth: Vec<u32> = canonical_order(&cloud).iter().map(|i| labels[*i as usize]).collect();
    let cloud = cloud.in_canonical_order();
    let height = |i: usize| {
        let [x, y, z] = cloud.world(i);
        let height = z - scene.terrain().elevation_m(x, y);
        if [7, 18].contains(&cloud.classification[i]) { f32::NAN } else { height as f32 }
    };
    let mut piece = Piece {
        frame: cloud.frame,
        height_m: (0..cloud.len()).map(height).collect(),
        is_first: cloud.return_number.iter().map(|number| *number <= 1).collect(),
        x: cloud.x,
        y: cloud.y,
        z: cloud.z,
        markers: Vec::new(),
    };
    for tree in scene.forest().trees.iter().filter(|tree| tree.visible) {
        mark(&mut piece, &truth, tree.id, tree.crown.radius_m());
    }
    (piece, truth)
}

/// Marks a tree that has enough points to be seen.
fn mark(piece: &mut Piece, truth: &[u32], id: u32, radius_m: f64) {
    let own = (0..truth.len()).filter(|i| truth[*i] == id && piece.height_m[*i] > 3.0);
    let own: Vec<usize> = own.collect();
    let highest = own.iter().max_by(|a, b| piece.height_m[**a].total_cmp(&piece.height_m[**b]));
    if let Some(&top) = highest.filter(|_| own.len() > 20) {
        let apex = [piece.x[top], piece.y[top], piece.z[top]];
        let (coefficients, tolerance_m) = ([1.0, 0.0], 0.6);
        let id = u64::from(id);
        let crown = Crown { id, apex, coefficients, radius_m, tolerance_m, oblique: false };
        let height_m = f64::from(piece.height_m[top]);
        piece.markers.push(Marker { crown, height_m, score: 1.0 });
    }
}

/// Mean over the marked trees: share of the points given to a tree that are its own, and share of
/// its own that it is given.
fn purity_and_completeness(piece: &Piece, truth: &[u32], claims: &[Claim]) -> [f64; 2] {
    let mut counts: BTreeMap<u64, [f64; 3]> = BTreeMap::new();
    for (i, claim) in claims.iter().enumerate().filter(|(i, _)| piece.height_m[*i] >= 1.0) {
        let own = u64::from(truth[i]);
        counts.entry(own).or_default()[0] += 1.0;
        counts.entry(claim.id).or_default()[1] += 1.0;
        if own == claim.id {
            counts.entry(own).or_default()[2] += 1.0;
        }
    }
    let trees = piece.markers.len() as f64;
    let mean = |of: usize| {
        let share =
            |marker: &Marker| counts.get(&marker.crown.id).map_or(0.0, |c| c[2] / c[of].max(1.0));
        piece.markers.iter().map(share).sum::<f64>() / trees
    };
    [mean(1), mean(0)]
}

#[test]
fn points_go_to_the_trees_they_come_from() {
    let stands = [
        ("open", StandParams::open_conifer(), [0.9, 0.9]),
        ("plantation", StandParams::conifer_plantation(), [0.7, 0.7]),
        ("broadleaf", StandParams::broadleaf(), [0.8, 0.8]),
    ];
    for (name, kind, least) in stands {
        let (piece, truth) = stand(kind, 3);
        for method in [SegmentMethod::Li, SegmentMethod::Ncut] {
            let params = SegmentationParams { method, ..SegmentationParams::default() };
            let claims = segmenter(&params).segment(&piece.view()).unwrap();
            let found = purity_and_completeness(&piece, &truth, &claims);
            let what = format!("{name}, {method:?}: {found:?}");
            assert!(found[0] >= least[0] && found[1] >= least[1], "{what}");
            let surface = claims.iter().filter(|claim| claim.score > 0.5);
            let first = surface.clone().count() as f64 / claims.len() as f64;
            assert!((0.1..0.6).contains(&first), "{what}, {first} on the surface");
        }
    }
}

#[test]
fn threads_do_not_matter() {
    let (piece, _) = stand(StandParams::broadleaf(), 5);
    for method in [SegmentMethod::Li, SegmentMethod::Ncut] {
        let params = SegmentationParams { method, block_m: 16, ..SegmentationParams::default() };
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let wanted = vec![true; piece.x.len()];
            pool.install(|| segment_in_blocks(&*segmenter(&params), &piece.view(), &wanted, 16))
        };
        assert_eq!(with(1).unwrap(), with(3).unwrap(), "{method:?}");
    }
}

/// Trees that the normalized cut finds by itself, matched by their tops.
#[test]
fn normalized_cut_finds_open_trees() {
    let (piece, truth) = stand(StandParams::open_conifer(), 7);
    let params = SegmentationParams::default();
    let found = ncut::trees(&piece.view(), 3.0, 3.0, &params).unwrap();
    let mut seen: Vec<u32> = found.tops.iter().map(|top| truth[*top as usize]).collect();
    seen.sort_unstable();
    seen.dedup();
    let marked = |id: &u32| piece.markers.iter().any(|m| m.crown.id == u64::from(*id));
    let (hit, trees) = (seen.iter().filter(|id| marked(id)).count(), piece.markers.len());
    assert!(hit as f64 >= 0.8 * trees as f64, "{hit} of {trees}, {} found", found.tops.len());
    assert!(found.tops.len() as f64 <= 1.5 * trees as f64, "{} for {trees}", found.tops.len());
}

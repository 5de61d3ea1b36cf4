//! What the scanner measures agrees with what is known.

#![allow(clippy::unwrap_used, reason = "a scene that cannot be made fails the test")]

use timberline_pointcloud::{PointCloud, Rect};
use timberline_synth::{
    Crown, Forest, ScannerParams, Scene, SceneParams, Stand, StandParams, TerrainParams,
    Undergrowth,
};

const CORNER: [f64; 2] = [431_000.0, 5_206_000.0];

fn params(stand: StandParams, edge: f64) -> SceneParams {
    let area = Rect { min: CORNER, max: CORNER.map(|value| value + edge) };
    let Rect { min, max } = area.grown(15.0);
    let boundary_m = vec![min, [max[0], min[1]], max, [min[0], max[1]]];
    SceneParams {
        seed: 77,
        origin_m: CORNER.map(|value| value as i64),
        area,
        terrain: TerrainParams::default(),
        stands: vec![Stand { name: "stand".into(), boundary_m, params: stand }],
        crown_relief: 0.0,
        undergrowth: Undergrowth::default(),
        scanner: ScannerParams { true_classes: true, ..ScannerParams::default() },
    }
}

fn exact(stand: StandParams, edge: f64) -> (Scene, PointCloud) {
    let mut params = params(stand, edge);
    params.scanner = params.scanner.without_errors();
    let scene = Scene::new(params).unwrap();
    let cloud = scene.points_in(&scene.params().area);
    (scene, cloud)
}

#[test]
fn ground_returns_lie_on_the_true_ground() {
    let (scene, cloud) = exact(StandParams::multilayer_mixed(), 60.0);
    let mut ground = 0;
    for i in (0..cloud.len()).filter(|&i| cloud.classification[i] == 2) {
        let [x, y, z] = cloud.world(i);
        // Half a tick upwards, and half a tick sideways on a slope.
        assert!((z - scene.terrain().elevation_m(x, y)).abs() < 1.5e-4, "{x} {y} {z}");
        ground += 1;
    }
    assert!(ground > 3000, "{ground}");
}

/// Whether a position is where vegetation is allowed: in a crown, on a stem, or low above the ground.
fn may_grow(scene: &Scene, at: [f64; 3], margin_m: f64) -> bool {
    let local = scene.frame().local_from_world(at);
    let height = at[2] - scene.terrain().elevation_m(at[0], at[1]);
    let in_tree = |crown: &Crown, base: [f64; 3]| {
        let up = (local[2] - base[2]) / (crown.top_m[2] - base[2]);
        let [dx, dy] = [0, 1].map(|i| local[i] - base[i] - up * (crown.top_m[i] - base[i]));
        crown.contains(local, margin_m)
            || (up < 1.0 && dx * dx + dy * dy < (0.6 + margin_m).powi(2))
    };
    height < 1.4 + margin_m || scene.forest().trees.iter().any(|t| in_tree(&t.crown, t.base_m))
}

#[test]
fn vegetation_returns_lie_within_crowns() {
    for stand in [StandParams::conifer_plantation(), StandParams::broadleaf()] {
        let (scene, cloud) = exact(stand, 30.0);
        for i in (0..cloud.len()).filter(|&i| cloud.classification[i] > 2) {
            // Hits of one beam in two crowns within a pulse's length make one return between them.
            assert!(may_grow(&scene, cloud.world(i), 0.38), "{:?}", cloud.world(i));
        }
    }
}

#[test]
fn errors_of_the_instrument_stay_small() {
    let scene = Scene::new(params(StandParams::open_conifer(), 60.0)).unwrap();
    let cloud = scene.points_in(&scene.params().area);
    let errors: Vec<f64> = (0..cloud.len())
        .filter(|&i| cloud.classification[i] == 2)
        .map(|i| cloud.world(i))
        .map(|[x, y, z]| z - scene.terrain().elevation_m(x, y))
        .collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    assert!((0.015..0.06).contains(&rms), "{rms}");
}

#[test]
fn tops_are_seen_a_little_too_low() {
    let scene = Scene::new(params(StandParams::conifer_plantation(), 60.0)).unwrap();
    let cloud = scene.points_in(&scene.params().area);
    let points: Vec<[f64; 3]> =
        (0..cloud.len()).filter(|&i| cloud.classification[i] < 7).map(|i| cloud.world(i)).collect();
    let inner = scene.params().area.grown(-2.0);
    let mut losses = Vec::new();
    for tree in scene.forest().trees.iter().filter(|tree| tree.visible) {
        assert_eq!(tree.crown.top_m[2], tree.base_m[2] + tree.height_m);
        let [x, y, z] = scene.frame().world_from_local(tree.crown.top_m);
        if !inner.contains(x, y) {
            continue;
        }
        let near = points.iter().filter(|p| (p[0] - x).abs() < 0.7 && (p[1] - y).abs() < 0.7);
        let seen = near.map(|p| p[2]).filter(|&top| top < z + 0.3).fold(f64::MIN, f64::max);
        losses.push(z - seen);
    }
    losses.sort_by(f64::total_cmp);
    let median = losses[losses.len() / 2];
    assert!(losses.len() > 200 && (0.2..1.2).contains(&median), "{median} of {}", losses.len());
}

#[test]
fn forests_differ_as_they_should() {
    // Share of ground among all points, and returns of a pulse, as ranges around real scans.
    let kinds = [
        (StandParams::conifer_plantation(), 0.10..0.30, 1.4..1.9),
        (StandParams::multilayer_mixed(), 0.10..0.35, 1.3..1.9),
        (StandParams::open_conifer(), 0.15..0.45, 1.2..1.6),
        (StandParams::broadleaf(), 0.10..0.35, 1.3..1.8),
        (StandParams::savanna(), 0.5..0.95, 1.0..1.3),
    ];
    for (stand, ground_share, returns) in kinds {
        let scene = Scene::new(params(stand, 80.0)).unwrap();
        let cloud = scene.points_in(&scene.params().area);
        let share = |count: usize| count as f64 / cloud.len() as f64;
        let ground = share(cloud.classification.iter().filter(|&&class| class == 2).count());
        let first = share(cloud.return_number.iter().filter(|&&number| number == 1).count());
        assert!(ground_share.contains(&ground), "ground {ground}");
        assert!(returns.contains(&(1.0 / first)), "returns {}", 1.0 / first);
    }
}

#[test]
fn the_density_is_the_one_asked_for() {
    for (density, heading_deg) in [(4.0, 0.0), (12.0, 37.0)] {
        let mut params = params(StandParams::savanna(), 120.0);
        params.stands.clear();
        params.terrain = TerrainParams::level(300.0);
        params.undergrowth = Undergrowth::none();
        params.scanner = ScannerParams { heading_deg, ..params.scanner }.with_density(density);
        let scene = Scene::new(params).unwrap();
        let points = scene.points_in(&scene.params().area).len() as f64;
        let found = points / (120.0 * 120.0);
        assert!((found / density - 1.0).abs() < 0.08, "{found} of {density} points/m2");
    }
}

#[test]
fn outliers_are_as_many_as_asked_and_some_are_classified() {
    let mut params = params(StandParams::open_conifer(), 60.0);
    params.scanner.high_outliers = 0.002;
    params.scanner.low_outliers = 0.004;
    let scene = Scene::new(params).unwrap();
    let cloud = scene.points_in(&scene.params().area);
    let count = |class: u8| cloud.classification.iter().filter(|&&c| c == class).count() as f64;
    let pulses = cloud.return_number.iter().filter(|&&number| number == 1).count() as f64;
    assert!((count(18) / (0.002 * 0.5 * pulses) - 1.0).abs() < 0.5, "{}", count(18));
    assert!((count(7) / (0.004 * 0.5 * pulses) - 1.0).abs() < 0.4, "{}", count(7));
    let withheld = cloud.flags.iter().filter(|&&flags| flags & 4 != 0).count() as f64;
    assert!((withheld / (0.4 * (count(7) + count(18))) - 1.0).abs() < 0.6);
    for i in 0..cloud.len() {
        let [x, y, z] = cloud.world(i);
        let height = z - scene.terrain().elevation_m(x, y);
        match cloud.classification[i] {
            7 => assert!((-15.2..-0.4).contains(&height), "{height}"),
            18 => assert!((35.0..91.0).contains(&height), "{height}"),
            _ => {}
        }
    }
}

#[test]
fn returns_of_a_pulse_are_numbered_from_the_top() {
    let (_, cloud) = exact(StandParams::multilayer_mixed(), 30.0);
    for i in 1..cloud.len() {
        assert!(
            cloud.return_number[i] >= 1 && cloud.return_number[i] <= cloud.number_of_returns[i]
        );
        let same = cloud.gps_time[i] == cloud.gps_time[i - 1]
            && cloud.source_id[i] == cloud.source_id[i - 1];
        if same {
            assert_eq!(cloud.number_of_returns[i], cloud.number_of_returns[i - 1]);
            assert!(cloud.return_number[i] > cloud.return_number[i - 1]);
            assert!(cloud.z[i] < cloud.z[i - 1] - 0.7);
        }
    }
    cloud.validate().unwrap();
}

#[test]
fn faults_are_named() {
    let mut empty = params(StandParams::savanna(), 10.0);
    empty.area.max = empty.area.min;
    assert!(Scene::new(empty).unwrap_err().to_string().contains("holds nothing"));
    let mut wide = params(StandParams::savanna(), 10.0);
    wide.scanner.half_angle_deg = 40.0;
    let message = Scene::new(wide).unwrap_err().to_string();
    assert_eq!(message, "`half_angle_deg` is 40; expected 1 to 28 degrees");
}

#[test]
fn points_know_their_trees() {
    let (scene, plain) = exact(StandParams::multilayer_mixed(), 60.0);
    let (cloud, trees) = scene.labelled_points_in(&scene.params().area);
    assert_eq!(cloud, plain);
    assert_eq!(trees.len(), cloud.len());
    let mut own = 0;
    for (i, &id) in trees.iter().enumerate().filter(|(_, id)| **id > 0) {
        let tree = &scene.forest().trees[id as usize - 1];
        let [x, y, z] = scene.frame().local_from_world(cloud.world(i));
        let up = (z - tree.base_m[2]) / tree.height_m;
        let axis: [f64; 2] =
            std::array::from_fn(|a| tree.base_m[a] + up * (tree.crown.top_m[a] - tree.base_m[a]));
        let off = [x - axis[0], y - axis[1]];
        let on_stem = off[0] * off[0] + off[1] * off[1] < 0.36;
        // A return is the mean of up to five hits, at most a pulse's length apart.
        assert!(on_stem || tree.crown.contains([x, y, z], 0.4), "{id} {x} {y} {z}");
        own += 1;
    }
    assert!(own * 3 > cloud.len(), "{own} of {}", cloud.len());
}

#[test]
fn given_trees_stand_where_they_are_put() {
    let (scene, cloud) = exact(StandParams::open_conifer(), 60.0);
    let mut trees = scene.forest().trees.clone();
    let again = Scene::with_forest(scene.params().clone(), Forest::of(trees.clone())).unwrap();
    assert_eq!(again.points_in(&scene.params().area), cloud);
    let (left, _) = scene.labelled_points_in(&scene.params().area);
    trees.retain(|tree| tree.id != 1);
    let less = Scene::with_forest(scene.params().clone(), Forest::of(trees)).unwrap();
    assert!(less.points_in(&scene.params().area).len() < left.len());
    assert_eq!(less.forest().trees[0].id, 1);
}

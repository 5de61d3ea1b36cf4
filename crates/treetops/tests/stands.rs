//! The default parameters on simulated stands with known trees, against fixed windows.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "these are tests")]

use timberline_pointcloud::{Nearest2, PointCloud, Rect};
use timberline_synth::{
    ScannerParams, Scene, SceneParams, Stand, StandParams, TerrainParams, Undergrowth,
};
use timberline_treetops::{Input, Params, find};

/// South-west corner of every stand.
const CORNER_M: [f64; 2] = [500_000.0, 5_000_000.0];
/// Crowns cut by the edge of the flight are not judged.
const BORDER_M: f64 = 5.0;

struct Truth {
    cloud: PointCloud,
    height_m: Vec<f32>,
    /// Apex, height above ground, whether nothing hangs over the apex.
    trees: Vec<([f64; 2], f64, bool)>,
    inner: Rect,
}

/// A scanned stand with heights above the true ground.
fn stand(params: StandParams, edge_m: f64, pulses_per_m2: f64, slope_deg: f64) -> Truth {
    let area = Rect { min: CORNER_M, max: CORNER_M.map(|value| value + edge_m) };
    let wide = area.grown(12.0);
    let boundary_m =
        vec![wide.min, [wide.max[0], wide.min[1]], wide.max, [wide.min[0], wide.max[1]]];
    let terrain = match slope_deg {
        0.0 => TerrainParams::level(500.0),
        slope_deg => TerrainParams { slope_deg, ..TerrainParams::default() },
    };
    let scene = Scene::new(SceneParams {
        seed: 7,
        origin_m: CORNER_M.map(|value| value as i64),
        area,
        terrain,
        stands: vec![Stand { name: "stand".into(), boundary_m, params }],
        crown_relief: 0.0,
        undergrowth: Undergrowth::default(),
        scanner: ScannerParams::default().with_density(pulses_per_m2),
    })
    .unwrap();
    let cloud = scene.points_in(&area).in_canonical_order();
    let height = |i: usize| {
        let [x, y, z] = cloud.world(i);
        (z - scene.terrain().elevation_m(x, y)) as f32
    };
    let tree = |tree: &timberline_synth::Tree| {
        let [x, y, _] = scene.frame().world_from_local(tree.crown.top_m);
        ([x, y], tree.top_above_ground_m(), tree.visible)
    };
    let trees = scene.forest().trees.iter().map(tree).collect();
    let height_m = (0..cloud.len()).map(height).collect();
    Truth { height_m, trees, inner: area.grown(-BORDER_M), cloud }
}

/// Recall of the trees with a visible top, precision, and median error of position.
fn judge(truth: &Truth, params: &Params) -> [f64; 3] {
    let tops = find(&Input::new(&truth.cloud, &truth.height_m), params).unwrap();
    let found: Vec<[f64; 2]> = tops.iter().map(|top| [top.world_m[0], top.world_m[1]]).collect();
    let nearest = Nearest2::new(&found).unwrap();
    let is_inner = |at: &[f64; 2]| truth.inner.contains(at[0], at[1]);
    let mut taken = vec![false; found.len()];
    let (mut visible, mut hits, mut distances) = (0, 0, Vec::new());
    let mut order: Vec<_> = truth.trees.iter().filter(|tree| tree.1 >= 2.0).collect();
    order.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (at, _, is_visible) in order {
        let judged = is_inner(at) && *is_visible;
        visible += usize::from(judged);
        let free = nearest.within(at, 2.0).into_iter().find(|hit| !taken[hit.index]);
        if let Some(hit) = free {
            taken[hit.index] = true;
            hits += usize::from(judged);
            distances.push(hit.squared_m2.sqrt());
        }
    }
    let inner: Vec<bool> =
        found.iter().zip(&taken).filter(|(at, _)| is_inner(at)).map(|(_, hit)| *hit).collect();
    let correct = inner.iter().filter(|hit| **hit).count();
    distances.sort_by(f64::total_cmp);
    let median = distances.get(distances.len() / 2).copied().unwrap_or(f64::NAN);
    [hits as f64 / visible as f64, correct as f64 / inner.len() as f64, median]
}

fn f_score([recall, precision, _]: [f64; 3]) -> f64 {
    2.0 * recall * precision / (recall + precision)
}

fn kinds() -> [(&'static str, StandParams); 5] {
    [
        ("open conifer", StandParams::open_conifer()),
        ("plantation", StandParams::conifer_plantation()),
        ("multilayer", StandParams::multilayer_mixed()),
        ("broadleaf", StandParams::broadleaf()),
        ("savanna", StandParams::savanna()),
    ]
}

#[test]
fn every_kind_of_stand() {
    let least = [
        ("open conifer", 0.9),
        ("plantation", 0.8),
        ("multilayer", 0.72),
        ("broadleaf", 0.75),
        ("savanna", 0.88),
    ];
    for ((name, params), (_, least)) in kinds().into_iter().zip(least) {
        let result = judge(&stand(params, 70.0, 8.0, 0.0), &Params::by_window());
        println!(
            "{name}: recall {:.3}, precision {:.3}, F {:.3}, position {:.3} m",
            result[0],
            result[1],
            f_score(result),
            result[2]
        );
        assert!(f_score(result) >= least, "{name}: {result:?}");
        assert!(result[2] < 0.6, "{name}: {result:?}");
    }
}

#[test]
fn noise_does_not_multiply_trees() {
    let params = StandParams::open_conifer();
    let mut truth = stand(params, 60.0, 8.0, 0.0);
    let methods = [Params::by_window(), Params { min_score: 0.4, ..Params::default() }];
    let count = |truth: &Truth, params| {
        find(&Input::new(&truth.cloud, &truth.height_m), params).unwrap().len()
    };
    let clean = methods.each_ref().map(|params| count(&truth, params));
    // A lone point every two metres at 45 m, well above the canopy.
    for i in 0..900 {
        let at = [CORNER_M[0] + f64::from(i % 30) * 2.0, CORNER_M[1] + f64::from(i / 30) * 2.0];
        let away = f64::from(i % 7) * 4.0;
        truth
            .cloud
            .push_world([at[0], at[1], 560.0 + away], &timberline_pointcloud::Point::default());
        truth.height_m.push((60.0 + away) as f32);
    }
    let noisy = methods.each_ref().map(|params| count(&truth, params));
    for (clean, noisy) in clean.into_iter().zip(noisy) {
        assert!(noisy.abs_diff(clean) <= clean / 50, "{clean} without noise, {noisy} with");
    }
}

/// The table behind the defaults: mean over kinds of stand of F against trees with a visible top.
#[test]
#[ignore = "a table, half a minute"]
fn by_density_and_slope() {
    let methods = [
        ("default", Params::default()),
        ("by window", Params::by_window()),
        (
            "by height",
            Params { rank_by: timberline_treetops::RankBy::Height, ..Params::by_window() },
        ),
        ("circle 3 m", Params::fixed_circle(3.0)),
        ("circle 5 m", Params::fixed_circle(5.0)),
    ];
    for (pulses, slope_deg) in
        [(2.0, 0.0), (4.0, 0.0), (8.0, 0.0), (20.0, 0.0), (50.0, 0.0), (8.0, 30.0)]
    {
        let truths: Vec<Truth> = kinds()
            .into_iter()
            .map(|(_, params)| stand(params, 100.0, pulses, slope_deg))
            .collect();
        for (name, params) in &methods {
            let scores: Vec<f64> =
                truths.iter().map(|truth| f_score(judge(truth, params))).collect();
            let mean = scores.iter().sum::<f64>() / scores.len() as f64;
            println!(
                "{pulses:>3} pulses/m2, {slope_deg:>2} degrees, {name:<10} F {mean:.3} {scores:.3?}"
            );
        }
    }
}

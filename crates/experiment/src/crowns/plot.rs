//! One plot of a dataset: a stand grown, bent, scanned and segmented.

use super::cluster::Cluster;
use super::dataset::{DatasetParams, Growth};
use super::segment::Segmenter;
use crate::Error;
use timberline_pointcloud::Rect;
use timberline_synth::random::{Domain, Stream};
use timberline_synth::{
    Forest, ScannerParams, Scene, SceneParams, Stand, StandParams, TerrainParams, Tree, Undergrowth,
};

/// Edge of the square whose trees become clusters, m.
const INNER_M: f64 = 40.0;
/// How far points are measured around it: more than the reach of a crown and its neighbour, m.
const SEEN_M: f64 = 12.0;
/// How far the forest goes on around that, m.
const MARGIN_M: f64 = 14.0;
/// A tree is located when this share of its crown lies open to the sky and its top is visible: in
/// the paper, too, only trees of the upper canopy have a segment of their own.
const EXPOSED: f64 = 0.6;
/// World position of every plot's corner, m.
const ORIGIN_M: [i64; 2] = [600_000, 5_400_000];
/// Stands by index: the trees to be located come first.
const CANOPY: u16 = 0;

/// Grows a plot and returns the clusters of its trees, with ids that are not unique yet.
pub(crate) fn plot(params: &DatasetParams, seed: u64, index: u64) -> Result<Vec<Cluster>, Error> {
    let scene = bent(params, scene_params(params, seed, index))?;
    let area = scene.params().area;
    let (cloud, labels) = scene.labelled_points_in(&area);
    // All in the frame of the scene, where the trees are.
    let local = |i: usize| scene.frame().local_from_world(cloud.world(i));
    let points: Vec<[f64; 3]> = (0..cloud.len()).map(local).collect();
    let segmenter = Segmenter::new(&scene.forest().trees, &points, &labels, CANOPY);
    let inner = Rect { min: [SEEN_M; 2], max: [SEEN_M + INNER_M; 2] };
    let located = |tree: &&Tree| {
        let [x, y, _] = tree.crown.top_m;
        tree.stand == CANOPY && tree.visible && tree.exposed >= EXPOSED && inner.contains(x, y)
    };
    let mut clusters = Vec::new();
    for tree in scene.forest().trees.iter().filter(located) {
        let mut stream = stream(params, seed, index, u64::from(tree.id) << 1);
        clusters.push(segmenter.cluster(tree, params, &mut stream)?);
    }
    Ok(clusters)
}

/// Numbers for one purpose in one plot of one dataset.
fn stream(params: &DatasetParams, seed: u64, plot: u64, purpose: u64) -> Stream {
    Stream::new(plot_seed(params, seed, plot), Domain::Experiment, purpose)
}

fn plot_seed(params: &DatasetParams, seed: u64, plot: u64) -> u64 {
    let name = params.name.bytes().fold(0_u64, |hash, byte| (hash << 8) ^ u64::from(byte));
    Stream::new(seed, Domain::Experiment, (name << 24) ^ plot).bits()
}

fn scene_params(params: &DatasetParams, seed: u64, index: u64) -> SceneParams {
    let corner = ORIGIN_M.map(|value| value as f64);
    let edge = INNER_M + 2.0 * SEEN_M;
    let area = Rect { min: corner, max: corner.map(|value| value + edge) };
    let Rect { min, max } = area.grown(MARGIN_M);
    let boundary_m = vec![min, [max[0], min[1]], max, [min[0], max[1]]];
    let cohorts = std::iter::once(&params.cohort).chain(&params.understorey);
    let stand = |(index, cohort): (usize, &timberline_synth::Cohort)| Stand {
        name: if index == 0 { "canopy".to_owned() } else { "understorey".to_owned() },
        boundary_m: boundary_m.clone(),
        params: StandParams {
            cohorts: vec![cohort.clone()],
            crown_overlap: params.crown_overlap,
            site: params.site,
            crown_scale: params.crown_scale,
        },
    };
    SceneParams {
        seed: plot_seed(params, seed, index),
        origin_m: ORIGIN_M,
        area,
        terrain: TerrainParams::default(),
        stands: cohorts.enumerate().map(stand).collect(),
        crown_relief: 0.0,
        undergrowth: Undergrowth::default(),
        scanner: ScannerParams {
            horizontal_noise_m: params.horizontal_noise_m,
            ..ScannerParams::default().with_density(params.pulses_per_m2)
        },
    }
}

/// The scene with its trees bent as the dataset says.
fn bent(params: &DatasetParams, scene: SceneParams) -> Result<Scene, Error> {
    let straight = Scene::new(scene)?;
    let mut trees = straight.forest().trees.clone();
    for tree in trees.iter_mut().filter(|tree| tree.stand == CANOPY) {
        let name = (u64::from(tree.id) << 1) | 1;
        let mut stream = Stream::new(straight.params().seed, Domain::Experiment, name);
        bend(tree, &params.growth, &mut stream);
        let [x, y, _] = straight.frame().world_from_local(tree.crown.top_m);
        tree.ground_below_top_m = straight.terrain().elevation_m(x, y);
    }
    Ok(Scene::with_forest(straight.params().clone(), Forest::of(trees))?)
}

/// Gives a tree another lean, a broken top, an uneven crown. What its neighbours push its crown
/// aside stays.
fn bend(tree: &mut Tree, growth: &Growth, stream: &mut Stream) {
    let (height, upper) = (tree.height_m, tree.crown.upper_m);
    let old = [0, 1].map(|i| (tree.crown.top_m[i] - tree.base_m[i]) / height);
    let size = (growth.lean_deg * stream.normal().abs().min(3.0)).to_radians();
    let (towards, tangent) = (stream.direction(), libm::tan(size));
    let aside = stream.direction();
    let [low, high] = growth.broken_offset_m;
    let offset = stream.within(low, high);
    let offset = if stream.chance(growth.broken_share) { offset } else { 0.0 };
    let radius = tree.crown.radius_m();
    let uneven = [0; 2].map(|_| growth.asymmetry * radius * stream.normal().clamp(-2.0, 2.0));
    for i in 0..2 {
        let lean = tangent * towards[i];
        tree.crown.top_m[i] = tree.base_m[i] + lean * height + offset * aside[i];
        // From the top down: back along the stem, back to it from a new leader, to the uneven side.
        let push = tree.crown.axis[i] + old[i];
        tree.crown.axis[i] = push - lean + (uneven[i] - offset * aside[i]) / upper;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bent_trees_keep_their_feet() {
        let mut params = DatasetParams::douglas_fir();
        params.growth = Growth {
            lean_deg: 0.0,
            broken_share: 1.0,
            broken_offset_m: [0.5, 0.5],
            asymmetry: 0.0,
            ..params.growth
        };
        let straight = Scene::new(scene_params(&params, 1, 0)).unwrap();
        let scene = bent(&params, scene_params(&params, 1, 0)).unwrap();
        let of_canopy = |scene: &Scene| -> Vec<Tree> {
            scene.forest().trees.iter().filter(|tree| tree.stand == CANOPY).cloned().collect()
        };
        let (before, after) = (of_canopy(&straight), of_canopy(&scene));
        assert_eq!(before.len(), after.len());
        for (old, new) in before.iter().zip(&after) {
            assert_eq!((old.base_m, old.height_m), (new.base_m, new.height_m));
            let offset = [0, 1].map(|i| new.crown.top_m[i] - new.base_m[i]);
            assert!((libm::hypot(offset[0], offset[1]) - 0.5).abs() < 1e-9);
        }
    }

    #[test]
    fn plots_differ_and_repeat() {
        let params = DatasetParams::spruce();
        let clusters = plot(&params, 3, 0).unwrap();
        assert!(clusters.len() > 20, "{}", clusters.len());
        assert_eq!(clusters, plot(&params, 3, 0).unwrap());
        assert_ne!(clusters[0].points, plot(&params, 3, 1).unwrap()[0].points);
        assert_ne!(clusters[0].points, plot(&params, 4, 0).unwrap()[0].points);
    }
}

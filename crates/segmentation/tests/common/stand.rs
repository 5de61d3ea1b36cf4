//! Simulated stands with true heights, true trees, and the true tree of every point.

use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::order::canonical_order;
use timberline_pointcloud::{Frame, Rect};
use timberline_segmentation::blocks::sort_markers;
use timberline_segmentation::{Crown, Marker, Piece};
use timberline_synth::{Scene, SceneParams, Tree, benchmark};

/// A stand as a segmenter sees it, and the truth.
pub(crate) struct Stand {
    pub(crate) piece: Piece,
    /// Id of the marker of every point's tree, 0 for none.
    pub(crate) truth: Vec<u64>,
}

/// Mixed forest with about so many points; the trees are those with a visible top.
pub(crate) fn stand(points: u64, seed: u64) -> Stand {
    of(benchmark::stand(points, seed))
}

/// A scene's area; the trees are those with a visible top.
pub(crate) fn of(params: SceneParams) -> Stand {
    let scene = Scene::new(params).unwrap();
    let area = scene.params().area;
    let (cloud, trees) = scene.labelled_points_in(&area);
    let order = canonical_order(&cloud);
    let cloud = cloud.select(&order);
    let height = |i: usize| {
        let [x, y, z] = cloud.world(i);
        (z - scene.terrain().elevation_m(x, y)) as f32
    };
    let mut markers: Vec<Marker> = scene
        .forest()
        .trees
        .iter()
        .filter(|tree| tree.visible)
        .filter_map(|tree| marker(tree, &scene, &cloud.frame, &area))
        .collect();
    sort_markers(&mut markers);
    let piece = Piece {
        frame: cloud.frame,
        height_m: (0..cloud.len()).map(height).collect(),
        is_first: cloud.return_number.iter().map(|number| *number <= 1).collect(),
        markers,
        x: cloud.x,
        y: cloud.y,
        z: cloud.z,
    };
    Stand { piece, truth: order.iter().map(|index| u64::from(trees[*index as usize])).collect() }
}

/// A tree with its apex in the area, its crown as a paraboloid.
fn marker(tree: &Tree, scene: &Scene, frame: &Frame, area: &Rect) -> Option<Marker> {
    let world = scene.frame().world_from_local(tree.crown.top_m).map(quantise);
    let radius_m = tree.crown.semi_axes_m[0];
    let crown = Crown {
        id: u64::from(tree.id),
        apex: frame.local_from_world(world),
        coefficients: [0.0, tree.crown.upper_m / (radius_m * radius_m)],
        radius_m,
        tolerance_m: 0.6,
        oblique: true,
    };
    let marker = Marker { crown, height_m: tree.top_above_ground_m(), score: 1.0 };
    area.contains(world[0], world[1]).then_some(marker)
}

//! A scanned stand with its truth.

use super::plan::{Case, Experiment};
use crate::Error;
use timberline_crowns::footprint::footprint;
use timberline_pointcloud::{PointCloud, Rect, order};
use timberline_synth::{
    ScannerParams, Scene, SceneParams, Stand, TerrainParams, Tree, Undergrowth,
};

/// A true tree. Positions are in the world, metres.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueTree {
    /// Its label in [`Plot::label`]; not 0.
    pub id: u64,
    /// Top of the crown.
    pub top_m: [f64; 2],
    /// Foot of the stem.
    pub stem_m: [f64; 2],
    /// Height of the top above the ground below it, m.
    pub height_m: f64,
    /// Whether nothing hangs over the top.
    pub visible: bool,
    /// The crown's widest section as a convex polygon, counter-clockwise, relative to the top.
    pub outline_m: Vec<[f64; 2]>,
}

/// Points with heights and labels, and the trees they come from.
#[derive(Debug, Clone)]
pub struct Plot {
    /// The points, in canonical order.
    pub cloud: PointCloud,
    /// Height above the ground, m.
    pub height_m: Vec<f32>,
    /// Whether a point is the first return of its pulse, or may be for all that is known.
    pub is_first: Vec<bool>,
    /// The true tree of every point, 0 for none.
    pub label: Vec<u64>,
    /// The true trees, also around the judged area.
    pub trees: Vec<TrueTree>,
    /// Where trees are judged.
    pub judged: Rect,
    /// Points in that area, 1/m².
    pub density_per_m2: f64,
    /// Pulses it took, 1/m².
    pub pulses_per_m2: f64,
}

/// South-west corner of every judged area, and the terrain's origin.
const CORNER_M: [i64; 2] = [500_000, 5_000_000];
/// How far the stand reaches beyond what is scanned, m: crowns hang in from there.
pub(super) const BEYOND_M: f64 = 12.0;
/// Edge of the square on which the number of returns per pulse is measured, m.
const PILOT_EDGE_M: f64 = 40.0;
/// ASPRS classes of noise, low and high.
const NOISE: [u8; 2] = [7, 18];
/// Flag of points withheld by the supplier.
const WITHHELD: u8 = 1 << 2;
/// Corners of a crown's outline.
const OUTLINE_CORNERS: u32 = 48;

impl Plot {
    /// Grows and scans the stand of a case.
    ///
    /// The density of pulses is set such that the density of points (all returns) is the wanted one:
    /// a pilot scan of the middle tells how many returns a pulse makes there.
    ///
    /// # Errors
    /// [`Error::Synth`] for parameters that no stand can be grown from.
    pub fn generate(experiment: &Experiment, case: &Case) -> Result<Self, Error> {
        let judged = judged(experiment);
        let wanted = case.density_per_m2;
        let pilot = scene(experiment, case, wanted)?;
        let middle = middle(&judged);
        let returns = density(&pilot.points_in(&middle), &middle);
        let pulses_per_m2 = wanted * wanted / returns.max(0.1 * wanted);
        let scene = scene(experiment, case, pulses_per_m2)?;
        Ok(Self::of(&scene, judged, pulses_per_m2))
    }

    fn of(scene: &Scene, judged: Rect, pulses_per_m2: f64) -> Self {
        let (all, trees) = scene.labelled_points_in(&scene.params().area);
        let mut kept = order::canonical_order(&all);
        kept.retain(|&i| is_kept(&all, i as usize));
        let cloud = all.select(&kept);
        let label = kept.iter().map(|&i| u64::from(trees[i as usize])).collect();
        let height = |i: usize| {
            let [x, y, z] = cloud.world(i);
            (z - scene.terrain().elevation_m(x, y)) as f32
        };
        let height_m = (0..cloud.len()).map(height).collect();
        let trees = scene.forest().trees.iter().map(|tree| true_tree(scene, tree)).collect();
        let density_per_m2 = density(&cloud, &judged);
        let is_first = cloud.return_number.iter().map(|number| *number <= 1).collect();
        Self { height_m, is_first, label, trees, judged, density_per_m2, pulses_per_m2, cloud }
    }

    /// A real scan whose trees are not known but for what labels say; all of it is judged. Points
    /// are brought into canonical order, with their heights and labels.
    ///
    /// # Errors
    /// [`Error::Length`].
    pub fn measured(cloud: &PointCloud, height_m: &[f32], label: &[u64]) -> Result<Self, Error> {
        let points = cloud.len();
        for (column, found) in [("height", height_m.len()), ("label", label.len())] {
            if found != points {
                return Err(Error::Length { column, points, found });
            }
        }
        let order = order::canonical_order(cloud);
        let cloud = cloud.select(&order);
        let judged = cloud.bounds().rect();
        let [width, height] = judged.size();
        Ok(Self {
            height_m: order.iter().map(|&i| height_m[i as usize]).collect(),
            is_first: cloud.return_number.iter().map(|number| *number <= 1).collect(),
            label: order.iter().map(|&i| label[i as usize]).collect(),
            trees: Vec::new(),
            judged,
            density_per_m2: cloud.len() as f64 / (width * height),
            pulses_per_m2: f64::NAN,
            cloud,
        })
    }

    /// Whether a position is judged.
    #[must_use]
    pub fn is_judged(&self, [x, y]: [f64; 2]) -> bool {
        self.judged.contains(x, y)
    }
}

fn is_kept(cloud: &PointCloud, i: usize) -> bool {
    cloud.flags[i] & WITHHELD == 0 && !NOISE.contains(&cloud.classification[i])
}

fn judged(experiment: &Experiment) -> Rect {
    let min = CORNER_M.map(|value| value as f64);
    Rect { min, max: min.map(|value| value + experiment.judged_edge_m) }
}

/// The square of the pilot scan.
fn middle(judged: &Rect) -> Rect {
    let size = judged.size();
    let aside = 0.5 * (size[0] - PILOT_EDGE_M).max(0.0);
    judged.grown(-aside)
}

fn density(cloud: &PointCloud, rect: &Rect) -> f64 {
    let inside = |i: &usize| {
        let [x, y, _] = cloud.world(*i);
        rect.contains(x, y)
    };
    let [width, height] = rect.size();
    (0..cloud.len()).filter(inside).count() as f64 / (width * height)
}

fn scene(experiment: &Experiment, case: &Case, pulses_per_m2: f64) -> Result<Scene, Error> {
    let area = judged(experiment).grown(experiment.margin_m);
    let Rect { min, max } = area.grown(BEYOND_M);
    let boundary_m = vec![min, [max[0], min[1]], max, [min[0], max[1]]];
    let name = case.stand.name().to_owned();
    let mut params = case.stand.params();
    params.crown_scale *= experiment.crown_scale;
    Ok(Scene::new(SceneParams {
        seed: experiment.scene_seed(case),
        origin_m: CORNER_M,
        area,
        terrain: terrain(experiment.slope_deg),
        stands: vec![Stand { name, boundary_m, params }],
        crown_relief: experiment.crown_relief,
        undergrowth: Undergrowth::default(),
        scanner: ScannerParams::default().with_density(pulses_per_m2),
    })?)
}

/// A plane with rounded relief, or a level.
fn terrain(slope_deg: f64) -> TerrainParams {
    let uneven = TerrainParams { slope_deg, ridges: Vec::new(), ..TerrainParams::default() };
    if slope_deg > 0.0 { uneven } else { TerrainParams::level(uneven.base_m) }
}

fn true_tree(scene: &Scene, tree: &Tree) -> TrueTree {
    let world = |at: [f64; 3]| {
        let [x, y, _] = scene.frame().world_from_local(at);
        [x, y]
    };
    TrueTree {
        id: u64::from(tree.id),
        top_m: world(tree.crown.top_m),
        stem_m: world(tree.base_m),
        height_m: tree.top_above_ground_m(),
        visible: tree.visible,
        outline_m: outline(&tree.crown),
    }
}

/// The widest section of a crown relative to its top.
fn outline(crown: &timberline_synth::Crown) -> Vec<[f64; 2]> {
    let [cx, cy] = crown.widest_centre_m();
    let ([a, b], [cos, sin]) = (crown.semi_axes_m, crown.direction);
    let corner = |step: u32| {
        let turn = f64::from(step) / f64::from(OUTLINE_CORNERS) * std::f64::consts::TAU;
        let (v, u) = libm::sincos(turn);
        let (along, across) = (u * a, v * b);
        [
            cx + cos * along - sin * across - crown.top_m[0],
            cy + sin * along + cos * across - crown.top_m[1],
        ]
    };
    footprint((0..OUTLINE_CORNERS).map(corner)).corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segmentation::plan::StandKind;

    #[test]
    fn the_wanted_density_is_met_and_labels_fit() {
        let experiment = Experiment { judged_edge_m: 40.0, margin_m: 5.0, ..Experiment::default() };
        let case = Case { stand: StandKind::OpenConifer, density_per_m2: 8.0, repeat: 1 };
        let plot = Plot::generate(&experiment, &case).unwrap();
        assert!((plot.density_per_m2 / 8.0 - 1.0).abs() < 0.1, "{}", plot.density_per_m2);
        assert!(plot.pulses_per_m2 < 8.0, "some pulses make several returns");
        assert_eq!(plot.label.len(), plot.cloud.len());
        let tree = plot.trees.iter().find(|tree| tree.visible && tree.height_m > 15.0).unwrap();
        let own: Vec<usize> = (0..plot.label.len()).filter(|&i| plot.label[i] == tree.id).collect();
        assert!(own.iter().all(|&i| f64::from(plot.height_m[i]) < tree.height_m + 2.0));
        let area = footprint(tree.outline_m.iter().copied()).area_m2;
        assert!(area > 3.0 && area < 200.0, "{area}");
    }
}

//! A segmented plot against its truth, tree by tree.

use super::method::{FoundTree, Segmented};
use super::outline::iou;
use super::plan::Experiment;
use super::plot::{Plot, TrueTree};
use crate::Error;
use serde::Serialize;
use std::collections::BTreeMap;
use timberline_crowns::CrownFitParams;
use timberline_crowns::footprint::footprint;
use timberline_evaluate::{Layer, Tree, layers, match_trees};

/// Lower points count for no tree when segments are compared, m above ground: the foot of a stem
/// among the herbs is not what a segmenter of crowns is asked for.
pub const MIN_POINT_HEIGHT_M: f64 = 1.0;

/// What was found of a true tree. Lengths in metres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Hit {
    /// Id of the found tree.
    pub id: u64,
    /// Distance in the plane from the true crown's top to the found one.
    pub top_error_m: f64,
    /// Distance in the plane from the foot of the stem to the found top.
    pub stem_error_m: f64,
    /// Found minus true height.
    pub height_error_m: f64,
    /// Points that are the tree's in both.
    pub shared_points: usize,
    /// Points of the found tree.
    pub found_points: usize,
    /// Overlap (intersection over union) of the convex hulls of the found and the true crown's
    /// points.
    pub hull_iou: f64,
    /// Overlap of the hull of the found points with the widest section of the true crown.
    pub crown_iou: f64,
}

/// A judged true tree.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TrueRow {
    /// Its label.
    pub id: u64,
    /// Top of its crown in the world.
    pub top_m: [f64; 2],
    /// Height of its top above ground, m.
    pub height_m: f64,
    /// Its canopy layer.
    pub layer: Option<Layer>,
    /// Whether nothing hangs over its top.
    pub visible: bool,
    /// Its points.
    pub points: usize,
    /// What was found of it.
    pub hit: Option<Hit>,
}

/// A judged found tree.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct FoundRow {
    /// Its id.
    pub id: u64,
    /// Top of its crown in the world.
    pub top_m: [f64; 2],
    /// Height of its top above ground, m.
    pub height_m: f64,
    /// Its canopy layer, by the heights of the found trees.
    pub layer: Option<Layer>,
    /// Its points.
    pub points: usize,
    /// Points of it that belong to the true tree it is; 0 if it is none.
    pub shared_points: usize,
    /// The true tree it is, and whether that is visible.
    pub is: Option<(u64, bool)>,
}

/// All judged trees of a plot under one segmenter.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Judged {
    /// True trees, by label.
    pub trees: Vec<TrueRow>,
    /// Found trees, by id.
    pub found: Vec<FoundRow>,
}

/// Compares segments with the truth.
///
/// Trees are matched on the whole plot, and judged where their own position lies in the judged
/// area, so that its border cuts no pair.
///
/// # Errors
/// [`Error::Length`], [`Error::Evaluate`].
pub fn judge(plot: &Plot, found: &Segmented, rules: &Experiment) -> Result<Judged, Error> {
    check(plot, found)?;
    let tall = |tree: &&TrueTree| tree.height_m >= rules.min_height_m;
    let truth: Vec<&TrueTree> = plot.trees.iter().filter(tall).collect();
    let tops: Vec<FoundTree> =
        found.trees.iter().filter(|tree| tree.height_m >= rules.min_height_m).copied().collect();
    let reference = layered(truth.iter().map(|t| (t.id, t.top_m, t.height_m)), rules)?;
    let detected = layered(tops.iter().map(|t| (t.id, t.top_m, t.height_m)), rules)?;
    let matching = match_trees(&reference, &detected, &rules.matching)?;
    let points = Points::new(plot, found);
    let mut partner: Vec<Option<usize>> = vec![None; truth.len()];
    let mut is: Vec<Option<usize>> = vec![None; tops.len()];
    for pair in &matching.pairs {
        partner[pair.reference] = Some(pair.detected);
        is[pair.detected] = Some(pair.reference);
    }
    let trees = (0..truth.len()).filter(|&i| plot.is_judged(truth[i].top_m)).map(|i| {
        let hit = partner[i].map(|j| points.hit(plot, truth[i], &tops[j]));
        true_row(truth[i], reference[i].layer, points.of_true(truth[i].id).len(), hit)
    });
    let found = (0..tops.len()).filter(|&j| plot.is_judged(tops[j].top_m)).map(|j| {
        let own = is[j].map(|i| truth[i]);
        found_row(&tops[j], detected[j].layer, &points, own)
    });
    Ok(Judged { trees: trees.collect(), found: found.collect() })
}

fn check(plot: &Plot, found: &Segmented) -> Result<(), Error> {
    let points = plot.cloud.len();
    let columns = [
        ("height", plot.height_m.len()),
        ("label", plot.label.len()),
        ("tree", found.claims.len()),
    ];
    match columns.into_iter().find(|(_, length)| *length != points) {
        None => Ok(()),
        Some((column, found)) => Err(Error::Length { column, points, found }),
    }
}

/// Trees as `evaluate` takes them, with their layers.
fn layered(
    trees: impl Iterator<Item = (u64, [f64; 2], f64)>,
    rules: &Experiment,
) -> Result<Vec<Tree>, Error> {
    let tree = |(id, at_m, height_m)| Tree { id, at_m, height_m, ..Tree::default() };
    let mut trees: Vec<Tree> = trees.map(tree).collect();
    let layers = layers(&trees, rules.layer_radius_m)?;
    trees.iter_mut().zip(layers).for_each(|(tree, layer)| tree.layer = layer);
    Ok(trees)
}

fn true_row(tree: &TrueTree, layer: Option<Layer>, points: usize, hit: Option<Hit>) -> TrueRow {
    let TrueTree { id, top_m, height_m, visible, .. } = *tree;
    TrueRow { id, top_m, height_m, layer, visible, points, hit }
}

fn found_row(
    tree: &FoundTree,
    layer: Option<Layer>,
    points: &Points,
    own: Option<&TrueTree>,
) -> FoundRow {
    let FoundTree { id, top_m, height_m } = *tree;
    FoundRow {
        id,
        top_m,
        height_m,
        layer,
        points: points.of_found(id).len(),
        shared_points: own.map_or(0, |own| points.shared(own.id, id)),
        is: own.map(|own| (own.id, own.visible)),
    }
}

/// Indices of the points of every tree, true and found.
struct Points {
    by_label: BTreeMap<u64, Vec<u32>>,
    by_found: BTreeMap<u64, Vec<u32>>,
    label: Vec<u64>,
}

impl Points {
    fn new(plot: &Plot, found: &Segmented) -> Self {
        let mut points = Self {
            by_label: BTreeMap::new(),
            by_found: BTreeMap::new(),
            label: plot.label.clone(),
        };
        let high =
            (0..plot.height_m.len()).filter(|&i| f64::from(plot.height_m[i]) >= MIN_POINT_HEIGHT_M);
        for i in high {
            if plot.label[i] != 0 {
                points.by_label.entry(plot.label[i]).or_default().push(i as u32);
            }
            if found.claims[i].id != 0 {
                points.by_found.entry(found.claims[i].id).or_default().push(i as u32);
            }
        }
        points
    }

    fn of_true(&self, label: u64) -> &[u32] {
        self.by_label.get(&label).map_or(&[], Vec::as_slice)
    }

    fn of_found(&self, id: u64) -> &[u32] {
        self.by_found.get(&id).map_or(&[], Vec::as_slice)
    }

    fn shared(&self, label: u64, id: u64) -> usize {
        self.of_found(id).iter().filter(|&&i| self.label[i as usize] == label).count()
    }

    fn hit(&self, plot: &Plot, tree: &TrueTree, found: &FoundTree) -> Hit {
        let hull = |points: &[u32], height_m: f64| crown_hull(plot, points, height_m, tree.top_m);
        let own = hull(self.of_found(found.id), found.height_m);
        Hit {
            id: found.id,
            top_error_m: distance(tree.top_m, found.top_m),
            stem_error_m: distance(tree.stem_m, found.top_m),
            height_error_m: found.height_m - tree.height_m,
            shared_points: self.shared(tree.id, found.id),
            found_points: self.of_found(found.id).len(),
            hull_iou: iou(&own, &hull(self.of_true(tree.id), tree.height_m)),
            crown_iou: iou(&own, &tree.outline_m),
        }
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    (dx * dx + dy * dy).sqrt()
}

/// Convex hull of a crown relative to a position in the world: of those of its points that are above
/// a share of its height, as the stage `crown-fit` draws its polygon.
pub(super) fn crown_hull(
    plot: &Plot,
    points: &[u32],
    height_m: f64,
    around_m: [f64; 2],
) -> Vec<[f64; 2]> {
    let above_m = CrownFitParams::default().polygon_above * height_m;
    let of_crown = |i: &&u32| f64::from(plot.height_m[**i as usize]) >= above_m;
    let offset = |&i: &u32| {
        let [x, y, _] = plot.cloud.world(i as usize);
        [x - around_m[0], y - around_m[1]]
    };
    footprint(points.iter().filter(of_crown).map(offset)).corners
}

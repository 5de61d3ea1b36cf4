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
use timberline_evaluate::{Layer, Matching, Tree, layers, match_trees};

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
    /// Whether it was found when heights must agree, too.
    pub found_with_height: bool,
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
    /// Points of that true tree; 0 if it is none.
    pub true_points: usize,
    /// The true tree it is, and whether that is visible.
    pub is: Option<(u64, bool)>,
    /// Whether it is a true tree when heights must agree, too.
    pub is_with_height: bool,
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
    let (partner, is) = partners(&matching, truth.len(), tops.len());
    let strict = match_trees(&reference, &detected, &rules.matching_with_height())?;
    let (strict_partner, strict_is) = partners(&strict, truth.len(), tops.len());
    let points = Points::new(plot, found);
    let trees = (0..truth.len()).filter(|&i| plot.is_judged(truth[i].top_m)).map(|i| {
        let hit = partner[i].map(|j| points.hit(plot, truth[i], &tops[j]));
        let found_with_height = strict_partner[i].is_some();
        let layer = reference[i].layer;
        let points = points.of_true(truth[i].id).len();
        TrueRow { found_with_height, ..true_row(truth[i], layer, points, hit) }
    });
    let found = (0..tops.len()).filter(|&j| plot.is_judged(tops[j].top_m)).map(|j| {
        let own = is[j].map(|i| truth[i]);
        let is_with_height = strict_is[j].is_some();
        FoundRow { is_with_height, ..found_row(&tops[j], detected[j].layer, &points, own) }
    });
    Ok(Judged { trees: trees.collect(), found: found.collect() })
}

/// The partner of every true and of every found tree.
fn partners(
    matching: &Matching,
    truth: usize,
    found: usize,
) -> (Vec<Option<usize>>, Vec<Option<usize>>) {
    let mut both = (vec![None; truth], vec![None; found]);
    for pair in &matching.pairs {
        both.0[pair.reference] = Some(pair.detected);
        both.1[pair.detected] = Some(pair.reference);
    }
    both
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
    let found_with_height = false;
    TrueRow { id, top_m, height_m, layer, visible, points, hit, found_with_height }
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
        true_points: own.map_or(0, |own| points.of_true(own.id).len()),
        is: own.map(|own| (own.id, own.visible)),
        is_with_height: false,
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

#[cfg(test)]
mod tests {
    use super::*;
    use timberline_pointcloud::{Frame, Point, PointCloud};
    use timberline_segmentation::Claim;

    const OUTLINE_M: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

    /// Trees at 2, 6 and 10 m east, 10, 8 and 12 m tall, each with the corners of its outline and
    /// its top as points; the third stands outside the judged area.
    fn plot() -> Plot {
        let mut cloud = PointCloud::new(Frame::new([1000, 2000, 0]));
        let (mut label, mut height_m) = (Vec::new(), Vec::new());
        for (id, x, height) in [(1, 2.0, 10.0), (2, 6.0, 8.0), (3, 10.0, 12.0)] {
            for [dx, dy] in OUTLINE_M.into_iter().chain([[0.0, 0.0]]) {
                cloud.push_world([1000.0 + x + dx, 2002.0 + dy, height], &Point::default());
                label.push(id);
                height_m.push(height as f32);
            }
        }
        let mut plot = Plot::measured(&cloud, &height_m, &label).unwrap();
        let tree = |(id, x, height_m)| TrueTree {
            id,
            top_m: [1000.0 + x, 2002.0],
            stem_m: [1000.0 + x, 2002.3],
            height_m,
            visible: id != 2,
            outline_m: OUTLINE_M.to_vec(),
        };
        plot.trees = [(1, 2.0, 10.0), (2, 6.0, 8.0), (3, 10.0, 12.0)].map(tree).to_vec();
        plot.judged = timberline_pointcloud::Rect { min: [1000.0, 2000.0], max: [1008.0, 2004.0] };
        plot
    }

    /// A found tree for every place, and every point with the tree that `id` says.
    fn found(plot: &Plot, tops: &[(u64, f64, f64)], id: impl Fn(u64) -> u64) -> Segmented {
        let tree = |&(id, x, height_m): &(u64, f64, f64)| FoundTree {
            id,
            top_m: [1000.0 + x, 2002.0],
            height_m,
        };
        let claim = |&label: &u64| Claim { id: id(label), score: 1.0 };
        Segmented {
            trees: tops.iter().map(tree).collect(),
            claims: plot.label.iter().map(claim).collect(),
        }
    }

    #[test]
    fn a_perfect_segmentation() {
        let plot = plot();
        let tops = [(11, 2.0, 10.0), (12, 6.0, 8.0), (13, 10.0, 12.0)];
        let segmented = found(&plot, &tops, |label| label + 10);
        let judged = judge(&plot, &segmented, &Experiment::default()).unwrap();
        assert_eq!((judged.trees.len(), judged.found.len()), (2, 2), "the third is not judged");
        for tree in &judged.trees {
            let hit = tree.hit.unwrap();
            assert_eq!((hit.top_error_m, hit.height_error_m), (0.0, 0.0));
            assert!((hit.stem_error_m - 0.3).abs() < 1e-9);
            assert_eq!((tree.points, hit.shared_points, hit.found_points), (5, 5, 5));
            assert!((hit.hull_iou - 1.0).abs() < 1e-9 && (hit.crown_iou - 1.0).abs() < 1e-9);
            assert!(tree.found_with_height);
        }
        let is: Vec<_> = judged.found.iter().map(|tree| tree.is).collect();
        assert_eq!(is, [Some((1, true)), Some((2, false))]);
    }

    #[test]
    fn one_tree_for_two_and_one_too_many() {
        let plot = plot();
        let segmented = found(&plot, &[(7, 2.5, 10.0), (8, 4.0, 30.0)], |_| 7);
        let judged = judge(&plot, &segmented, &Experiment::default()).unwrap();
        let hit = judged.trees[0].hit.unwrap();
        assert_eq!((hit.id, hit.top_error_m), (7, 0.5));
        assert_eq!((hit.shared_points, hit.found_points), (5, 15));
        // Its hull is five times as long as the crown.
        assert!((hit.hull_iou - 0.2).abs() < 1e-9, "{}", hit.hull_iou);
        let second = &judged.trees[1];
        assert_eq!(second.hit.unwrap().id, 8, "2 m away, by position alone");
        assert!(!second.found_with_height, "22 m too tall");
        assert!(judged.found[1].is.is_some() && !judged.found[1].is_with_height);
        assert_eq!(judged.found[1].points, 0);
    }

    #[test]
    fn a_partner_beyond_the_border_counts() {
        let plot = plot();
        let segmented = found(&plot, &[(8, 8.0, 8.0)], |_| 0);
        let judged = judge(&plot, &segmented, &Experiment::default()).unwrap();
        assert!(judged.found.is_empty(), "its own top is outside");
        assert_eq!(judged.trees[1].hit.map(|hit| hit.id), Some(8));
    }

    #[test]
    fn columns_must_fit() {
        let plot = plot();
        let mut segmented = found(&plot, &[], |_| 0);
        segmented.claims.pop();
        let message = judge(&plot, &segmented, &Experiment::default()).unwrap_err().to_string();
        assert!(message.contains("`tree`") && message.contains("14 values for 15"), "{message}");
    }
}

//! Figures of one or several judged plots.

use super::judge::{FoundRow, Hit, Judged, TrueRow};
use serde::Serialize;
use timberline_evaluate::{Accuracy, ErrorStats, Layer};

/// How well the trees of some plots were found and their points gathered.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Summary {
    /// All trees.
    pub all: Accuracy,
    /// All trees when heights must agree, too.
    pub with_height: Accuracy,
    /// Trees with nothing above their tops: found trees that are hidden ones count neither for nor
    /// against.
    pub visible: Accuracy,
    /// Trees of which at least half was gathered: those found whose points overlap the true ones by
    /// an intersection over union of [`HALF`] or more.
    pub segments: Accuracy,
    /// By class of height: true trees by their height, found ones by theirs.
    pub by_height: Vec<Accuracy>,
    /// By canopy layer: true trees among the true ones, found trees among the found ones.
    pub by_layer: Vec<Accuracy>,
    /// From the true crown's top to the found one, in the plane, m.
    pub top_error_m: ErrorStats,
    /// From the foot of the stem to the found top, in the plane, m.
    pub stem_error_m: ErrorStats,
    /// Found minus true height, m.
    pub height_error_m: ErrorStats,
    /// Mean over the matched of [`Hit::hull_iou`]; none without any.
    pub hull_iou: Option<f64>,
    /// Mean over the matched of [`Hit::crown_iou`]; none without any.
    pub crown_iou: Option<f64>,
    /// Mean over the matched of the share of the found points that are the tree's.
    pub tree_purity: Option<f64>,
    /// Mean over the matched of the share of the tree's points that were found.
    pub tree_completeness: Option<f64>,
    /// Share of all points of found trees that belong to the tree theirs is; those of false trees
    /// belong to none.
    pub point_purity: Option<f64>,
    /// Share of all points of true trees that were found; of missed trees none were.
    pub point_completeness: Option<f64>,
}

/// Overlap of points from which a segment holds its tree, as is usual for segments of instances
/// (Kirillov et al. 2019, Panoptic segmentation, section 4.1).
pub const HALF: f64 = 0.5;

/// Layers in the sequence of the tables.
pub const LAYERS: [Layer; 3] = [Layer::Upper, Layer::Middle, Layer::Lower];

impl Summary {
    /// Pools plots. `edges_m` are the borders between classes of height.
    #[must_use]
    pub fn of(plots: &[&Judged], edges_m: &[f64]) -> Self {
        let trees: Vec<&TrueRow> = plots.iter().flat_map(|plot| &plot.trees).collect();
        let found: Vec<&FoundRow> = plots.iter().flat_map(|plot| &plot.found).collect();
        let hits: Vec<(&TrueRow, &Hit)> =
            trees.iter().filter_map(|tree| Some((*tree, tree.hit.as_ref()?))).collect();
        let errors = |error: fn(&Hit) -> f64| ErrorStats::of(hits.iter().map(|(_, h)| error(h)));
        let mean_of = |value: &dyn Fn(&(&TrueRow, &Hit)) -> f64| mean(hits.iter().map(value));
        let gathered = hits.iter().map(|(_, hit)| hit.shared_points).sum();
        let right = found.iter().map(|tree| tree.shared_points).sum();
        Self {
            all: group("all", &trees, &found, |_| true, |_| true),
            with_height: with_height(&trees, &found),
            visible: group("visible", &trees, &found, |tree| tree.visible, is_not_hidden),
            segments: segments(&trees, &found),
            by_height: by_height(&trees, &found, edges_m),
            by_layer: by_layer(&trees, &found),
            top_error_m: errors(|hit| hit.top_error_m),
            stem_error_m: errors(|hit| hit.stem_error_m),
            height_error_m: errors(|hit| hit.height_error_m),
            hull_iou: mean_of(&|(_, hit)| hit.hull_iou),
            crown_iou: mean_of(&|(_, hit)| hit.crown_iou),
            tree_purity: mean_of(&|(_, hit)| ratio(hit.shared_points, hit.found_points)),
            tree_completeness: mean_of(&|(tree, hit)| ratio(hit.shared_points, tree.points)),
            point_purity: share(right, found.iter().map(|tree| tree.points).sum()),
            point_completeness: share(gathered, trees.iter().map(|tree| tree.points).sum()),
        }
    }
}

fn with_height(trees: &[&TrueRow], found: &[&FoundRow]) -> Accuracy {
    Accuracy {
        group: "with-height".to_owned(),
        reference: trees.len(),
        found: trees.iter().filter(|tree| tree.found_with_height).count(),
        detected: Some(found.len()),
        correct: found.iter().filter(|tree| tree.is_with_height).count(),
    }
}

fn segments(trees: &[&TrueRow], found: &[&FoundRow]) -> Accuracy {
    let is_held = |shared: usize, one: usize, other: usize| {
        shared > 0 && ratio(shared, one + other - shared) >= HALF
    };
    let of_true = |tree: &&&TrueRow| {
        tree.hit.is_some_and(|hit| is_held(hit.shared_points, tree.points, hit.found_points))
    };
    let of_found = |tree: &&&FoundRow| is_held(tree.shared_points, tree.points, tree.true_points);
    Accuracy {
        group: "segments".to_owned(),
        reference: trees.len(),
        found: trees.iter().filter(of_true).count(),
        detected: Some(found.len()),
        correct: found.iter().filter(of_found).count(),
    }
}

fn is_not_hidden(tree: &FoundRow) -> bool {
    tree.is.is_none_or(|(_, visible)| visible)
}

fn by_height(trees: &[&TrueRow], found: &[&FoundRow], edges_m: &[f64]) -> Vec<Accuracy> {
    let class = |height_m: f64| edges_m.partition_point(|edge| *edge <= height_m);
    let one = |(index, name): (usize, String)| {
        let (of_true, of_found) =
            (|t: &TrueRow| class(t.height_m) == index, |f: &FoundRow| class(f.height_m) == index);
        group(&name, trees, found, of_true, of_found)
    };
    class_names(edges_m).into_iter().enumerate().map(one).collect()
}

/// Names of the classes of height.
#[must_use]
pub fn class_names(edges_m: &[f64]) -> Vec<String> {
    let (Some(first), Some(last)) = (edges_m.first(), edges_m.last()) else { return Vec::new() };
    let between = edges_m.windows(2).map(|pair| format!("{} to {} m", pair[0], pair[1]));
    let mut names = vec![format!("below {first} m")];
    names.extend(between);
    names.push(format!("from {last} m"));
    names
}

fn by_layer(trees: &[&TrueRow], found: &[&FoundRow]) -> Vec<Accuracy> {
    let one = |layer: Layer| {
        let (of_true, of_found) =
            (|t: &TrueRow| t.layer == Some(layer), |f: &FoundRow| f.layer == Some(layer));
        group(&layer.to_string(), trees, found, of_true, of_found)
    };
    LAYERS.map(one).to_vec()
}

fn group(
    name: &str,
    trees: &[&TrueRow],
    found: &[&FoundRow],
    of_true: impl Fn(&TrueRow) -> bool,
    of_found: impl Fn(&FoundRow) -> bool,
) -> Accuracy {
    let trees: Vec<_> = trees.iter().filter(|tree| of_true(tree)).collect();
    let found: Vec<_> = found.iter().filter(|tree| of_found(tree)).collect();
    Accuracy {
        group: name.to_owned(),
        reference: trees.len(),
        found: trees.iter().filter(|tree| tree.hit.is_some()).count(),
        detected: Some(found.len()),
        correct: found.iter().filter(|tree| tree.is.is_some()).count(),
    }
}

fn ratio(part: usize, whole: usize) -> f64 {
    if whole == 0 { 0.0 } else { part as f64 / whole as f64 }
}

fn share(part: usize, whole: usize) -> Option<f64> {
    (whole > 0).then(|| ratio(part, whole))
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0_usize, 0.0), |(n, sum), value| (n + 1, sum + value));
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(id: u64, shared_points: usize, found_points: usize) -> Hit {
        Hit {
            id,
            top_error_m: 0.5,
            stem_error_m: 1.0,
            height_error_m: -0.2,
            shared_points,
            found_points,
            hull_iou: 0.8,
            crown_iou: 0.6,
        }
    }

    fn tree(id: u64, height_m: f64, visible: bool, hit: Option<Hit>) -> TrueRow {
        let layer = Some(if height_m > 20.0 { Layer::Upper } else { Layer::Lower });
        let found_with_height = hit.is_some();
        let (top_m, points) = ([0.0; 2], 100);
        TrueRow { id, top_m, height_m, layer, visible, points, hit, found_with_height }
    }

    fn found(id: u64, height_m: f64, is: Option<(u64, bool)>) -> FoundRow {
        let shared_points = if is.is_some() { 40 } else { 0 };
        FoundRow {
            id,
            top_m: [0.0; 2],
            height_m,
            layer: Some(Layer::Upper),
            points: 80,
            shared_points,
            true_points: 100,
            is,
            is_with_height: is.is_some(),
        }
    }

    /// Two tall trees of which one was found, a hidden one that was found, and a false tree.
    fn example() -> Judged {
        Judged {
            trees: vec![
                tree(1, 25.0, true, Some(hit(7, 40, 80))),
                tree(2, 25.0, true, None),
                tree(3, 8.0, false, Some(hit(8, 40, 80))),
            ],
            found: vec![
                found(7, 24.8, Some((1, true))),
                found(8, 7.8, Some((3, false))),
                found(9, 12.0, None),
            ],
        }
    }

    #[test]
    fn counts_and_shares() {
        let summary = Summary::of(&[&example()], &[10.0, 20.0]);
        assert_eq!(summary.all.recall(), Some(2.0 / 3.0));
        assert_eq!(summary.all.precision(), Some(2.0 / 3.0));
        assert_eq!(summary.with_height.f_score(), summary.all.f_score());
        assert_eq!(summary.visible.recall(), Some(0.5));
        assert_eq!(summary.visible.precision(), Some(0.5), "the hidden one is left out");
        let recalls: Vec<_> = summary.by_height.iter().map(Accuracy::recall).collect();
        assert_eq!(recalls, [Some(1.0), None, Some(0.5)]);
        assert_eq!(summary.by_layer[0].recall(), Some(0.5));
        assert_eq!(summary.segments.found, 0, "40 of 140 points");
        assert_eq!(summary.point_purity, Some(80.0 / 240.0));
        assert_eq!(summary.point_completeness, Some(80.0 / 300.0));
        assert_eq!(summary.tree_purity, Some(0.5));
        assert_eq!(summary.tree_completeness, Some(0.4));
        assert_eq!((summary.top_error_m.n, summary.top_error_m.rmse), (2, 0.5));
    }

    #[test]
    fn a_segment_holds_its_tree_from_half_on() {
        let mut one = example();
        one.trees[0].hit = Some(hit(7, 70, 80));
        one.found[0].shared_points = 70;
        // The partner of the third is judged elsewhere.
        one.trees[2].hit = Some(hit(8, 100, 100));
        let summary = Summary::of(&[&one], &[]);
        assert_eq!((summary.segments.found, summary.segments.correct), (2, 1));
        assert_eq!(summary.segments.precision(), Some(1.0 / 3.0));
    }

    #[test]
    fn plots_are_pooled_by_their_trees() {
        let (one, none) =
            (example(), Judged { trees: vec![tree(1, 30.0, true, None)], found: vec![] });
        let summary = Summary::of(&[&one, &none], &[]);
        assert_eq!(summary.all.recall(), Some(0.5));
        assert!(summary.by_height.is_empty());
        let empty = Summary::of(&[], &[10.0]);
        assert_eq!((empty.all.recall(), empty.hull_iou, empty.point_purity), (None, None, None));
    }
}

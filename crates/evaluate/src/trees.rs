//! How well trees were found: recall, precision, F, and the errors of those found.

use crate::{Error, ErrorStats, MatchParams, Matching, Pair, match_trees};
use serde::{Deserialize, Serialize};
use std::fmt;
use timberline_pointcloud::Nearest2;

/// A tree, measured or detected.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Tree {
    /// Unique in its list.
    pub id: u64,
    /// Position in the plane, metres.
    pub at_m: [f64; 2],
    /// Height above ground, metres; NaN where unknown.
    pub height_m: f64,
    /// Mean crown diameter, metres; NaN where unknown.
    pub crown_diameter_m: f64,
    /// Canopy layer, where known.
    pub layer: Option<Layer>,
}

impl Default for Tree {
    fn default() -> Self {
        let unknown = f64::NAN;
        Self { id: 0, at_m: [0.0; 2], height_m: unknown, crown_diameter_m: unknown, layer: None }
    }
}

/// Canopy layer by height relative to the top height around (IUFRO, Leibundgut 1958).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Layer {
    /// Above two thirds of the top height.
    Upper,
    /// From one third to two thirds.
    Middle,
    /// Below one third.
    Lower,
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Upper => "upper layer",
            Self::Middle => "middle layer",
            Self::Lower => "lower layer",
        })
    }
}

/// The layer of each tree: its height against that of the tallest within `radius_m` of it (itself
/// included). None where the height is unknown.
///
/// # Errors
/// [`Error::Search`] when the neighbour search refuses the positions.
pub fn layers(trees: &[Tree], radius_m: f64) -> Result<Vec<Option<Layer>>, Error> {
    let positions: Vec<[f64; 2]> = trees.iter().map(|tree| tree.at_m).collect();
    let search = Nearest2::new(&positions)?;
    let layer = |tree: &Tree| {
        let around = search.within(&tree.at_m, radius_m);
        let top = around.iter().map(|n| trees[n.index].height_m).fold(tree.height_m, f64::max);
        let share = 3.0 * tree.height_m;
        match () {
            () if tree.height_m.is_nan() => None,
            () if share > 2.0 * top => Some(Layer::Upper),
            () if share >= top => Some(Layer::Middle),
            () => Some(Layer::Lower),
        }
    };
    Ok(trees.iter().map(layer).collect())
}

/// How many trees of a group there are and how many were matched.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Accuracy {
    /// What the group is.
    pub group: String,
    /// Reference trees in the group.
    pub reference: usize,
    /// Those of them that were found.
    pub found: usize,
    /// Detected trees in the group (by their own height); none for groups only the reference knows.
    pub detected: Option<usize>,
    /// Those of them that are reference trees.
    pub correct: usize,
}

impl Accuracy {
    /// Share of the reference trees that were found; none without reference trees.
    #[must_use]
    pub fn recall(&self) -> Option<f64> {
        share(self.found, self.reference)
    }

    /// Share of the detected trees that are reference trees; none without detected trees.
    #[must_use]
    pub fn precision(&self) -> Option<f64> {
        share(self.correct, self.detected?)
    }

    /// Harmonic mean of recall and precision; 0 when both are 0.
    #[must_use]
    pub fn f_score(&self) -> Option<f64> {
        let (recall, precision) = (self.recall()?, self.precision()?);
        let sum = recall + precision;
        Some(if sum > 0.0 { 2.0 * recall * precision / sum } else { 0.0 })
    }
}

fn share(part: usize, whole: usize) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

/// The result of an assessment of detected trees.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TreeAccuracy {
    /// All trees.
    pub all: Accuracy,
    /// By class of height: reference trees by their height, detected trees by theirs.
    pub by_height: Vec<Accuracy>,
    /// By canopy layer of the reference trees, where any is known; recall only.
    pub by_layer: Vec<Accuracy>,
    /// Distance in the plane between the partners, metres.
    pub position_m: ErrorStats,
    /// Height, detected minus reference, metres.
    pub height_m: ErrorStats,
    /// Crown diameter, detected minus reference, metres.
    pub crown_diameter_m: ErrorStats,
    /// Crown diameter, relative error.
    pub crown_diameter_ratio: ErrorStats,
    /// Who was matched to whom.
    pub matching: Matching,
}

/// Matches the trees and counts. `edges_m` are the borders between height classes, ascending: edges
/// 10 and 20 give the classes below 10, 10 to 20 (10 included), and from 20 m up.
///
/// # Errors
/// As [`match_trees`], and [`Error::Parameter`] for edges that do not ascend.
pub fn assess_trees(
    reference: &[Tree],
    detected: &[Tree],
    params: &MatchParams,
    edges_m: &[f64],
) -> Result<TreeAccuracy, Error> {
    check_edges(edges_m)?;
    let matching = match_trees(reference, detected, params)?;
    let mut tally = Tally::new(edges_m);
    reference.iter().for_each(|tree| tally.reference(tree));
    detected.iter().for_each(|tree| tally.detected(tree));
    for pair in &matching.pairs {
        tally.pair(&reference[pair.reference], &detected[pair.detected]);
    }
    let errors = |error: fn(&Tree, &Tree) -> f64| {
        let of = |pair: &Pair| error(&detected[pair.detected], &reference[pair.reference]);
        ErrorStats::of(matching.pairs.iter().map(of))
    };
    let known_layers = tally.by_layer.into_iter().filter(|group| group.reference > 0).collect();
    Ok(TreeAccuracy {
        all: tally.all,
        by_height: tally.by_height,
        by_layer: known_layers,
        position_m: ErrorStats::of(matching.pairs.iter().map(|pair| pair.distance_m)),
        height_m: errors(|found, truth| found.height_m - truth.height_m),
        crown_diameter_m: errors(|found, truth| found.crown_diameter_m - truth.crown_diameter_m),
        crown_diameter_ratio: errors(|found, truth| {
            found.crown_diameter_m / truth.crown_diameter_m - 1.0
        }),
        matching,
    })
}

fn check_edges(edges_m: &[f64]) -> Result<(), Error> {
    let finite = edges_m.iter().find(|edge| !edge.is_finite());
    let falling = edges_m.windows(2).find(|pair| pair[0] >= pair[1]).map(|pair| &pair[1]);
    match finite.or(falling) {
        None => Ok(()),
        Some(&value) => {
            let allowed = "edges of height classes must be finite and ascend";
            Err(Error::Parameter { name: "edges_m", value, allowed })
        }
    }
}

struct Tally<'a> {
    edges_m: &'a [f64],
    all: Accuracy,
    by_height: Vec<Accuracy>,
    by_layer: Vec<Accuracy>,
}

impl<'a> Tally<'a> {
    fn new(edges_m: &'a [f64]) -> Self {
        let group = |group: String| Accuracy { group, detected: Some(0), ..Accuracy::default() };
        let layer = |layer: Layer| Accuracy { detected: None, ..group(layer.to_string()) };
        Self {
            edges_m,
            all: group("all trees".to_owned()),
            by_height: class_names(edges_m).into_iter().map(group).collect(),
            by_layer: [Layer::Upper, Layer::Middle, Layer::Lower].map(layer).to_vec(),
        }
    }

    fn class(&self, tree: &Tree) -> Option<usize> {
        let class = self.edges_m.partition_point(|edge| *edge <= tree.height_m);
        (!tree.height_m.is_nan() && !self.by_height.is_empty()).then_some(class)
    }

    fn reference(&mut self, tree: &Tree) {
        self.all.reference += 1;
        self.in_class(tree, |group| group.reference += 1);
        self.in_layer(tree, |group| group.reference += 1);
    }

    fn detected(&mut self, tree: &Tree) {
        let add = |group: &mut Accuracy| group.detected = group.detected.map(|n| n + 1);
        add(&mut self.all);
        self.in_class(tree, add);
    }

    fn pair(&mut self, reference: &Tree, detected: &Tree) {
        self.all.found += 1;
        self.all.correct += 1;
        self.in_class(reference, |group| group.found += 1);
        self.in_class(detected, |group| group.correct += 1);
        self.in_layer(reference, |group| group.found += 1);
    }

    fn in_class(&mut self, tree: &Tree, change: impl FnOnce(&mut Accuracy)) {
        if let Some(class) = self.class(tree) {
            change(&mut self.by_height[class]);
        }
    }

    fn in_layer(&mut self, tree: &Tree, change: impl FnOnce(&mut Accuracy)) {
        if let Some(layer) = tree.layer {
            change(&mut self.by_layer[layer as usize]);
        }
    }
}

fn class_names(edges_m: &[f64]) -> Vec<String> {
    let (Some(first), Some(last)) = (edges_m.first(), edges_m.last()) else { return Vec::new() };
    let between = edges_m.windows(2).map(|pair| format!("{} to {} m", pair[0], pair[1]));
    let mut names = vec![format!("below {first} m")];
    names.extend(between);
    names.push(format!("from {last} m"));
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(id: u64, x: f64, height_m: f64, crown_diameter_m: f64) -> Tree {
        Tree { id, at_m: [x, 0.0], height_m, crown_diameter_m, layer: None }
    }

    /// Three reference trees; one found 0.5 m off and 1 m short, one found exactly, one missed;
    /// one false alarm.
    fn example() -> TreeAccuracy {
        let mut reference =
            [tree(1, 0.0, 30.0, 6.0), tree(2, 10.0, 21.0, f64::NAN), tree(3, 20.0, 9.0, 2.0)];
        let layers = layers(&reference, 25.0).unwrap();
        reference.iter_mut().zip(layers).for_each(|(tree, layer)| tree.layer = layer);
        let detected =
            [tree(7, 0.5, 29.0, 4.5), tree(8, 10.0, 21.0, 4.0), tree(9, 40.0, 12.0, 3.0)];
        assess_trees(&reference, &detected, &MatchParams::default(), &[10.0, 30.0]).unwrap()
    }

    #[test]
    fn counts_by_hand() {
        let found = example();
        assert_eq!((found.all.recall(), found.all.precision()), (Some(2.0 / 3.0), Some(2.0 / 3.0)));
        assert!((found.all.f_score().unwrap() - 2.0 / 3.0).abs() < 1e-15);
        let rows: Vec<_> = found
            .by_height
            .iter()
            .map(|g| (g.group.as_str(), g.reference, g.found, g.detected, g.correct))
            .collect();
        let expected = [
            ("below 10 m", 1, 0, Some(0), 0),
            ("10 to 30 m", 1, 1, Some(3), 2),
            ("from 30 m", 1, 1, Some(0), 0),
        ];
        assert_eq!(rows, expected);
        assert_eq!(found.by_height[0].f_score(), None);
    }

    #[test]
    fn layers_by_hand() {
        let rows = example().by_layer;
        let rows: Vec<_> =
            rows.iter().map(|g| (g.group.as_str(), g.reference, g.found, g.precision())).collect();
        assert_eq!(rows, [("upper layer", 2, 2, None), ("lower layer", 1, 0, None)]);
    }

    #[test]
    fn errors_by_hand() {
        let found = example();
        assert_eq!((found.position_m.median, found.position_m.rmse), (0.25, 0.125f64.sqrt()));
        assert_eq!(
            (found.height_m.n, found.height_m.bias, found.height_m.rmse),
            (2, -0.5, 0.5f64.sqrt())
        );
        assert_eq!((found.crown_diameter_m.n, found.crown_diameter_m.bias), (1, -1.5));
        assert_eq!(found.crown_diameter_ratio.median, -0.25);
        assert_eq!((found.matching.missed, found.matching.false_alarms), (vec![2], vec![2]));
    }

    #[test]
    fn layers_follow_the_tallest_near_by() {
        let trees = [tree(1, 0.0, 30.0, 1.0), tree(2, 5.0, 10.0, 1.0), tree(3, 90.0, 9.9, 1.0)];
        let found = layers(&trees, 20.0).unwrap();
        assert_eq!(found, [Some(Layer::Upper), Some(Layer::Middle), Some(Layer::Upper)]);
    }

    #[test]
    fn edges_must_ascend() {
        let error = assess_trees(&[], &[], &MatchParams::default(), &[10.0, 10.0]).unwrap_err();
        assert!(error.to_string().contains("`edges_m` is 10; edges"), "{error}");
    }

    #[test]
    fn of_nothing() {
        let found = assess_trees(&[], &[], &MatchParams::default(), &[]).unwrap();
        assert_eq!(
            (found.all.recall(), found.all.precision(), found.all.f_score()),
            (None, None, None)
        );
        assert!(found.by_height.is_empty());
    }
}

//! Real scans with truth: crowns drawn by hand, and single trees that were measured.

use super::chain::Chain;
use super::judge::{MIN_POINT_HEIGHT_M, crown_hull};
use super::method::{FoundTree, Method, Segmented};
use super::plot::Plot;
use crate::Error;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;
use timberline_crowns::footprint::footprint;
use timberline_evaluate::{assess_labels, boxes::MIN_IOU, match_boxes};
use timberline_pointcloud::Rect;

/// A scan whose crowns were drawn as boxes; the plot's labels tell the box of every point.
#[derive(Debug, Clone)]
pub struct BoxedScan {
    /// Name in tables.
    pub name: String,
    /// The points.
    pub plot: Plot,
    /// The boxes, in the world.
    pub boxes: Vec<Rect>,
}

/// A scan of one tree with what was measured of it.
#[derive(Debug, Clone)]
pub struct Clip {
    /// Name in tables.
    pub name: String,
    /// The points.
    pub plot: Plot,
    /// Where the top was measured, in the world.
    pub top_m: [f64; 2],
    /// Measured height, m.
    pub height_m: f64,
    /// Measured mean diameter of the crown, m.
    pub crown_diameter_m: f64,
}

/// Boxes found by a segmenter.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoxRow {
    /// Name of the scan.
    pub scan: String,
    /// Name of the segmenter.
    pub method: &'static str,
    /// Boxes drawn.
    pub boxes: usize,
    /// Trees found.
    pub found: usize,
    /// Pairs of a box and a tree whose box overlaps it by [`MIN_IOU`] or more.
    pub matched: usize,
    /// Share of the boxes that were found.
    pub recall: Option<f64>,
    /// Share of the trees whose box was drawn.
    pub precision: Option<f64>,
    /// Mean overlap of the pairs.
    pub mean_iou: Option<f64>,
    /// Share of the points in boxes and found trees that are in the box that most of the tree's
    /// points in boxes are in.
    pub purity: f64,
    /// Share of the points in boxes that are in the tree with most of the box's points.
    pub completeness: f64,
    /// Share of the points of found trees that are in any box.
    pub in_boxes: f64,
}

/// What a segmenter found of a measured tree. Lengths in metres.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClipRow {
    /// Name of the clip.
    pub clip: String,
    /// Name of the segmenter.
    pub method: &'static str,
    /// Measured height.
    pub height_m: f64,
    /// Measured diameter of the crown.
    pub crown_diameter_m: f64,
    /// Trees found in the clip.
    pub trees: usize,
    /// Distance to the found tree's top; none where no tree is within [`REACH_M`].
    pub distance_m: Option<f64>,
    /// Its height.
    pub found_height_m: Option<f64>,
    /// Its crown's diameter: that of the circle with the area of its polygon.
    pub found_diameter_m: Option<f64>,
}

/// Farthest that a found top may be from the measured one, m.
pub const REACH_M: f64 = 2.0;
/// Largest error of a height that is right, m.
pub const HEIGHT_WITHIN_M: f64 = 1.0;
/// Largest relative error of a diameter that is right.
pub const DIAMETER_WITHIN: f64 = 0.2;

impl ClipRow {
    /// Whether the height is within [`HEIGHT_WITHIN_M`].
    #[must_use]
    pub fn height_is_right(&self) -> bool {
        self.found_height_m.is_some_and(|found| (found - self.height_m).abs() <= HEIGHT_WITHIN_M)
    }

    /// Whether the crown's diameter is within [`DIAMETER_WITHIN`].
    #[must_use]
    pub fn diameter_is_right(&self) -> bool {
        let off = |found: f64| (found / self.crown_diameter_m - 1.0).abs();
        self.found_diameter_m.is_some_and(|found| off(found) <= DIAMETER_WITHIN)
    }
}

/// Every scan with boxes, segmented every way.
///
/// # Errors
/// What the stages and segmenters refuse.
pub fn boxes(scans: &[BoxedScan], chain: &Chain, methods: &[Method]) -> Result<Vec<BoxRow>, Error> {
    let of_scan = |scan: &BoxedScan| -> Result<Vec<BoxRow>, Error> {
        let markers = chain.markers(&scan.plot)?;
        let row = |method: &Method| box_row(scan, method, &method.run(&scan.plot, &markers)?);
        methods.iter().map(row).collect()
    };
    let rows: Result<Vec<_>, Error> = scans.par_iter().map(of_scan).collect();
    Ok(rows?.into_iter().flatten().collect())
}

fn box_row(scan: &BoxedScan, method: &Method, found: &Segmented) -> Result<BoxRow, Error> {
    let hulls = hulls(&scan.plot, found);
    let boxes: Vec<Rect> = hulls.values().filter_map(|(tree, hull)| around(tree, hull)).collect();
    let matched = match_boxes(&scan.boxes, &boxes, MIN_IOU)?;
    let high: Vec<usize> = (0..scan.plot.label.len())
        .filter(|&i| f64::from(scan.plot.height_m[i]) >= MIN_POINT_HEIGHT_M)
        .collect();
    let in_trees = high.iter().filter(|&&i| found.claims[i].id != 0);
    let in_both = in_trees.clone().filter(|&&i| scan.plot.label[i] != 0).count();
    let in_trees = in_trees.count();
    let boxed: Vec<usize> = high.into_iter().filter(|&i| scan.plot.label[i] != 0).collect();
    let truth: Vec<u64> = boxed.iter().map(|&i| scan.plot.label[i]).collect();
    let claimed: Vec<u64> = boxed.iter().map(|&i| found.claims[i].id).collect();
    let labels = assess_labels(&truth, &claimed)?;
    Ok(BoxRow {
        scan: scan.name.clone(),
        method: method.name,
        boxes: matched.reference,
        found: matched.detected,
        matched: matched.pairs.len(),
        recall: matched.recall(),
        precision: matched.precision(),
        mean_iou: matched.mean_iou(),
        purity: labels.purity,
        completeness: labels.completeness,
        in_boxes: in_both as f64 / in_trees.max(1) as f64,
    })
}

/// The found trees with the hulls of their crowns, relative to their tops.
fn hulls(plot: &Plot, found: &Segmented) -> BTreeMap<u64, (FoundTree, Vec<[f64; 2]>)> {
    let mut points: BTreeMap<u64, Vec<u32>> = BTreeMap::new();
    for (i, claim) in found.claims.iter().enumerate().filter(|(_, claim)| claim.id != 0) {
        points.entry(claim.id).or_default().push(i as u32);
    }
    let hull = |tree: &FoundTree| {
        let own = points.get(&tree.id).map_or(&[][..], Vec::as_slice);
        (tree.id, (*tree, crown_hull(plot, own, tree.height_m, tree.top_m)))
    };
    found.trees.iter().map(hull).collect()
}

/// The box around a hull, in the world; none without points.
fn around(tree: &FoundTree, hull: &[[f64; 2]]) -> Option<Rect> {
    let corner = |c: &[f64; 2]| Rect { min: *c, max: *c };
    let rect = hull.iter().map(corner).reduce(|a, b| a.union(&b))?;
    Some(rect.moved(tree.top_m))
}

/// Every clip, segmented every way; sequence by clip, then segmenter.
///
/// # Errors
/// What the stages and segmenters refuse.
pub fn clips(clips: &[Clip], chain: &Chain, methods: &[Method]) -> Result<Vec<ClipRow>, Error> {
    let of_clip = |clip: &Clip| -> Result<Vec<ClipRow>, Error> {
        let markers = chain.markers(&clip.plot)?;
        let row = |method: &Method| Ok(clip_row(clip, method, &method.run(&clip.plot, &markers)?));
        methods.iter().map(row).collect()
    };
    let rows: Result<Vec<_>, Error> = clips.par_iter().map(of_clip).collect();
    Ok(rows?.into_iter().flatten().collect())
}

fn clip_row(clip: &Clip, method: &Method, found: &Segmented) -> ClipRow {
    let hulls = hulls(&clip.plot, found);
    let distance = |tree: &FoundTree| {
        let (dx, dy) = (tree.top_m[0] - clip.top_m[0], tree.top_m[1] - clip.top_m[1]);
        (dx * dx + dy * dy).sqrt()
    };
    let near = hulls.values().map(|(tree, hull)| (distance(tree), tree, hull));
    let nearest = near.filter(|(d, ..)| *d <= REACH_M).min_by(|a, b| a.0.total_cmp(&b.0));
    let diameter = |hull: &[[f64; 2]]| footprint(hull.iter().copied()).mean_diameter_m;
    ClipRow {
        clip: clip.name.clone(),
        method: method.name,
        height_m: clip.height_m,
        crown_diameter_m: clip.crown_diameter_m,
        trees: hulls.len(),
        distance_m: nearest.map(|(d, ..)| d),
        found_height_m: nearest.map(|(_, tree, _)| tree.height_m),
        found_diameter_m: nearest.map(|(.., hull)| diameter(hull)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segmentation::method::method;
    use timberline_pointcloud::{Frame, Point, PointCloud};
    use timberline_segmentation::Claim;

    /// Two trees of four points each, side by side, and a claim for each point.
    fn example() -> (Plot, Segmented) {
        let mut cloud = PointCloud::new(Frame::new([1000, 2000, 0]));
        let (mut label, mut claims) = (Vec::new(), Vec::new());
        for tree in 0..2_u32 {
            for (dx, dy) in [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)] {
                let x = 1000.0 + 4.0 * f64::from(tree) + dx;
                cloud.push_world([x, 2000.0 + dy, 9.0], &Point::default());
                label.push(u64::from(tree) + 1);
                claims.push(Claim { id: 7 + u64::from(tree), score: 1.0 });
            }
        }
        let height_m = vec![9.0; 8];
        let tree = |id, x| FoundTree { id, top_m: [x, 2001.0], height_m: 9.0 };
        let trees = vec![tree(7, 1001.0), tree(8, 1005.0)];
        let plot = Plot::measured(&cloud, &height_m, &label).unwrap();
        (plot, Segmented { trees, claims })
    }

    #[test]
    fn boxes_and_labels() {
        let (plot, found) = example();
        let first = Rect { min: [1000.0, 2000.0], max: [1002.0, 2002.0] };
        let scan = BoxedScan { name: "two".into(), plot, boxes: vec![first] };
        let row = box_row(&scan, &method("starsac").unwrap(), &found).unwrap();
        assert_eq!((row.recall, row.precision, row.mean_iou), (Some(1.0), Some(0.5), Some(1.0)));
        assert_eq!((row.purity, row.completeness, row.in_boxes), (1.0, 1.0, 1.0));
    }

    #[test]
    fn the_nearest_tree_is_the_measured_one() {
        let (plot, found) = example();
        let clip = Clip {
            name: "second".into(),
            plot,
            top_m: [1004.5, 2001.0],
            height_m: 9.8,
            crown_diameter_m: 2.2,
        };
        let row = clip_row(&clip, &method("starsac").unwrap(), &found);
        assert_eq!((row.trees, row.distance_m), (2, Some(0.5)));
        assert!(row.height_is_right() && row.diameter_is_right(), "{row:?}");
        let far = Clip { top_m: [1020.0, 2001.0], ..clip };
        let row = clip_row(&far, &method("starsac").unwrap(), &found);
        assert!(row.distance_m.is_none() && !row.height_is_right());
    }
}

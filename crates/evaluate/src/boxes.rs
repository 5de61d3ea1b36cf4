//! Crown boxes drawn by hand against boxes of detected crowns.

use crate::Error;
use serde::{Deserialize, Serialize};
use timberline_pointcloud::Rect;

/// Overlap from which two boxes are the same crown, as in the benchmark of Weinstein et al. 2021
/// (NeonTreeEvaluation).
pub const MIN_IOU: f64 = 0.4;

/// Intersection over union of two boxes; 0 when either has no area.
#[must_use]
pub fn iou(a: &Rect, b: &Rect) -> f64 {
    let area = |rect: &Rect| rect.size()[0].max(0.0) * rect.size()[1].max(0.0);
    let overlap =
        |axis: usize| (a.max[axis].min(b.max[axis]) - a.min[axis].max(b.min[axis])).max(0.0);
    let shared = overlap(0) * overlap(1);
    let union = area(a) + area(b) - shared;
    if shared > 0.0 && union > 0.0 { shared / union } else { 0.0 }
}

/// How well boxes were found.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct BoxAccuracy {
    /// Reference boxes.
    pub reference: usize,
    /// Detected boxes.
    pub detected: usize,
    /// Pairs (index of the reference box, index of the detected box, overlap), best overlap first.
    pub pairs: Vec<(usize, usize, f64)>,
}

impl BoxAccuracy {
    /// Share of the reference boxes that were found; none without reference boxes.
    #[must_use]
    pub fn recall(&self) -> Option<f64> {
        (self.reference > 0).then(|| self.pairs.len() as f64 / self.reference as f64)
    }

    /// Share of the detected boxes that are reference boxes; none without detected boxes.
    #[must_use]
    pub fn precision(&self) -> Option<f64> {
        (self.detected > 0).then(|| self.pairs.len() as f64 / self.detected as f64)
    }

    /// Mean overlap of the pairs; none without pairs.
    #[must_use]
    pub fn mean_iou(&self) -> Option<f64> {
        let sum: f64 = self.pairs.iter().map(|pair| pair.2).sum();
        (!self.pairs.is_empty()).then(|| sum / self.pairs.len() as f64)
    }
}

/// Pairs boxes greedily, best overlap first, down to `min_iou`; each box once. Equal overlaps go to
/// the boxes with the smaller corners, so the order of input does not matter.
///
/// # Errors
/// [`Error::Parameter`] unless `min_iou` is above 0 and at most 1.
pub fn match_boxes(
    reference: &[Rect],
    detected: &[Rect],
    min_iou: f64,
) -> Result<BoxAccuracy, Error> {
    if !(min_iou > 0.0 && min_iou <= 1.0) {
        let allowed = "an overlap must be above 0 and at most 1";
        return Err(Error::Parameter { name: "min_iou", value: min_iou, allowed });
    }
    let mut candidates: Vec<(usize, usize, f64)> = Vec::new();
    for (r, reference) in reference.iter().enumerate() {
        let overlaps =
            detected.iter().enumerate().map(|(d, detected)| (r, d, iou(reference, detected)));
        candidates.extend(overlaps.filter(|candidate| candidate.2 >= min_iou));
    }
    let corners = |rect: &Rect| [rect.min[0], rect.min[1], rect.max[0], rect.max[1]];
    let by_corners = |a: &Rect, b: &Rect| {
        let pairs = corners(a).into_iter().zip(corners(b));
        pairs.fold(std::cmp::Ordering::Equal, |so_far, (a, b)| so_far.then(a.total_cmp(&b)))
    };
    candidates.sort_by(|a, b| {
        b.2.total_cmp(&a.2)
            .then_with(|| by_corners(&reference[a.0], &reference[b.0]))
            .then_with(|| by_corners(&detected[a.1], &detected[b.1]))
    });
    let mut taken = (vec![false; reference.len()], vec![false; detected.len()]);
    candidates.retain(|&(r, d, _)| {
        let is_free = !taken.0[r] && !taken.1[d];
        taken.0[r] |= is_free;
        taken.1[d] |= is_free;
        is_free
    });
    Ok(BoxAccuracy { reference: reference.len(), detected: detected.len(), pairs: candidates })
}

/// For each box the number of positions inside (borders included): a box with one treetop is found,
/// with more it is split.
#[must_use]
pub fn positions_in(boxes: &[Rect], positions_m: &[[f64; 2]]) -> Vec<usize> {
    let inside = |rect: &Rect, p: &[f64; 2]| {
        (0..2).all(|axis| p[axis] >= rect.min[axis] && p[axis] <= rect.max[axis])
    };
    boxes.iter().map(|rect| positions_m.iter().filter(|p| inside(rect, p)).count()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rect(x: f64, y: f64, width: f64, height: f64) -> Rect {
        Rect { min: [x, y], max: [x + width, y + height] }
    }

    #[test]
    fn overlap_by_hand() {
        assert_eq!(iou(&rect(0.0, 0.0, 2.0, 2.0), &rect(1.0, 0.0, 2.0, 2.0)), 1.0 / 3.0);
        assert_eq!(iou(&rect(0.0, 0.0, 2.0, 2.0), &rect(2.0, 0.0, 2.0, 2.0)), 0.0);
        assert_eq!(iou(&rect(0.0, 0.0, 0.0, 0.0), &rect(0.0, 0.0, 0.0, 0.0)), 0.0);
        assert_eq!(iou(&Rect::EMPTY, &rect(0.0, 0.0, 1.0, 1.0)), 0.0);
    }

    #[test]
    fn the_best_overlap_goes_first() {
        let reference = [rect(0.0, 0.0, 4.0, 4.0), rect(1.0, 0.0, 4.0, 4.0)];
        let detected = [rect(1.0, 0.0, 4.0, 4.0), rect(9.0, 9.0, 1.0, 1.0)];
        let found = match_boxes(&reference, &detected, MIN_IOU).unwrap();
        assert_eq!(found.pairs, [(1, 0, 1.0)]);
        assert_eq!(
            (found.recall(), found.precision(), found.mean_iou()),
            (Some(0.5), Some(0.5), Some(1.0))
        );
    }

    #[test]
    fn ties_do_not_depend_on_the_order() {
        let reference = [rect(0.0, 0.0, 2.0, 2.0)];
        let (left, right) = (rect(-0.5, 0.0, 2.0, 2.0), rect(0.5, 0.0, 2.0, 2.0));
        assert_eq!(match_boxes(&reference, &[left, right], 0.4).unwrap().pairs[0].1, 0);
        assert_eq!(match_boxes(&reference, &[right, left], 0.4).unwrap().pairs[0].1, 1);
    }

    #[test]
    fn an_impossible_overlap_is_refused() {
        assert!(match_boxes(&[], &[], 0.0).unwrap_err().to_string().contains("`min_iou` is 0;"));
    }

    #[test]
    fn positions_are_counted() {
        let boxes = [rect(0.0, 0.0, 2.0, 2.0), rect(5.0, 5.0, 1.0, 1.0)];
        assert_eq!(positions_in(&boxes, &[[2.0, 2.0], [1.0, 1.0], [4.0, 5.0]]), [2, 0]);
    }
}

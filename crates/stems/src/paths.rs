//! The stem with the cheapest way to every voxel: comparative shortest paths (Tao et al. 2015,
//! "Segmenting tree crowns from terrestrial and mobile LiDAR data by exploring ecological theories").
//!
//! Ways are divided by a power of the stem's diameter, because thicker stems feed wider crowns. A
//! step costs its length and more where it leaps over a gap, because branches hang together and
//! neighbouring crowns do not.

use crate::graph::Graph;
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// Where ways begin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// The voxel.
    pub at: u32,
    /// What is found from there: a number of the caller's.
    pub label: u32,
    /// What ways from there are divided by.
    pub scale: f64,
}

/// Length of a step that costs twice its length, m.
const LEAP_M: f64 = 0.2;

/// Label of voxels that no way reaches.
pub const UNREACHED: u32 = u32::MAX;

/// A way's end in the queue; ties go to the smaller label and index, whatever the order of sources.
#[derive(PartialEq)]
struct End {
    cost: f64,
    label: u32,
    at: u32,
    scale: f64,
}

impl Eq for End {}

impl Ord for End {
    fn cmp(&self, other: &Self) -> Ordering {
        let rest = (self.label, self.at).cmp(&(other.label, other.at));
        self.cost.total_cmp(&other.cost).then(rest)
    }
}

impl PartialOrd for End {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The label of the source with the cheapest way to every voxel, [`UNREACHED`] where there is none.
#[must_use]
pub fn cheapest(graph: &Graph, sources: &[Source]) -> Vec<u32> {
    let mut label = vec![UNREACHED; graph.len()];
    let mut cost = vec![f64::INFINITY; graph.len()];
    let mut open: BinaryHeap<Reverse<End>> = BinaryHeap::new();
    for source in sources {
        open.push(Reverse(End {
            cost: 0.0,
            label: source.label,
            at: source.at,
            scale: source.scale,
        }));
    }
    while let Some(Reverse(end)) = open.pop() {
        let at = end.at as usize;
        if label[at] != UNREACHED {
            continue;
        }
        (label[at], cost[at]) = (end.label, end.cost);
        for (to, length_m) in graph.neighbours(end.at) {
            let next = end.cost + length_m * (1.0 + length_m / LEAP_M) / end.scale;
            if label[to as usize] == UNREACHED && next <= cost[to as usize] {
                cost[to as usize] = next;
                let End { label, scale, .. } = end;
                open.push(Reverse(End { cost: next, label, at: to, scale }));
            }
        }
    }
    label
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(count: u32) -> Vec<[f64; 3]> {
        (0..count).map(|k| [0.1 * f64::from(k), 0.0, 0.0]).collect()
    }

    #[test]
    fn the_middle_parts_equal_stems_and_moves_with_their_size() {
        let positions = line(101);
        let graph = Graph::new(&positions, 0.15).unwrap();
        let border = |left: f64, right: f64| {
            let sources = [
                Source { at: 0, label: 0, scale: left },
                Source { at: 100, label: 1, scale: right },
            ];
            cheapest(&graph, &sources).iter().filter(|label| **label == 0).count()
        };
        assert_eq!(border(1.0, 1.0), 51);
        assert!((75..=76).contains(&border(3.0, 1.0)));
    }

    #[test]
    fn what_no_way_reaches_has_no_label() {
        let mut positions: Vec<[f64; 3]> =
            (0..20).map(|k| [0.1 * f64::from(k), 0.0, 0.0]).collect();
        positions.extend((0..20).map(|k| [0.1 * f64::from(k), 50.0, 0.0]));
        let graph = Graph::new(&positions, 0.5).unwrap();
        let labels = cheapest(&graph, &[Source { at: 3, label: 7, scale: 1.0 }]);
        assert!(labels[..20].iter().all(|label| *label == 7));
        assert!(labels[20..].iter().all(|label| *label == UNREACHED));
    }

    #[test]
    fn the_order_of_sources_does_not_matter() {
        let positions = line(50);
        let graph = Graph::new(&positions, 0.15).unwrap();
        let mut sources = [
            Source { at: 10, label: 2, scale: 1.0 },
            Source { at: 40, label: 1, scale: 1.0 },
            Source { at: 25, label: 3, scale: 0.5 },
        ];
        let once = cheapest(&graph, &sources);
        sources.reverse();
        assert_eq!(cheapest(&graph, &sources), once);
    }
}

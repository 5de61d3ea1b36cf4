//! Radii by the pipe model.

use crate::model::Node;
use crate::vector::distance;

/// A radius that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    pub(crate) node: u32,
    pub(crate) radius_m: f64,
    pub(crate) points: u32,
}

/// Gives every node a radius by the pipe model (Shinozaki et al. 1964): the cross-section of a
/// branch carries what grows beyond it, here the length of all branches beyond. One factor makes
/// these radii agree with those that were seen, by the median of their points; where none was,
/// with `fallback_m` at the base.
pub(crate) fn pipe_radii(nodes: &mut [Node], seen: &[Seen], fallback_m: f64) {
    let beyond = lengths_beyond(nodes);
    let pipe = |node: usize| beyond[node].max(1e-6).sqrt();
    let mut ratios: Vec<(f64, u32)> =
        seen.iter().map(|s| (s.radius_m / pipe(s.node as usize), s.points)).collect();
    ratios.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let half = ratios.iter().map(|ratio| u64::from(ratio.1)).sum::<u64>().div_ceil(2);
    let mut sum = 0;
    let middle = ratios.iter().find(|ratio| {
        sum += u64::from(ratio.1);
        sum >= half
    });
    let factor = middle.map_or(fallback_m / pipe(0), |ratio| ratio.0);
    for place in 0..nodes.len() {
        nodes[place].radius_m = factor * pipe(place);
    }
    let first = nodes.iter().find(|node| node.parent == Some(0)).map(|node| node.radius_m);
    if let (Some(first), Some(root)) = (first, nodes.first_mut()) {
        root.radius_m = first;
    }
}

/// Length of all branches beyond each node and of half the piece below it, m.
fn lengths_beyond(nodes: &[Node]) -> Vec<f64> {
    let mut beyond = vec![0.0; nodes.len()];
    for place in (1..nodes.len()).rev() {
        if let Some(parent) = nodes[place].parent {
            let own = distance(nodes[place].position_m, nodes[parent as usize].position_m);
            beyond[parent as usize] += beyond[place] + own;
            beyond[place] += 0.5 * own;
        }
    }
    beyond
}

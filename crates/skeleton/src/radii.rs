//! Radii by the length of what a branch carries.

use crate::model::Node;
use crate::vector::distance;

/// A radius that was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    pub(crate) node: u32,
    pub(crate) radius_m: f64,
    pub(crate) points: u32,
}

/// The exponent where too little was seen: the pipe model's, by which cross-sections add up.
const PIPE: f64 = 0.5;

/// Smallest and largest exponent that is believed.
const EXPONENTS: (f64, f64) = (0.3, 1.1);

/// Lengths carried must differ by this factor for an exponent to be found.
const RANGE: f64 = 4.0;

/// Gives every node a radius by a power of the length of all branches beyond it, after the pipe model
/// (Shinozaki et al. 1964: the cross-section of a branch carries what grows beyond it). Factor and
/// exponent are those that fit the radii seen, by least squares of their logarithms weighted by
/// points; where none was seen, the base has `fallback_m`.
pub(crate) fn allometric_radii(nodes: &mut [Node], seen: &[Seen], fallback_m: f64) {
    let beyond = lengths_beyond(nodes);
    let length = |node: usize| beyond[node].max(1e-6);
    let logs: Vec<[f64; 3]> = seen
        .iter()
        .map(|s| [libm::log(length(s.node as usize)), libm::log(s.radius_m), f64::from(s.points)])
        .collect();
    let (factor, exponent) = fit(&logs).unwrap_or_else(|| {
        (libm::log(fallback_m) - PIPE * libm::log(length(0)), PIPE)
    });
    for (place, node) in nodes.iter_mut().enumerate() {
        node.radius_m = libm::exp(factor + exponent * libm::log(length(place)));
    }
    let first = nodes.iter().find(|node| node.parent == Some(0)).map(|node| node.radius_m);
    if let (Some(first), Some(root)) = (first, nodes.first_mut()) {
        root.radius_m = first;
    }
}

/// Logarithm of the factor, and exponent.
fn fit(logs: &[[f64; 3]]) -> Option<(f64, f64)> {
    let total: f64 = logs.iter().map(|row| row[2]).sum();
    if total <= 0.0 {
        return None;
    }
    let mean = |axis: usize| logs.iter().map(|row| row[axis] * row[2]).sum::<f64>() / total;
    let (x, y) = (mean(0), mean(1));
    let low = logs.iter().map(|row| row[0]).fold(f64::INFINITY, f64::min);
    let high = logs.iter().map(|row| row[0]).fold(f64::NEG_INFINITY, f64::max);
    let up: f64 = logs.iter().map(|row| row[2] * (row[0] - x) * (row[1] - y)).sum();
    let across: f64 = logs.iter().map(|row| row[2] * (row[0] - x) * (row[0] - x)).sum();
    let exponent = if high - low >= libm::log(RANGE) && across > 0.0 {
        (up / across).clamp(EXPONENTS.0, EXPONENTS.1)
    } else {
        PIPE
    };
    Some((y - exponent * x, exponent))
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A stem of 10 m with a branch of 4 m halfway up.
    fn tree() -> Vec<Node> {
        let node = |position_m, parent| Node { position_m, parent, radius_m: 0.0, points: 0 };
        vec![
            node([0.0; 3], None),
            node([0.0, 0.0, 5.0], Some(0)),
            node([0.0, 0.0, 10.0], Some(1)),
            node([4.0, 0.0, 5.0], Some(1)),
        ]
    }

    #[test]
    fn the_law_behind_radii_is_found() {
        let mut nodes = tree();
        let law = |length: f64| 0.02 * libm::pow(length, 0.7);
        let seen = [(1u32, 11.5), (2, 2.5), (3, 2.0)]
            .map(|(node, length)| Seen { node, radius_m: law(length), points: 10 });
        allometric_radii(&mut nodes, &seen, 1.0);
        for (node, length) in nodes.iter().skip(1).zip([11.5, 2.5, 2.0]) {
            assert!((node.radius_m - law(length)).abs() < 1e-12);
        }
        assert_eq!(nodes[0].radius_m, nodes[1].radius_m);
    }

    #[test]
    fn without_circles_the_fallback_holds_at_the_base() {
        let mut nodes = tree();
        allometric_radii(&mut nodes, &[], 0.1);
        assert!((nodes[1].radius_m - 0.1 * (11.5f64 / 14.0).sqrt()).abs() < 1e-12);
    }
}

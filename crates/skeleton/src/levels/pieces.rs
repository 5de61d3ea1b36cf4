//! Pieces of a cloud that the neighbour graph does not connect: which are bridged, which cut off.

use crate::graph::Graph;
use crate::graph::emst::{Link, bridges};
use crate::kdtree::KdTree;
use crate::vector::{Vector, distance};

/// Gaps up to this many median spacings are always bridged: within a twig, distances to the next
/// point vary by that much.
const ALWAYS_SPACINGS: f64 = 8.0;

/// Smaller pieces do not hold the base unless all are small: echoes of nothing lie below the ground.
const BASE_POINTS: u32 = 10;

/// The pieces of a cloud.
#[derive(Debug)]
pub(crate) struct Pieces {
    /// Piece of every point.
    pub(crate) of: Vec<u32>,
    links: Vec<Link>,
    points: Vec<u32>,
    bounds: Vec<(Vector, Vector)>,
}

/// What is left after cutting.
#[derive(Debug)]
pub(crate) struct Joined {
    /// The bridges kept.
    pub(crate) bridges: Vec<[u32; 2]>,
    /// Pieces cut off.
    pub(crate) cut: usize,
}

impl Pieces {
    pub(crate) fn new(tree: &KdTree, points: &[Vector], graph: &Graph) -> Self {
        let of = graph.sets();
        let links = bridges(tree, points, &of);
        let pieces = links.len() + 1;
        let mut count = vec![0; pieces];
        let mut bounds = vec![([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]); pieces];
        for (p, &piece) in points.iter().zip(&of) {
            count[piece as usize] += 1;
            bounds[piece as usize] = union(bounds[piece as usize], (*p, *p));
        }
        Self { of, links, points: count, bounds }
    }

    /// Whether a point's piece is large enough to hold the base.
    pub(crate) fn may_hold_base(&self, point: u32) -> bool {
        let largest = self.points.iter().max().copied().unwrap_or(0);
        let own = self.points[self.of[point as usize] as usize];
        own >= BASE_POINTS.min(largest)
    }

    /// Bridges the pieces from the one that holds the base outwards. A bridge is cut when it is
    /// longer than some spacings and than `gap_m`, or than what lies beyond it.
    pub(crate) fn join(&self, base: u32, spacing_m: f64, gap_m: f64) -> Joined {
        let order = self.outwards(self.of[base as usize]);
        let mut beyond = self.bounds.clone();
        for &(piece, parent, _) in order.iter().rev() {
            beyond[parent as usize] = union(beyond[parent as usize], beyond[piece as usize]);
        }
        let mut kept = vec![true; self.points.len()];
        let mut joined = Joined { bridges: Vec::new(), cut: 0 };
        for &(piece, parent, link) in &order {
            let (low, high) = beyond[piece as usize];
            let allowed = gap_m.min(distance(low, high)).max(ALWAYS_SPACINGS * spacing_m);
            let link = &self.links[link];
            let short = link.squared_m2 <= allowed * allowed;
            kept[piece as usize] = short && kept[parent as usize];
            if kept[piece as usize] {
                joined.bridges.push(link.ends);
            } else {
                joined.cut += 1;
            }
        }
        joined
    }

    /// Every piece but the first with the one before it and the link between: parents first.
    fn outwards(&self, first: u32) -> Vec<(u32, u32, usize)> {
        let mut links_of = vec![Vec::new(); self.points.len()];
        for (place, link) in self.links.iter().enumerate() {
            let [a, b] = link.ends.map(|end| self.of[end as usize]);
            links_of[a as usize].push((b, place));
            links_of[b as usize].push((a, place));
        }
        let (mut order, mut open) = (Vec::new(), vec![(first, first)]);
        while let Some((piece, parent)) = open.pop() {
            for &(next, place) in links_of[piece as usize].iter().filter(|link| link.0 != parent) {
                order.push((next, piece, place));
                open.push((next, piece));
            }
        }
        order
    }
}

fn union(a: (Vector, Vector), b: (Vector, Vector)) -> (Vector, Vector) {
    (
        std::array::from_fn(|axis| a.0[axis].min(b.0[axis])),
        std::array::from_fn(|axis| a.1[axis].max(b.1[axis])),
    )
}

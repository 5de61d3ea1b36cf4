//! Which section every point belongs to.

use crate::sections::Section;
use rayon::prelude::*;
use timberline_solids::Cylinder;
use timberline_solids::vector::{dot, sub};

/// Sections in a leaf of the tree of boxes.
const LEAF: usize = 4;
/// Points asked one after the other, each beginning with the answer before it.
const CHUNK: usize = 1024;

/// The section of every point: that whose axis is nearest once its expected radius is taken off, so
/// that points of the stem stay the stem's where twigs touch it. Of equal ones the first.
#[must_use]
pub fn assign(points_m: &[[f64; 3]], sections: &[Section]) -> Vec<u32> {
    let index = Index::new(sections);
    let chunks = points_m.par_chunks(CHUNK).map(|chunk| {
        let mut last = 0;
        let one = |point: &[f64; 3]| {
            last = index.nearest(*point, last);
            last
        };
        chunk.iter().map(one).collect::<Vec<_>>()
    });
    chunks.collect::<Vec<_>>().concat()
}

/// Distance from a position to a section's surface, negative inside, without end discs, m.
#[must_use]
pub fn outwards_m(section: &Section, point: [f64; 3]) -> f64 {
    Core::of(section).outwards(point)
}

/// A section prepared for distances.
#[derive(Debug, Clone, Copy)]
struct Core {
    start: [f64; 3],
    axis: [f64; 3],
    /// One over the squared length; 0 without length.
    inverse: f64,
    radius: f64,
}

impl Core {
    fn of(section: &Section) -> Self {
        Self::new(section.start_m, section.end_m, section.radius_m)
    }

    fn new(start: [f64; 3], end: [f64; 3], radius: f64) -> Self {
        let axis = sub(end, start);
        let squared = dot(axis, axis);
        let inverse = if squared > 0.0 { 1.0 / squared } else { 0.0 };
        Self { start, axis, inverse, radius }
    }

    fn outwards(&self, point: [f64; 3]) -> f64 {
        let offset = sub(point, self.start);
        let t = (dot(offset, self.axis) * self.inverse).clamp(0.0, 1.0);
        let away: [f64; 3] = std::array::from_fn(|k| offset[k] - t * self.axis[k]);
        dot(away, away).sqrt() - self.radius
    }
}

/// A box around axes, the thickest of them, and where they are.
#[derive(Debug, Clone, Copy)]
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    radius: f64,
    /// Sections of a leaf; of others the places of the two nodes below.
    begin: u32,
    end: u32,
    leaf: bool,
}

impl Node {
    /// No section within is nearer.
    fn bound(&self, point: [f64; 3]) -> f64 {
        let away: [f64; 3] =
            std::array::from_fn(|k| (self.low[k] - point[k]).max(point[k] - self.high[k]).max(0.0));
        dot(away, away).sqrt() - self.radius
    }
}

/// A tree of boxes over sections.
pub(crate) struct Index {
    cores: Vec<Core>,
    /// Sections in the order of the leaves.
    order: Vec<u32>,
    nodes: Vec<Node>,
}

impl Index {
    fn new(sections: &[Section]) -> Self {
        Self::over(sections.iter().map(Core::of).collect())
    }

    /// An index of cylinders, with rounded ends.
    pub(crate) fn of_solids(solids: &[Cylinder]) -> Self {
        Self::over(solids.iter().map(|s| Core::new(s.start_m, s.end_m, s.radius_m)).collect())
    }

    /// Distance from a position to the surface of all, m, negative inside any; `guess` is one of them.
    pub(crate) fn outwards_m(&self, point: [f64; 3], guess: u32) -> f64 {
        self.cores[self.nearest(point, guess) as usize].outwards(point)
    }

    fn over(cores: Vec<Core>) -> Self {
        let mut order: Vec<u32> = (0..cores.len() as u32).collect();
        let mut nodes = Vec::new();
        if !order.is_empty() {
            build(&cores, &mut order, 0, &mut nodes);
        }
        Self { cores, order, nodes }
    }

    /// The section nearest to a point, starting from a guess. There must be sections.
    fn nearest(&self, point: [f64; 3], guess: u32) -> u32 {
        let mut best = (self.cores[guess as usize].outwards(point), guess);
        let mut stack = [0u32; 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let node = self.nodes[stack[depth] as usize];
            if node.bound(point) > best.0 {
                continue;
            }
            if node.leaf {
                for &section in &self.order[node.begin as usize..node.end as usize] {
                    let found = (self.cores[section as usize].outwards(point), section);
                    if found.0 < best.0 || (found.0 == best.0 && found.1 < best.1) {
                        best = found;
                    }
                }
                continue;
            }
            let (left, right) = (node.begin, node.end);
            let nearer = |k: u32| self.nodes[k as usize].bound(point);
            let (first, second) =
                if nearer(left) <= nearer(right) { (left, right) } else { (right, left) };
            stack[depth] = second;
            stack[depth + 1] = first;
            depth += 2;
        }
        best.1
    }
}

/// Builds the node over a run of the order and all below it; its place. Halves by the median of the
/// longest side, so that the depth stays below 32.
fn build(cores: &[Core], order: &mut [u32], begin: usize, nodes: &mut Vec<Node>) -> u32 {
    let mut node = bounds(cores, order);
    let place = nodes.len();
    node.begin = begin as u32;
    node.end = (begin + order.len()) as u32;
    nodes.push(node);
    if order.len() > LEAF {
        let side = (0..3).fold(0, |longest, k| {
            let wider = node.high[k] - node.low[k] > node.high[longest] - node.low[longest];
            if wider { k } else { longest }
        });
        let key = |section: &u32| {
            let core = &cores[*section as usize];
            core.start[side] + 0.5 * core.axis[side]
        };
        let half = order.len() / 2;
        order.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        let (left, right) = order.split_at_mut(half);
        nodes[place].leaf = false;
        nodes[place].begin = build(cores, left, begin, nodes);
        nodes[place].end = build(cores, right, begin + half, nodes);
    }
    place as u32
}

fn bounds(cores: &[Core], order: &[u32]) -> Node {
    let mut node = Node {
        low: [f64::INFINITY; 3],
        high: [f64::NEG_INFINITY; 3],
        radius: 0.0,
        begin: 0,
        end: 0,
        leaf: true,
    };
    for core in order.iter().map(|section| &cores[*section as usize]) {
        for k in 0..3 {
            let ends = [core.start[k], core.start[k] + core.axis[k]];
            node.low[k] = node.low[k].min(ends[0]).min(ends[1]);
            node.high[k] = node.high[k].max(ends[0]).max(ends[1]);
        }
        node.radius = node.radius.max(core.radius);
    }
    node
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn section(start_m: [f64; 3], end_m: [f64; 3], radius_m: f64) -> Section {
        Section { branch: 0, start_m, end_m, from_m: 0.0, to_m: 0.0, radius_m, reach_m: 0.0 }
    }

    #[test]
    fn a_twig_that_touches_the_stem_takes_none_of_its_points() {
        let stem = section([0.0; 3], [0.0, 0.0, 4.0], 0.2);
        let twig = section([0.0, 0.0, 2.0], [0.5, 0.0, 2.0], 0.01);
        let on_stem = (0..36).map(|i| {
            let (sin, cos) = libm::sincos(f64::from(i) * 0.17);
            [0.2 * cos, 0.2 * sin, 2.02]
        });
        let points: Vec<_> = on_stem.chain([[0.3, 0.01, 2.0]]).collect();
        let owner = assign(&points, &[twig, stem]);
        assert!(owner[..36].iter().all(|owner| *owner == 1), "{owner:?}");
        assert_eq!(owner[36], 0);
    }

    proptest! {
        #[test]
        fn as_brute_force(
            ends in prop::collection::vec((prop::array::uniform6(-20i32..20), 0i32..9), 1..90),
            points in prop::collection::vec(prop::array::uniform3(-25i32..25), 1..30),
        ) {
            // Whole decimetres make ties, coincident and empty sections.
            let deci = |v: i32| f64::from(v) * 0.1;
            let sections: Vec<Section> = ends
                .iter()
                .map(|([a, b, c, d, e, f], r)| section([a, b, c].map(|v| deci(*v)), [d, e, f].map(|v| deci(*v)), deci(*r)))
                .collect();
            let points: Vec<[f64; 3]> = points.iter().map(|p| p.map(deci)).collect();
            for (point, owner) in points.iter().zip(assign(&points, &sections)) {
                let all = sections.iter().map(|section| outwards_m(section, *point));
                let best = all.enumerate().min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
                prop_assert_eq!(owner as usize, best.unwrap().0);
            }
        }
    }
}

//! A kd-tree whose answers are exact in their ties: neighbours of all points at once, and the
//! nearest points of other sets (for spanning trees).

use crate::vector::{Vector, squared};

/// Most points of a leaf: measured, k-NN of 100k points is fastest between 12 and 24.
const LEAF: usize = 16;

/// A node: a range of points and what holds them. The children of node `i` are `left` and `left + 1`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Node {
    min: Vector,
    max: Vector,
    pub(crate) start: u32,
    pub(crate) end: u32,
    /// First of the two children; 0 for a leaf.
    pub(crate) left: u32,
}

impl Node {
    fn squared_to(&self, p: &Vector) -> f64 {
        let mut sum = 0.0;
        for axis in 0..3 {
            let out = (self.min[axis] - p[axis]).max(p[axis] - self.max[axis]).max(0.0);
            sum += out * out;
        }
        sum
    }
}

/// A neighbour: squared distance, m², and index of the point. Ordered by both.
pub(crate) type Near = (f64, u32);

pub(crate) fn nearer(a: &Near, b: &Near) -> bool {
    a.0 < b.0 || (a.0 == b.0 && a.1 < b.1)
}

/// Points in leaves.
#[derive(Debug)]
pub(crate) struct KdTree {
    /// Children come after their parents.
    pub(crate) nodes: Vec<Node>,
    /// Positions in the order of the leaves.
    pub(crate) points: Vec<Vector>,
    /// Their indices in the slice given.
    pub(crate) index: Vec<u32>,
}

impl KdTree {
    /// Builds the tree over at least one point.
    pub(crate) fn new(given: &[Vector]) -> Self {
        let mut order: Vec<(Vector, u32)> =
            given.iter().enumerate().map(|(i, p)| (*p, i as u32)).collect();
        let len = order.len();
        let mut nodes = vec![node_over(&order, 0, len)];
        let mut next = 0;
        while next < nodes.len() {
            let (start, end) = (nodes[next].start as usize, nodes[next].end as usize);
            if end - start > LEAF {
                let middle = usize::midpoint(start, end);
                split(&mut order[start..end], &nodes[next]);
                nodes[next].left = nodes.len() as u32;
                nodes.push(node_over(&order, start, middle));
                nodes.push(node_over(&order, middle, end));
            }
            next += 1;
        }
        let (points, index) = order.into_iter().unzip();
        Self { nodes, points, index }
    }

    /// Fills `found` with the nearest points other than `own`, nearest first, at most `count`.
    pub(crate) fn nearest(&self, at: &Vector, own: u32, count: usize, found: &mut Vec<Near>) {
        found.clear();
        let mut stack = [(0.0, 0u32); 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (away, place) = stack[depth];
            if found.len() == count && away > found[count - 1].0 {
                continue;
            }
            let node = &self.nodes[place as usize];
            if node.left == 0 {
                self.scan(node, at, own, count, found);
                continue;
            }
            let left = (self.nodes[node.left as usize].squared_to(at), node.left);
            let right = (self.nodes[node.left as usize + 1].squared_to(at), node.left + 1);
            let (near, far) = if left.0 <= right.0 { (left, right) } else { (right, left) };
            stack[depth] = far;
            stack[depth + 1] = near;
            depth += 2;
        }
    }

    /// Fills `found` with all points within a distance, in the order of the tree.
    pub(crate) fn within(&self, at: &Vector, radius: f64, found: &mut Vec<u32>) {
        found.clear();
        let most = radius * radius;
        let mut stack = vec![0u32];
        while let Some(place) = stack.pop() {
            let node = &self.nodes[place as usize];
            if node.squared_to(at) > most {
                continue;
            }
            if node.left == 0 {
                let own = node.start as usize..node.end as usize;
                found.extend(own.filter(|&i| squared(self.points[i], *at) <= most).map(|i| self.index[i]));
            } else {
                stack.extend([node.left + 1, node.left]);
            }
        }
    }

    fn scan(&self, node: &Node, at: &Vector, own: u32, count: usize, found: &mut Vec<Near>) {
        for i in node.start as usize..node.end as usize {
            let new = (squared(self.points[i], *at), self.index[i]);
            if new.1 == own || (found.len() == count && !nearer(&new, &found[count - 1])) {
                continue;
            }
            if found.len() == count {
                found.pop();
            }
            let mut place = found.len();
            while place > 0 && nearer(&new, &found[place - 1]) {
                place -= 1;
            }
            found.insert(place, new);
        }
    }

    /// The nearest point of another set than `set`, if it is nearer than `best`. `set_of` tells the
    /// set of every point, `set_of_node` the one of a node's points where they have one.
    pub(crate) fn nearest_of_others(
        &self,
        at: &Vector,
        set: u32,
        sets: &Sets<'_>,
        best: &mut Near,
    ) -> bool {
        let mut better = false;
        let mut stack = [(0.0, 0u32); 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (away, place) = stack[depth];
            if away > best.0 || sets.of_node[place as usize] == set {
                continue;
            }
            let node = &self.nodes[place as usize];
            if node.left == 0 {
                for i in node.start as usize..node.end as usize {
                    let new = (squared(self.points[i], *at), self.index[i]);
                    if nearer(&new, best) && sets.of_point[self.index[i] as usize] != set {
                        *best = new;
                        better = true;
                    }
                }
                continue;
            }
            let left = (self.nodes[node.left as usize].squared_to(at), node.left);
            let right = (self.nodes[node.left as usize + 1].squared_to(at), node.left + 1);
            let (near, far) = if left.0 <= right.0 { (left, right) } else { (right, left) };
            stack[depth] = far;
            stack[depth + 1] = near;
            depth += 2;
        }
        better
    }
}

/// The sets of points and of nodes.
#[derive(Debug)]
pub(crate) struct Sets<'a> {
    pub(crate) of_point: &'a [u32],
    /// [`Sets::MIXED`] where a node has points of several.
    pub(crate) of_node: &'a [u32],
}

impl Sets<'_> {
    pub(crate) const MIXED: u32 = u32::MAX;
}

fn node_over(order: &[(Vector, u32)], start: usize, end: usize) -> Node {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for (p, _) in &order[start..end] {
        for axis in 0..3 {
            min[axis] = min[axis].min(p[axis]);
            max[axis] = max[axis].max(p[axis]);
        }
    }
    Node { min, max, start: start as u32, end: end as u32, left: 0 }
}

/// Parts the points at the median of their widest axis.
fn split(points: &mut [(Vector, u32)], node: &Node) {
    let width = |axis: usize| node.max[axis] - node.min[axis];
    let axis = (1..3).fold(0, |best, axis| if width(axis) > width(best) { axis } else { best });
    let middle = points.len() / 2;
    points.select_nth_unstable_by(middle, |a, b| {
        a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1))
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn as_brute_force_with_many_ties(
            points in prop::collection::vec((0i32..6, 0i32..6, 0i32..4), 1..200), count in 1usize..20,
        ) {
            let points: Vec<Vector> =
                points.iter().map(|p| [f64::from(p.0), f64::from(p.1), f64::from(p.2)]).collect();
            let tree = KdTree::new(&points);
            let mut found = Vec::new();
            for (i, at) in points.iter().enumerate() {
                tree.nearest(at, i as u32, count, &mut found);
                let mut all: Vec<Near> = (0..points.len())
                    .filter(|&j| j != i)
                    .map(|j| (squared(points[j], *at), j as u32))
                    .collect();
                all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                all.truncate(count);
                prop_assert_eq!(&found, &all);
                let mut near = Vec::new();
                tree.within(at, 2.0, &mut near);
                near.sort_unstable();
                let inside = |j: &u32| squared(points[*j as usize], *at) <= 4.0;
                let all: Vec<u32> = (0..points.len() as u32).filter(inside).collect();
                prop_assert_eq!(near, all);
            }
        }
    }
}

//! Step 4: the tree without its small parts, and radii by length.

use crate::paths::NONE;
use crate::vector::{Vector, distance};

/// A subtree with less than this share of the length of its parent's is left out.
const KEEP_SHARE: f64 = 0.019;

/// Exponent of the law of radii.
const EXPONENT: f64 = 1.1;

/// A tree whose vertices may be taken out.
#[derive(Debug, Clone)]
pub(super) struct Tree {
    pub(super) position: Vec<Vector>,
    pub(super) parent: Vec<u32>,
    pub(super) children: Vec<Vec<u32>>,
    pub(super) alive: Vec<bool>,
    /// Points that each vertex stands for.
    pub(super) points: Vec<u32>,
    /// Radius of the edge to the parent, m.
    pub(super) radius_m: Vec<f64>,
    /// Mean of the longest ways to a tip from both ends of the edge to the parent, m.
    pub(super) weight_m: Vec<f64>,
    pub(super) root: u32,
}

impl Tree {
    /// A tree over positions, with `order` naming all vertices, parents first.
    pub(super) fn new(position: &[Vector], parent: &[u32], order: &[u32]) -> Self {
        let len = position.len();
        let mut children = vec![Vec::new(); len];
        for &v in order.iter().filter(|&&v| parent[v as usize] != NONE) {
            children[parent[v as usize] as usize].push(v);
        }
        Self {
            position: position.to_vec(),
            parent: parent.to_vec(),
            children,
            alive: vec![true; len],
            points: vec![1; len],
            radius_m: vec![0.0; len],
            weight_m: vec![0.0; len],
            root: order[0],
        }
    }

    /// All vertices, parents first.
    pub(super) fn order(&self) -> Vec<u32> {
        let mut order = vec![self.root];
        let mut next = 0;
        while next < order.len() {
            order.extend(&self.children[order[next] as usize]);
            next += 1;
        }
        order
    }

    /// Length of the edge to the parent, m.
    pub(super) fn edge_m(&self, v: u32) -> f64 {
        distance(self.position[v as usize], self.position[self.parent[v as usize] as usize])
    }

    /// Length of all that hangs on each vertex, or of the longest way only, m.
    fn lengths(&self, join: impl Fn(f64, f64) -> f64) -> Vec<f64> {
        let mut length = vec![0.0; self.position.len()];
        for &v in self.order().iter().skip(1).rev() {
            let parent = self.parent[v as usize] as usize;
            length[parent] = join(length[parent], length[v as usize] + self.edge_m(v));
        }
        length
    }

    /// The longest way to a tip from each vertex, m.
    pub(super) fn longest(&self) -> Vec<f64> {
        self.lengths(f64::max)
    }

    /// Leaves out subtrees with little length; their points go to where they hung.
    pub(super) fn leave_out_small(&mut self) {
        let length = self.lengths(|sum, own| sum + own);
        for v in self.order() {
            if !self.alive[v as usize] {
                continue;
            }
            let own = length[v as usize];
            let keep = |&c: &u32| (length[c as usize] + self.edge_m(c)) / own >= KEEP_SHARE;
            let (kept, out): (Vec<u32>, Vec<u32>) = self.children[v as usize].iter().partition(|c| keep(c));
            self.children[v as usize] = kept;
            for branch in out {
                self.cut(branch, v);
            }
        }
    }

    /// Takes out a subtree.
    fn cut(&mut self, branch: u32, onto: u32) {
        let mut open = vec![branch];
        while let Some(v) = open.pop() {
            self.alive[v as usize] = false;
            self.points[onto as usize] += self.points[v as usize];
            open.append(&mut self.children[v as usize]);
        }
    }

    /// Sets weights and radii so that the trunk has a radius.
    pub(super) fn set_radii(&mut self, trunk_m: f64) {
        let longest = self.longest();
        let order = self.order();
        for &v in order.iter().skip(1) {
            let parent = self.parent[v as usize] as usize;
            self.weight_m[v as usize] = 0.5 * (longest[v as usize] + longest[parent]);
        }
        let trunk = self.trunk().map_or(1.0, |v| self.weight_m[v as usize]).max(1e-12);
        for &v in order.iter().skip(1) {
            let ratio = self.weight_m[v as usize] / trunk;
            self.radius_m[v as usize] = trunk_m * libm::pow(ratio, EXPONENT);
        }
        self.radius_m[self.root as usize] = trunk_m;
    }

    /// The end of the first edge: that child of the root with the longest way to a tip.
    pub(super) fn trunk(&self) -> Option<u32> {
        let longest = self.longest();
        let ahead = |&v: &u32| longest[v as usize] + self.edge_m(v);
        let children = &self.children[self.root as usize];
        children.iter().copied().reduce(|a, b| if ahead(&b) > ahead(&a) { b } else { a })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stem of ten edges of 1 m with a twig of 0.1 m on the second vertex and one of 3 m on the third.
    pub(crate) fn tree() -> Tree {
        let mut position: Vec<Vector> = (0..11).map(|i| [0.0, 0.0, f64::from(i)]).collect();
        position.extend([[0.1, 0.0, 1.0], [3.0, 0.0, 2.0]]);
        let mut parent: Vec<u32> = (0..11).map(|i: u32| i.wrapping_sub(1)).collect();
        parent.extend([1, 2]);
        let order: Vec<u32> = (0..13).collect();
        Tree::new(&position, &parent, &order)
    }

    #[test]
    fn small_subtrees_go_and_radii_follow_the_law() {
        let mut tree = tree();
        tree.leave_out_small();
        assert_eq!(tree.alive.iter().filter(|alive| **alive).count(), 12);
        assert_eq!(tree.points[1], 2);
        tree.set_radii(0.2);
        assert_eq!(tree.radius_m[1], 0.2);
        let law = |weight: f64| 0.2 * libm::pow(weight / 9.5, 1.1);
        assert!((tree.radius_m[6] - law(4.5)).abs() < 1e-12);
        assert!((tree.radius_m[12] - law(4.0)).abs() < 1e-12);
    }
}

//! The Euclidean minimum spanning tree, exactly: Borůvka's rounds, each over a kd-tree in which
//! nodes that lie in one set are passed over.

use crate::kdtree::{KdTree, Near, Sets};
use crate::vector::Vector;

/// An edge of a spanning tree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Link {
    /// Squared length, m².
    pub squared_m2: f64,
    /// The ends, the smaller index first.
    pub ends: [u32; 2],
}

impl Link {
    fn key(&self) -> (u64, [u32; 2]) {
        // The bits of numbers of 0 and more are in their order.
        (self.squared_m2.to_bits(), self.ends)
    }
}

/// The Euclidean minimum spanning tree of different points, sorted by length, then by indices, which
/// also decide between trees of equal length.
#[must_use]
pub fn emst(points: &[[f64; 3]]) -> Vec<Link> {
    if points.len() < 2 {
        return Vec::new();
    }
    let sets: Vec<u32> = (0..points.len() as u32).collect();
    bridges(&KdTree::new(points), points, &sets)
}

/// The edges of the tree that join sets of points which are already connected within themselves.
pub(crate) fn bridges(tree: &KdTree, points: &[Vector], sets: &[u32]) -> Vec<Link> {
    let mut left = sets.iter().max().map_or(0, |&last| last as usize + 1);
    let mut joined = Joined((0..left as u32).collect());
    let mut set_of: Vec<u32> = sets.to_vec();
    let mut found = Vec::new();
    while left > 1 {
        let best = shortest_out(tree, points, &set_of, joined.0.len());
        for link in best.into_iter().flatten() {
            let [a, b] = link.ends.map(|end| joined.root(sets[end as usize]));
            if a != b {
                joined.0[a.max(b) as usize] = a.min(b);
                found.push(link);
                left -= 1;
            }
        }
        for (set, first) in set_of.iter_mut().zip(sets) {
            *set = joined.root(*first);
        }
    }
    found.sort_unstable_by_key(Link::key);
    found
}

/// The shortest edge that leaves each set.
fn shortest_out(
    tree: &KdTree,
    points: &[Vector],
    set_of: &[u32],
    sets: usize,
) -> Vec<Option<Link>> {
    let of_node = sets_of_nodes(tree, set_of);
    let all = Sets { of_point: set_of, of_node: &of_node };
    let mut best: Vec<Option<Link>> = vec![None; sets];
    for (p, &index) in tree.points.iter().zip(&tree.index) {
        let set = set_of[index as usize];
        let known = best[set as usize];
        let bound = known.map_or(f64::INFINITY, |link| link.squared_m2);
        // Ties with what is known must be seen: any index is smaller than the bound's.
        let mut near: Near = (bound, u32::MAX);
        if tree.nearest_of_others(p, set, &all, &mut near) {
            let ends = [index.min(near.1), index.max(near.1)];
            let link = Link { squared_m2: near.0, ends };
            if known.is_none_or(|known| link.key() < known.key()) {
                best[set as usize] = Some(link);
            }
        }
    }
    debug_assert_eq!(points.len(), set_of.len());
    best
}

fn sets_of_nodes(tree: &KdTree, set_of: &[u32]) -> Vec<u32> {
    let mut of_node = vec![Sets::MIXED; tree.nodes.len()];
    for (place, node) in tree.nodes.iter().enumerate().rev() {
        let one = if node.left == 0 {
            let members = &tree.index[node.start as usize..node.end as usize];
            let first = set_of[members[0] as usize];
            members.iter().all(|&i| set_of[i as usize] == first).then_some(first)
        } else {
            let [a, b] = [of_node[node.left as usize], of_node[node.left as usize + 1]];
            (a == b).then_some(a)
        };
        of_node[place] = one.unwrap_or(Sets::MIXED);
    }
    of_node
}

/// Union-find with the smallest member as root.
struct Joined(Vec<u32>);

impl Joined {
    fn root(&mut self, of: u32) -> u32 {
        let mut at = of;
        while self.0[at as usize] != at {
            self.0[at as usize] = self.0[self.0[at as usize] as usize];
            at = self.0[at as usize];
        }
        at
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::squared;
    use proptest::prelude::*;

    /// Kruskal over all pairs.
    fn brute(points: &[Vector], sets: &[u32]) -> Vec<Link> {
        let mut all = Vec::new();
        for a in 0..points.len() as u32 {
            for b in a + 1..points.len() as u32 {
                let squared_m2 = squared(points[a as usize], points[b as usize]);
                all.push(Link { squared_m2, ends: [a, b] });
            }
        }
        all.sort_by_key(Link::key);
        let mut joined = Joined((0..=*sets.iter().max().unwrap()).collect());
        all.retain(|link| {
            let [a, b] = link.ends.map(|end| joined.root(sets[end as usize]));
            joined.0[a.max(b) as usize] = a.min(b);
            a != b
        });
        all
    }

    proptest! {
        #[test]
        fn as_kruskal_over_all_pairs_with_many_ties(
            points in prop::collection::btree_set((0i32..7, 0i32..7, 0i32..5), 2..120),
            groups in 1u32..40,
        ) {
            let points: Vec<Vector> =
                points.iter().map(|p| [f64::from(p.0), f64::from(p.1), f64::from(p.2)]).collect();
            let alone: Vec<u32> = (0..points.len() as u32).collect();
            prop_assert_eq!(emst(&points), brute(&points, &alone));
            let groups = groups.min(points.len() as u32);
            let sets: Vec<u32> = alone.iter().map(|i| i % groups).collect();
            prop_assert_eq!(bridges(&KdTree::new(&points), &points, &sets), brute(&points, &sets));
        }
    }
}

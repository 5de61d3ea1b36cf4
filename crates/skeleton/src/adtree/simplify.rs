//! Step 5: parallel siblings merged, vertices on straight lines removed, until nothing changes.

use super::tree::Tree;
use crate::paths::NONE;
use crate::vector::{add, cross, distance, dot, norm, scale, sub, to_segment};

/// Siblings are parallel above this cosine, and alike when their lengths differ by at most a factor.
const PARALLEL: f64 = 0.9;
const ALIKE: f64 = 2.0;

/// Largest offset of what is merged or removed, in radii.
const OFFSET: f64 = 1.0;

/// Most rounds; clouds of single trees need about ten.
const ROUNDS: usize = 100;

/// Simplifies a tree with radii in place.
pub(super) fn simplify(tree: &mut Tree) {
    for _ in 0..ROUNDS {
        let trunk_m = tree.radius_m[tree.root as usize];
        let changed = merge_siblings(tree) | remove_straight(tree);
        tree.set_radii(trunk_m);
        if !changed {
            return;
        }
    }
}

fn merge_siblings(tree: &mut Tree) -> bool {
    let mut changed = false;
    for v in tree.order() {
        if !tree.alive[v as usize] {
            continue;
        }
        while let Some((a, b)) = mergeable(tree, v) {
            merge(tree, v, a, b);
            changed = true;
        }
    }
    changed
}

/// The first two children of a vertex that are one branch.
fn mergeable(tree: &Tree, v: u32) -> Option<(u32, u32)> {
    let children = &tree.children[v as usize];
    let pairs = (0..children.len()).flat_map(|i| (0..i).map(move |j| (j, i)));
    let mut pairs = pairs.map(|(i, j)| (children[i], children[j]));
    pairs.find(|&(a, b)| are_one(tree, a, b))
}

fn are_one(tree: &Tree, a: u32, b: u32) -> bool {
    let from = tree.position[tree.parent[a as usize] as usize];
    let [p, q] = [a, b].map(|c| sub(tree.position[c as usize], from));
    let (m, n) = (norm(p), norm(q));
    if m == 0.0 || n == 0.0 {
        return m == n;
    }
    let lateral = if m <= n { norm(cross(p, q)) / n } else { norm(cross(p, q)) / m };
    let radius = tree.radius_m[a as usize].max(tree.radius_m[b as usize]);
    dot(p, q) / (m * n) > PARALLEL && m <= ALIKE * n && n <= ALIKE * m && lateral <= OFFSET * radius
}

/// Merges the second child into the first, at the mean of both by their weights.
fn merge(tree: &mut Tree, v: u32, a: u32, b: u32) {
    let (i, j) = (a as usize, b as usize);
    let total = tree.weight_m[i] + tree.weight_m[j];
    let share = if total > 0.0 { tree.weight_m[j] / total } else { 0.5 };
    let step = sub(tree.position[j], tree.position[i]);
    tree.position[i] = add(tree.position[i], scale(step, share));
    tree.points[i] += tree.points[j];
    tree.weight_m[i] = tree.weight_m[i].max(tree.weight_m[j]);
    tree.radius_m[i] = tree.radius_m[i].max(tree.radius_m[j]);
    let moved = std::mem::take(&mut tree.children[j]);
    moved.iter().for_each(|&child| tree.parent[child as usize] = a);
    tree.children[i].extend(moved);
    tree.children[v as usize].retain(|&child| child != b);
    tree.alive[j] = false;
    tree.parent[j] = NONE;
}

fn remove_straight(tree: &mut Tree) -> bool {
    let mut changed = false;
    for v in tree.order().into_iter().skip(1) {
        let &[child] = &tree.children[v as usize][..] else {
            continue;
        };
        let parent = tree.parent[v as usize];
        let [at, from, to] = [v, parent, child].map(|place| tree.position[place as usize]);
        let off = if distance(from, to) > 0.0 { to_segment(at, from, to).0 } else { 0.0 };
        if off < OFFSET * tree.radius_m[v as usize] {
            for slot in tree.children[parent as usize].iter_mut().filter(|slot| **slot == v) {
                *slot = child;
            }
            tree.parent[child as usize] = parent;
            tree.points[child as usize] += tree.points[v as usize];
            tree.children[v as usize].clear();
            tree.alive[v as usize] = false;
            changed = true;
        }
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::Vector;

    #[test]
    fn a_straight_stem_becomes_one_edge_and_twins_become_one() {
        let mut position: Vec<Vector> = (0..6).map(|i| [0.0, 0.0, f64::from(i)]).collect();
        position.extend([[0.01, 0.0, 4.9], [2.0, 0.0, 3.0]]);
        let parent = [NONE, 0, 1, 2, 3, 4, 4, 2];
        let order: Vec<u32> = (0..8).collect();
        let mut tree = Tree::new(&position, &parent, &order);
        tree.set_radii(0.2);
        simplify(&mut tree);
        let left: Vec<u32> = tree.order();
        assert_eq!(left.len(), 4, "foot, fork, top, twig: {left:?}");
        assert_eq!(left.iter().map(|&v| tree.points[v as usize]).sum::<u32>(), 8);
    }
}

//! Step 7: branches as Hermite curves, cut into pieces of 5 cm.

use super::tree::Tree;
use crate::model::{Node, Skeleton};
use crate::vector::{Vector, add, distance, scale, sub};

/// Length of the pieces, m.
const PIECE_M: f64 = 0.05;

/// The tree as nodes along smooth curves. Tangents at inner vertices are those from the vertex before
/// to the one after (Catmull and Rom 1974); radii go evenly from vertex to vertex.
pub(super) fn skeleton(tree: &Tree) -> Skeleton {
    let longest = tree.longest();
    let radius_m = tree.radius_m[tree.root as usize];
    let root = Node { position_m: tree.position[tree.root as usize], parent: None, radius_m, points: 0 };
    let mut nodes = vec![root];
    let mut open = vec![(tree.root, 0u32, sorted(tree, tree.root, &longest))];
    // Branch by branch: the first child goes on at once, the others wait.
    while let Some((mut at, mut node, children)) = open.pop() {
        let mut next = children;
        while let Some((&first, others)) = next.split_first() {
            if !others.is_empty() {
                open.push((at, node, others.to_vec()));
            }
            node = edge(tree, &mut nodes, first, node, &longest);
            at = first;
            next = sorted(tree, at, &longest);
        }
    }
    Skeleton { nodes }
}

/// Children, the longest way to a tip first.
fn sorted(tree: &Tree, v: u32, longest: &[f64]) -> Vec<u32> {
    let mut children = tree.children[v as usize].clone();
    let ahead = |c: u32| longest[c as usize] + tree.edge_m(c);
    children.sort_by(|&a, &b| {
        ahead(b).total_cmp(&ahead(a)).then(tree.points[b as usize].cmp(&tree.points[a as usize]))
    });
    children
}

/// Adds the nodes of the edge to a vertex and returns the last.
fn edge(tree: &Tree, nodes: &mut Vec<Node>, v: u32, from: u32, longest: &[f64]) -> u32 {
    let parent = tree.parent[v as usize];
    let [a, b] = [parent, v].map(|place| tree.position[place as usize]);
    let before = if parent == tree.root { None } else { Some(tree.parent[parent as usize]) };
    let after = sorted(tree, v, longest).first().copied();
    let position = |place: u32| tree.position[place as usize];
    let length = distance(a, b);
    let tangent = |p: Vector, q: Vector| {
        let span = distance(p, q);
        if span > 0.0 { scale(sub(q, p), length / span) } else { [0.0; 3] }
    };
    let start = tangent(before.map_or(a, position), b);
    let end = tangent(a, after.map_or(b, position));
    let radii = [if parent == tree.root { v } else { parent }, v].map(|p| tree.radius_m[p as usize]);
    let pieces = ((length / PIECE_M).ceil() as u32).max(1);
    let (mut last, points) = (from, tree.points[v as usize]);
    for piece in 1..=pieces {
        let t = f64::from(piece) / f64::from(pieces);
        let position_m = hermite(a, b, start, end, t);
        let radius_m = radii[0] + t * (radii[1] - radii[0]);
        let share = |k: u32| (u64::from(points) * u64::from(k) / u64::from(pieces)) as u32;
        let points = share(piece) - share(piece - 1);
        nodes.push(Node { position_m, parent: Some(last), radius_m, points });
        last = nodes.len() as u32 - 1;
    }
    last
}

fn hermite(a: Vector, b: Vector, start: Vector, end: Vector, t: f64) -> Vector {
    let (t2, t3) = (t * t, t * t * t);
    let ends = add(scale(a, 2.0 * t3 - 3.0 * t2 + 1.0), scale(b, 3.0 * t2 - 2.0 * t3));
    add(ends, add(scale(start, t3 - 2.0 * t2 + t), scale(end, t3 - t2)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paths::NONE;

    #[test]
    fn pieces_lie_on_a_curve_through_the_vertices() {
        let position = [[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0]];
        let mut tree = Tree::new(&position, &[NONE, 0, 1], &[0, 1, 2]);
        tree.set_radii(0.1);
        let skeleton = skeleton(&tree);
        assert_eq!(skeleton.nodes.len(), 41);
        assert_eq!(skeleton.nodes[20].position_m, position[1]);
        assert_eq!(skeleton.branches(), 1);
        let before = skeleton.nodes[19].position_m;
        assert!(before[0].abs() > 1e-4, "the corner is rounded: {before:?}");
        assert_eq!(skeleton.nodes.iter().map(|node| node.points).sum::<u32>(), 2);
    }
}

//! The Delaunay triangulation in space, whose edges hold every shortest path over squared lengths.

use super::Graph;
use simple_delaunay_lib::delaunay_3d::delaunay_struct_3d::DelaunayStructure3D;
use simple_delaunay_lib::delaunay_3d::simplicial_struct_3d::Node;

/// The Delaunay triangulation of different points as a graph. `None` where the points do not span a
/// volume, or the triangulation fails.
///
/// A shortest path over squared lengths runs within the Gabriel graph: where another point lies in the
/// ball over an edge, the way over it is shorter by Pythagoras. The triangulation holds that graph.
#[must_use]
pub fn delaunay(points: &[[f64; 3]]) -> Option<Graph> {
    if points.len() < 5 {
        return None;
    }
    let mut structure = DelaunayStructure3D::new();
    structure.insert_vertices(&points.to_vec(), true).ok()?;
    let simplices = structure.get_simplicial();
    let mut edges = Vec::with_capacity(points.len() * 16);
    for tetrahedron in 0..simplices.get_nb_tetrahedra() {
        let nodes = simplices.get_tetrahedron(tetrahedron).ok()?.nodes();
        for (place, a) in nodes.iter().enumerate() {
            for b in &nodes[place + 1..] {
                if let (Node::Value(a), Node::Value(b)) = (a, b) {
                    edges.push([(*a).min(*b) as u32, (*a).max(*b) as u32]);
                }
            }
        }
    }
    edges.sort_unstable();
    edges.dedup();
    Some(Graph::new(points.len(), &edges))
}

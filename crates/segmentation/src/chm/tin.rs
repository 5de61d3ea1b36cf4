//! Triangles of a Delaunay triangulation: the one place here that knows spade.

use crate::Error;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A vertex with its height.
struct Vertex([f64; 3]);

impl HasPosition for Vertex {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        Point2::new(self.0[0], self.0[1])
    }
}

/// Calls `visit` with the corners of every triangle between vertices with distinct (x, y).
///
/// # Errors
/// [`Error::Triangulation`] for coordinates that are not finite.
pub(super) fn each_triangle(
    vertices: &[[f64; 3]],
    mut visit: impl FnMut([[f64; 3]; 3]),
) -> Result<(), Error> {
    let elements = vertices.iter().map(|vertex| Vertex(*vertex)).collect();
    let triangulation: DelaunayTriangulation<Vertex> =
        DelaunayTriangulation::bulk_load_stable(elements)
            .map_err(|error| Error::Triangulation { reason: error.to_string() })?;
    for face in triangulation.inner_faces() {
        visit(face.vertices().map(|vertex| vertex.data().0));
    }
    Ok(())
}

/// Square of the longest edge of a triangle in the plane, m².
pub(super) fn longest_squared([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    let squared = |p: &[f64; 3], q: &[f64; 3]| {
        let (dx, dy) = (p[0] - q[0], p[1] - q[1]);
        dx * dx + dy * dy
    };
    squared(a, b).max(squared(b, c)).max(squared(c, a))
}

//! Triangles of a Delaunay triangulation: the one place here that knows spade.

use crate::Error;
use spade::handles::FixedVertexHandle;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};

/// A vertex with its height.
struct Vertex([f64; 3]);

impl HasPosition for Vertex {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        Point2::new(self.0[0], self.0[1])
    }
}

/// A Delaunay triangulation to which vertices are added.
pub(super) struct Tin {
    triangulation: DelaunayTriangulation<Vertex>,
}

impl Tin {
    /// Nothing yet.
    pub(super) fn new() -> Self {
        Self { triangulation: DelaunayTriangulation::new() }
    }

    /// Adds vertices with (x, y) that no other has; quickest when near ones follow each other.
    ///
    /// # Errors
    /// [`Error::Triangulation`] for coordinates that are not finite.
    pub(super) fn add(&mut self, vertices: &[[f64; 3]]) -> Result<(), Error> {
        let refused =
            |error: spade::InsertionError| Error::Triangulation { reason: error.to_string() };
        if self.triangulation.num_vertices() == 0 {
            let first = vertices.iter().map(|vertex| Vertex(*vertex)).collect();
            self.triangulation = DelaunayTriangulation::bulk_load_stable(first).map_err(refused)?;
            return Ok(());
        }
        let mut last = FixedVertexHandle::from_index(0);
        for vertex in vertices {
            let inserted = self.triangulation.insert_with_hint(Vertex(*vertex), last);
            last = inserted.map_err(refused)?;
        }
        Ok(())
    }

    /// Calls `visit` with the corners of every triangle.
    pub(super) fn each_triangle(&self, mut visit: impl FnMut([[f64; 3]; 3])) {
        for face in self.triangulation.inner_faces() {
            visit(face.vertices().map(|vertex| vertex.data().0));
        }
    }
}

/// Square of the longest edge of a triangle in the plane, m².
pub(super) fn longest_squared([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    let squared = |p: &[f64; 3], q: &[f64; 3]| {
        let (dx, dy) = (p[0] - q[0], p[1] - q[1]);
        dx * dx + dy * dy
    };
    squared(a, b).max(squared(b, c)).max(squared(c, a))
}

//! A triangulated surface: the one place that knows spade.

use crate::Error;
use spade::handles::{FixedVertexHandle, VertexHandle};
use spade::{DelaunayTriangulation, HasPosition, Point2, PositionInTriangulation, Triangulation};

/// A vertex with its elevation.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Vertex {
    position: [f64; 3],
}

impl HasPosition for Vertex {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        Point2::new(self.position[0], self.position[1])
    }
}

/// The triangle above or below a position, as the densification sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Offset {
    /// Vertical distance to the triangle's plane, positive above it, metres.
    pub vertical_m: f64,
    /// Distance along the plane's normal, positive above it, metres.
    pub normal_m: f64,
    /// Sine of the largest angle between the plane and the lines to the triangle's corners, which is
    /// that to the nearest corner (Axelsson 2000, figure 3); 0 to 1.
    pub sine: f64,
}

/// A Delaunay triangulation with elevations.
#[derive(Debug)]
pub struct Tin {
    triangulation: DelaunayTriangulation<Vertex>,
}

impl Tin {
    /// Triangulates vertices with distinct (x, y).
    ///
    /// # Errors
    /// [`Error::Triangulation`] for coordinates that are not finite or coincide.
    pub fn new(vertices: &[[f64; 3]]) -> Result<Self, Error> {
        let elements = vertices.iter().map(|position| Vertex { position: *position }).collect();
        let triangulation: DelaunayTriangulation<Vertex> =
            DelaunayTriangulation::bulk_load_stable(elements)
                .map_err(|error| Error::Triangulation { reason: error.to_string() })?;
        if triangulation.num_vertices() == vertices.len() {
            return Ok(Self { triangulation });
        }
        let reason =
            format!("{} of {} vertices are distinct", triangulation.num_vertices(), vertices.len());
        Err(Error::Triangulation { reason })
    }

    /// A cursor for queries; neighbouring positions one after the other are fast.
    #[must_use]
    pub fn cursor(&self) -> Cursor<'_> {
        Cursor { tin: self, hint: FixedVertexHandle::from_index(0) }
    }

    /// How far a vertex lies above the surface of its neighbours, and their median distance in the
    /// plane (both metres). The surface is the plane fitted to the neighbours with weights falling
    /// with distance, slightly pulled towards the horizontal.
    #[must_use]
    pub fn deviation(&self, vertex: usize) -> (f64, f64) {
        let centre = self.triangulation.vertex(FixedVertexHandle::from_index(vertex));
        let origin = centre.data().position;
        let relative = |v: VertexHandle<'_, Vertex>| {
            let p = v.data().position;
            [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]
        };
        let mut around: Vec<[f64; 3]> = centre.out_edges().map(|e| relative(e.to())).collect();
        if around.is_empty() {
            return (0.0, 0.0);
        }
        let fitted = plane_at_origin(&around);
        let distance = |p: &[f64; 3]| (p[0] * p[0] + p[1] * p[1]).sqrt();
        let middle = around.len() / 2;
        around.select_nth_unstable_by(middle, |a, b| distance(a).total_cmp(&distance(b)));
        (-fitted, distance(&around[middle]))
    }

    /// Calls `visit` with the index of every neighbour of a vertex.
    pub fn neighbours(&self, vertex: usize, mut visit: impl FnMut(usize)) {
        let centre = self.triangulation.vertex(FixedVertexHandle::from_index(vertex));
        centre.out_edges().for_each(|edge| visit(edge.to().fix().index()));
    }
}

/// Position-by-position queries of a [`Tin`].
#[derive(Debug)]
pub struct Cursor<'a> {
    tin: &'a Tin,
    hint: FixedVertexHandle,
}

impl Cursor<'_> {
    /// How a point lies to its triangle; `None` outside the triangulation.
    #[must_use]
    pub fn offset(&mut self, p: [f64; 3]) -> Option<Offset> {
        let triangulation = &self.tin.triangulation;
        let corners = match triangulation.locate_with_hint(Point2::new(p[0], p[1]), self.hint) {
            PositionInTriangulation::OnFace(face) => {
                triangulation.face(face).vertices().map(|v| (v.fix(), v.data().position))
            }
            PositionInTriangulation::OnEdge(edge) => {
                let edge = triangulation.directed_edge(edge);
                let face = edge.face().as_inner().or_else(|| edge.rev().face().as_inner())?;
                face.vertices().map(|v| (v.fix(), v.data().position))
            }
            PositionInTriangulation::OnVertex(vertex) => {
                self.hint = vertex;
                let vertical_m = p[2] - triangulation.vertex(vertex).data().position[2];
                let sine = if vertical_m == 0.0 { 0.0 } else { 1.0 };
                return Some(Offset { vertical_m, normal_m: vertical_m, sine });
            }
            _ => return None,
        };
        self.hint = corners[0].0;
        Some(offset_to(corners.map(|(_, position)| position), p))
    }
}

fn offset_to(corners: [[f64; 3]; 3], p: [f64; 3]) -> Offset {
    let minus = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let (u, v) = (minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let w = minus(p, corners[0]);
    let along = w[0] * normal[0] + w[1] * normal[1] + w[2] * normal[2];
    let length = (normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]).sqrt();
    let sign = if normal[2] < 0.0 { -1.0 } else { 1.0 };
    let normal_m = sign * along / length;
    let vertical_m = along / normal[2];
    let squared = corners.map(|corner| {
        let d = minus(p, corner);
        d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    });
    let nearest = squared[0].min(squared[1]).min(squared[2]).sqrt();
    let sine = if nearest > 0.0 { (normal_m.abs() / nearest).min(1.0) } else { 0.0 };
    Offset { vertical_m, normal_m, sine }
}

/// Weighted least-squares plane through points, evaluated at the origin. Weights 1/distance; a small
/// diagonal term on the slopes decides where the points do not.
fn plane_at_origin(points: &[[f64; 3]]) -> f64 {
    const RIDGE: f64 = 1e-3;
    const NEAREST_M: f64 = 0.05;
    let mut m = [[0.0, 0.0, 0.0], [0.0, RIDGE, 0.0], [0.0, 0.0, RIDGE]];
    let mut b = [0.0; 3];
    for [x, y, z] in points {
        let weight = 1.0 / (x * x + y * y).sqrt().max(NEAREST_M);
        let row = [1.0, *x, *y];
        for i in 0..3 {
            (0..3).for_each(|j| m[i][j] += weight * row[i] * row[j]);
            b[i] += weight * row[i] * z;
        }
    }
    solve3(m, b)[0]
}

/// Solves a symmetric positive definite system of three equations by elimination.
pub(crate) fn solve3(mut m: [[f64; 3]; 3], mut b: [f64; 3]) -> [f64; 3] {
    for k in 0..3 {
        for i in k + 1..3 {
            let factor = m[i][k] / m[k][k];
            for j in k..3 {
                m[i][j] -= factor * m[k][j];
            }
            b[i] -= factor * b[k];
        }
    }
    let mut x = [0.0; 3];
    for i in (0..3).rev() {
        let known: f64 = (i + 1..3).map(|j| m[i][j] * x[j]).sum();
        x[i] = (b[i] - known) / m[i][i];
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slope() -> Vec<[f64; 3]> {
        [[0., 0.], [10., 0.], [0., 10.], [10., 10.], [5., 5.]].map(|[x, y]| [x, y, x]).to_vec()
    }

    #[test]
    fn distances_to_a_slope_of_45_degrees() {
        let tin = Tin::new(&slope()).unwrap();
        let offset = tin.cursor().offset([5.0, 2.0, 6.0]).unwrap();
        assert!((offset.vertical_m - 1.0).abs() < 1e-12);
        assert!((offset.normal_m - 0.5f64.sqrt()).abs() < 1e-12);
        assert!(offset.sine > 0.0 && offset.sine < 0.3);
        assert!(tin.cursor().offset([-5.0, 2.0, 0.0]).is_none());
    }

    #[test]
    fn a_raised_vertex_deviates_by_its_height() {
        let mut vertices = slope();
        vertices[4][2] += 3.0;
        let (deviation, distance) = Tin::new(&vertices).unwrap().deviation(4);
        assert!((deviation - 3.0).abs() < 0.01, "{deviation}");
        assert!((distance - 50f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn coincident_vertices_are_refused() {
        assert!(Tin::new(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0; 3]]).is_err());
    }
}

//! Triangle meshes.

use crate::vector::{cross, dot, norm, sub};
use serde::{Deserialize, Serialize};

/// Triangles over shared vertices. Seen from outside, the corners of a triangle go round to the left.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Mesh {
    /// Positions, m.
    pub vertices_m: Vec<[f64; 3]>,
    /// Places of the corners in [`Mesh::vertices_m`].
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Whether every triangle names vertices that are there and finite.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let count = self.vertices_m.len();
        self.vertices_m.iter().flatten().all(|value| value.is_finite())
            && self.triangles.iter().flatten().all(|corner| (*corner as usize) < count)
    }

    /// The corners of a triangle, m.
    ///
    /// # Panics
    /// Where there is no such triangle or vertex, see [`Mesh::is_valid`].
    #[must_use]
    pub fn corners_m(&self, triangle: usize) -> [[f64; 3]; 3] {
        self.triangles[triangle].map(|corner| self.vertices_m[corner as usize])
    }

    /// Whether the surface has neither border nor fork and one outside: every edge belongs to two
    /// triangles, which pass it in opposite directions. Several closed bodies are watertight, too.
    #[must_use]
    pub fn is_watertight(&self) -> bool {
        let mut edges = Vec::with_capacity(self.triangles.len() * 3);
        for [a, b, c] in &self.triangles {
            edges.extend([(*a, *b), (*b, *c), (*c, *a)]);
        }
        edges.sort_unstable();
        let once = edges.windows(2).all(|pair| pair[0] != pair[1]);
        let returned = |(a, b): &(u32, u32)| a != b && edges.binary_search(&(*b, *a)).is_ok();
        !edges.is_empty() && once && edges.iter().all(returned)
    }

    /// Area of the surface, m2.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        (0..self.triangles.len()).map(|triangle| self.triangle_area_m2(triangle)).sum()
    }

    pub(crate) fn triangle_area_m2(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners_m(triangle);
        norm(cross(sub(b, a), sub(c, a))) / 2.0
    }

    /// Volume inside, m3: by the divergence theorem, and so of use for watertight meshes only. Where
    /// bodies overlap, the part in common counts for each.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        let Some(origin) = self.vertices_m.first().copied() else { return 0.0 };
        let six_fold = (0..self.triangles.len()).map(|triangle| {
            let [a, b, c] = self.corners_m(triangle).map(|corner| sub(corner, origin));
            dot(a, cross(b, c))
        });
        six_fold.sum::<f64>() / 6.0
    }

    /// Adds another mesh beside what is there.
    pub fn append(&mut self, other: &Self) {
        let shift = self.vertices_m.len() as u32;
        self.vertices_m.extend(&other.vertices_m);
        self.triangles.extend(other.triangles.iter().map(|corners| corners.map(|c| c + shift)));
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A box from the origin to `size`.
    pub(crate) fn block(size: [f64; 3]) -> Mesh {
        let corner = |i: usize| std::array::from_fn(|axis| size[axis] * ((i >> axis) & 1) as f64);
        let faces =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        Mesh {
            vertices_m: (0..8).map(corner).collect(),
            triangles: faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect(),
        }
    }

    #[test]
    fn a_block_is_closed_and_has_its_volume() {
        let mut mesh = block([2.0, 3.0, 4.0]);
        assert!(mesh.is_valid() && mesh.is_watertight());
        assert_eq!((mesh.volume_m3(), mesh.area_m2()), (24.0, 52.0));
        let far = Mesh {
            vertices_m: mesh.vertices_m.iter().map(|v| v.map(|x| x + 5e5)).collect(),
            ..mesh.clone()
        };
        assert_eq!(far.volume_m3(), 24.0);
        mesh.append(&block([1.0; 3]));
        assert!(mesh.is_watertight());
        assert_eq!(mesh.volume_m3(), 25.0);
    }

    #[test]
    fn holes_forks_and_flipped_triangles_are_noticed() {
        let whole = block([1.0; 3]);
        let mut holed = whole.clone();
        holed.triangles.pop();
        assert!(!holed.is_watertight());
        let mut flipped = whole.clone();
        flipped.triangles[0].swap(0, 1);
        assert!(!flipped.is_watertight());
        let mut doubled = whole.clone();
        doubled.triangles.push(doubled.triangles[0]);
        assert!(!doubled.is_watertight());
        let mut flat = whole.clone();
        flat.triangles.push([3, 3, 3]);
        assert!(!flat.is_watertight());
        assert!(!Mesh::default().is_watertight());
        let lost = Mesh { triangles: vec![[0, 1, 8]], ..whole };
        assert!(!lost.is_valid());
    }
}

//! The nearest of many triangles.

use crate::Mesh;
use crate::bvh::{Best, Box3, Bvh};
use crate::vector::{along, dot, sub};
use rayon::prelude::*;

/// Positions asked one after the other, each beginning with the answer before it.
const CHUNK: usize = 1024;

/// Finds the triangle of a mesh nearest to a position. Exact.
#[derive(Debug)]
pub struct MeshIndex {
    triangles: Vec<[[f64; 3]; 3]>,
    bvh: Bvh,
}

impl MeshIndex {
    /// An index of a mesh. Triangles with a corner that is missing or not finite are never found.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let corner = |place: u32| mesh.vertices_m.get(place as usize).copied();
        let triangles: Vec<[[f64; 3]; 3]> = mesh
            .triangles
            .iter()
            .map(|places| places.map(|place| corner(place).unwrap_or([f64::NAN; 3])))
            .collect();
        let boxes: Vec<Box3> = triangles.iter().map(bounds).collect();
        Self { triangles, bvh: Bvh::new(&boxes) }
    }

    /// Place of the nearest triangle and the distance to it, m; of equally near ones the first. None
    /// for an empty mesh and for a position that is not finite.
    #[must_use]
    pub fn nearest(&self, position_m: [f64; 3]) -> Option<(u32, f64)> {
        self.search(position_m, None).map(|best| (best.item, best.squared.sqrt()))
    }

    /// [`MeshIndex::nearest`] of many positions, in their order, in parallel.
    #[must_use]
    pub fn nearest_all(&self, positions_m: &[[f64; 3]]) -> Vec<Option<(u32, f64)>> {
        let chunks = positions_m.par_chunks(CHUNK).map(|chunk| {
            let mut last = None;
            let ask = |position_m: &[f64; 3]| {
                let best = self.search(*position_m, last);
                last = best.map(|best| best.item).or(last);
                best.map(|best| (best.item, best.squared.sqrt()))
            };
            chunk.iter().map(ask).collect::<Vec<_>>()
        });
        chunks.collect::<Vec<_>>().concat()
    }

    fn search(&self, position_m: [f64; 3], guess: Option<u32>) -> Option<Best> {
        if !position_m.iter().all(|value| value.is_finite()) {
            return None;
        }
        let squared = |item: u32| {
            let off = sub(position_m, nearest_on(self.triangles[item as usize], position_m));
            dot(off, off)
        };
        let guess = guess.map(|item| Best { item, squared: squared(item) });
        self.bvh.nearest(position_m, guess, squared)
    }
}

fn bounds(corners: &[[f64; 3]; 3]) -> Box3 {
    // A comparison with NaN keeps the other value: look for it first.
    if corners.iter().flatten().any(|value| !value.is_finite()) {
        return Box3 { min: [f64::NAN; 3], max: [f64::NAN; 3] };
    }
    corners
        .iter()
        .fold(Box3::EMPTY, |bounds, corner| bounds.union(&Box3 { min: *corner, max: *corner }))
}

/// The position on a triangle that is nearest to another: on the plane if the foot of the plumb line is
/// inside, else the nearest on its edges. Triangles without area have their edges.
#[must_use]
pub fn nearest_on([a, b, c]: [[f64; 3]; 3], position: [f64; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (sub(b, a), sub(c, a), sub(position, a));
    // Normal equations of ap = v ab + w ac.
    let (uu, uv, vv) = (dot(ab, ab), dot(ab, ac), dot(ac, ac));
    let (pu, pv) = (dot(ap, ab), dot(ap, ac));
    let determinant = uu * vv - uv * uv;
    if determinant > 1e-12 * uu * vv {
        let v = (vv * pu - uv * pv) / determinant;
        let w = (uu * pv - uv * pu) / determinant;
        if v >= 0.0 && w >= 0.0 && v + w <= 1.0 {
            return along(along(a, ab, v), ac, w);
        }
    }
    let squared = |at: [f64; 3]| dot(sub(position, at), sub(position, at));
    let edges = [(a, b), (b, c), (c, a)].map(|(from, to)| nearest_between(from, to, position));
    let [first, rest @ ..] = edges;
    rest.into_iter().fold(first, |best, at| if squared(at) < squared(best) { at } else { best })
}

/// The position on a segment that is nearest to another.
fn nearest_between(from: [f64; 3], to: [f64; 3], position: [f64; 3]) -> [f64; 3] {
    let way = sub(to, from);
    let squared = dot(way, way);
    let share = if squared > 0.0 { dot(sub(position, from), way) / squared } else { 0.0 };
    along(from, way, share.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::block;
    use crate::vector::distance;
    use proptest::prelude::*;

    fn place() -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3(-10i32..10).prop_map(|p| p.map(|v| f64::from(v) * 0.25))
    }

    proptest! {
        /// A fine net of positions on the triangle comes no nearer, and nearly as near.
        #[test]
        fn no_place_on_the_triangle_is_nearer(corners in prop::array::uniform3(place()), p in place()) {
            let best = distance(p, nearest_on(corners, p));
            let [a, b, c] = corners;
            let steps = 60;
            let net = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| (i, j)));
            let least = net.map(|(i, j)| {
                let (v, w) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                distance(p, along(along(a, sub(b, a), v), sub(c, a), w))
            });
            let least = least.fold(f64::INFINITY, f64::min);
            prop_assert!(best <= least + 1e-9, "{best} {least}");
            let edge = distance(a, b).max(distance(b, c)).max(distance(c, a));
            prop_assert!(best >= least - edge / f64::from(steps), "{best} {least}");
        }

        #[test]
        fn as_brute_force(
            vertices in prop::collection::vec(place(), 3..60),
            triangles in prop::collection::vec(prop::array::uniform3(0u32..60), 0..150),
            positions in prop::collection::vec(place(), 1..30),
        ) {
            let count = vertices.len() as u32;
            let triangles: Vec<_> = triangles.into_iter().map(|t| t.map(|i| i % count)).collect();
            let mesh = Mesh { vertices_m: vertices, triangles };
            let brute = |p: [f64; 3]| {
                (0..mesh.triangles.len())
                    .map(|t| distance(p, nearest_on(mesh.corners_m(t), p)))
                    .fold(f64::INFINITY, f64::min)
            };
            let found = MeshIndex::new(&mesh).nearest_all(&positions);
            for (position, found) in positions.iter().zip(found) {
                prop_assert_eq!(found.map_or(f64::INFINITY, |f| f.1), brute(*position));
                prop_assert_eq!(found, MeshIndex::new(&mesh).nearest(*position));
            }
        }
    }

    #[test]
    fn faces_edges_and_corners_of_a_block() {
        let index = MeshIndex::new(&block([2.0; 3]));
        let distance = |p| index.nearest(p).unwrap().1;
        assert_eq!(distance([1.0, 0.7, 3.0]), 1.0);
        assert_eq!(distance([1.0, 1.0, 1.5]), 0.5);
        assert_eq!(distance([5.0, 6.0, 1.0]), 5.0);
        assert_eq!(distance([-2.0, -1.0, -2.0]), 3.0);
        assert_eq!(index.nearest([f64::NAN; 3]), None);
        let broken =
            Mesh { vertices_m: vec![[f64::NAN; 3]; 3], triangles: vec![[0, 1, 2], [0, 1, 9]] };
        assert_eq!(MeshIndex::new(&broken).nearest([0.0; 3]), None);
    }
}

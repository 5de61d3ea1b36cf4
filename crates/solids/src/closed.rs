//! One closed surface around a whole branching model.
//!
//! The model is taken as the union of round cones (balls of a radius that changes evenly along a
//! segment). Its signed distance is the least of theirs (outside exact, inside a bound); it is found on
//! the corners of a cubic grid near the surface only, every cube is cut into six tetrahedra along its
//! main diagonal (Kuhn 1960), and the surface inside each is drawn where the distance changes its sign
//! (marching tetrahedra, Doi and Koide 1991). Neighbouring cubes cut their common face alike, so the
//! surface is a closed manifold whatever the model: no holes, no forks, no inner walls.

use crate::Mesh;
use crate::tubes::Node;
use crate::vector::{along, distance, dot, norm, sub, unit};
use rayon::prelude::*;

/// How far from the surface corners are known, in edges of the grid: beyond the diagonal of a cube
/// (1.73), so that every cube that the surface passes has all its corners.
const BAND: f64 = 1.8;
/// Part of an edge that is kept on either side of the surface: vertices on edges that meet in a corner
/// stay apart, and triangles keep an area.
const KEPT: f64 = 0.05;
/// A ball of this radius, in edges of the grid, holds a corner wherever it lies: half the diagonal.
const LEAST_RADIUS: f64 = 0.866_025_403_784_438_6;
/// Triangles for a square of the grid's edge on a surface (measured on cones in three
/// directions: 6.8 to 8.6, test `the_number_of_triangles_is_foreseen`).
const TRIANGLES_A_SQUARE: f64 = 8.6;

/// Corners that are looked at for every triangle at most: memory stays bounded for clumsy models, too (a
/// fat ball has many corners inside and few triangles).
const CORNERS_A_TRIANGLE: f64 = 50.0;

/// A ball that changes its radius evenly on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoundCone {
    /// Centre and radius at the start, m.
    pub start: ([f64; 3], f64),
    /// Centre and radius at the end, m.
    pub end: ([f64; 3], f64),
}

impl RoundCone {
    /// Signed distance of a position, m, negative inside. Exact.
    #[must_use]
    pub fn signed_distance_m(&self, position_m: [f64; 3]) -> f64 {
        let ((a, ra), (b, rb)) = (self.start, self.end);
        let length = distance(a, b);
        let slope = ra - rb;
        let Some(axis) = unit(sub(b, a)).filter(|_| slope.abs() < length) else {
            // One ball holds the other.
            return if ra >= rb {
                distance(position_m, a) - ra
            } else {
                distance(position_m, b) - rb
            };
        };
        // In the half plane through the axis: across and along; the line that touches both balls
        // has the normal (cos, sin).
        let offset = sub(position_m, a);
        let y = dot(offset, axis);
        let x = norm(along(offset, axis, -y));
        let sin = slope / length;
        let cos = (1.0 - sin * sin).sqrt();
        let place = y * cos - x * sin;
        if place <= 0.0 {
            norm(offset) - ra
        } else if place >= length * cos {
            distance(position_m, b) - rb
        } else {
            x * cos + y * sin - ra
        }
    }

    /// Area of the surface, m2, nearly.
    fn area_m2(&self) -> f64 {
        let ((a, ra), (b, rb)) = (self.start, self.end);
        std::f64::consts::PI * (ra + rb) * distance(a, b)
    }

    /// Volume of the box in which a grid's corners are looked at, m3.
    fn box_m3(&self, cell_m: f64) -> f64 {
        let ((a, ra), (b, rb)) = (self.start, self.end);
        let margin = 2.0 * (ra.max(rb) + BAND * cell_m);
        (0..3).map(|axis| (a[axis] - b[axis]).abs() + margin).product()
    }

    fn is_finite(&self) -> bool {
        let ((a, ra), (b, rb)) = (self.start, self.end);
        a.iter().chain(&b).chain([&ra, &rb]).all(|value| value.is_finite()) && ra.min(rb) >= 0.0
    }

    fn at_least(self, radius_m: f64) -> Self {
        let ((a, ra), (b, rb)) = (self.start, self.end);
        Self { start: (a, ra.max(radius_m)), end: (b, rb.max(radius_m)) }
    }
}

/// The cones between the nodes of an axis, see [`crate::tubes::smoothed`].
#[must_use]
pub fn cones_of(axis: &[Node]) -> Vec<RoundCone> {
    let end = |node: &Node| (node.centre_m, node.radius_m);
    axis.windows(2).map(|pair| RoundCone { start: end(&pair[0]), end: end(&pair[1]) }).collect()
}

/// A closed surface and how it came about.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Closed {
    /// The surface.
    pub mesh: Mesh,
    /// Edge of the grid, m.
    pub cell_m: f64,
    /// Radius below which cones were made thicker, so that the grid does not lose them, m.
    pub least_radius_m: f64,
    /// Number of cones that were made thicker.
    pub thickened: u64,
}

/// The smallest edge of a grid, not below `finest_m`, with which a model has about so many triangles and
/// not very many corners inside for each of them.
#[must_use]
pub fn cell_for(cones: &[RoundCone], triangles: u64, finest_m: f64) -> f64 {
    let fits = |cell_m: f64| {
        let thick = cones.iter().filter(|c| c.is_finite());
        let thick = thick.map(|cone| cone.at_least(LEAST_RADIUS * cell_m));
        let (area, volume) = thick.fold((0.0, 0.0), |(area, volume), cone| {
            (area + cone.area_m2(), volume + cone.box_m3(cell_m))
        });
        let corners = volume / (cell_m * cell_m * cell_m);
        area * TRIANGLES_A_SQUARE <= triangles as f64 * cell_m * cell_m
            && corners <= triangles as f64 * CORNERS_A_TRIANGLE
    };
    let mut cell_m = finest_m.max(1e-4);
    // In steps of 5 %: the area itself grows with the least radius.
    while !fits(cell_m) && cell_m < 10.0 {
        cell_m *= 1.05;
    }
    cell_m
}

/// The closed surface of the union of cones, on a grid with its corners at multiples of `cell_m`. Empty
/// without cones and for an edge that is not positive.
#[must_use]
pub fn closed(cones: &[RoundCone], cell_m: f64) -> Closed {
    if cell_m <= 0.0 || !cell_m.is_finite() {
        return Closed::default();
    }
    let least_radius_m = LEAST_RADIUS * cell_m;
    let thin = |c: &&RoundCone| c.start.1.min(c.end.1) < least_radius_m;
    let finite: Vec<RoundCone> = cones.iter().copied().filter(RoundCone::is_finite).collect();
    let thickened = finite.iter().filter(thin).count() as u64;
    let cones: Vec<RoundCone> = finite.into_iter().map(|c| c.at_least(least_radius_m)).collect();
    let mesh = Field::of(&cones, cell_m).map(|field| field.contour()).unwrap_or_default();
    Closed { mesh, cell_m, least_radius_m, thickened }
}

/// Signed distances at the corners near the surface and inside.
struct Field {
    cell_m: f64,
    /// Index of the grid's first corner in multiples of the edge.
    first: [i64; 3],
    /// Corners along x and y.
    size: [u64; 2],
    /// Numbers of the known corners, ascending: along x, then y, then z.
    corners: Vec<u64>,
    /// Their signed distances, m.
    values: Vec<f64>,
}

impl Field {
    fn of(cones: &[RoundCone], cell_m: f64) -> Option<Self> {
        let reach = |cone: &RoundCone| {
            let ((a, ra), (b, rb)) = (cone.start, cone.end);
            let margin = BAND * cell_m;
            let index = |value: f64| (value / cell_m).floor() as i64;
            let low: [i64; 3] = std::array::from_fn(|i| index((a[i] - ra).min(b[i] - rb) - margin));
            let high: [i64; 3] =
                std::array::from_fn(|i| index((a[i] + ra).max(b[i] + rb) + margin) + 1);
            [low, high]
        };
        let boxes: Vec<[[i64; 3]; 2]> = cones.iter().map(reach).collect();
        let bounds = boxes.iter().copied().reduce(|a, b| {
            [
                std::array::from_fn(|i| a[0][i].min(b[0][i])),
                std::array::from_fn(|i| a[1][i].max(b[1][i])),
            ]
        })?;
        let [first, last] = bounds;
        let size = [0, 1].map(|axis| (last[axis] - first[axis] + 1) as u64);
        let mut field = Self { cell_m, first, size, corners: Vec::new(), values: Vec::new() };
        let found: Vec<Vec<(u64, f64)>> = cones
            .par_iter()
            .zip(&boxes)
            .with_min_len(64)
            .map(|(cone, reach)| field.near(cone, reach))
            .collect();
        let mut found = found.concat();
        found.par_sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        found.dedup_by_key(|(corner, _)| *corner);
        (field.corners, field.values) = found.into_iter().unzip();
        Some(field)
    }

    /// The corners near a cone or inside, with their distances.
    fn near(&self, cone: &RoundCone, [low, high]: &[[i64; 3]; 2]) -> Vec<(u64, f64)> {
        let mut found = Vec::new();
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let value = cone.signed_distance_m([x, y, z].map(|i| i as f64 * self.cell_m));
                    if value < BAND * self.cell_m {
                        found.push((self.number([x, y, z]), value));
                    }
                }
            }
        }
        found
    }

    fn number(&self, index: [i64; 3]) -> u64 {
        let [x, y, z]: [u64; 3] = std::array::from_fn(|i| (index[i] - self.first[i]) as u64);
        (z * self.size[1] + y) * self.size[0] + x
    }

    /// Position of a corner, m.
    fn position(&self, number: u64) -> [f64; 3] {
        let [columns, rows] = self.size;
        let index = [number % columns, number / columns % rows, number / columns / rows];
        std::array::from_fn(|i| (index[i] as i64 + self.first[i]) as f64 * self.cell_m)
    }

    /// Where the corners of the cube above a corner are among the known ones, in binary order of their
    /// offsets; none unless all are known and the surface passes between them.
    fn cube(&self, place: usize) -> Option<[usize; 8]> {
        let [columns, rows] = self.size;
        let corner = self.corners[place];
        let mut cube = [0; 8];
        for (edge, above) in [0, columns, columns * rows, columns * (rows + 1)].iter().enumerate() {
            let wanted = corner + above;
            // Corners are sorted: the wanted one is not before this one.
            let at = if edge == 0 {
                place
            } else {
                place + self.corners[place..].binary_search(&wanted).ok()?
            };
            if self.corners.get(at + 1) != Some(&(wanted + 1)) {
                return None;
            }
            cube[2 * edge] = at;
            cube[2 * edge + 1] = at + 1;
        }
        let inside = cube.iter().filter(|at| self.values[**at] < 0.0).count();
        (1..8).contains(&inside).then_some(cube)
    }

    /// The surface.
    fn contour(&self) -> Mesh {
        const CHUNK: usize = 1 << 14;
        let chunks: Vec<Vec<[[u32; 2]; 3]>> = (0..self.corners.len())
            .collect::<Vec<_>>()
            .par_chunks(CHUNK)
            .map(|places| {
                let mut triangles = Vec::new();
                for place in places {
                    if let Some(cube) = self.cube(*place) {
                        self.cut_cube(&cube, &mut triangles);
                    }
                }
                triangles
            })
            .collect();
        let triangles = chunks.concat();
        let mut edges: Vec<[u32; 2]> = triangles.iter().flatten().copied().collect();
        edges.par_sort_unstable();
        edges.dedup();
        let place = |edge: &[u32; 2]| edges.binary_search(edge).unwrap_or_default() as u32;
        Mesh {
            vertices_m: edges.par_iter().map(|edge| self.vertex(*edge)).collect(),
            triangles: triangles
                .par_iter()
                .map(|t| std::array::from_fn(|i| place(&t[i])))
                .collect(),
        }
    }

    /// Where the surface passes an edge between two corners, the first of which has the lower number.
    fn vertex(&self, [from, to]: [u32; 2]) -> [f64; 3] {
        let [from, to] = [from as usize, to as usize];
        let (a, b) = (self.values[from], self.values[to]);
        let share = (a / (a - b)).clamp(KEPT, 1.0 - KEPT);
        let start = self.position(self.corners[from]);
        along(start, sub(self.position(self.corners[to]), start), share)
    }

    /// Adds the triangles inside a cube, each corner as the edge it lies on.
    fn cut_cube(&self, cube: &[usize; 8], triangles: &mut Vec<[[u32; 2]; 3]>) {
        /// The six ways from corner 0 to corner 7 along edges, the two corners between exchanged where
        /// the order of the axes is an odd permutation: all tetrahedra are oriented alike.
        const WAYS: [[usize; 4]; 6] =
            [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];
        for way in WAYS {
            self.cut_tetrahedron(way.map(|corner| cube[corner]), triangles);
        }
    }

    /// Adds the triangles inside a tetrahedron, their outside where the distance is positive.
    fn cut_tetrahedron(&self, corners: [usize; 4], triangles: &mut Vec<[[u32; 2]; 3]>) {
        // Even permutations, so that the orientation of the tetrahedron stays.
        let inside = corners.map(|corner| self.values[corner] < 0.0);
        let count = inside.into_iter().filter(|inside| *inside).count();
        let order: [usize; 4] = match (count, inside) {
            (1, [true, ..]) | (3, [false, ..]) => [0, 1, 2, 3],
            (1, [_, true, ..]) | (3, [_, false, ..]) => [1, 0, 3, 2],
            (1, [_, _, true, _]) | (3, [_, _, false, _]) => [2, 3, 0, 1],
            (1 | 3, _) => [3, 2, 1, 0],
            (2, [true, true, ..]) => [0, 1, 2, 3],
            (2, [true, _, true, _]) => [0, 2, 3, 1],
            (2, [true, ..]) => [0, 3, 1, 2],
            (2, [_, true, true, _]) => [1, 2, 0, 3],
            (2, [_, true, ..]) => [1, 3, 2, 0],
            (2, _) => [2, 3, 0, 1],
            _ => return,
        };
        let [i, j, k, l] = order.map(|place| corners[place] as u32);
        let edge = |a: u32, b: u32| [a.min(b), a.max(b)];
        match count {
            1 => triangles.push([edge(i, j), edge(i, k), edge(i, l)]),
            3 => triangles.push([edge(i, j), edge(i, l), edge(i, k)]),
            _ => {
                let [a, b, c, d] = [edge(i, k), edge(i, l), edge(j, l), edge(j, k)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
}

#[cfg(test)]
mod tests;

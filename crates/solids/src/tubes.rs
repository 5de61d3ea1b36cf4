//! Smooth tubes along branches.
//!
//! The axis is a cubic Hermite curve through the nodes of a branch, cut into short steps; along it a
//! frame is carried without twist by double reflection (Wang, Juttler, Zheng and Liu 2008, Computation
//! of rotation minimizing frames), and at every step stands a ring of a regular polygon. The polygon
//! has the area of the circle, so a tube has the volume of its cylinders. Each tube is closed by fans.

use crate::vector::{across, add, along, cross, distance, dot, norm, scale, sub, unit};
use crate::{Cylinder, Mesh};
use std::f64::consts::PI;

/// Nodes nearer to the one before than this are left out, m: they give no direction.
const SAME_PLACE_M: f64 = 1e-6;

/// How fine tubes are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fineness {
    /// Corners of a ring; fewer than 3 count as 3.
    pub sides: u32,
    /// Longest step along the axis, m.
    pub step_m: f64,
}

impl Default for Fineness {
    /// Ten sides and 5 cm, as Du et al. 2019 draw their trees.
    fn default() -> Self {
        Self { sides: 10, step_m: 0.05 }
    }
}

/// A node of an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Position, m.
    pub centre_m: [f64; 3],
    /// Radius, m.
    pub radius_m: f64,
    /// Which cylinder of the branch it belongs to.
    pub cylinder: u32,
}

/// A mesh of tubes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tubes {
    /// The surface.
    pub mesh: Mesh,
    /// For every vertex the place of its cylinder in its branch.
    pub cylinder: Vec<u32>,
}

/// The axis of a branch: the start of the first cylinder and the end of every one, with the mean of the
/// radii on both sides. Cylinders without length are passed over.
#[must_use]
pub fn axis_of(branch: &[Cylinder]) -> Vec<Node> {
    let mut nodes: Vec<Node> = Vec::with_capacity(branch.len() + 1);
    let finite = (0u32..).zip(branch).filter(|(_, cylinder)| cylinder.is_finite());
    for (place, cylinder) in finite {
        let Cylinder { start_m, end_m, radius_m } = *cylinder;
        match nodes.last_mut() {
            None => nodes.push(Node { centre_m: start_m, radius_m, cylinder: place }),
            Some(last) => last.radius_m = (last.radius_m + radius_m) / 2.0,
        }
        let before = nodes.last().map_or(start_m, |last| last.centre_m);
        if distance(before, end_m) > SAME_PLACE_M {
            nodes.push(Node { centre_m: end_m, radius_m, cylinder: place });
        }
    }
    nodes
}

/// The nodes of a smooth curve through the nodes of an axis, at most `step_m` apart. Radii are
/// interpolated linearly.
#[must_use]
pub fn smoothed(axis: &[Node], step_m: f64) -> Vec<Node> {
    let mut nodes = Vec::new();
    nodes.extend(axis.first());
    for (place, pair) in axis.windows(2).enumerate() {
        let [from, to] = [pair[0], pair[1]];
        let chord = distance(from.centre_m, to.centre_m);
        let (out, into) = (tangent(axis, place), tangent(axis, place + 1));
        let steps = (chord / step_m.max(SAME_PLACE_M)).ceil().clamp(1.0, 1000.0) as usize;
        for step in 1..=steps {
            let t = step as f64 / steps as f64;
            let centre_m = if step == steps {
                to.centre_m
            } else {
                hermite([from.centre_m, to.centre_m], [scale(out, chord), scale(into, chord)], t)
            };
            let radius_m = from.radius_m + (to.radius_m - from.radius_m) * t;
            nodes.push(Node { centre_m, radius_m, cylinder: to.cylinder });
        }
    }
    nodes
}

/// Direction of the curve in a node, of length at most 1: that of the parabola through it and its
/// neighbours, or of the only neighbour.
fn tangent(axis: &[Node], place: usize) -> [f64; 3] {
    let chord = |from: usize, to: usize| {
        let way = sub(axis[to].centre_m, axis[from].centre_m);
        (unit(way).unwrap_or([0.0; 3]), norm(way))
    };
    if place == 0 {
        return chord(0, 1).0;
    }
    if place + 1 == axis.len() {
        return chord(place - 1, place).0;
    }
    let ((before, l0), (after, l1)) = (chord(place - 1, place), chord(place, place + 1));
    scale(add(scale(before, l1), scale(after, l0)), 1.0 / (l0 + l1))
}

/// A cubic curve between two positions with given velocities.
fn hermite([from, to]: [[f64; 3]; 2], [out, into]: [[f64; 3]; 2], t: f64) -> [f64; 3] {
    let (t2, t3) = (t * t, t * t * t);
    let ends = add(scale(from, 2.0 * t3 - 3.0 * t2 + 1.0), scale(to, 3.0 * t2 - 2.0 * t3));
    add(ends, add(scale(out, t3 - 2.0 * t2 + t), scale(into, t3 - t2)))
}

/// The closed tube along a branch of cylinders; empty for a branch without length.
#[must_use]
pub fn tube(branch: &[Cylinder], fineness: Fineness) -> Tubes {
    let nodes = smoothed(&axis_of(branch), fineness.step_m);
    if nodes.len() < 2 {
        return Tubes::default();
    }
    let sides = fineness.sides.max(3);
    let mut tubes = Tubes::default();
    for (node, [normal, binormal]) in nodes.iter().zip(frames(&nodes)) {
        // A polygon with the area of the circle.
        let angle = 2.0 * PI / f64::from(sides);
        let reach = node.radius_m * (angle / libm::sin(angle)).sqrt();
        for side in 0..sides {
            let (sin, cos) = libm::sincos(angle * f64::from(side));
            let out = add(scale(normal, cos), scale(binormal, sin));
            tubes.mesh.vertices_m.push(along(node.centre_m, out, reach));
            tubes.cylinder.push(node.cylinder);
        }
    }
    let rings = nodes.len() as u32;
    let next = |side: u32| (side + 1) % sides;
    for ring in 0..rings - 1 {
        let (low, high) = (ring * sides, (ring + 1) * sides);
        for side in 0..sides {
            let [a, b] = [low + side, low + next(side)];
            let [c, d] = [high + next(side), high + side];
            tubes.mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    close(&mut tubes, &nodes, sides);
    tubes
}

/// Closes both ends by fans around their centres.
fn close(tubes: &mut Tubes, nodes: &[Node], sides: u32) {
    let top = (nodes.len() as u32 - 1) * sides;
    for (ring, node) in [(0, nodes.first()), (top, nodes.last())] {
        let Some(node) = node else { continue };
        let centre = tubes.mesh.vertices_m.len() as u32;
        tubes.mesh.vertices_m.push(node.centre_m);
        tubes.cylinder.push(node.cylinder);
        for side in 0..sides {
            let [a, b] = [ring + side, ring + (side + 1) % sides];
            tubes.mesh.triangles.push(if ring == 0 { [centre, b, a] } else { [centre, a, b] });
        }
    }
}

/// Two directions across the curve in every node, carried along without twist.
fn frames(nodes: &[Node]) -> Vec<[[f64; 3]; 2]> {
    let directions = directions(nodes);
    let mut normal = across(directions[0]);
    let mut frames = vec![[normal, cross(directions[0], normal)]];
    for place in 1..nodes.len() {
        let way = sub(nodes[place].centre_m, nodes[place - 1].centre_m);
        let reflected = reflect(normal, way);
        let direction = reflect(directions[place - 1], way);
        let turned = reflect(reflected, sub(directions[place], direction));
        // Rounding is taken out, so that long branches keep their roundness.
        let upright = along(turned, directions[place], -dot(turned, directions[place]));
        normal = unit(upright).unwrap_or_else(|| across(directions[place]));
        frames.push([normal, cross(directions[place], normal)]);
    }
    frames
}

/// Direction of the curve in every node: half way between those of the steps on both sides.
fn directions(nodes: &[Node]) -> Vec<[f64; 3]> {
    let step = |from: usize, to: usize| {
        let from = from.min(nodes.len() - 1);
        unit(sub(nodes[to.min(nodes.len() - 1)].centre_m, nodes[from].centre_m))
    };
    let mut last = [0.0, 0.0, 1.0];
    let of = |place: usize| {
        let before = place.checked_sub(1).and_then(|before| step(before, place));
        let after = step(place, place + 1);
        let sum = add(before.unwrap_or([0.0; 3]), after.unwrap_or([0.0; 3]));
        // Where a branch turns back on itself the sum has no direction.
        last = unit(sum).or(after).or(before).unwrap_or(last);
        last
    };
    (0..nodes.len()).map(of).collect()
}

/// A vector mirrored on the plane across another one.
fn reflect(vector: [f64; 3], across: [f64; 3]) -> [f64; 3] {
    let squared = dot(across, across);
    if squared > 0.0 { along(vector, across, -2.0 * dot(vector, across) / squared) } else { vector }
}

#[cfg(test)]
mod tests;

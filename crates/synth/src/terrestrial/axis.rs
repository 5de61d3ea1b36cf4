//! Axes of stems and branches, and the tree that is put together from them.

use super::cylinder::{Leaf, TrueCylinder};
use super::vector::{Vec3, along, dot, length, sub, unit};

/// A place on an axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AxisNode {
    pub(crate) at: Vec3,
    pub(crate) radius: f64,
}

/// An axis that has become part of a tree.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    nodes: Vec<AxisNode>,
    /// Distance of every node from the first one along the axis, m.
    reach: Vec<f64>,
    /// Number of its first piece.
    first: u32,
    pub(crate) order: u8,
}

/// What is at a distance along an axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) at: Vec3,
    pub(crate) direction: Vec3,
    pub(crate) radius: f64,
    pub(crate) piece: u32,
}

impl Axis {
    /// Length, m.
    pub(crate) fn length(&self) -> f64 {
        self.reach.last().copied().unwrap_or(0.0)
    }

    /// The place at a distance from the start, m.
    pub(crate) fn place(&self, distance: f64) -> Place {
        let last = self.nodes.len() - 2;
        let index = self.reach[1..=last].partition_point(|&reach| reach <= distance);
        let (a, b) = (self.nodes[index], self.nodes[index + 1]);
        let way = sub(b.at, a.at);
        let share = (distance - self.reach[index]) / (self.reach[index + 1] - self.reach[index]);
        let share = share.clamp(0.0, 1.0);
        Place {
            at: along(a.at, way, share),
            direction: unit(way),
            radius: a.radius + share * (b.radius - a.radius),
            piece: self.first + index as u32,
        }
    }
}

impl Place {
    /// Where the axis of a branch starts: within this wood, just deep enough that no part of the
    /// branch's end stands out. What both hold is hence counted only near the rim.
    pub(crate) fn insertion(&self, direction: Vec3, radius: f64) -> Vec3 {
        let cosine = dot(direction, self.direction);
        let radial = along(direction, self.direction, -cosine);
        let room = (self.radius * self.radius - radius * radius).max(0.0).sqrt();
        let depth = (room - radius * cosine.abs()).max(0.0);
        along(self.at, unit(radial), if length(radial) > 1e-9 { depth } else { 0.0 })
    }
}

/// A tree being put together.
#[derive(Debug, Default)]
pub(crate) struct Assembly {
    pub(crate) pieces: Vec<TrueCylinder>,
    pub(crate) leaves: Vec<Leaf>,
    branches: u32,
}

impl Assembly {
    /// Adds an axis of at least two nodes as a new branch.
    pub(crate) fn add(&mut self, nodes: Vec<AxisNode>, order: u8, on: Option<u32>) -> Axis {
        let first = self.pieces.len() as u32;
        let mut reach = vec![0.0];
        for (index, pair) in nodes.windows(2).enumerate() {
            let piece = TrueCylinder {
                id: first + index as u32,
                parent: if index == 0 { on } else { Some(first + index as u32 - 1) },
                branch: self.branches,
                order,
                start_m: pair[0].at,
                end_m: pair[1].at,
                start_radius_m: pair[0].radius,
                end_radius_m: pair[1].radius,
            };
            reach.push(reach[index] + piece.length_m());
            self.pieces.push(piece);
        }
        self.branches += 1;
        Axis { nodes, reach, first, order }
    }
}

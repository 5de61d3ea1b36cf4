//! A hierarchy of boxes over things that rays hit and positions are near to.

use super::vector::Vec3;
use timberline_pointcloud::Bounds3;

/// Things in a leaf of the hierarchy.
const LEAF: usize = 4;
/// Slices among which the best cut is sought.
const BINS: usize = 16;
/// Level from which on nodes are divided at the median, which bounds the depth.
const MEDIAN_BELOW: usize = 28;
/// Room for the nodes that wait for a visit: one for each level, and 32 levels of halves hold all
/// that a 32-bit number can count.
const DEEPEST: usize = MEDIAN_BELOW + 34;

/// A box of the hierarchy.
#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Bounds3,
    /// First thing of a leaf, or index of the second child (the first one follows its parent).
    at: u32,
    /// Things of a leaf; 0 for an inner node.
    count: u32,
    /// Axis by which it is divided.
    axis: u8,
}

/// Boxes over boxes, divided across the longest axis.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bvh {
    nodes: Vec<Node>,
    /// Numbers of the things, leaf by leaf.
    order: Vec<u32>,
}

impl Bvh {
    /// The hierarchy of the boxes of some things.
    pub(crate) fn build(boxes: &[Bounds3]) -> Self {
        let centres: Vec<Vec3> =
            boxes.iter().map(|b| std::array::from_fn(|i| 0.5 * (b.min[i] + b.max[i]))).collect();
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut build = Build { boxes, centres, nodes: Vec::with_capacity(boxes.len()) };
        if !boxes.is_empty() {
            build.divide(&mut order, 0, 0);
        }
        Self { nodes: build.nodes, order }
    }

    /// The box around everything.
    pub(crate) fn bounds(&self) -> Bounds3 {
        self.nodes.first().map_or(Bounds3::EMPTY, |node| node.bounds)
    }

    /// Visits the things whose boxes, grown by `radius` on all sides, a ray enters before the range
    /// that `visit` gave last, near ones first. `visit` gets a thing's number and returns the range
    /// beyond which nothing matters any more.
    pub(crate) fn along_beam(
        &self,
        origin: Vec3,
        direction: Vec3,
        radius: f64,
        mut limit: f64,
        mut visit: impl FnMut(u32) -> f64,
    ) {
        let inverse = direction.map(|d| 1.0 / d);
        let mut stack = [0_u32; DEEPEST];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index as usize];
            if !enters(&node.bounds, radius, origin, inverse, limit) {
                continue;
            }
            if node.count > 0 {
                let first = node.at as usize;
                for &thing in &self.order[first..first + node.count as usize] {
                    limit = visit(thing);
                }
                continue;
            }
            // The nearer half is visited first, hence pushed last.
            let forward = direction[usize::from(node.axis)] >= 0.0;
            let pair = if forward { [node.at, index + 1] } else { [index + 1, node.at] };
            stack[depth..depth + 2].copy_from_slice(&pair);
            depth += 2;
        }
    }

    /// The thing of smallest signed distance from a position, and that distance; of equals the one of
    /// the smallest number. The distance outside a thing must not be below that from its box.
    pub(crate) fn nearest(&self, point: Vec3, distance: impl Fn(u32) -> f64) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        let mut stack = [0_u32; DEEPEST];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index as usize];
            if best.is_some_and(|(_, d)| distance_to_box(&node.bounds, point) > d.max(0.0)) {
                continue;
            }
            if node.count > 0 {
                let first = node.at as usize;
                for &thing in &self.order[first..first + node.count as usize] {
                    let found = distance(thing);
                    if best.is_none_or(|(t, d)| found < d || (found == d && thing < t)) {
                        best = Some((thing, found));
                    }
                }
                continue;
            }
            let halves = [index + 1, node.at];
            let gaps = halves.map(|h| distance_to_box(&self.nodes[h as usize].bounds, point));
            let pair = if gaps[0] <= gaps[1] { [halves[1], halves[0]] } else { halves };
            stack[depth..depth + 2].copy_from_slice(&pair);
            depth += 2;
        }
        best
    }
}

/// The boxes that a hierarchy is built of.
struct Build<'a> {
    boxes: &'a [Bounds3],
    centres: Vec<Vec3>,
    nodes: Vec<Node>,
}

impl Build<'_> {
    /// Builds the node over `order`, whose first element has place `first` of the whole, and all
    /// below it.
    fn divide(&mut self, order: &mut [u32], first: usize, depth: usize) {
        let whole = |bounds: Bounds3, &index: &u32| bounds.union(&self.boxes[index as usize]);
        let bounds = order.iter().fold(Bounds3::EMPTY, whole);
        let index = self.nodes.len();
        self.nodes.push(Node { bounds, at: first as u32, count: order.len() as u32, axis: 0 });
        if order.len() <= LEAF {
            return;
        }
        let mut spread = Bounds3::EMPTY;
        order.iter().for_each(|&thing| spread.include(self.centres[thing as usize]));
        let edge = |axis: usize| spread.max[axis] - spread.min[axis];
        let axis = (1..3).fold(0, |best, axis| if edge(axis) > edge(best) { axis } else { best });
        let bins = Bins { axis, low: spread.min[axis], edge: edge(axis) };
        let cut = if depth < MEDIAN_BELOW { self.cheapest(order, &bins) } else { None };
        let middle = match cut {
            Some(cut) => bins.partition(order, &self.centres, cut),
            None => self.at_median(order, axis),
        };
        let (low, high) = order.split_at_mut(middle);
        self.divide(low, first, depth + 1);
        let second = self.nodes.len() as u32;
        self.divide(high, first + middle, depth + 1);
        self.nodes[index] = Node { bounds, at: second, count: 0, axis: axis as u8 };
    }

    fn at_median(&self, order: &mut [u32], axis: usize) -> usize {
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |&a, &b| {
            let at = |thing: u32| self.centres[thing as usize][axis];
            at(a).total_cmp(&at(b)).then(a.cmp(&b))
        });
        middle
    }

    /// The cut between bins after which rays meet the least (the surface area heuristic, binned: Wald
    /// 2007, On fast construction of SAH-based bounding volume hierarchies); `None` where all
    /// centres lie in one bin.
    fn cheapest(&self, order: &[u32], bins: &Bins) -> Option<usize> {
        let mut held = [(0_u32, Bounds3::EMPTY); BINS];
        for &thing in order {
            let bin = bins.of(self.centres[thing as usize]);
            held[bin].0 += 1;
            held[bin].1 = held[bin].1.union(&self.boxes[thing as usize]);
        }
        let sum = |some: &[(u32, Bounds3)]| {
            let all = some.iter().fold((0, Bounds3::EMPTY), |a, b| (a.0 + b.0, a.1.union(&b.1)));
            (all.0 > 0).then(|| f64::from(all.0) * half_area(&all.1))
        };
        let cost = |cut: usize| Some((cut, sum(&held[..cut])? + sum(&held[cut..])?));
        (1..BINS).filter_map(cost).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(cut, _)| cut)
    }
}

/// Equal slices of the range of the centres on an axis.
struct Bins {
    axis: usize,
    low: f64,
    edge: f64,
}

impl Bins {
    fn of(&self, centre: Vec3) -> usize {
        let share = (centre[self.axis] - self.low) / self.edge;
        // A range of nothing gives NaN, which is bin 0.
        ((share * BINS as f64) as usize).min(BINS - 1)
    }

    /// Moves the things of the bins below the cut to the front, in their order; returns their number.
    fn partition(&self, order: &mut [u32], centres: &[Vec3], cut: usize) -> usize {
        let below = |thing: &u32| self.of(centres[*thing as usize]) < cut;
        let (low, high): (Vec<u32>, Vec<u32>) = order.iter().partition(|thing| below(thing));
        order[..low.len()].copy_from_slice(&low);
        order[low.len()..].copy_from_slice(&high);
        low.len()
    }
}

fn half_area(bounds: &Bounds3) -> f64 {
    let [x, y, z] = std::array::from_fn(|axis| bounds.max[axis] - bounds.min[axis]);
    x * y + y * z + z * x
}

/// Whether a ray enters a box grown by a radius before a range (slabs; Kay and Kajiya 1986). A ray within a slab's face
/// may give NaN, which counts as within.
fn enters(bounds: &Bounds3, radius: f64, origin: Vec3, inverse: Vec3, limit: f64) -> bool {
    let (mut near, mut far) = (0.0_f64, limit);
    for axis in 0..3 {
        let a = (bounds.min[axis] - radius - origin[axis]) * inverse[axis];
        let b = (bounds.max[axis] + radius - origin[axis]) * inverse[axis];
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    near <= far
}

fn distance_to_box(bounds: &Bounds3, point: Vec3) -> f64 {
    let out =
        |axis: usize| (bounds.min[axis] - point[axis]).max(point[axis] - bounds.max[axis]).max(0.0);
    let [x, y, z] = [out(0), out(1), out(2)];
    (x * x + y * y + z * z).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn balls() -> impl Strategy<Value = Vec<(Vec3, f64)>> {
        let at = [-5f64..5., -5f64..5., -5f64..5.];
        prop::collection::vec((at, 0.01f64..0.8), 0..60)
    }

    fn boxes(balls: &[(Vec3, f64)]) -> Vec<Bounds3> {
        let corner = |c: Vec3, r: f64| c.map(|value| value + r);
        balls.iter().map(|&(c, r)| Bounds3 { min: corner(c, -r), max: corner(c, r) }).collect()
    }

    proptest! {
        #[test]
        fn nearest_is_that_of_all(balls in balls(), point in [-6f64..6., -6f64..6., -6f64..6.]) {
            let distance = |i: u32| {
                let (c, r) = balls[i as usize];
                super::super::vector::length(super::super::vector::sub(point, c)) - r
            };
            let found = Bvh::build(&boxes(&balls)).nearest(point, distance);
            let all = (0..balls.len() as u32).map(|i| (i, distance(i)));
            let expected = all.min_by(|a, b| a.1.total_cmp(&b.1));
            prop_assert_eq!(found, expected);
        }

        #[test]
        fn rays_find_the_boxes_they_pass(balls in balls(), towards in [-5f64..5., -5f64..5., -5f64..5.]) {
            let origin = [-9.0, 0.3, 0.2];
            let direction = super::super::vector::unit(super::super::vector::sub(towards, origin));
            let mut seen = Vec::new();
            Bvh::build(&boxes(&balls)).along_beam(origin, direction, 0.0, 40.0, |i| { seen.push(i); 40.0 });
            for (i, (c, r)) in balls.iter().enumerate() {
                let from = super::super::vector::sub(*c, origin);
                let t = super::super::vector::dot(from, direction);
                let off = super::super::vector::dot(from, from) - t * t;
                if off < r * r && t > 0.0 {
                    prop_assert!(seen.contains(&(i as u32)));
                }
            }
        }
    }
}

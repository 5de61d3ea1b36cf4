//! A tree of boxes for exact nearest searches (bounding volume hierarchy).
//!
//! Built by the surface area heuristic over bins (Wald 2007, On fast construction of SAH-based
//! bounding volume hierarchies), searched depth first with the nearer child first.

/// A box with edges along the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Box3 {
    /// Smallest coordinates.
    pub(crate) min: [f64; 3],
    /// Largest coordinates.
    pub(crate) max: [f64; 3],
}

impl Box3 {
    /// The box that holds nothing.
    pub(crate) const EMPTY: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    /// The smallest box that holds both.
    pub(crate) fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    /// Squared distance from a position to the box; 0 inside.
    pub(crate) fn squared_distance(&self, position: [f64; 3]) -> f64 {
        let mut squared = 0.0;
        for axis in 0..3 {
            let off = (self.min[axis] - position[axis]).max(position[axis] - self.max[axis]);
            let off = off.max(0.0);
            squared += off * off;
        }
        squared
    }

    /// Half of the surface.
    fn half_area(&self) -> f64 {
        let [x, y, z]: [f64; 3] =
            std::array::from_fn(|axis| (self.max[axis] - self.min[axis]).max(0.0));
        x * y + y * z + z * x
    }

    /// Twice the centre.
    fn centre2(&self) -> [f64; 3] {
        std::array::from_fn(|axis| self.min[axis] + self.max[axis])
    }
}

/// Items in a leaf beyond which it is split.
const LEAF: usize = 4;
/// Bins per axis.
const BINS: usize = 16;
/// What rounding may take from a squared distance, relative: a box is given up only if it is farther by
/// more than this, so that no item is lost to the last bits.
const SLACK: f64 = 1e-12;

/// A node. The first child of an inner node follows it.
#[derive(Debug, Clone, Copy)]
struct Node {
    bounds: Box3,
    /// Of a leaf: place of its first item; of an inner node: place of its second child.
    place: u32,
    /// Number of items of a leaf; 0 for an inner node.
    count: u32,
}

/// The tree of boxes.
#[derive(Debug)]
pub(crate) struct Bvh {
    nodes: Vec<Node>,
    items: Vec<u32>,
}

/// The best item so far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Best {
    /// The item.
    pub(crate) item: u32,
    /// Its squared distance.
    pub(crate) squared: f64,
}

impl Bvh {
    /// Builds the tree; items with a box that is not finite are left out.
    pub(crate) fn new(boxes: &[Box3]) -> Self {
        let finite = |bounds: &Box3| bounds.min.iter().chain(&bounds.max).all(|v| v.is_finite());
        let items = (0u32..).zip(boxes).filter(|(_, bounds)| finite(bounds)).map(|(item, _)| item);
        let mut bvh = Self { nodes: Vec::new(), items: items.collect() };
        let mut items = std::mem::take(&mut bvh.items);
        if !items.is_empty() {
            bvh.build(boxes, &mut items, 0);
        }
        bvh.items = items;
        bvh
    }

    fn build(&mut self, boxes: &[Box3], items: &mut [u32], first: usize) {
        let bounds =
            items.iter().fold(Box3::EMPTY, |bounds, item| bounds.union(&boxes[*item as usize]));
        let node = self.nodes.len();
        let (place, count) = (first as u32, items.len() as u32);
        self.nodes.push(Node { bounds, place, count });
        if items.len() <= LEAF {
            return;
        }
        let middle = split(boxes, items);
        let (left, right) = items.split_at_mut(middle);
        self.build(boxes, left, first);
        self.nodes[node].place = self.nodes.len() as u32;
        self.nodes[node].count = 0;
        self.build(boxes, right, first + middle);
    }

    /// The item with the smallest squared distance, of equal ones the lowest, beginning with a guess.
    pub(crate) fn nearest(
        &self,
        position: [f64; 3],
        guess: Option<Best>,
        squared: impl Fn(u32) -> f64,
    ) -> Option<Best> {
        let mut best = guess;
        let mut stack = Vec::with_capacity(64);
        if let Some(root) = self.nodes.first() {
            stack.push((root.bounds.squared_distance(position), 0u32));
        }
        while let Some((least, place)) = stack.pop() {
            if best.is_some_and(|best| least * (1.0 - SLACK) > best.squared) {
                continue;
            }
            let node = &self.nodes[place as usize];
            if node.count == 0 {
                let children = [place + 1, node.place];
                let [a, b] = children
                    .map(|child| self.nodes[child as usize].bounds.squared_distance(position));
                let ordered = [(a, children[0]), (b, children[1])];
                let [near, far] = if a <= b { ordered } else { [ordered[1], ordered[0]] };
                stack.extend([far, near]);
                continue;
            }
            for item in &self.items[node.place as usize..][..node.count as usize] {
                let found = Best { item: *item, squared: squared(*item) };
                best = Some(best.map_or(found, |best| nearer(best, found)));
            }
        }
        best
    }

    /// Whether any item whose box holds a position fulfils a condition.
    pub(crate) fn any_around(&self, position: [f64; 3], condition: impl Fn(u32) -> bool) -> bool {
        let mut stack = if self.nodes.is_empty() { Vec::new() } else { vec![0u32] };
        while let Some(place) = stack.pop() {
            let node = &self.nodes[place as usize];
            if node.bounds.squared_distance(position) > 0.0 {
                continue;
            }
            if node.count == 0 {
                stack.extend([place + 1, node.place]);
            } else {
                let items = &self.items[node.place as usize..][..node.count as usize];
                if items.iter().any(|item| condition(*item)) {
                    return true;
                }
            }
        }
        false
    }
}

fn nearer(a: Best, b: Best) -> Best {
    if (b.squared, b.item) < (a.squared, a.item) { b } else { a }
}

/// Orders items so that a cut at the place returned is good, and returns it: never 0 nor the length.
fn split(boxes: &[Box3], items: &mut [u32]) -> usize {
    let centre = |item: u32, axis: usize| boxes[item as usize].centre2()[axis];
    let mut best: Option<(f64, usize, f64)> = None;
    for axis in 0..3 {
        let (low, high) = items.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), item| {
            (l.min(centre(*item, axis)), h.max(centre(*item, axis)))
        });
        if high > low {
            let bin =
                |item: u32| ((centre(item, axis) - low) / (high - low) * BINS as f64) as usize;
            for (cost, cut) in cuts(boxes, items, bin) {
                if best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, low + (high - low) * cut as f64 / BINS as f64));
                }
            }
        }
    }
    let half = items.len() / 2;
    let Some((_, axis, at)) = best else { return half };
    items.sort_unstable_by(|a, b| centre(*a, axis).total_cmp(&centre(*b, axis)).then(a.cmp(b)));
    let middle = items.partition_point(|item| centre(*item, axis) < at);
    if middle == 0 || middle == items.len() { half } else { middle }
}

/// Cost of every cut between bins that leaves items on both sides.
fn cuts(boxes: &[Box3], items: &[u32], bin: impl Fn(u32) -> usize) -> Vec<(f64, usize)> {
    let mut bins = [(Box3::EMPTY, 0usize); BINS];
    for item in items {
        let place = bin(*item).min(BINS - 1);
        bins[place] = (bins[place].0.union(&boxes[*item as usize]), bins[place].1 + 1);
    }
    let sweep = |order: &mut dyn Iterator<Item = usize>| {
        let (mut bounds, mut count) = (Box3::EMPTY, 0);
        let mut costs = [(0.0, 0); BINS];
        for place in order {
            bounds = bounds.union(&bins[place].0);
            count += bins[place].1;
            let area = if count > 0 { bounds.half_area() } else { 0.0 };
            costs[place] = (area * count as f64, count);
        }
        costs
    };
    let (left, right) = (sweep(&mut (0..BINS)), sweep(&mut (0..BINS).rev()));
    let valid = |cut: &usize| left[*cut - 1].1 > 0 && right[*cut].1 > 0;
    (1..BINS).filter(valid).map(|cut| (left[cut - 1].0 + right[cut].0, cut)).collect()
}

//! Sections strung into branches, and which branches are worth keeping.

use super::grow::Grown;
use super::section::{Members, Shape, shape};
use crate::cloud::Cloud;
use crate::paths::NONE;
use crate::vector::{Vector, distance, dot, sub, to_segment};

/// What a branch must explain at `detail` 1: the distances of its points from the surface of the
/// branch it leaves, in units of [`UNIT_M`] or of the spacing where that is wider, added up. Measured:
/// docs/terrestrial.md.
const EXPLAINED: f64 = 1.12;

/// Unit of what a branch explains, m. Spacings alone would give a dense cloud a branch for every bud,
/// metres alone would leave a sparse one a branch for every point.
const UNIT_M: f64 = 0.1;

/// Fewest points of a branch at `detail` 1: two from `detail` 0.5 downwards.
const FEWEST_POINTS: f64 = 0.7;

/// How far along the branch it leaves a side branch may be nearest to it: its own length times this.
const ALONGSIDE: f64 = 1.5;

/// Points within this many spacings of a surface are on it.
const SURFACE_SPACINGS: f64 = 1.5;

/// A run of sections from a fork to a tip.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Branch {
    /// From base to tip.
    pub(crate) sections: Vec<u32>,
    /// The branch it leaves; [`NONE`] for the stem.
    pub(crate) parent: u32,
    /// Place in the sections of that branch.
    pub(crate) fork: u32,
    /// Points of branches on it that were not worth keeping, with the place of the section nearest to
    /// each.
    pub(crate) absorbed: Vec<(u32, u32)>,
}

/// Strings the sections into branches, each after the one it leaves. At a fork the branch goes on
/// where most length lies ahead, a bend counting against it.
pub(crate) fn string(grown: &Grown) -> Vec<Branch> {
    let children = children(grown);
    let ahead = lengths_ahead(grown);
    let mut branches = Vec::new();
    let mut open = vec![(0u32, NONE, 0u32)];
    while let Some((first, parent, fork)) = open.pop() {
        let own = branches.len() as u32;
        let mut sections = vec![first];
        let mut at = first;
        while let Some(on) = goes_on(grown, &children[at as usize], at, &ahead) {
            let place = sections.len() as u32 - 1;
            let others = children[at as usize].iter().filter(|&&child| child != on);
            open.extend(others.map(|&child| (child, own, place)));
            sections.push(on);
            at = on;
        }
        branches.push(Branch { sections, parent, fork, absorbed: Vec::new() });
    }
    branches
}

fn children(grown: &Grown) -> Vec<Vec<u32>> {
    let mut children = vec![Vec::new(); grown.sections.len()];
    for (place, section) in grown.sections.iter().enumerate().skip(1) {
        // A second section without a parent comes of a gap above the base: it hangs on the first.
        let parent = if section.parent == NONE { 0 } else { section.parent };
        children[parent as usize].push(place as u32);
    }
    children
}

/// The longest way from each section to a tip, m.
fn lengths_ahead(grown: &Grown) -> Vec<f64> {
    let mut ahead = vec![0.0f64; grown.sections.len()];
    for place in (1..grown.sections.len()).rev() {
        let section = &grown.sections[place];
        let parent = if section.parent == NONE { 0 } else { section.parent as usize };
        let step = distance(section.shape.centre, grown.sections[parent].shape.centre);
        ahead[parent] = ahead[parent].max(ahead[place] + step);
    }
    ahead
}

fn goes_on(grown: &Grown, children: &[u32], at: u32, ahead: &[f64]) -> Option<u32> {
    let own = &grown.sections[at as usize].shape;
    let worth = |child: u32| {
        let shape = &grown.sections[child as usize].shape;
        let step = distance(shape.centre, own.centre);
        (ahead[child as usize] + step) * (1.5 + dot(shape.along, own.along))
    };
    let mut best: Option<(f64, u32)> = None;
    for &child in children {
        let worth = worth(child);
        let points = |section: u32| grown.members(section as usize).len();
        let better = best.is_none_or(|(most, other)| {
            worth > most || (worth == most && points(child) > points(other))
        });
        if better {
            best = Some((worth, child));
        }
    }
    best.map(|(_, child)| child)
}

/// What pruning looks at.
#[derive(Debug)]
pub(crate) struct Pruning<'a> {
    pub(crate) grown: &'a Grown,
    pub(crate) cloud: &'a Cloud,
    pub(crate) spacing_m: &'a [f64],
    pub(crate) detail: f64,
}

impl Pruning<'_> {
    /// Which branches are kept: tips inwards, a branch goes when what it explains is not worth it, and
    /// its points go to the branch it left.
    pub(crate) fn prune(&self, branches: &mut [Branch]) -> Vec<bool> {
        let mut kept = vec![true; branches.len()];
        let mut carries = vec![false; branches.len()];
        for own in (1..branches.len()).rev() {
            let parent = branches[own].parent as usize;
            kept[own] = carries[own] || self.is_worth(&branches[own], &branches[parent]);
            if kept[own] {
                carries[parent] = true;
                continue;
            }
            let points = self.points_of(&branches[own]);
            let near = self.alongside(&branches[own], &branches[parent]);
            branches[own].absorbed.clear();
            let placed = points.into_iter().map(|point| (near.nearest(self.at(point)).1, point));
            let placed: Vec<(u32, u32)> = placed.collect();
            branches[parent].absorbed.extend(placed);
        }
        kept
    }

    fn at(&self, point: u32) -> Vector {
        self.cloud.points[point as usize]
    }

    fn points_of(&self, branch: &Branch) -> Vec<u32> {
        let own = branch.sections.iter().flat_map(|&section| self.grown.members(section as usize));
        own.copied().chain(branch.absorbed.iter().map(|entry| entry.1)).collect()
    }

    /// Whether the distances of a branch's points from the surface of the one it leaves add up to
    /// enough. Tips come first: they tell most.
    fn is_worth(&self, branch: &Branch, parent: &Branch) -> bool {
        let points = self.points_of(branch);
        if (points.len() as f64) < FEWEST_POINTS / self.detail {
            return false;
        }
        let near = self.alongside(branch, parent);
        let enough = EXPLAINED / self.detail;
        let mut worth = 0.0;
        points.iter().rev().any(|&point| {
            let spacing = self.spacing_m[point as usize];
            let away = near.nearest(self.at(point)).0 - near.radius;
            let surface = near.radius.min(SURFACE_SPACINGS * spacing);
            worth += (away - surface).max(0.0) / spacing.max(UNIT_M);
            worth >= enough
        })
    }

    /// The part of the branch it leaves that a side branch may be near to.
    fn alongside(&self, branch: &Branch, parent: &Branch) -> Alongside {
        let centre = |&section: &u32| self.grown.sections[section as usize].shape.centre;
        let fork = branch.fork as usize;
        let on = centre(&parent.sections[fork]);
        let own = branch.sections.iter().map(|section| distance(centre(section), on));
        let reach = ALONGSIDE * own.fold(0.0, f64::max);
        let near = |section: &&u32| distance(centre(section), on) <= reach;
        let before = parent.sections[..fork].iter().rev().take_while(near).count().max(1);
        let after = parent.sections[fork + 1..].iter().take_while(near).count().max(1);
        let from = fork.saturating_sub(before);
        let upto = (fork + after + 1).min(parent.sections.len());
        let shape = &self.grown.sections[parent.sections[fork] as usize].shape;
        Alongside {
            axis: parent.sections[from..upto].iter().map(centre).collect(),
            first: from as u32,
            radius: shape.radius.max(shape.reach),
        }
    }

    /// Centres again for sections that have taken in points of their own surface: of a thin branch,
    /// two sides may have grown apart.
    pub(crate) fn take_in(&self, branch: &Branch, shapes: &mut [Shape]) {
        let mut taken: Vec<Vec<u32>> = vec![Vec::new(); shapes.len()];
        for &(place, point) in &branch.absorbed {
            let shape = &shapes[place as usize];
            let limit = shape.radius.max(shape.reach) + SURFACE_SPACINGS * shape.spacing;
            let out = sub(self.at(point), shape.centre);
            let along = dot(out, shape.along);
            if dot(out, out) - along * along <= limit * limit {
                taken[place as usize].push(point);
            }
        }
        for place in 0..shapes.len() {
            if taken[place].is_empty() {
                continue;
            }
            let section = branch.sections[place] as usize;
            taken[place].extend(self.grown.members(section));
            let below = place.checked_sub(1).map(|place| shapes[place]);
            shapes[place] = self.shape_of(&taken[place], &shapes[place], below.as_ref());
        }
    }

    fn shape_of(&self, points: &[u32], own: &Shape, below: Option<&Shape>) -> Shape {
        let positions: Vec<Vector> = points.iter().map(|&point| self.at(point)).collect();
        let wood: Vec<f32> = points.iter().map(|&point| self.cloud.wood[point as usize]).collect();
        let members = Members { points: &positions, wood: &wood, spacing: own.spacing, share: 1.0 };
        Shape { along: own.along, ..shape(&members, below, own.last) }
    }
}

/// A stretch of a branch.
struct Alongside {
    axis: Vec<Vector>,
    /// Place of the first section in the branch.
    first: u32,
    radius: f64,
}

impl Alongside {
    /// Distance from the axis, and the place of the nearest section.
    fn nearest(&self, p: Vector) -> (f64, u32) {
        let mut best = (f64::INFINITY, 0);
        for (place, centre) in self.axis.iter().enumerate() {
            let away = distance(*centre, p);
            if away < best.0 {
                best = (away, place);
            }
        }
        let (away, place) = best;
        let from = place.saturating_sub(1);
        let upto = (place + 2).min(self.axis.len());
        let pairs = self.axis[from..upto].windows(2);
        let away = pairs.map(|pair| to_segment(p, pair[0], pair[1]).0).fold(away, f64::min);
        (away, self.first + place as u32)
    }
}

//! Sections grown from the base upwards, each as long as its branch is thick.

use super::cluster::clusters;
use super::section::{Known, Members, Section, Shape, shape};
use crate::cloud::Cloud;
use crate::paths::{NONE, Paths};
use crate::vector::{Vector, distance};

/// Length of a section in spacings, and in radii of the section below: the longer of the two.
const LENGTH_SPACINGS: f64 = 0.75;
const LENGTH_RADII: f64 = 1.0;

/// Points of a section are parted where a gap is wider than this many spacings and radii.
const GAP_SPACINGS: f64 = 0.6;
const GAP_RADII: f64 = 0.9;

/// The tree of sections over the points.
#[derive(Debug, Default)]
pub(crate) struct Grown {
    /// Every section after its parent.
    pub(crate) sections: Vec<Section>,
    /// Points by section.
    pub(crate) points: Vec<u32>,
}

impl Grown {
    pub(crate) fn members(&self, section: usize) -> &[u32] {
        let Section { start, end, .. } = self.sections[section];
        &self.points[start as usize..end as usize]
    }
}

/// What sections are grown over.
#[derive(Debug)]
pub(crate) struct Ground<'a> {
    pub(crate) cloud: &'a Cloud,
    pub(crate) spacing_m: &'a [f64],
    /// Length of the path to every point, m: infinite for points that were cut off.
    pub(crate) length_m: &'a [f64],
    pub(crate) upwards: &'a Upwards,
    /// Largest radius of the first section, m.
    pub(crate) first_radius_m: f64,
    /// Length of the first section, m.
    pub(crate) first_length_m: f64,
    /// Factor on lengths and gaps that are told in spacings: below 1 for more detail.
    pub(crate) fineness: f64,
}

/// The points after each on the paths from the base.
#[derive(Debug)]
pub(crate) struct Upwards {
    start: Vec<u32>,
    to: Vec<u32>,
    /// Points whose paths lead over each, itself among them.
    beyond: Vec<u32>,
}

impl Upwards {
    pub(crate) fn new(paths: &Paths) -> Self {
        let mut start = vec![0u32; paths.parent.len() + 1];
        let has_parent = |v: &&u32| paths.parent[**v as usize] != NONE;
        for &v in paths.order.iter().filter(has_parent) {
            start[paths.parent[v as usize] as usize + 1] += 1;
        }
        for i in 1..start.len() {
            start[i] += start[i - 1];
        }
        let mut next = start.clone();
        let mut to = vec![0; start[start.len() - 1] as usize];
        for &v in paths.order.iter().filter(has_parent) {
            let place = &mut next[paths.parent[v as usize] as usize];
            to[*place as usize] = v;
            *place += 1;
        }
        let mut beyond = vec![1; paths.parent.len()];
        for &v in paths.order.iter().rev().filter(has_parent) {
            beyond[paths.parent[v as usize] as usize] += beyond[v as usize];
        }
        Self { start, to, beyond }
    }

    pub(crate) fn of(&self, point: u32) -> &[u32] {
        let place = point as usize;
        &self.to[self.start[place] as usize..self.start[place + 1] as usize]
    }
}

/// Points that a section or a gap above it begins with.
#[derive(Debug)]
struct Front {
    parent: u32,
    seeds: Vec<u32>,
    from_m: f64,
}

/// Grows all sections from the points the paths begin at.
pub(crate) fn grow(ground: &Ground<'_>, sources: Vec<u32>) -> Grown {
    let mut grown = Grown::default();
    let mut fronts = vec![Front { parent: NONE, seeds: sources, from_m: 0.0 }];
    while let Some(front) = fronts.pop() {
        advance(ground, &mut grown, &front, &mut fronts);
    }
    grown
}

/// Takes the points up to the next level set, parts them, and adds the sections and their fronts.
fn advance(ground: &Ground<'_>, grown: &mut Grown, front: &Front, fronts: &mut Vec<Front>) {
    let length = |&p: &u32| ground.length_m[p as usize];
    let below = grown.sections.get(front.parent as usize).map(|section| section.shape);
    let spacing = mean_spacing(ground, &front.seeds);
    let radius = below.map_or(ground.first_radius_m, |below| below.reach);
    let step = match below {
        None => ground.first_length_m,
        Some(_) => (LENGTH_SPACINGS * ground.fineness * spacing).max(LENGTH_RADII * radius),
    };
    let first = front.seeds.iter().map(length).fold(f64::INFINITY, f64::min);
    // Seeds beyond the whole next section come over a gap: they begin at their own distance.
    let from = if first < front.from_m + step { front.from_m } else { first };
    let upto = from + step;
    let (mut taken, late): (Vec<u32>, Vec<u32>) =
        front.seeds.iter().partition(|point| length(point) < upto);
    if !late.is_empty() {
        fronts.push(Front { parent: front.parent, seeds: late, from_m: upto });
    }
    let mut next = 0;
    while next < taken.len() {
        let above = ground.upwards.of(taken[next]);
        taken.extend(above.iter().filter(|point| length(point) < upto));
        next += 1;
    }
    let gap = match below {
        None => f64::INFINITY,
        Some(_) => (GAP_SPACINGS * ground.fineness * spacing).max(GAP_RADII * radius),
    };
    for group in clusters(&ground.cloud.points, taken, gap) {
        let above = group.iter().flat_map(|&point| ground.upwards.of(point));
        let seeds: Vec<u32> = above.filter(|point| length(point) >= upto).copied().collect();
        let parent = grown.sections.len() as u32;
        let beyond = |&point: &u32| f64::from(ground.upwards.beyond[point as usize]);
        let carried = group.len() as f64 + seeds.iter().map(beyond).sum::<f64>();
        add_section(ground, grown, front.parent, &group, carried);
        if !seeds.is_empty() {
            fronts.push(Front { parent, seeds, from_m: upto });
        }
    }
}

fn add_section(
    ground: &Ground<'_>,
    grown: &mut Grown,
    parent: u32,
    group: &[u32],
    carried: f64,
) {
    let below: Option<Shape> = grown.sections.get(parent as usize).map(|section| section.shape);
    let points: Vec<Vector> = group.iter().map(|&p| ground.cloud.points[p as usize]).collect();
    let wood: Vec<f32> = group.iter().map(|&p| ground.cloud.wood[p as usize]).collect();
    let spacing = mean_spacing(ground, group);
    let members = Members { points: &points, wood: &wood, spacing, carried };
    let first = Known { centre: None, radius: ground.first_radius_m, carried };
    let shape = shape(&members, below.as_ref(), first);
    let start = grown.points.len() as u32;
    grown.points.extend_from_slice(group);
    let end = grown.points.len() as u32;
    grown.sections.push(Section { parent, start, end, shape });
}

fn mean_spacing(ground: &Ground<'_>, points: &[u32]) -> f64 {
    points.iter().map(|&p| ground.spacing_m[p as usize]).sum::<f64>() / points.len() as f64
}

/// Length of every path from its own length at the source, m.
pub(crate) fn lengths(points: &[Vector], paths: &Paths) -> Vec<f64> {
    let mut length = vec![f64::INFINITY; points.len()];
    for &v in &paths.order {
        let parent = paths.parent[v as usize];
        length[v as usize] = if parent == NONE {
            paths.cost[v as usize]
        } else {
            length[parent as usize] + distance(points[v as usize], points[parent as usize])
        };
    }
    length
}

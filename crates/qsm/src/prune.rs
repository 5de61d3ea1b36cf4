//! Branches that are none, and where the others leave the wood that they grow on.

use crate::assign::outwards_m;
use crate::branches::{Branch, position_at};
use crate::sections::{Section, Sections};
use timberline_solids::vector::{along, distance, dot, sub};

/// How far a branch must rise out of the one it grows on: in radii of that one, and in standard
/// deviations of the points across surfaces. What does not is a path of the skeleton from the axis
/// to points of the surface.
const RISE_RADII: f64 = 0.3;
const RISE_NOISES: f64 = 3.0;
/// A branch that leaves at 20 degrees has risen after 4 radii of the other; what takes longer runs
/// along its surface.
const PARALLEL_RADII: f64 = 5.0;
/// Places along a branch at which it is looked at.
const STEPS: usize = 60;

/// Takes out branches that hardly leave the branch they grow on and bear no other.
#[must_use]
pub fn pruned(branches: Vec<Branch>, sections: &Sections, noise_m: f64) -> Vec<Branch> {
    let mut keep = vec![true; branches.len()];
    let mut bears = vec![false; branches.len()];
    for (number, branch) in branches.iter().enumerate().rev() {
        let Some(fork) = branch.fork else { continue };
        let parent = &sections.all[sections.of(fork.branch as usize)];
        keep[number] = bears[number] || rises(branch, parent, noise_m);
        bears[fork.branch as usize] |= keep[number];
    }
    let mut place = vec![0u32; branches.len()];
    let mut next = 0;
    for number in 0..branches.len() {
        place[number] = next;
        next += u32::from(keep[number]);
    }
    let mut kept = Vec::with_capacity(next as usize);
    for (mut branch, keep) in branches.into_iter().zip(keep) {
        if let Some(fork) = &mut branch.fork {
            fork.branch = place[fork.branch as usize];
        }
        if keep {
            kept.push(branch);
        }
    }
    kept
}

fn rises(branch: &Branch, parent: &[Section], noise_m: f64) -> bool {
    branch.path_m.iter().any(|position| {
        let (outwards, on) = nearest(parent, *position);
        outwards > needed_m(&parent[on], noise_m)
    })
}

/// How far out of a section a branch must rise, m.
fn needed_m(section: &Section, noise_m: f64) -> f64 {
    let rise = RISE_RADII * section.radius_m;
    // The noise is that of the stem's bark; a thin branch cannot have it.
    rise.max(RISE_NOISES * noise_m.min(rise))
}

/// Distance from a position to the nearest surface of a branch, negative inside, and the section.
fn nearest(sections: &[Section], position: [f64; 3]) -> (f64, usize) {
    let mut best = (f64::INFINITY, 0);
    for (place, section) in sections.iter().enumerate() {
        let outwards = outwards_m(section, position);
        if outwards < best.0 {
            best = (outwards, place);
        }
    }
    best
}

/// Begins every side branch where it leaves the wood of the branch it grows on
/// ([`Branch::begin_m`]): no wood counts twice and the two still overlap. A branch that first runs
/// along the other's surface is a path of the skeleton over points of that surface; it begins where
/// it rises, and its fork is moved there.
pub fn begin(branches: &mut [Branch], sections: &Sections, noise_m: f64) {
    // What was taken off each branch, m.
    let mut taken = vec![0.0f64; branches.len()];
    for number in 0..branches.len() {
        let Some(mut fork) = branches[number].fork else { continue };
        let parent = &sections.all[sections.of(fork.branch as usize)];
        let (left, risen) = leaving(&branches[number], parent, noise_m);
        let thick = parent[nearest(parent, branches[number].path_m[0]).1].radius_m;
        if risen - left <= PARALLEL_RADII * thick {
            fork.at_m = (fork.at_m - taken[fork.branch as usize]).max(0.0);
            (branches[number].fork, branches[number].begin_m) = (Some(fork), left);
            continue;
        }
        let (mut branch, at_m) = cut_off(&branches[number], risen, parent);
        taken[number] = risen - distance(branch.path_m[0], branch.path_m[1]);
        fork.at_m = (at_m - taken[fork.branch as usize]).max(0.0);
        branch.fork = Some(fork);
        branch.begin_m = leaving(&branch, parent, noise_m).0;
        branches[number] = branch;
    }
}

/// Where a branch is as deep below the surface of the other as it is thick, and where it has risen out
/// of it for good, m along it. Neither is beyond four fifths of it.
fn leaving(branch: &Branch, parent: &[Section], noise_m: f64) -> (f64, f64) {
    let stations = branch.stations_m();
    let most = 0.8 * stations[stations.len() - 1];
    let radius_m = branch.radius_m[0];
    let at = |place: usize| most * place as f64 / STEPS as f64;
    let mut left = None;
    for place in 0..=STEPS {
        let (outwards, on) = nearest(parent, position_at(&branch.path_m, &stations, at(place)));
        if left.is_none() && outwards > -radius_m {
            left = Some(at(place));
        }
        if outwards > needed_m(&parent[on], noise_m) {
            return (left.unwrap_or(most), at(place));
        }
    }
    (left.unwrap_or(most), most)
}

/// A branch without its path up to a station: from there it goes straight to the axis of the other.
/// Second, how far along the other that is, m.
fn cut_off(branch: &Branch, from_m: f64, parent: &[Section]) -> (Branch, f64) {
    let stations = branch.stations_m();
    let first = position_at(&branch.path_m, &stations, from_m);
    let section = &parent[nearest(parent, first).1];
    let axis = sub(section.end_m, section.start_m);
    let squared = dot(axis, axis);
    let share = if squared > 0.0 { dot(sub(first, section.start_m), axis) / squared } else { 0.0 };
    let share = share.clamp(0.0, 1.0);
    let rest = stations.partition_point(|station| *station <= from_m);
    let mut path_m = vec![along(section.start_m, axis, share), first];
    path_m.extend(&branch.path_m[rest..]);
    let mut radius_m = vec![branch.radius_m[rest - 1]; 2];
    radius_m.extend(&branch.radius_m[rest..]);
    let at_m = section.from_m + share * (section.to_m - section.from_m);
    (Branch { path_m, radius_m, ..branch.clone() }, at_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Params;
    use crate::branches::Fork;
    use crate::sections::cut;

    fn line(path_m: Vec<[f64; 3]>, radius_m: f64, fork: Option<Fork>) -> Branch {
        let radius_m = vec![radius_m; path_m.len() - 1];
        let order = u16::from(fork.is_some());
        Branch { path_m, radius_m, fork, order, begin_m: 0.0 }
    }

    fn trees(side: Vec<[f64; 3]>) -> Vec<Branch> {
        let stem = line(vec![[0.0; 3], [0.0, 0.0, 3.0], [0.0, 0.0, 6.0]], 0.1, None);
        vec![stem, line(side, 0.03, Some(Fork { branch: 0, at_m: 1.0 }))]
    }

    #[test]
    fn a_branch_begins_at_the_surface() {
        let mut branches = trees(vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0]]);
        let sections = cut(&branches, &Params::default());
        begin(&mut branches, &sections, 0.003);
        assert!((branches[1].begin_m - 0.07).abs() < 0.02, "{}", branches[1].begin_m);
        assert_eq!(branches[1].path_m.len(), 2);
    }

    #[test]
    fn a_path_along_the_surface_is_cut_off() {
        let path = vec![[0.0, 0.0, 1.0], [0.1, 0.0, 1.2], [0.1, 0.0, 4.0], [1.1, 0.0, 4.5]];
        let mut branches = trees(path);
        let sections = cut(&branches, &Params::default());
        begin(&mut branches, &sections, 0.003);
        let fork = branches[1].fork.unwrap();
        assert!((fork.at_m - 4.0).abs() < 0.1, "{fork:?}");
        assert!(branches[1].path_m[1][2] > 3.9, "{:?}", branches[1].path_m);
        assert_eq!(branches[1].path_m.len(), branches[1].radius_m.len() + 1);
    }

    #[test]
    fn what_stays_within_the_stem_is_pruned() {
        let branches = trees(vec![[0.0, 0.0, 1.0], [0.11, 0.0, 1.2], [0.1, 0.0, 4.0]]);
        let sections = cut(&branches, &Params::default());
        assert_eq!(pruned(branches, &sections, 0.003).len(), 1);
    }
}

//! Branches that are none.

use crate::assign::outwards_m;
use crate::branches::Branch;
use crate::sections::{Section, Sections};

/// How far a branch must rise out of the one it grows on: in radii of that one, and in standard
/// deviations of the points across surfaces. What does not is a path of the skeleton from the axis
/// to points of the surface.
const RISE_RADII: f64 = 0.3;
const RISE_NOISES: f64 = 3.0;

/// Takes out branches that hardly leave the branch they grow on and bear no other.
#[must_use]
pub fn pruned(branches: Vec<Branch>, sections: &Sections, noise_m: f64) -> Vec<Branch> {
    let mut keep = vec![true; branches.len()];
    let mut bears = vec![false; branches.len()];
    for (number, branch) in branches.iter().enumerate().rev() {
        let Some(fork) = branch.fork else { continue };
        let parent = around(sections, fork.branch as usize, fork.at_m);
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

/// The sections of a branch around a station: that which holds it and its neighbours.
#[must_use]
pub fn around(sections: &Sections, branch: usize, at_m: f64) -> &[Section] {
    let range = sections.of(branch);
    let place = sections.at(branch, at_m);
    &sections.all[place.saturating_sub(1).max(range.start)..(place + 2).min(range.end)]
}

fn rises(branch: &Branch, parent: &[Section], noise_m: f64) -> bool {
    let thickest = parent.iter().fold(0.0f64, |most, section| most.max(section.radius_m));
    let needed = (RISE_RADII * thickest).max(RISE_NOISES * noise_m);
    branch.path_m.iter().any(|position| {
        let outwards = parent.iter().map(|section| outwards_m(section, *position));
        outwards.fold(f64::INFINITY, f64::min) > needed
    })
}

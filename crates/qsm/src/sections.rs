//! Branches cut into sections, the cylinders to be.

use crate::Params;
use crate::branches::{Branch, position_at};
use timberline_solids::vector::{distance, dot, sub, unit};

/// The foot of a stem swells within this length, and sections of it are at most so long: over a longer
/// one the points of a foot scatter more than those of any cylinder, and it would not be measured.
const FOOT_M: f64 = 1.0;
const FOOT_SECTION_M: f64 = 0.2;

/// A piece of a branch that becomes one cylinder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    /// Place of its branch.
    pub branch: u32,
    /// Lower end of its axis, m.
    pub start_m: [f64; 3],
    /// Upper end of its axis, m.
    pub end_m: [f64; 3],
    /// Where it begins and ends along the branch, m.
    pub from_m: f64,
    /// See `from_m`.
    pub to_m: f64,
    /// Expected radius, m.
    pub radius_m: f64,
    /// Longest way from its middle to a tip, m.
    pub reach_m: f64,
}

impl Section {
    /// Middle along the branch, m.
    #[must_use]
    pub fn middle_m(&self) -> f64 {
        0.5 * (self.from_m + self.to_m)
    }

    /// Length of the axis, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        distance(self.start_m, self.end_m)
    }
}

/// All sections of a tree, branch by branch.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sections {
    /// The sections.
    pub all: Vec<Section>,
    /// First section of each branch, and the number of sections.
    pub first: Vec<usize>,
}

impl Sections {
    /// Places of a branch's sections.
    #[must_use]
    pub fn of(&self, branch: usize) -> std::ops::Range<usize> {
        self.first[branch]..self.first[branch + 1]
    }

    /// The section of a branch that holds a station; the nearest beyond its ends.
    #[must_use]
    pub fn at(&self, branch: usize, at_m: f64) -> usize {
        let range = self.of(branch);
        let inside = self.all[range.clone()].partition_point(|section| section.to_m <= at_m);
        (range.start + inside).min(range.end - 1)
    }
}

/// Cuts branches into sections of a length that follows the radius, shorter where they bend.
#[must_use]
pub fn cut(branches: &[Branch], params: &Params) -> Sections {
    let mut sections = Sections::default();
    for (number, branch) in branches.iter().enumerate() {
        sections.first.push(sections.all.len());
        let stations = branch.stations_m();
        let last = stations[stations.len() - 1];
        let mut from_m = branch.begin_m;
        while from_m < last {
            let radius_m = radius_at(branch, &stations, from_m).max(params.min_radius_m);
            let to_m = end_of(branch, &stations, from_m, radius_m, params);
            sections.all.push(section(number, branch, &stations, [from_m, to_m], params));
            from_m = to_m;
        }
    }
    sections.first.push(sections.all.len());
    add_reach(&mut sections, branches);
    sections
}

/// Takes every segment of the branches as a section with its own radius.
#[must_use]
pub fn as_they_are(branches: &[Branch], params: &Params) -> Sections {
    let mut sections = Sections::default();
    for (number, branch) in branches.iter().enumerate() {
        sections.first.push(sections.all.len());
        let stations = branch.stations_m();
        for ends in stations.windows(2) {
            sections.all.push(section(number, branch, &stations, [ends[0], ends[1]], params));
        }
    }
    sections.first.push(sections.all.len());
    add_reach(&mut sections, branches);
    sections
}

fn section(
    number: usize,
    branch: &Branch,
    stations: &[f64],
    [from_m, to_m]: [f64; 2],
    params: &Params,
) -> Section {
    Section {
        branch: number as u32,
        start_m: position_at(&branch.path_m, stations, from_m),
        end_m: position_at(&branch.path_m, stations, to_m),
        from_m,
        to_m,
        radius_m: radius_at(branch, stations, 0.5 * (from_m + to_m)).max(params.min_radius_m),
        reach_m: 0.0,
    }
}

fn radius_at(branch: &Branch, stations: &[f64], at_m: f64) -> f64 {
    let place = stations.partition_point(|station| *station <= at_m);
    branch.radius_m[place.saturating_sub(1).min(branch.radius_m.len() - 1)]
}

/// Where the section that begins at `from_m` ends.
fn end_of(branch: &Branch, stations: &[f64], from_m: f64, radius_m: f64, params: &Params) -> f64 {
    let last = stations[stations.len() - 1];
    let foot = branch.fork.is_none() && from_m < FOOT_M;
    let most = if foot { params.max_section_m.min(FOOT_SECTION_M) } else { params.max_section_m };
    let wanted = (params.section_radii * radius_m)
        .clamp(params.min_section_m, most.max(params.min_section_m));
    // A rest of less than half a section is not worth one of its own.
    let mut to_m = if last - from_m < 1.5 * wanted { last } else { from_m + wanted };
    let start = position_at(&branch.path_m, stations, from_m);
    let allowed = (params.max_bend_radii * radius_m).max(params.min_radius_m);
    loop {
        let end = position_at(&branch.path_m, stations, to_m);
        let inner = stations.partition_point(|station| *station <= from_m)
            ..stations.partition_point(|station| *station < to_m);
        let Some((off, place)) = farthest(&branch.path_m, inner, start, end) else { return to_m };
        if off <= allowed || stations[place] - from_m < 0.25 * params.min_section_m {
            return to_m;
        }
        to_m = stations[place];
    }
}

/// The position of a path within a range that is farthest from a line, and how far that is.
fn farthest(
    path: &[[f64; 3]],
    range: std::ops::Range<usize>,
    start: [f64; 3],
    end: [f64; 3],
) -> Option<(f64, usize)> {
    let axis = unit(sub(end, start));
    let mut most: Option<(f64, usize)> = None;
    for place in range {
        let offset = sub(path[place], start);
        let along = axis.map_or(0.0, |axis| dot(offset, axis));
        let off = (dot(offset, offset) - along * along).max(0.0).sqrt();
        if most.is_none_or(|(far, _)| off > far) {
            most = Some((off, place));
        }
    }
    most
}

/// Fills in [`Section::reach_m`]: branches in reverse, so that what grows on one is known before it.
fn add_reach(sections: &mut Sections, branches: &[Branch]) {
    // Of each section: longest way to a tip of branches that grow on it, from its end, m.
    let mut beside = vec![0.0f64; sections.all.len()];
    for number in (0..branches.len()).rev() {
        let mut reach = 0.0f64;
        for place in sections.of(number).rev() {
            let section = &mut sections.all[place];
            let length = section.to_m - section.from_m;
            reach = reach.max(beside[place]);
            section.reach_m = reach + 0.5 * length;
            reach += length;
        }
        let Some(fork) = branches[number].fork else { continue };
        let on = sections.at(fork.branch as usize, fork.at_m);
        beside[on] = beside[on].max(reach);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::branches::Fork;

    fn straight(length_m: f64, radius_m: f64) -> Branch {
        let path_m = (0..=20).map(|i| [0.0, 0.0, length_m * f64::from(i) / 20.0]).collect();
        Branch { path_m, radius_m: vec![radius_m; 20], fork: None, order: 0, begin_m: 0.0 }
    }

    #[test]
    fn length_follows_the_radius() {
        let params = Params::default();
        for radius_m in [0.03, 0.1] {
            let sections = cut(&[straight(5.0, radius_m)], &params);
            for section in &sections.all {
                let radii = section.length_m() / radius_m;
                let of_foot =
                    section.from_m < FOOT_M && section.length_m() <= FOOT_SECTION_M + 1e-9;
                assert!(of_foot || (2.0..=6.0).contains(&radii), "{radii}");
            }
            assert_eq!(sections.all.last().unwrap().end_m, [0.0, 0.0, 5.0]);
        }
    }

    #[test]
    fn bends_end_sections() {
        let path_m = vec![[0.0; 3], [0.0, 0.0, 0.5], [0.5, 0.0, 0.5]];
        let bent =
            Branch { path_m, radius_m: vec![0.12, 0.12], fork: None, order: 0, begin_m: 0.0 };
        let sections = cut(&[bent], &Params::default());
        assert!(sections.all.iter().any(|section| section.end_m == [0.0, 0.0, 0.5]));
    }

    #[test]
    fn reach_counts_side_branches() {
        let stem = straight(2.0, 0.1);
        let path_m = vec![[0.0, 0.0, 1.0], [3.0, 0.0, 1.0]];
        let fork = Some(Fork { branch: 0, at_m: 1.0 });
        let side = Branch { path_m, radius_m: vec![0.05], fork, order: 1, begin_m: 0.0 };
        let sections = cut(&[stem, side], &Params::default());
        let lowest = sections.all[0];
        assert!((lowest.reach_m - 4.0).abs() < 0.4, "{}", lowest.reach_m);
        let highest = sections.all[sections.of(0).end - 1];
        assert!(highest.reach_m < 0.3);
        assert_eq!(sections.at(1, 99.0), sections.all.len() - 1);
    }
}

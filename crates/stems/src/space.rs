//! The trees of a plot and the space of each: stems, bases, and the voxels that belong to them.

use crate::chain::stems;
use crate::disc::discs;
use crate::graph::Graph;
use crate::grounded::without_branches;
use crate::paths::{Source, UNREACHED, cheapest};
use crate::slices::{SlicePoint, clusters};
use crate::voxels::Voxels;
use crate::{Error, StemAxis, StemsParams};
use rayon::prelude::*;
use std::collections::BTreeMap;
use timberline_pointcloud::Frame;

/// Fewest voxels of a scan with a tree.
const FEWEST_VOXELS: usize = 20;
/// Breast height above the base, m.
const BREAST_HEIGHT_M: f64 = 1.3;
/// Diameter that undergrowth counts with where its ways compete with those of stems, m.
const UNDERGROWTH_DIAMETER_M: f64 = 0.02;
/// Height up to which voxels away from stems may be undergrowth, m.
const UNDERGROWTH_HEIGHT_M: f64 = 0.5;
/// A stem is wider than its cross-sections by this much where voxels are given to it, m.
const BARK_M: f64 = 0.03;
/// Height of the foot of a tree without ground whose middle is its base, m.
const FOOT_HEIGHT_M: f64 = 0.3;
/// A foot wider than this is no stem's, m.
const WIDEST_FOOT_M: f64 = 1.0;
/// Part of the lowest points that a tree without ground stands on.
const FOOT_SHARE: f64 = 0.002;

/// A tree and what was seen of its stem.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Where the stem's axis meets the ground, in the world, m.
    pub base_m: [f64; 3],
    /// Whether the base's elevation is the ground's; otherwise that of the lowest points.
    pub on_ground: bool,
    /// Diameter of the stem at breast height from the slices there, m; of all slices where these are too
    /// few. None where no cross-section was seen.
    pub dbh_m: Option<f64>,
    /// The stem in the frame of the space; none where no cross-section was seen.
    pub axis: Option<StemAxis>,
}

/// The trees of a plot, sorted by base, and whose every voxel is.
#[derive(Debug, Clone, PartialEq)]
pub struct Space {
    /// The trees.
    pub trees: Vec<Tree>,
    /// Place in `trees` for every voxel, `u32::MAX` for those of no tree.
    pub owner: Vec<u32>,
}

/// Elevation that heights count from in a scan without ground, m: its lowest points', of which two
/// in a thousand are left out as noise.
#[must_use]
pub fn foot_m(voxels: &Voxels) -> f64 {
    let mut elevations: Vec<f64> = voxels.all.iter().map(|voxel| voxel.centroid_m()[2]).collect();
    elevations.sort_by(f64::total_cmp);
    let place = (elevations.len() as f64 * FOOT_SHARE) as usize;
    elevations.get(place).copied().unwrap_or(0.0)
}

/// Finds the trees. `slice_points` are those between the heights of the search, in `frame`; heights
/// count from the ground, or, if there is none, from [`foot_m`].
///
/// # Errors
/// [`Error::TooFewPoints`], [`Error::Flat`], [`Error::NoStem`], and those of grids.
pub fn trees(
    voxels: &Voxels,
    slice_points: &[SlicePoint],
    frame: &Frame,
    has_ground: bool,
    params: &StemsParams,
) -> Result<Space, Error> {
    let positions: Vec<[f64; 3]> =
        voxels.all.iter().map(|voxel| voxel.local_centroid_m(frame)).collect();
    if positions.len() < FEWEST_VOXELS {
        return Err(Error::TooFewPoints {
            what: "voxels with points",
            found: positions.len(),
            needed: FEWEST_VOXELS,
        });
    }
    check_depth(&positions)?;
    let clusters = clusters(slice_points, params);
    let found: Vec<_> = clusters.par_iter().flat_map_iter(|one| discs(one, params)).collect();
    let foot_m = foot_m(voxels) - frame.origin_m[2] as f64;
    let scene = Scene { voxels, positions: &positions, frame, has_ground, foot_m, params };
    let axes = scene.without_branches(stems(&found, params))?;
    match axes.is_empty() {
        false => scene.by_stems(axes),
        true if !has_ground => scene.one_tree(),
        true => Err(Error::NoStem { low_m: params.search_from_m, high_m: params.search_to_m }),
    }
}

/// Refuses what has no extent in one direction.
fn check_depth(positions: &[[f64; 3]]) -> Result<(), Error> {
    /// A tree is thicker in every direction, m.
    const THINNEST_M: f64 = 0.01;
    /// A wall's roughness in parts of its smaller extent.
    const FLATTEST: f64 = 0.01;
    let len = positions.len() as f64;
    let sum = positions.iter().fold(nalgebra::Vector3::zeros(), |sum, p| sum + vector(p));
    let mean = sum / len;
    let spread = |matrix: nalgebra::Matrix3<f64>, p: &[f64; 3]| {
        let off = vector(p) - mean;
        matrix + off * off.transpose()
    };
    let matrix = positions.iter().fold(nalgebra::Matrix3::zeros(), spread) / len;
    let mut spreads: Vec<f64> =
        matrix.symmetric_eigenvalues().iter().map(|v| v.max(0.0).sqrt()).collect();
    spreads.sort_by(f64::total_cmp);
    let thickness_m = spreads[0];
    if thickness_m < THINNEST_M.max(FLATTEST * spreads[1]) && spreads[2] > 10.0 * THINNEST_M {
        return Err(Error::Flat { voxels: positions.len(), thickness_m });
    }
    Ok(())
}

fn vector(p: &[f64; 3]) -> nalgebra::Vector3<f64> {
    nalgebra::Vector3::new(p[0], p[1], p[2])
}

struct Scene<'a> {
    voxels: &'a Voxels,
    positions: &'a [[f64; 3]],
    frame: &'a Frame,
    has_ground: bool,
    /// [`foot_m`] in the frame, m.
    foot_m: f64,
    params: &'a StemsParams,
}

impl Scene<'_> {
    /// Leaves out steep branches, see [`without_branches`].
    fn without_branches(&self, axes: Vec<StemAxis>) -> Result<Vec<StemAxis>, Error> {
        let all = 0..self.positions.len() as u32;
        let kept: Vec<u32> = all.filter(|&at| !self.is_ground(at)).collect();
        let positions: Vec<[f64; 3]> = kept.iter().map(|&at| self.positions[at as usize]).collect();
        let heights: Vec<f64> = kept.iter().map(|&at| self.height_m(at)).collect();
        without_branches(axes, &positions, &heights, self.has_ground, self.params)
    }

    /// Gives voxels to the stems that were seen.
    fn by_stems(&self, mut axes: Vec<StemAxis>) -> Result<Space, Error> {
        axes.sort_by(|a, b| {
            let at = |axis: &StemAxis| axis.discs[0].centre_m;
            at(a).partial_cmp(&at(b)).unwrap_or(std::cmp::Ordering::Equal)
        });
        // The ground is no way from tree to tree.
        let on_stem: Vec<Option<u32>> = self.on_stems(&axes);
        let kept: Vec<u32> = (0..self.positions.len() as u32)
            .filter(|&at| on_stem[at as usize].is_some() || !self.is_ground(at))
            .collect();
        let positions: Vec<[f64; 3]> = kept.iter().map(|&at| self.positions[at as usize]).collect();
        let graph = Graph::new(&positions, self.params.gap_m)?;
        let sources = self.sources(&axes, &kept, &on_stem);
        let labels = cheapest(&graph, &sources);
        let mut owner = vec![UNREACHED; self.positions.len()];
        for (label, at) in labels.into_iter().zip(kept) {
            // The label after the last tree is the undergrowth's.
            owner[at as usize] = if (label as usize) < axes.len() { label } else { UNREACHED };
        }
        let own = voxels_of(&owner, axes.len());
        let trees = own.iter().zip(axes).map(|(own, axis)| self.tree(own, axis)).collect();
        Ok(self.without_saplings(Space { trees, owner }))
    }

    /// Leaves out trees that are too low, with their voxels.
    fn without_saplings(&self, space: Space) -> Space {
        let up_m = self.frame.origin_m[2] as f64;
        let mut top_m = vec![f64::NEG_INFINITY; space.trees.len()];
        for (position, owner) in self.positions.iter().zip(&space.owner) {
            if let Some(top) = top_m.get_mut(*owner as usize) {
                *top = top.max(position[2] + up_m);
            }
        }
        let high = |tree: &Tree, top: f64| {
            !self.has_ground || top - tree.base_m[2] >= self.params.smallest_height_m
        };
        let (mut place, mut trees) = (vec![UNREACHED; space.trees.len()], Vec::new());
        for (old, (tree, top)) in space.trees.into_iter().zip(top_m).enumerate() {
            if high(&tree, top) {
                place[old] = trees.len() as u32;
                trees.push(tree);
            }
        }
        let moved = |old: &u32| place.get(*old as usize).copied().unwrap_or(UNREACHED);
        Space { trees, owner: space.owner.iter().map(moved).collect() }
    }

    /// Height above ground, or above the lowest points, m.
    fn height_m(&self, at: u32) -> f64 {
        match self.has_ground {
            true => f64::from(self.voxels.all[at as usize].height_m),
            false => self.positions[at as usize][2] - self.foot_m,
        }
    }

    fn is_ground(&self, at: u32) -> bool {
        let low = self.height_m(at) < self.params.clearance_m;
        self.has_ground && (low || self.voxels.all[at as usize].is_ground)
    }

    /// The stem each voxel is on.
    fn on_stems(&self, axes: &[StemAxis]) -> Vec<Option<u32>> {
        let below_m = self.params.search_from_m + self.params.slice_m + BARK_M;
        let reach_m = |axis: &StemAxis| axis.radius_m() + BARK_M + self.voxels.edge_m() / 2.0;
        let reaches_m: Vec<f64> = axes.iter().map(reach_m).collect();
        // No stem leans more than 45 degrees.
        let widest_m = reaches_m.iter().copied().fold(0.0, f64::max) + below_m;
        let columns = Columns::new(axes, widest_m);
        let on = |stem: u32, at: &[f64; 3]| {
            let (axis, reach_m) = (&axes[stem as usize], reaches_m[stem as usize]);
            let [low, high] = axis.span_m();
            let near = || {
                let [x, y] = axis.at_elevation(at[2]);
                let (dx, dy) = (at[0] - x, at[1] - y);
                dx * dx + dy * dy <= reach_m * reach_m
            };
            at[2] >= low - below_m && at[2] <= high && near()
        };
        let stem = |at: &[f64; 3]| columns.near(at).iter().copied().find(|&stem| on(stem, at));
        self.positions.par_iter().map(stem).collect()
    }

    /// Ways begin on stems, and on low vegetation between them.
    fn sources(&self, axes: &[StemAxis], kept: &[u32], on_stem: &[Option<u32>]) -> Vec<Source> {
        let scale = |diameter_m: f64| libm::pow(diameter_m, self.params.metabolic_exponent);
        let scales: Vec<f64> = axes.iter().map(|axis| scale(2.0 * axis.radius_m())).collect();
        let undergrowth = scale(UNDERGROWTH_DIAMETER_M);
        let source = |(at, &voxel): (usize, &u32)| {
            let low = self.has_ground && self.height_m(voxel) < UNDERGROWTH_HEIGHT_M;
            let (label, scale) = match on_stem[voxel as usize] {
                Some(stem) => (stem, scales[stem as usize]),
                None if low => (axes.len() as u32, undergrowth),
                None => return None,
            };
            Some(Source { at: at as u32, label, scale })
        };
        kept.iter().enumerate().filter_map(source).collect()
    }

    fn tree(&self, own: &[u32], axis: StemAxis) -> Tree {
        let z_m = self.base_elevation_m(own, &axis);
        let foot = if self.has_ground { None } else { self.foot(own, z_m) };
        let [x, y] = foot.unwrap_or_else(|| axis.at_elevation(z_m));
        let base_m = self.frame.world_from_local([x, y, z_m]);
        // What is seen farther up or down still tells how thick nothing on this tree can be.
        let near = axis.diameter_at(BREAST_HEIGHT_M, self.params);
        let dbh_m = near.or(Some(2.0 * axis.radius_m())).filter(|dbh_m| *dbh_m > 0.0);
        Tree { base_m, on_ground: self.has_ground, dbh_m, axis: Some(axis) }
    }

    /// Middle of a tree's lowest voxels in the plane, where they lie close together: nearer to the
    /// base than a stem's line from far above.
    fn foot(&self, own: &[u32], z_m: f64) -> Option<[f64; 2]> {
        let positions = own.iter().map(|&at| self.positions[at as usize]);
        let low: Vec<[f64; 3]> = positions.filter(|p| p[2] <= z_m + FOOT_HEIGHT_M).collect();
        let range = |axis: usize| {
            let values = || low.iter().map(|p| p[axis]);
            (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max))
        };
        let ((west, east), (south, north)) = (range(0), range(1));
        let width_m = (east - west).max(north - south);
        let median = |axis: usize| {
            let mut values: Vec<f64> = low.iter().map(|p| p[axis]).collect();
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        (width_m <= WIDEST_FOOT_M).then(|| [median(0), median(1)])
    }

    /// Elevation of the ground at a stem, or of a tree's lowest voxels, in the frame.
    fn base_elevation_m(&self, own: &[u32], axis: &StemAxis) -> f64 {
        let own = own.iter().map(|&at| at as usize);
        let up_m = self.frame.origin_m[2] as f64;
        if !self.has_ground {
            let lowest = own.map(|at| self.positions[at][2]).fold(f64::INFINITY, f64::min);
            return lowest.min(axis.span_m()[0]);
        }
        let lowest_disc = axis.discs[0].centre_m;
        let near = own.filter(|&at| {
            let [dx, dy] = [0, 1].map(|a| self.positions[at][a] - lowest_disc[a]);
            dx * dx + dy * dy < 0.25 && self.positions[at][2] < lowest_disc[2] + 0.5
        });
        let mut ground: Vec<f64> = near
            .map(|at| self.voxels.all[at].ground_m - up_m)
            .filter(|ground| ground.is_finite())
            .collect();
        ground.sort_by(f64::total_cmp);
        let below_first = lowest_disc[2] - self.params.search_from_m;
        ground.get(ground.len() / 2).copied().unwrap_or(below_first)
    }

    /// A single tree whose stem cannot be seen: all that hangs together with the lowest voxel of the
    /// largest part.
    fn one_tree(&self) -> Result<Space, Error> {
        let graph = Graph::new(self.positions, self.params.gap_m)?;
        let part = graph.parts();
        let mut sizes = vec![0u32; part.len()];
        part.iter().for_each(|root| sizes[*root as usize] += 1);
        let largest = (0..sizes.len()).max_by_key(|&root| (sizes[root], std::cmp::Reverse(root)));
        let largest = largest.unwrap_or(0) as u32;
        let owner: Vec<u32> =
            part.iter().map(|root| if *root == largest { 0 } else { UNREACHED }).collect();
        let mut own: Vec<[f64; 3]> =
            (0..owner.len()).filter(|&at| owner[at] == 0).map(|at| self.positions[at]).collect();
        own.sort_by(|a, b| {
            a[2].total_cmp(&b[2]).then(a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal))
        });
        let lowest = &own[..own.len().div_ceil(50).min(own.len())];
        let mean =
            |axis: usize| lowest.iter().map(|p| p[axis]).sum::<f64>() / lowest.len().max(1) as f64;
        let base = [mean(0), mean(1), lowest.first().map_or(0.0, |p| p[2])];
        let base_m = self.frame.world_from_local(base);
        let tree = Tree { base_m, on_ground: false, dbh_m: None, axis: None };
        Ok(Space { trees: vec![tree], owner })
    }
}

/// Places of the voxels of each of `trees` trees.
fn voxels_of(owner: &[u32], trees: usize) -> Vec<Vec<u32>> {
    let mut own = vec![Vec::new(); trees];
    for (at, tree) in (0..).zip(owner) {
        if let Some(own) = own.get_mut(*tree as usize) {
            own.push(at);
        }
    }
    own
}

/// Stems by the columns of the plot that they lie in.
struct Columns {
    stems: BTreeMap<[i32; 2], Vec<u32>>,
}

impl Columns {
    /// Edge of a column, m.
    const EDGE_M: f64 = 1.0;

    /// Puts every stem into the columns within `reach_m` of its cross-sections.
    fn new(axes: &[StemAxis], reach_m: f64) -> Self {
        let mut stems: BTreeMap<[i32; 2], Vec<u32>> = BTreeMap::new();
        for (stem, axis) in (0..).zip(axes) {
            for disc in &axis.discs {
                let [x, y, _] = disc.centre_m;
                let [low, high] = [-reach_m, reach_m].map(|by| Self::column(x + by, y + by));
                for column in
                    (low[0]..=high[0]).flat_map(|i| (low[1]..=high[1]).map(move |j| [i, j]))
                {
                    let known = stems.entry(column).or_default();
                    if known.last() != Some(&stem) {
                        known.push(stem);
                    }
                }
            }
        }
        Self { stems }
    }

    fn column(x: f64, y: f64) -> [i32; 2] {
        [x, y].map(|value| (value / Self::EDGE_M).floor() as i32)
    }

    /// The stems that may be near a position, ascending.
    fn near(&self, at: &[f64; 3]) -> &[u32] {
        self.stems.get(&Self::column(at[0], at[1])).map_or(&[], Vec::as_slice)
    }
}

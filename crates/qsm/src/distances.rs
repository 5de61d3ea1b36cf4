//! Distances between points and model, both ways.

use crate::Model;
use crate::assign::Index;
use rayon::prelude::*;
use std::f64::consts::PI;
use timberline_pointcloud::Nearest3;
use timberline_pointcloud::nearest::BuildError;
use timberline_solids::vector::{across, add, along, cross, dot, scale, sub};
use timberline_solids::{Cylinder, CylinderIndex, DistanceSummary, free_ends};

/// Distance between samples of the surface, m; wider on models with more than [`MOST_SAMPLES`].
const SPACING_M: f64 = 0.02;
const MOST_SAMPLES: f64 = 60_000.0;
/// Sectors of a cylinder that are seen or not.
const SECTORS: usize = 24;
/// Samples deeper than this inside another cylinder are no surface, as a share of their own radius:
/// cylinders one after the other overlap where a branch bends.
const INSIDE_RADII: f64 = 0.05;

/// From every point to the nearest surface of the model: lateral surfaces, and discs at free ends.
#[must_use]
pub fn cloud_to_model(points_m: &[[f64; 3]], model: &Model) -> DistanceSummary {
    let solids = model.solids();
    let parents: Vec<Option<u32>> =
        model.cylinders.iter().map(|cylinder| cylinder.parent).collect();
    let index = CylinderIndex::with_ends(&solids, &free_ends(&solids, &parents));
    let found = index.nearest_all(points_m);
    DistanceSummary::of(&mut found.into_iter().flatten().map(|(_, distance)| distance).collect())
}

/// From samples of the model's surface that could be seen to the nearest point.
///
/// Samples lie on a lattice on every cylinder. One could be seen when it lies inside no other
/// cylinder and the scan has points on its side of the branch: in its sector of 15 degrees or the
/// next, on its cylinder or the neighbours along the branch. What is on a side that no point was
/// ever recorded on was not seen, and a distance there would measure the scan. Cylinders without any
/// point are left out with it; [`unseen_cylinders`] counts them.
///
/// # Errors
/// What the neighbour search says.
pub fn model_to_cloud(
    points_m: &[[f64; 3]],
    owner: &[u32],
    model: &Model,
) -> Result<DistanceSummary, BuildError> {
    let nearest = Nearest3::new(points_m)?;
    let seen = seen_sectors(points_m, owner, model);
    let samples = samples(model, &seen);
    let distance = |at: &[f64; 3]| nearest.nearest(at, 1).first().map(|n| n.squared_m2.sqrt());
    let mut found: Vec<f64> = samples.par_iter().filter_map(distance).collect();
    Ok(DistanceSummary::of(&mut found))
}

/// Number of cylinders that no point belongs to.
#[must_use]
pub fn unseen_cylinders(owner: &[u32], model: &Model) -> usize {
    let mut has = vec![false; model.cylinders.len()];
    owner.iter().for_each(|cylinder| has[*cylinder as usize] = true);
    has.iter().filter(|has| !**has).count()
}

/// Two directions across a cylinder; none of one without length.
fn frame(solid: &Cylinder) -> Option<[[f64; 3]; 2]> {
    let axis = solid.axis()?;
    let first = across(axis);
    Some([first, cross(axis, first)])
}

/// The sector of a direction across.
fn sector_of([x, y]: [f64; 2]) -> usize {
    let turn = libm::atan2(y, x) / (2.0 * PI) + 0.5;
    ((turn * SECTORS as f64) as usize).min(SECTORS - 1)
}

/// The sectors of each cylinder, as bits, that have a point on it or on its neighbours, with the
/// sectors beside them.
fn seen_sectors(points_m: &[[f64; 3]], owner: &[u32], model: &Model) -> Vec<u32> {
    let frames: Vec<_> = model.cylinders.iter().map(|c| frame(&c.solid)).collect();
    let mut seen = vec![0u32; model.cylinders.len()];
    for (point, &place) in points_m.iter().zip(owner) {
        let branch = &model.branches[model.cylinders[place as usize].branch as usize];
        let first = place.saturating_sub(1).max(branch.first);
        for other in first..(place + 2).min(branch.first + branch.len) {
            let Some(axes) = frames[other as usize] else { continue };
            let solid = &model.cylinders[other as usize].solid;
            let offset = sub(*point, solid.start_m);
            let sector = sector_of(axes.map(|axis| dot(offset, axis)));
            for beside in [sector + SECTORS - 1, sector, sector + 1] {
                seen[other as usize] |= 1 << (beside % SECTORS);
            }
        }
    }
    seen
}

/// The samples of all cylinders that could be seen.
fn samples(model: &Model, seen: &[u32]) -> Vec<[f64; 3]> {
    let solids = model.solids();
    let area: f64 = solids.iter().map(Cylinder::lateral_area_m2).sum();
    let spacing = SPACING_M.max((area / MOST_SAMPLES).sqrt());
    let index = Index::of_solids(&solids);
    let per_cylinder = (0..solids.len()).into_par_iter().map(|place| {
        let mut found = lattice(&solids[place], spacing, seen[place]);
        let deep = -INSIDE_RADII * solids[place].radius_m;
        found.retain(|at| index.outwards_m(*at, place as u32) >= deep);
        found
    });
    per_cylinder.collect::<Vec<_>>().concat()
}

/// Samples of one lateral surface in the sectors seen: at least three around and one along.
fn lattice(solid: &Cylinder, spacing: f64, seen: u32) -> Vec<[f64; 3]> {
    let Some([first, second]) = frame(solid).filter(|_| seen != 0) else { return Vec::new() };
    let around = ((2.0 * PI * solid.radius_m / spacing).ceil() as usize).max(3);
    let rows = ((solid.length_m() / spacing).ceil() as usize).max(1);
    let mut found = Vec::with_capacity(around * rows);
    for row in 0..rows {
        let share = (row as f64 + 0.5) / rows as f64;
        let centre = along(solid.start_m, sub(solid.end_m, solid.start_m), share);
        for step in 0..around {
            let (sin, cos) = libm::sincos(2.0 * PI * (step as f64 + 0.5) / around as f64);
            if seen & (1 << sector_of([cos, sin])) != 0 {
                let out = add(scale(first, cos), scale(second, sin));
                found.push(along(centre, out, solid.radius_m));
            }
        }
    }
    found
}

//! From cylinders to meshes with colours.

use super::Model;
use timberline_artefact::kinds::RadiusSource;
use timberline_solids::closed::{Closed, RoundCone, cell_for, closed, cones_of};
use timberline_solids::tubes::{Fineness, axis_of, tube};
use timberline_solids::{Cylinder, Mesh};

/// Branches nowhere thicker than this are twigs, m: a picture of the whole tree has a few pixels for them.
const TWIG_RADIUS_M: f64 = 0.01;

/// The tube of one branch.
#[derive(Debug, Clone, PartialEq)]
pub struct BranchMesh {
    /// Order of the branch.
    pub order: u16,
    /// The surface, in the tree's frame.
    pub mesh: Mesh,
    /// For every vertex what the radius there rests on.
    pub source: Vec<RadiusSource>,
}

/// Colour of a radius source, red, green and blue, from the palette of Okabe and Ito (2008): measured
/// green, interpolated orange, inferred purple.
#[must_use]
pub fn colour(source: RadiusSource) -> [u8; 3] {
    match source {
        RadiusSource::Measured => [0, 158, 115],
        RadiusSource::Interpolated => [230, 159, 0],
        RadiusSource::Inferred => [204, 121, 167],
    }
}

/// The tubes of all branches with a length and cylinders of at least a radius, in the order of the
/// branches. A branch that gets too thin on its way is cut off there.
#[must_use]
pub fn branches(model: &Model<'_>, fineness: Fineness, least_radius_m: f64) -> Vec<BranchMesh> {
    let all = model.cylinders();
    let mut meshes = Vec::new();
    for branch in &model.qsm.branches {
        let places = model.places(branch);
        let thick = all[places.clone()].iter().take_while(|c| c.radius_m >= least_radius_m).count();
        let places = places.start..places.start + thick;
        let tubes = tube(&all[places.clone()], fineness_of(&all[places.clone()], fineness));
        if tubes.mesh.triangles.is_empty() {
            continue;
        }
        let cylinders = &model.qsm.cylinders[places];
        let source = tubes.cylinder.iter().map(|place| cylinders[*place as usize].source).collect();
        meshes.push(BranchMesh { order: branch.order, mesh: tubes.mesh, source });
    }
    meshes
}

/// Twigs have half the corners of thicker branches, and no fewer than three: most of a tree's mesh is twigs.
fn fineness_of(branch: &[Cylinder], fineness: Fineness) -> Fineness {
    let thickest_m = branch.iter().map(|cylinder| cylinder.radius_m).fold(0.0, f64::max);
    let sides = if thickest_m < TWIG_RADIUS_M { fineness.sides / 2 } else { fineness.sides };
    Fineness { sides: sides.max(3), ..fineness }
}

/// One closed surface around a tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Watertight {
    /// The surface.
    pub closed: Closed,
    /// Number of pieces that are too thin for its grid and left out.
    pub left_out: u64,
}

/// One closed surface around the tree with about so many triangles, see [`timberline_solids::closed`].
///
/// Twigs that its grid cannot show are left out rather than drawn as thick as the grid: there are so many
/// of them that they would make most of the volume.
#[must_use]
pub fn watertight(model: &Model<'_>, triangles: u64, finest_m: f64) -> Watertight {
    /// From one least radius to the next that is tried.
    const STEP: f64 = 1.15;
    let all: Vec<Cylinder> = model.cylinders();
    let of_branch = |branch| cones_of(&axis_of(&all[model.places(branch)]));
    let cones: Vec<RoundCone> = model.qsm.branches.iter().flat_map(of_branch).collect();
    let radius_m = |cone: &RoundCone| cone.start.1.max(cone.end.1);
    let thickest_m = cones.iter().map(radius_m).fold(0.0, f64::max);
    let mut least_m = finest_m;
    loop {
        let kept: Vec<RoundCone> =
            cones.iter().filter(|cone| radius_m(cone) >= least_m).copied().collect();
        let cell_m = cell_for(&kept, triangles, finest_m);
        if cell_m <= least_m || STEP * least_m > thickest_m {
            // A tree thinner than any grid is drawn as it can be.
            let kept = if kept.is_empty() { &cones } else { &kept };
            let left_out = (cones.len() - kept.len()) as u64;
            return Watertight { closed: closed(kept, cell_m), left_out };
        }
        least_m *= STEP;
    }
}

//! From cylinders to meshes with colours.

use super::Model;
use timberline_artefact::kinds::RadiusSource;
use timberline_solids::closed::{Closed, RoundCone, cell_for, closed, cones_of};
use timberline_solids::tubes::{Fineness, axis_of, tube};
use timberline_solids::{Cylinder, Mesh};

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
        let tubes = tube(&all[places.clone()], fineness);
        if tubes.mesh.triangles.is_empty() {
            continue;
        }
        let cylinders = &model.qsm.cylinders[places];
        let source = tubes.cylinder.iter().map(|place| cylinders[*place as usize].source).collect();
        meshes.push(BranchMesh { order: branch.order, mesh: tubes.mesh, source });
    }
    meshes
}

/// One closed surface around the whole tree with about so many triangles, see
/// [`timberline_solids::closed`].
#[must_use]
pub fn watertight(model: &Model<'_>, triangles: u64, finest_m: f64) -> Closed {
    let all: Vec<Cylinder> = model.cylinders();
    let of_branch = |branch| cones_of(&axis_of(&all[model.places(branch)]));
    let cones: Vec<RoundCone> = model.qsm.branches.iter().flat_map(of_branch).collect();
    closed(&cones, cell_for(&cones, triangles, finest_m))
}

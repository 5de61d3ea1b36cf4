//! From cylinders to meshes with colours.

use super::Model;
use timberline_artefact::kinds::RadiusSource;
use timberline_solids::closed::{Closed, RoundCone, cell_for, closed, cones_of};
use timberline_solids::tubes::{Fineness, axis_of, tube};
use timberline_solids::vector::along;
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
/// of them that they would make most of the volume. What bears a thicker piece stays, so that the surface
/// is one.
#[must_use]
pub fn watertight(model: &Model<'_>, triangles: u64, finest_m: f64) -> Watertight {
    /// From one least radius to the next that is tried.
    const STEP: f64 = 1.15;
    let pieces = pieces(model);
    let thickest_m =
        model.qsm.cylinders.iter().map(|cylinder| cylinder.radius_m).fold(0.0, f64::max);
    let mut least_m = finest_m;
    loop {
        let bears = bearing(model, least_m);
        let kept: Vec<RoundCone> =
            pieces.iter().filter(|(place, _)| bears[*place]).map(|(_, cone)| *cone).collect();
        let cell_m = cell_for(&kept, triangles, finest_m);
        if cell_m <= least_m || STEP * least_m > thickest_m {
            let all: Vec<RoundCone> = pieces.iter().map(|(_, cone)| *cone).collect();
            // A tree thinner than any grid is drawn as it can be.
            let kept = if kept.is_empty() { &all } else { &kept };
            let left_out = (all.len() - kept.len()) as u64;
            return Watertight { closed: closed(kept, cell_m), left_out };
        }
        least_m *= STEP;
    }
}

/// Round cones along all branches, each with the place of its cylinder. Side branches begin on the axis of
/// the cylinder that bears them: its surface may end a little before their own first cylinder.
fn pieces(model: &Model<'_>) -> Vec<(usize, RoundCone)> {
    let all = model.cylinders();
    let root = |place: usize| {
        let parent = all.get(model.qsm.cylinders.get(place)?.parent? as usize)?;
        let (along_m, _) = parent.along_and_across_m(all[place].start_m);
        let at_m = along_m.clamp(0.0, parent.length_m());
        let on_axis = along(parent.start_m, parent.axis().unwrap_or_default(), at_m);
        let radius_m = all[place].radius_m.min(parent.radius_m);
        Some((place, RoundCone { start: (on_axis, radius_m), end: (all[place].start_m, radius_m) }))
    };
    let of_branch = |branch| {
        let places = model.places(branch);
        let axis = axis_of(&all[places.clone()]);
        let at = axis.iter().skip(1).map(|node| places.start + node.cylinder as usize);
        root(places.start).into_iter().chain(at.zip(cones_of(&axis))).collect::<Vec<_>>()
    };
    model.qsm.branches.iter().flat_map(of_branch).collect()
}

/// Which cylinders have at least a radius, or bear one that has.
fn bearing(model: &Model<'_>, least_m: f64) -> Vec<bool> {
    let cylinders = &model.qsm.cylinders;
    let mut bears: Vec<bool> = cylinders.iter().map(|c| c.radius_m >= least_m).collect();
    for place in (0..cylinders.len()).rev() {
        let parent = cylinders[place].parent.map(|parent| parent as usize);
        if let Some(parent) = parent.filter(|parent| bears[place] && *parent < place) {
            bears[parent] = true;
        }
    }
    bears
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::testing::{FRAME, fork};
    use timberline_artefact::Crs;

    fn of(change: impl Fn(&mut timberline_artefact::kinds::Qsm)) -> (f64, Watertight) {
        let (mut qsm, crs) = (fork(7), Crs::default());
        change(&mut qsm);
        let model = Model { qsm: &qsm, frame: FRAME, crs: &crs };
        let volume_m3 = model.cylinders().iter().map(Cylinder::volume_m3).sum();
        (volume_m3, watertight(&model, 200_000, 0.005))
    }

    /// Twigs were drawn as thick as the grid: a tree of many had an eighth more volume.
    #[test]
    fn twigs_do_not_swell_the_closed_surface() {
        let (whole_m3, with_branch) = of(|_| ());
        let (_, with_twig) = of(|qsm| qsm.cylinders[3].radius_m = 0.002);
        // The piece that joins it to the stem's axis is left out with it.
        assert_eq!((with_branch.left_out, with_twig.left_out), (0, 2));
        let volume_m3 = |found: &Watertight| found.closed.mesh.volume_m3();
        assert!((volume_m3(&with_branch) / whole_m3 - 1.0).abs() < 0.1, "{whole_m3}");
        assert!(volume_m3(&with_twig) < volume_m3(&with_branch));
    }

    /// A branch that began a little off its stem was a body of its own.
    #[test]
    fn a_branch_off_its_stem_is_joined_to_it() {
        let (_, found) = of(|qsm| qsm.cylinders[3].start_m = [0.9, 0.6, 4.2]);
        let mesh = &found.closed.mesh;
        let mut first: Vec<usize> = (0..mesh.vertices_m.len()).collect();
        for _ in 0..mesh.vertices_m.len() {
            let mut changed = false;
            for triangle in &mesh.triangles {
                let least = triangle.iter().map(|v| first[*v as usize]).min().unwrap();
                for vertex in triangle {
                    changed |= first[*vertex as usize] != least;
                    first[*vertex as usize] = least;
                }
            }
            if !changed {
                break;
            }
        }
        assert!(first.iter().all(|one| *one == 0), "more than one body");
    }

    /// A stem that is thin in the middle fell apart.
    #[test]
    fn what_bears_a_thicker_piece_is_not_left_out() {
        let (_, found) = of(|qsm| qsm.cylinders[1].radius_m = 0.004);
        assert_eq!(found.left_out, 0);
        let (_, found) = of(|qsm| (1..4).for_each(|place| qsm.cylinders[place].radius_m = 0.004));
        assert_eq!(found.left_out, 4);
    }
}

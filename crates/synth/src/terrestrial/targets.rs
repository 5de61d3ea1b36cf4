//! All that a beam can meet: wood, leaves, ground.

use super::bvh::Bvh;
use super::cylinder::{Joint, Leaf, Solid, TrueCylinder};
use super::ground_mesh::GroundMesh;
use super::points::Label;
use super::tree_model::TreeModel;
use super::vector::{Vec3, sub};
use crate::pulse::RAYS;
use timberline_pointcloud::{Bounds3, Frame};

/// Whose a thing is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Owner {
    pub(crate) tree: u32,
    pub(crate) label: Label,
    /// Number of the piece of wood in its tree.
    pub(crate) cylinder: u32,
}

/// A ray of a beam; its direction is a unit vector.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
}

/// Where a ray ends.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RayHit {
    pub(crate) range: f64,
    pub(crate) normal: Vec3,
    pub(crate) owner: Owner,
}

/// How far the stem is continued below its foot, so that no gap shows on a slope, m.
const ROOT_M: f64 = 0.4;
/// Owner of everything that is no piece of a tree's wood.
pub(crate) const NO_CYLINDER: u32 = u32::MAX;
const GROUND: Owner = Owner { tree: 0, label: Label::Ground, cylinder: NO_CYLINDER };

/// Things and ground in a local frame, ready for rays.
#[derive(Debug)]
pub(crate) struct Targets {
    pub(crate) frame: Frame,
    solids: Vec<Solid>,
    leaves: Vec<Leaf>,
    /// Of solids, then of leaves.
    owners: Vec<Owner>,
    bvh: Bvh,
    ground: Option<GroundMesh>,
}

impl Targets {
    /// Trees and low vegetation; vegetation belongs to no tree, and its wood is told from leaves no
    /// more. With ground, stems go on below their feet.
    pub(crate) fn new(
        frame: Frame,
        trees: &[TreeModel],
        vegetation: &[TreeModel],
        ground: Option<GroundMesh>,
    ) -> Self {
        let (mut solids, mut leaves) = (Vec::new(), Vec::new());
        let (mut of_solids, mut of_leaves) = (Vec::new(), Vec::new());
        let models = trees.iter().map(|t| (t, true)).chain(vegetation.iter().map(|v| (v, false)));
        for (model, is_tree) in models {
            let owner = |label, cylinder| match is_tree {
                true => Owner { tree: model.id, label, cylinder },
                false => Owner { tree: 0, label: Label::Understorey, cylinder: NO_CYLINDER },
            };
            let local = model.clone().at(frame.local_from_world(model.base_m));
            let root = local.cylinders.first().filter(|_| ground.is_some()).map(root);
            let joined = local.solids();
            of_solids.extend((0..joined.len() as u32).map(|i| owner(Label::Wood, i)));
            solids.extend(joined);
            of_solids.extend(root.iter().map(|_| owner(Label::Wood, 0)));
            solids.extend(root);
            of_leaves.extend(local.leaves.iter().map(|_| owner(Label::Leaf, NO_CYLINDER)));
            leaves.extend(local.leaves);
        }
        let boxes: Vec<Bounds3> =
            solids.iter().map(Solid::bounds).chain(leaves.iter().map(Leaf::bounds)).collect();
        of_solids.extend(of_leaves);
        let bvh = Bvh::build(&boxes);
        Self { frame, solids, leaves, owners: of_solids, bvh, ground }
    }

    /// The box around all things, and the ground's.
    pub(crate) fn bounds(&self) -> Bounds3 {
        self.ground.as_ref().map_or(Bounds3::EMPTY, GroundMesh::bounds).union(&self.bvh.bounds())
    }

    /// Where the rays of a beam from local positions end, if within a range. The first ray is the axis;
    /// no ray may be further than `radius` from it.
    pub(crate) fn hits(&self, rays: &[Ray], radius: f64, limit: f64) -> [Option<RayHit>; RAYS] {
        let mut best = [(limit, [0.0; 3], u32::MAX); RAYS];
        let Some(axis) = rays.first() else { return [None; RAYS] };
        self.bvh.along_beam(axis.origin, axis.direction, radius, limit, |thing| {
            let mut farthest = 0.0_f64;
            for (ray, nearest) in rays.iter().zip(&mut best) {
                if let Some((range, normal)) = self.thing_hit(thing, ray, nearest.0) {
                    *nearest = (range, normal, thing);
                }
                farthest = farthest.max(nearest.0);
            }
            farthest
        });
        let mut hits = [None; RAYS];
        for ((ray, (range, normal, thing)), hit) in rays.iter().zip(best).zip(&mut hits) {
            let ground = self.ground.as_ref();
            let ground = ground.and_then(|mesh| mesh.hit(ray.origin, ray.direction, range));
            let owner = self.owners.get(thing as usize);
            let on_thing = owner.map(|&owner| RayHit { range, normal, owner });
            *hit =
                ground.map(|(range, normal)| RayHit { range, normal, owner: GROUND }).or(on_thing);
        }
        hits
    }

    fn thing_hit(&self, thing: u32, ray: &Ray, limit: f64) -> Option<(f64, Vec3)> {
        let index = thing as usize;
        match self.solids.get(index) {
            Some(solid) => solid.hit(ray.origin, ray.direction, limit),
            None => self.leaves[index - self.solids.len()].hit(ray.origin, ray.direction, limit),
        }
    }
}

/// The stem below its foot.
fn root(foot: &TrueCylinder) -> Solid {
    let below = sub(foot.start_m, [0.0, 0.0, ROOT_M]);
    let piece = TrueCylinder {
        start_m: below,
        end_m: foot.start_m,
        end_radius_m: foot.start_radius_m,
        ..*foot
    };
    Solid::new(&piece, [Joint::Flat, Joint::Buried])
}

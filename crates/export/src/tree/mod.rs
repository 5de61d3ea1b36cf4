//! The files about one tree: tables, meshes, a recording for viewers.
//!
//! * [`cylinder_columns`]: `qsm.csv`; [`treeqsm`]: the columns of TreeQSM; [`treefile`]: the tree file of
//!   raycloudtools.
//! * [`ply`], [`obj`], [`glb`]: meshes of smooth tubes, [`scene`] says how they come about.
//! * [`recording`]: MCAP with cloud, skeleton and cylinders.
//! * [`metrics`]: `metrics.json`; [`tree_columns`], [`taper_columns`], [`order_columns`]: one row a tree, a step
//!   of the taper, an order of branches.
//!
//! Meshes are in the tree's frame, whose origin in the world stands in the file; text files are in the
//! world. No world coordinate is ever an `f32`.

pub mod cylinder_columns;
pub mod glb;
pub mod metrics;
pub mod obj;
pub mod order_columns;
pub mod ply;
pub mod recording;
pub mod scene;
pub mod taper_columns;
pub mod tree_columns;
pub mod treefile;
pub mod treeqsm;

use timberline_artefact::Crs;
use timberline_artefact::kinds::{Qsm, QsmBranch};
use timberline_pointcloud::Frame;
use timberline_solids::Cylinder;

/// The model of a tree and where it stands.
#[derive(Debug, Clone, Copy)]
pub struct Model<'a> {
    /// The model.
    pub qsm: &'a Qsm,
    /// The frame of its positions.
    pub frame: Frame,
    /// The CRS of the campaign.
    pub crs: &'a Crs,
}

impl Model<'_> {
    /// All cylinders, in the tree's frame.
    #[must_use]
    pub fn cylinders(&self) -> Vec<Cylinder> {
        let plain = |c: &timberline_artefact::kinds::QsmCylinder| Cylinder {
            start_m: c.start_m,
            end_m: c.end_m,
            radius_m: c.radius_m,
        };
        self.qsm.cylinders.iter().map(plain).collect()
    }

    /// Places of the cylinders of a branch; none where the branch names some that are not there.
    #[must_use]
    pub fn places(&self, branch: &QsmBranch) -> std::ops::Range<usize> {
        let range = branch.first as usize..branch.first as usize + branch.len as usize;
        if range.end <= self.qsm.cylinders.len() { range } else { 0..0 }
    }
}

#[cfg(test)]
pub(crate) mod testing;

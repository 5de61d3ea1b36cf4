//! A tree before and after it is modelled.

use timberline_solids::{Cylinder, DistanceSummary};

/// One node of a skeleton.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SkeletonNode {
    /// Position, local frame, m.
    pub position_m: [f64; 3],
    /// Place of the parent among the nodes, before this one; none for the root.
    pub parent: Option<u32>,
    /// Radius of the branch below the node by an allometric rule, m: a first guess.
    pub radius_m: f64,
}

/// The points of one tree, as scanned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TreePoints<'a> {
    /// Positions, local frame, m. Those that are not finite are left out.
    pub points_m: &'a [[f64; 3]],
    /// How likely each point is on wood, 0 to 1; none where that is not known.
    pub wood: Option<&'a [f32]>,
    /// Where the axis of the stem meets the ground, local frame, m.
    pub base_m: [f64; 3],
    /// Diameter at breast height by what found the stem, m, if it was seen: nothing above is much
    /// thicker. It is no part of the result.
    pub dbh_m: Option<f64>,
}

/// What a radius rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum RadiusSource {
    /// A fit to the points of the cylinder.
    Measured,
    /// Measured cylinders of the same branch.
    Interpolated,
    /// The pipe model: nothing could be measured on the branch.
    Inferred,
}

/// One cylinder of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelCylinder {
    /// Where it is and how thick.
    pub solid: Cylinder,
    /// Standard error of the radius, m; NaN where there is none.
    pub radius_sd_m: f64,
    /// What the radius rests on.
    pub source: RadiusSource,
    /// Part of the circumference that has points, 0 to 1.
    pub arc_coverage: f64,
    /// Number of points the fit rests on.
    pub points: u32,
    /// Place of the parent among the cylinders, before this one; none for the lowest.
    pub parent: Option<u32>,
    /// Place of its branch.
    pub branch: u32,
}

/// One branch: cylinders one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ModelBranch {
    /// Place of the branch it grows on, before this one; none for the stem.
    pub parent: Option<u32>,
    /// 0 for the stem, 1 for branches on the stem, and so on.
    pub order: u16,
    /// Its first cylinder; the others follow it.
    pub first: u32,
    /// Number of cylinders.
    pub len: u32,
}

/// The cylinders and branches of a tree.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Model {
    /// The cylinders, branch by branch, each after its parent.
    pub cylinders: Vec<ModelCylinder>,
    /// The branches, the stem first, each after its parent.
    pub branches: Vec<ModelBranch>,
}

impl Model {
    /// The cylinders of a branch.
    #[must_use]
    pub fn cylinders_of(&self, branch: &ModelBranch) -> &[ModelCylinder] {
        &self.cylinders[branch.first as usize..][..branch.len as usize]
    }

    /// The cylinders of the stem; none of an empty model.
    #[must_use]
    pub fn stem(&self) -> &[ModelCylinder] {
        self.branches.first().map_or(&[], |stem| self.cylinders_of(stem))
    }

    /// The bare cylinders.
    #[must_use]
    pub fn solids(&self) -> Vec<Cylinder> {
        self.cylinders.iter().map(|cylinder| cylinder.solid).collect()
    }
}

/// A modelled tree.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelledTree {
    /// Cylinders and branches.
    pub model: Model,
    /// What is read off them and the points.
    pub metrics: crate::metrics::Metrics,
    /// From every point to the nearest surface of the model.
    pub cloud_to_model: DistanceSummary,
    /// From the model's surface, as far as it could be seen, to the nearest point.
    pub model_to_cloud: DistanceSummary,
    /// Number of cylinders that no point belongs to.
    pub unseen_cylinders: usize,
    /// Standard deviation of the points across the surface of wood, m; none where nothing was fitted.
    pub noise_m: Option<f64>,
    /// Relation of radius and reach that the measured sections of this tree show.
    pub pipe: Option<crate::pipe::PipeModel>,
    /// Number of points that are not finite.
    pub not_finite: usize,
}

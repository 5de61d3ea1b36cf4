//! Cylinder models of the trees of a plot against the trees that are really there.

mod text;

use crate::Error;
use crate::branches::{Branch, BranchAccuracy, BranchParams, THICK_M, Volumes, assess_branches};
use crate::distances::{BothWays, CylinderModel, between_models, from_surface};
use crate::report::NamedErrors;
use crate::stats::ErrorStats;
use crate::stems::{Stem, StemAccuracy, assess_stems};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use timberline_solids::{Cylinder, Ends, free_ends};

/// A piece of wood: a cylinder of a tree model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// The cylinder.
    pub cylinder: Cylinder,
    /// Place of the piece it grows on in [`TreeModel::pieces`].
    pub parent: Option<u32>,
    /// Number of its branch, unique in the tree.
    pub branch: u32,
    /// 0 for the stem, 1 for branches on it, and so on.
    pub order: u16,
}

/// A tree, true or modelled.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeModel {
    /// Its stem. All stems are in one frame, which need not be that of the pieces.
    pub stem: Stem,
    /// Its wood, pieces of a branch one after the other. All trees are in one frame.
    pub pieces: Vec<Piece>,
    /// Its volumes, which may count twigs that are no pieces.
    pub volumes: Volumes,
}

/// How tree models are compared.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelParams {
    /// Largest distance in the plane at which two stems may be the same, m.
    pub max_distance_m: f64,
    /// Distance between samples of surfaces, m.
    pub spacing_m: f64,
    /// When branches are found, or false.
    pub branches: BranchParams,
}

impl Default for ModelParams {
    /// Stems within half a metre, samples every 2 cm.
    fn default() -> Self {
        Self { max_distance_m: 0.5, spacing_m: 0.02, branches: BranchParams::default() }
    }
}

/// True volumes and those of the model.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct VolumePair {
    /// What is really there.
    pub truth: Volumes,
    /// What the model has.
    pub model: Volumes,
}

impl VolumePair {
    fn add(&mut self, truth: &Volumes, model: &Volumes) {
        for (own, other) in [(&mut self.truth, truth), (&mut self.model, model)] {
            own.stem_m3 += other.stem_m3;
            own.thick_m3 += other.thick_m3;
            own.thin_m3 += other.thin_m3;
        }
    }

    /// Errors as shares of the true volumes: stem, thick, thin, total.
    #[must_use]
    pub fn relative_errors(&self) -> [f64; 4] {
        self.model.relative_errors(&self.truth)
    }
}

/// What is compared as one number a tree; not known is none.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Size {
    /// Its id.
    pub id: u64,
    /// Where it stands, m.
    pub at_m: [f64; 2],
    /// Diameter at breast height, m.
    pub dbh_m: Option<f64>,
    /// Height, m.
    pub height_m: Option<f64>,
}

impl From<&Stem> for Size {
    fn from(stem: &Stem) -> Self {
        let known = |value: f64| Some(value).filter(|value| value.is_finite());
        let (dbh_m, height_m) = (known(stem.dbh_m), known(stem.height_m));
        Self { id: stem.id, at_m: stem.at_m, dbh_m, height_m }
    }
}

/// How the model of one tree compares.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelAccuracy {
    /// The tree as it is.
    pub truth: Size,
    /// The tree as it was found.
    pub model: Size,
    /// Distance of the stems in the plane, m.
    pub position_m: f64,
    /// Volumes.
    pub volumes: VolumePair,
    /// Branches found and missing, real and false.
    pub branches: BranchAccuracy,
    /// Number of cylinders of the model.
    pub cylinders: usize,
    /// Distances from the model's surface to the true one (forth) and back.
    pub surfaces: BothWays,
    /// The same from the surfaces of wood of at least [`THICK_M`] of diameter (and all of the stem) to
    /// surfaces of any.
    pub thick_surfaces: BothWays,
}

/// How the models of a plot compare.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PlotAccuracy {
    /// Stems found, their diameters and heights.
    pub stems: StemAccuracy,
    /// Trees found, in the order of the true ones.
    pub trees: Vec<ModelAccuracy>,
    /// True trees without a model.
    pub missed: Vec<Size>,
    /// Models without a true tree.
    pub false_trees: Vec<Size>,
    /// Volumes of the trees found, summed.
    pub found_volumes: VolumePair,
    /// Volumes of all trees and of all models, summed.
    pub plot_volumes: VolumePair,
    /// Branches of the trees found, summed.
    pub branches: BranchAccuracy,
    /// Borders of the classes of branch diameters, m.
    pub classes_m: Vec<f64>,
    /// Distances over all trees found taken as one, as [`ModelAccuracy::surfaces`].
    pub surfaces: BothWays,
    /// As [`ModelAccuracy::thick_surfaces`], over all trees found taken as one.
    pub thick_surfaces: BothWays,
}

impl PlotAccuracy {
    /// Errors by tree in the units of foresters: positions, diameters, heights, volumes.
    #[must_use]
    pub fn errors(&self) -> Vec<NamedErrors> {
        let named = |name: &str, unit: &str, errors| NamedErrors {
            name: name.to_owned(),
            unit: unit.to_owned(),
            errors,
        };
        let percent = |class: usize| {
            let errors = self.trees.iter().map(|tree| tree.volumes.relative_errors()[class]);
            ErrorStats::of(errors.map(|share| 100.0 * share))
        };
        let dbh_cm = self.trees.iter().filter_map(|t| Some((t.model.dbh_m?, t.truth.dbh_m?)));
        let dbh_cm = ErrorStats::between(dbh_cm.map(|(a, b)| (100.0 * a, 100.0 * b)));
        vec![
            named("stem position", "m", self.stems.position_m),
            named("DBH", "cm", dbh_cm),
            named("tree height", "m", self.stems.height_m),
            named("stem volume", "%", percent(0)),
            named("branches from 5 cm", "%", percent(1)),
            named("branches below 5 cm", "%", percent(2)),
            named("whole volume", "%", percent(3)),
        ]
    }
}

impl ModelParams {
    /// Adds a class for branches thinner than any that the truth lists: what a model has of them may
    /// be real and counts as false all the same. Of a truth without branches nothing changes.
    #[must_use]
    pub fn with_class_below_truth(mut self, reference: &[TreeModel]) -> Self {
        let diameters_m = reference.iter().flat_map(branches).map(|branch| branch.diameter_m());
        let thinnest_m = diameters_m.fold(f64::INFINITY, f64::min);
        let classes_m = &mut self.branches.classes_m;
        if thinnest_m > 0.0 && thinnest_m < classes_m.first().copied().unwrap_or(f64::INFINITY) {
            classes_m.insert(0, thinnest_m);
        }
        self
    }
}

/// Matches the models of a plot with its trees by their stems and compares the partners.
///
/// # Errors
/// As [`assess_stems`], [`assess_branches`] and [`between_models`].
pub fn assess_models(
    reference: &[TreeModel],
    models: &[TreeModel],
    params: &ModelParams,
) -> Result<PlotAccuracy, Error> {
    let list = |trees: &[TreeModel]| trees.iter().map(|tree| tree.stem).collect::<Vec<_>>();
    let stems = assess_stems(&list(reference), &list(models), params.max_distance_m)?;
    let size = |trees: &[TreeModel], places: &[usize]| {
        places.iter().map(|place| Size::from(&trees[*place].stem)).collect()
    };
    let mut plot = PlotAccuracy {
        missed: size(reference, &stems.matching.missed),
        false_trees: size(models, &stems.matching.false_alarms),
        classes_m: params.branches.classes_m.clone(),
        ..PlotAccuracy::default()
    };
    let mut all = [Solid::default(), Solid::default()];
    for pair in &stems.matching.pairs {
        let (truth, model) = (&reference[pair.reference], &models[pair.detected]);
        let solids = [Solid::of(truth), Solid::of(model)];
        let tree = assess_model(truth, model, &solids, pair.distance_m, params)?;
        plot.found_volumes.add(&truth.volumes, &model.volumes);
        plot.branches.add(&tree.branches);
        plot.trees.push(tree);
        all.iter_mut().zip(solids).for_each(|(all, one)| all.add(one));
    }
    reference.iter().for_each(|tree| plot.plot_volumes.add(&tree.volumes, &Volumes::default()));
    models.iter().for_each(|tree| plot.plot_volumes.add(&Volumes::default(), &tree.volumes));
    (plot.surfaces, plot.thick_surfaces) = surfaces(&all, params.spacing_m)?;
    Ok(PlotAccuracy { stems, ..plot })
}

fn assess_model(
    truth: &TreeModel,
    model: &TreeModel,
    solids: &[Solid; 2],
    position_m: f64,
    params: &ModelParams,
) -> Result<ModelAccuracy, Error> {
    let (surfaces, thick_surfaces) = surfaces(solids, params.spacing_m)?;
    Ok(ModelAccuracy {
        truth: Size::from(&truth.stem),
        model: Size::from(&model.stem),
        position_m,
        volumes: VolumePair { truth: truth.volumes, model: model.volumes },
        branches: assess_branches(&branches(truth), &branches(model), &params.branches)?,
        cylinders: model.pieces.len(),
        surfaces,
        thick_surfaces,
    })
}

fn branches(tree: &TreeModel) -> Vec<Branch> {
    let mut branches: BTreeMap<u32, Branch> = BTreeMap::new();
    for piece in &tree.pieces {
        let branch = branches.entry(piece.branch).or_default();
        branch.order = piece.order;
        branch.cylinders.push(piece.cylinder);
    }
    branches.into_values().collect()
}

/// Cylinders with their free ends, and which of them are thick.
#[derive(Default)]
struct Solid {
    cylinders: Vec<Cylinder>,
    ends: Vec<Ends>,
    is_thick: Vec<bool>,
}

impl Solid {
    fn of(tree: &TreeModel) -> Self {
        let cylinders: Vec<Cylinder> = tree.pieces.iter().map(|piece| piece.cylinder).collect();
        let parents: Vec<Option<u32>> = tree.pieces.iter().map(|piece| piece.parent).collect();
        let is_thick = |piece: &Piece| piece.order == 0 || 2.0 * piece.cylinder.radius_m >= THICK_M;
        let ends = free_ends(&cylinders, &parents);
        Self { cylinders, ends, is_thick: tree.pieces.iter().map(is_thick).collect() }
    }

    fn add(&mut self, other: Self) {
        self.cylinders.extend(other.cylinders);
        self.ends.extend(other.ends);
        self.is_thick.extend(other.is_thick);
    }

    fn thick(&self) -> Self {
        let places = || (0..self.cylinders.len()).filter(|place| self.is_thick[*place]);
        Self {
            cylinders: places().map(|place| self.cylinders[place]).collect(),
            ends: places().map(|place| self.ends[place]).collect(),
            is_thick: places().map(|_| true).collect(),
        }
    }

    fn model(&self) -> CylinderModel<'_> {
        CylinderModel { cylinders: &self.cylinders, ends: &self.ends }
    }
}

/// Distances between truth and model, in this order given: from all surfaces, and from thick wood.
fn surfaces(solids: &[Solid; 2], spacing_m: f64) -> Result<(BothWays, BothWays), Error> {
    let [truth, model] = solids;
    let thick = BothWays {
        forth: from_surface(&model.thick().model(), &truth.model(), spacing_m)?,
        back: from_surface(&truth.thick().model(), &model.model(), spacing_m)?,
    };
    Ok((between_models(&model.model(), &truth.model(), spacing_m)?, thick))
}

#[cfg(test)]
mod tests;

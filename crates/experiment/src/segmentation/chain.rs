//! The airborne chain up to the trees, by the library functions of its stages.

use super::plot::Plot;
use crate::Error;
use rayon::prelude::*;
use serde::Serialize;
use timberline_artefact::tree_id;
use timberline_crowns::detection::{Candidate, Candidates};
use timberline_crowns::starsac::{CrownModel, Shape, fit_window};
use timberline_crowns::{CrownModelParams, DetectionParams, Top};
use timberline_pointcloud::Grid2;
use timberline_segmentation::{Crown, Marker, View};
use timberline_treetops::{Input, Treetop, find};

/// Parameters of the stages before the segmentation.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Chain {
    /// Of the candidates.
    pub treetops: timberline_treetops::Params,
    /// Of their crown models.
    pub crown_models: CrownModelParams,
    /// Of the choice among them.
    pub detection: DetectionParams,
}

/// Edge of the search grid's cells, m.
const GRID_CELL_M: f64 = 2.0;

/// A candidate with the crown model it is judged by.
#[derive(Debug, Clone, PartialEq)]
struct Modelled {
    /// Its point.
    index: u32,
    candidate: Candidate,
    crown: Crown,
}

impl Chain {
    /// The trees of a plot, sorted by id.
    ///
    /// # Errors
    /// What the stages refuse.
    pub fn markers(&self, plot: &Plot) -> Result<Vec<Marker>, Error> {
        let modelled = self.modelled(plot)?;
        let chosen = self.rivals(&modelled)?.trees(self.detection.min_score);
        let marker = |one: Modelled| {
            let place = chosen.binary_search_by_key(&one.crown.id, |(id, _)| *id).ok()?;
            let height_m = one.candidate.height_m;
            Some(Marker { crown: one.crown, height_m, score: chosen[place].1 })
        };
        Ok(modelled.into_iter().filter_map(marker).collect())
    }

    /// The candidates for trees of a plot, to be judged, sorted by id, and their points.
    ///
    /// # Errors
    /// What the stages refuse.
    pub fn candidates(&self, plot: &Plot) -> Result<(Candidates, Vec<u32>), Error> {
        let modelled = self.modelled(plot)?;
        let points = modelled.iter().map(|one| one.index).collect();
        Ok((self.rivals(&modelled)?, points))
    }

    fn rivals(&self, modelled: &[Modelled]) -> Result<Candidates, Error> {
        let all = modelled.iter().map(|one| one.candidate).collect();
        Ok(Candidates::new(all, self.detection.reach_m)?)
    }

    /// Every candidate with its crown model, sorted by id.
    fn modelled(&self, plot: &Plot) -> Result<Vec<Modelled>, Error> {
        let cloud = &plot.cloud;
        let tops = find(&Input::new(cloud, &plot.height_m), &self.treetops)?;
        let grid = Grid2::new(&cloud.x, &cloud.y, GRID_CELL_M)?;
        let mut all: Vec<Modelled> =
            tops.par_iter().map(|top| self.model(plot, &grid, top)).collect();
        all.sort_by_key(|one| one.candidate.id);
        Ok(all)
    }

    fn model(&self, plot: &Plot, grid: &Grid2, top: &Treetop) -> Modelled {
        let (cloud, params) = (&plot.cloud, &self.crown_models);
        let Treetop { index, world_m: apex_m, height_m, .. } = *top;
        let id = tree_id(apex_m[0], apex_m[1]);
        let (score, cover_m) = (top.score as f32, top.cover_m as f32);
        let top = Top { id, apex_m, height_m, score, cover_m };
        let outcome = fit_window(&top.window(cloud, &plot.height_m, grid, params), params, id);
        let blank = Crown {
            id,
            apex: cloud.local(index as usize),
            coefficients: [0.0; 2],
            radius_m: 0.0,
            tolerance_m: params.tolerance_m,
            oblique: true,
        };
        let crown = outcome.accepted().map_or(blank, |model| standing(model, blank));
        let candidate = Candidate {
            coefficients: crown.coefficients,
            radius_m: crown.radius_m,
            inliers: outcome.crown.as_ref().map_or(0, CrownModel::grade),
            outliers: outcome.crown.as_ref().map_or(0, |model| model.outliers),
            residual: outcome.crown.as_ref().map_or(0.0, |m| m.mean_residual_m / crown.tolerance_m),
            ..top.candidate()
        };
        Modelled { index, candidate, crown }
    }
}

fn standing(model: &CrownModel, blank: Crown) -> Crown {
    Crown {
        coefficients: [model.model.b1, model.model.b2],
        radius_m: model.radius_m,
        oblique: model.model.shape == Shape::TwoParameter,
        ..blank
    }
}

/// What a segmenter sees of a plot.
#[must_use]
pub fn view<'a>(plot: &'a Plot, markers: &'a [Marker]) -> View<'a> {
    let cloud = &plot.cloud;
    View {
        frame: cloud.frame,
        x: &cloud.x,
        y: &cloud.y,
        z: &cloud.z,
        height_m: &plot.height_m,
        is_first: &plot.is_first,
        markers,
    }
}

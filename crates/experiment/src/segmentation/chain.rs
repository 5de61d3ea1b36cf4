//! The airborne chain up to the trees, by the library functions of its stages.

use super::plot::Plot;
use crate::Error;
use rayon::prelude::*;
use serde::Serialize;
use timberline_artefact::tree_id;
use timberline_crowns::starsac::{CrownModel, Shape, fit_window};
use timberline_crowns::{CrownModelParams, Window};
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
}

/// Edge of the search grid's cells, m.
const GRID_CELL_M: f64 = 2.0;

impl Chain {
    /// The trees of a plot, sorted by id.
    ///
    /// # Errors
    /// What the stages refuse.
    pub fn markers(&self, plot: &Plot) -> Result<Vec<Marker>, Error> {
        let mut markers = detected(self.candidates(plot)?);
        markers.sort_by_key(|marker| marker.crown.id);
        Ok(markers)
    }

    /// Every candidate with its crown model; without one its radius is 0.
    fn candidates(&self, plot: &Plot) -> Result<Vec<Marker>, Error> {
        let cloud = &plot.cloud;
        let tops = find(&Input::new(cloud, &plot.height_m), &self.treetops)?;
        let grid = Grid2::new(&cloud.x, &cloud.y, GRID_CELL_M)?;
        Ok(tops.par_iter().map(|top| self.candidate(plot, &grid, top)).collect())
    }

    fn candidate(&self, plot: &Plot, grid: &Grid2, top: &Treetop) -> Marker {
        let (cloud, params) = (&plot.cloud, &self.crown_models);
        let id = tree_id(top.world_m[0], top.world_m[1]);
        let first_only = params.returns == timberline_crowns::params::Returns::First;
        let accept = |i: usize| {
            let wanted = !first_only || plot.is_first[i];
            wanted.then(|| f64::from(plot.height_m[i]) >= params.min_height_m)
        };
        let apex = cloud.local(top.index as usize);
        let half_width_m = params.half_width_m(top.height_m);
        let window =
            Window::gather([&cloud.x, &cloud.y, &cloud.z], grid, apex, half_width_m, accept);
        let outcome = fit_window(&window, params, id);
        let blank = Crown {
            id,
            apex,
            coefficients: [0.0; 2],
            radius_m: 0.0,
            tolerance_m: params.tolerance_m,
            oblique: true,
        };
        let crown = outcome.accepted().map_or(blank, |model| standing(model, blank));
        Marker { crown, height_m: top.height_m, score: 1.0 }
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

/// The trees among the candidates: those whose model stands.
fn detected(mut candidates: Vec<Marker>) -> Vec<Marker> {
    candidates.retain(|marker| marker.crown.radius_m > 0.0);
    candidates
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

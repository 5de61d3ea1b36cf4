//! The stages `crown-models`, `detection` and `crown-fit`: the only place here that reads and writes artefacts.

mod crown_fit;
mod crown_models;
mod detection;
mod position;

pub use crown_fit::CrownFitStage;
pub use crown_models::CrownModelStage;
pub use detection::DetectionStage;

use crate::Top;
use timberline_artefact::kinds::Treetop;

/// A treetop without its artefact.
fn top_of(top: &Treetop) -> Top {
    let Treetop { id, apex_m, height_m, score, cover_m, .. } = *top;
    Top { id, apex_m, height_m, score, cover_m }
}

/// Trees fitted between two looks at whether to stop.
const BATCH: usize = 256;

/// Edge of the search grid's cells, m: a window spans a few.
const GRID_CELL_M: f64 = 2.0;

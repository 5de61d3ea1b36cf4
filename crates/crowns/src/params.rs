//! Parameters of the two stages.

mod crown_fit;
mod crown_models;

pub use crown_fit::{BoundsRule, CrownFitParams, FitMethod, PriorRule, SolverChoice};
pub use crown_models::{CrownModelParams, Method, OutlierScope, RadiusRule, Returns, ShapeChoice};

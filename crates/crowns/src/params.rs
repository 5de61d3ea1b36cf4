//! Parameters of the stages.

mod crown_fit;
mod crown_models;
mod detection;

pub use crown_fit::{BoundsRule, CrownFitParams, FitMethod, PriorRule, SolverChoice};
pub use crown_models::{CrownModelParams, Method, OutlierScope, RadiusRule, Returns, ShapeChoice};
pub use detection::DetectionParams;

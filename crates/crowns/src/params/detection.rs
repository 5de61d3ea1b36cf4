//! Parameters of the stage `detection`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Parameters of the stage `detection`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DetectionParams {
    /// Candidates less sure to be trees are left out: the one threshold between more trees and fewer
    /// false ones.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "1", "x-source" = "this program; set on simulated stands, no command varies it"))]
    pub min_score: f64,
    /// How far apart candidates can be rivals.
    #[schemars(range(min = 1.0, max = 60.0), extend("x-unit" = "m", "x-source" = "this program; the model behind the score was found with it"))]
    pub reach_m: f64,
}

impl Default for DetectionParams {
    fn default() -> Self {
        Self { min_score: 0.45, reach_m: 10.0 }
    }
}

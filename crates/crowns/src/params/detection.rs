//! Parameters of the stage `detection`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Parameters of the stage `detection`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DetectionParams {
    /// Trees with a lower score are left out.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "1", "x-source" = "this program"))]
    pub min_score: f64,
}

impl Default for DetectionParams {
    fn default() -> Self {
        Self { min_score: 0.5 }
    }
}

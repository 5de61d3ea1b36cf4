//! Parameters of the stage `tree-labels`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the points of a terrestrial scan are given their trees: by the space that the stage `stems`
/// found for each, or by a program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TreeLabelsParams {
    /// A program that takes the place of the built-in way: its words, as in `[segmentation]`; empty
    /// for none. See pipelines/hooks/README.md.
    pub command: Vec<String>,
    /// For `command`: its version. Change it whenever its answer could change for a reason that is not
    /// in the files named in `command`, whose contents count anyway.
    pub command_version: String,
    /// For `command`: surroundings of a tile that it is given besides, at least the largest crown radius.
    #[schemars(range(min = 0.0, max = 200.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub command_halo_m: f64,
    /// For `command`: points further from the stem's base in the plane get no tree.
    #[schemars(range(min = 1.0, max = 60.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub reach_m: f64,
    /// For `command`: it is killed when it has not ended after this time.
    #[schemars(range(min = 1, max = 604_800), extend("x-unit" = "s", "x-source" = "this program", "x-limit" = true))]
    pub command_time_limit_s: u32,
    /// For `command`: it is killed when it and all it started hold more memory.
    #[schemars(range(min = 10, max = 1_000_000), extend("x-unit" = "MB", "x-source" = "this program", "x-limit" = true))]
    pub command_memory_limit_mb: u32,
}

impl Default for TreeLabelsParams {
    fn default() -> Self {
        Self {
            command: Vec::new(),
            command_version: String::new(),
            command_halo_m: 15.0,
            reach_m: 20.0,
            command_time_limit_s: 600,
            command_memory_limit_mb: 2000,
        }
    }
}

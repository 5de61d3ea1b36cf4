//! What consolidation (weighted locally optimal projection, Huang et al. 2009) does to tree models.
//!
//! Every tree is modelled as AdTree does it and as this program does by default, each along a
//! skeleton from the points as scanned, from points consolidated in the paper's mode, and from points
//! consolidated by default. Distances are always those of the points as scanned; in default mode radii
//! rest on these, too.

mod assess;
mod summary;
pub mod text;

pub use assess::assess;
pub use summary::{Change, changes};

use serde::Serialize;
use timberline_solids::DistanceSummary;

/// One tree as scanned.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Name for the tables.
    pub name: String,
    /// Points, local frame, m.
    pub points_m: Vec<[f64; 3]>,
    /// How likely each point is on wood, 0 to 1, where that is known.
    pub wood: Option<Vec<f32>>,
    /// Where the stem's axis meets the ground, local frame, m.
    pub base_m: [f64; 3],
    /// Diameter at breast height by what found the stem, m, if it was seen.
    pub dbh_m: Option<f64>,
}

/// How a tree is modelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// Skeleton and radii as AdTree makes them (Du et al. 2019).
    Adtree,
    /// This program's default.
    Default,
}

impl Mode {
    /// All, in the sequence of the tables.
    pub const ALL: [Self; 2] = [Self::Adtree, Self::Default];

    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Adtree => "adtree",
            Self::Default => "default",
        }
    }
}

/// The points under the skeleton.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// As scanned.
    Scanned,
    /// Consolidated in the paper's mode: one radius for the stem and one for the rest, half of the points.
    Paper,
    /// Consolidated by default.
    Default,
    /// What the stage `cylinders` keeps of the models from the points as scanned and consolidated by
    /// default.
    Kept,
}

impl Source {
    /// All, in the sequence of the tables.
    pub const ALL: [Self; 4] = [Self::Scanned, Self::Paper, Self::Default, Self::Kept];

    /// Name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Scanned => "scanned",
            Self::Paper => "paper",
            Self::Default => "consolidated",
            Self::Kept => "kept",
        }
    }
}

/// What a model is like.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Figures {
    /// From every point as scanned to the nearest surface of the model.
    pub cloud_to_model: DistanceSummary,
    /// From the model's surface, as far as it could be seen, to the nearest point as scanned.
    pub model_to_cloud: DistanceSummary,
    /// Diameter at breast height, m.
    pub dbh_m: Option<f64>,
    /// Number of branches.
    pub branches: usize,
    /// Number of cylinders.
    pub cylinders: usize,
}

/// One model of one tree.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// How it was made.
    pub mode: Mode,
    /// From which points.
    pub source: Source,
    /// What came of it, if anything did.
    pub figures: Option<Figures>,
    /// Why nothing did, or what was kept and why.
    pub remark: String,
}

/// What consolidation did to the points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Thinned {
    /// Points after.
    pub points: usize,
    /// Median thickness of the cloud across its surface before, m.
    pub thickness_before_m: f64,
    /// The same after, m.
    pub thickness_after_m: f64,
}

/// One tree with all its models.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Assessed {
    /// Name for the tables.
    pub name: String,
    /// Points as scanned.
    pub points: usize,
    /// By the paper's mode and by default; none where it was skipped before that was known.
    pub thinned: [Option<Thinned>; 2],
    /// Models, by mode and source.
    pub rows: Vec<Row>,
}

impl Assessed {
    /// The figures of a model, if it was made.
    #[must_use]
    pub fn figures(&self, mode: Mode, source: Source) -> Option<&Figures> {
        let row = self.rows.iter().find(|row| (row.mode, row.source) == (mode, source))?;
        row.figures.as_ref()
    }
}

#[cfg(test)]
mod tests;

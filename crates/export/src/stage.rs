//! The stage `export`: a whole campaign to the files that people take away.
//!
//! Tiles are read one after the other and twice: once for rasters, tables and what the header of the
//! point file must know beforehand, once for the points. Memory holds one tile, a window of a raster
//! and indices; everything else waits in scratch files.

mod points;
mod rasters;
mod survey;
mod tables;
mod tree_models;
mod tree_tables;

pub use tree_models::{Params as TreeModelsParams, TreeModelsStage};
pub use tree_tables::{Params as TreeTablesParams, TreeTablesStage};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use survey::Survey;
use timberline_artefact::kinds::{
    GroundModel, GroundPoints, Heights, Labels, Outputs, PointTile, Trees,
};
use timberline_artefact::stage::{Context, InputSpec, Inputs, Stage, StageError, StageInfo};
use timberline_artefact::{Facts, Kind, OutputFolder, UnitKind};
use timberline_pointcloud::order::morton;
use timberline_pointcloud::{TileGrid, TileId};

/// Parameters of the stage `export`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Write `trees.csv`, its dictionary and `trees.gpkg`.
    pub write_tables: bool,
    /// Write `dtm.tif` and `chm.tif`.
    pub write_rasters: bool,
    /// Write `points.laz`.
    pub write_points: bool,
    /// Edge of a cell of the canopy height model; doubled where points are too few, see
    /// `chm_points_a_cell`.
    #[schemars(range(min = 0.05, max = 20.0), extend("x-unit" = "m"))]
    pub chm_cell_m: f64,
    /// The edge of a cell is doubled until there are so many points a cell on average. 0 keeps
    /// `chm_cell_m` whatever the density.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub chm_points_a_cell: f64,
    /// How far a cell of the canopy height model without points looks for cells with points, of which
    /// it takes the mean weighted by the inverse squared distance, if they lie in at least three of
    /// the quadrants around it. 0 leaves all gaps open.
    #[schemars(range(min = 0, max = 20), extend("x-unit" = "cell"))]
    pub chm_fill_cells: u32,
    /// Widest gap in the points across which the terrain is drawn; wider ones and the surroundings
    /// of the survey stay empty.
    #[schemars(
        range(min = 0.0, max = 500.0),
        extend("x-unit" = "m", "x-source" = "morphological closing, Serra 1982")
    )]
    pub dtm_gap_m: f64,
    /// Smallest step of a coordinate in `points.laz`, in the units of the CRS.
    #[schemars(range(min = 0.0001, max = 0.1), extend("x-unit" = "CRS unit"))]
    pub las_scale: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            write_tables: true,
            write_rasters: true,
            write_points: true,
            chm_cell_m: 0.5,
            chm_points_a_cell: 0.5,
            chm_fill_cells: 2,
            dtm_gap_m: 30.0,
            las_scale: 0.001,
        }
    }
}

impl timberline_artefact::stage::Params for Params {
    fn check(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        if self.dtm_gap_m / self.chm_cell_m > 2000.0 {
            wrong.push(format!(
                "dtm_gap_m = {} is more than 2000 cells of chm_cell_m = {}",
                self.dtm_gap_m, self.chm_cell_m
            ));
        }
        wrong
    }
}

/// Outputs as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct ExportStage;

const NAME: &str = "export";

const INPUTS: &[InputSpec] = &[
    InputSpec::all(PointTile::NAME),
    InputSpec::all(GroundPoints::NAME),
    InputSpec::all(GroundModel::NAME),
    InputSpec::all(Heights::NAME),
    InputSpec::all(Labels::NAME),
    InputSpec::all(Trees::NAME),
];

impl Stage for ExportStage {
    type Params = Params;

    fn info() -> StageInfo {
        StageInfo {
            name: NAME,
            version: 4,
            summary: "tables, GIS layers, rasters and classified points of the whole campaign",
            unit: UnitKind::Campaign,
            inputs: INPUTS,
            outputs: &[Outputs::NAME],
        }
    }

    /// One tile of points is held, however many the campaign has.
    fn memory_bytes(_params: &Params, points: u64) -> u64 {
        const LARGEST_TILE: u64 = 1_000_000;
        const BYTES_PER_POINT: u64 = 400;
        const BUFFERS: u64 = 200 << 20;
        BUFFERS + points.min(LARGEST_TILE) * BYTES_PER_POINT
    }

    fn run(params: &Params, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let mut folder = OutputFolder::open(context.outputs_folder(), NAME)?;
        let tiles = tiles_along_the_curve(inputs)?;
        let mut survey = Survey::of(&tiles, params, inputs, context, folder.scratch())?;
        if params.write_tables {
            tables::write(&survey, context, &mut folder)?;
        }
        if params.write_rasters {
            rasters::write(&mut survey, params, context, &mut folder)?;
        }
        if params.write_points {
            points::write(&survey, &tiles, params, inputs, context, &mut folder)?;
        }
        let (facts, totals) = (survey.facts(), survey.totals());
        drop(survey);
        let files = folder.publish(is_ours)?;
        context.emit(&Outputs { files, totals }, facts)?;
        Ok(())
    }
}

/// Whether a file in the outputs folder is this stage's.
fn is_ours(name: &str) -> bool {
    let fixed = ["trees.csv", "trees.dictionary.csv", "trees.gpkg", "points.laz"];
    let is_raster = ["dtm", "chm"].iter().any(|stem| {
        let rest = name.strip_prefix(stem).unwrap_or_default();
        let site = rest.strip_prefix('-').and_then(|rest| rest.strip_suffix(".tif"));
        let numbered = site.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
        rest == ".tif" || rest == ".vrt" || numbered
    });
    fixed.contains(&name) || is_raster
}

/// The tiles in the order of the space-filling curve: where tiles have edges of a power of two and
/// aligned corners, their points one after the other are then in canonical order.
fn tiles_along_the_curve(inputs: &Inputs) -> Result<Vec<TileId>, StageError> {
    let mut tiles = inputs.tiles_of(PointTile::NAME);
    if let Some(first) = tiles.first() {
        let path = inputs.tile_path(PointTile::NAME, *first)?;
        let grid: TileGrid = timberline_artefact::read_header(path)?
            .facts
            .grid
            .ok_or("points without a tile grid")?;
        tiles.sort_by_key(|tile| {
            let [x, y] = grid.rect(*tile).min;
            (morton(x, y), *tile)
        });
    }
    Ok(tiles)
}

/// Facts of the whole campaign.
fn facts_of(survey: &Survey) -> Facts {
    Facts {
        crs: survey.crs.clone(),
        bounds: survey.bounds(),
        grid: survey.grid,
        ..Facts::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_files_are_known_by_name() {
        for name in ["dtm.tif", "chm.vrt", "dtm-12.tif", "trees.gpkg", "points.laz"] {
            assert!(is_ours(name), "{name}");
        }
        for name in ["map.png", "dtm-old.tif", "dtm-.tif", "dtm-1.tif.aux.xml", "my-dtm.tif", ""] {
            assert!(!is_ours(name), "{name}");
        }
    }
}

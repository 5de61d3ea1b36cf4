//! The stages `ground` (a tile's points to its ground points) and `dtm` (ground points to the terrain
//! model and heights above ground).

use crate::classify::{Label, classify};
use crate::coverage::covered;
use crate::nodes::Cell;
use crate::patch::Patch;
use crate::{DtmParams, GroundParams, Hardy, Nodes, Surface};
use timberline_artefact::kinds::{GroundModel, GroundPoints, HardyPatch, Heights, PointTile};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Aligned, Kind, Raster, Surroundings, UnitKind, gather};

/// Ground classification as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct GroundStage;

/// Terrain model and heights as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct DtmStage;

const GROUND_INPUTS: &[InputSpec] = &[InputSpec::halo(PointTile::NAME)];
const DTM_INPUTS: &[InputSpec] =
    &[InputSpec::halo(PointTile::NAME), InputSpec::halo(GroundPoints::NAME)];

impl Params for GroundParams {}
impl Params for DtmParams {}

impl Stage for GroundStage {
    type Params = GroundParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "ground",
            version: 1,
            summary: "ground points: supplied classes, or TIN densification (Axelsson 2000)",
            unit: UnitKind::Tile,
            inputs: GROUND_INPUTS,
            outputs: &[GroundPoints::NAME],
        }
    }

    fn halo_m(params: &GroundParams) -> f64 {
        params.block_m + params.buffer_m
    }

    fn run(
        params: &GroundParams,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let all = gather(inputs, Self::halo_m(params), &[])?;
        context.check_cancelled()?;
        let labels = all.own_values(&classify(&all.cloud, all.tile_rect, params)?);
        let ground: Vec<u32> =
            (0..labels.len() as u32).filter(|&i| labels[i as usize] != Label::Other).collect();
        let supplied = labels.iter().filter(|label| **label == Label::Supplied).count();
        let facts = all
            .located
            .clone()
            .count("points", all.own_len)
            .count("ground", ground.len())
            .count("ground-supplied", supplied);
        context.advance(all.own_len as u64);
        context.emit(&GroundPoints { ground, supplied: supplied as u64 }, facts)?;
        Ok(())
    }
}

impl Stage for DtmStage {
    type Params = DtmParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "dtm",
            version: 1,
            summary: "terrain by blended multiquadric patches (Hardy 1971) and heights above it",
            unit: UnitKind::Tile,
            inputs: DTM_INPUTS,
            outputs: &[GroundModel::NAME, Heights::NAME],
        }
    }

    fn halo_m(params: &DtmParams) -> f64 {
        params.reach_m()
    }

    fn run(params: &DtmParams, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let all = gather(inputs, Self::halo_m(params), &[Aligned::Ground])?;
        context.check_cancelled()?;
        let ground = (0..all.cloud.len()).filter(|&i| all.is_ground[i]).map(|i| all.cloud.world(i));
        let nodes = Nodes::new(ground, params.merge_m);
        let surface = Surface::build(&nodes, all.tile_rect, params)?;
        let heights = heights(&all, &surface);
        let raster = raster(&all, params, &surface);
        let patches = surface.patches().iter().map(wire).collect();
        let facts = all.located.clone().count("points", all.own_len).count("nodes", nodes.len());
        context.advance(all.own_len as u64);
        context.emit(&GroundModel { raster, patches }, facts.clone())?;
        context.emit(&Heights { height_m: heights }, facts)?;
        Ok(())
    }
}

/// Heights of the tile's own points, in the tile's order.
fn heights(all: &Surroundings, surface: &Surface) -> Vec<f32> {
    let mut heights = vec![f32::NAN; all.own_len];
    for (index, own) in all.own.iter().enumerate() {
        if let Some(own) = own {
            let [x, y, z] = all.cloud.world(index);
            heights[*own as usize] = (z - surface.at([x, y])) as f32;
        }
    }
    heights
}

/// Elevations at the centres of the tile's cells that lie near enough to a point.
fn raster(all: &Surroundings, params: &DtmParams, surface: &Surface) -> Raster {
    let mut raster = Raster::covering(&all.tile_rect, params.cell_m);
    let first = [raster.column0, raster.row0];
    let size = [raster.columns as usize, raster.rows as usize];
    let world = (0..all.cloud.len()).map(|i| all.cloud.world(i));
    let covered = covered(world, first, size, params.cell_m, params.rim_m);
    for row in 0..raster.rows {
        for column in 0..raster.columns {
            let index = raster.index(column, row);
            if covered[index] {
                raster.values[index] = surface.at(raster.centre(column, row));
            }
        }
    }
    raster
}

/// A patch as it is stored.
fn wire(patch: &Patch) -> HardyPatch {
    let surface = &patch.surface;
    HardyPatch {
        centre_m: patch.cell.centre(),
        edge_m: patch.cell.edge_m(),
        datum_m: patch.datum_m,
        offset_squared_m2: surface.offset_squared_m2,
        trend: surface.trend,
        nodes_m: surface.x.iter().zip(&surface.y).map(|(x, y)| [*x, *y]).collect(),
        coefficients: surface.coefficients.clone(),
    }
}

/// The surface of a stored model, for positions in a world rectangle.
#[must_use]
pub fn surface_of(model: &GroundModel, rect: timberline_pointcloud::Rect) -> Surface {
    let patches = model.patches.iter().map(|stored| {
        let log2_edge = libm::log2(stored.edge_m).round() as i32;
        Patch {
            cell: Cell::at(log2_edge, stored.centre_m),
            datum_m: stored.datum_m,
            surface: Hardy {
                x: stored.nodes_m.iter().map(|node| node[0]).collect(),
                y: stored.nodes_m.iter().map(|node| node[1]).collect(),
                coefficients: stored.coefficients.clone(),
                trend: stored.trend,
                offset_squared_m2: stored.offset_squared_m2,
            },
        }
    });
    Surface::from_patches(patches.collect(), rect)
}

//! The stages `ground` (a tile's points to its ground points) and `dtm` (ground points to the terrain
//! model and heights above ground).

use crate::classify::{Label, classify, region_of};
use crate::nodes::Cell;
use crate::patch::Patch;
use crate::{DtmParams, GroundParams, Hardy, Nodes, Surface};
use timberline_artefact::kinds::{GroundModel, GroundPoints, HardyPatch, Heights, PointTile};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Aligned, Kind, Raster, Surroundings, UnitKind, gather, read_header};
use timberline_pointcloud::{Rect, closing};

/// Ground classification as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct GroundStage;

/// Terrain model and heights as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct DtmStage;

const GROUND_INPUTS: &[InputSpec] = &[InputSpec::halo(PointTile::NAME)];
const DTM_INPUTS: &[InputSpec] =
    &[InputSpec::halo(PointTile::NAME), InputSpec::halo(GroundPoints::NAME)];

impl Params for GroundParams {
    fn check(&self) -> Vec<String> {
        Self::check(self)
    }
}

impl Params for DtmParams {
    fn check(&self) -> Vec<String> {
        Self::check(self)
    }
}

impl Stage for GroundStage {
    type Params = GroundParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "ground",
            version: 3,
            summary: "ground points: supplied classes, or TIN densification (Axelsson 2000)",
            unit: UnitKind::Tile,
            inputs: GROUND_INPUTS,
            outputs: &[GroundPoints::NAME],
        }
    }

    fn halo_m(params: &GroundParams) -> f64 {
        params.reach_m()
    }

    fn run(
        params: &GroundParams,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let all = gather(inputs, reach_m(inputs, params)?, &[])?;
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
        if ground.is_empty() && all.own_len > 0 {
            context.warn(format!("tile {}", all.tile), "no ground point found");
        }
        context.advance(all.own_len as u64);
        context.emit(&GroundPoints { ground, supplied: supplied as u64 }, facts)?;
        Ok(())
    }
}

/// How far beyond the unit's tile the points that decide about it lie: not more than the buffer where
/// the tile consists of whole blocks.
fn reach_m(inputs: &Inputs, params: &GroundParams) -> Result<f64, timberline_artefact::Error> {
    let (header, tile) = (read_header(inputs.own_path(PointTile::NAME)?)?, inputs.tile()?);
    let Some(grid) = header.facts.grid else { return Ok(params.reach_m()) };
    let rect = grid.rect(tile);
    let region = region_of(rect, params);
    let beyond = |a: usize| (rect.min[a] - region.min[a]).max(region.max[a] - rect.max[a]);
    Ok(beyond(0).max(beyond(1)).min(params.reach_m()))
}

impl Stage for DtmStage {
    type Params = DtmParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "dtm",
            version: 4,
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
    let own: Vec<(usize, u32)> =
        all.own.iter().enumerate().filter_map(|(i, own)| own.map(|own| (i, own))).collect();
    let world: Vec<[f64; 3]> = own.iter().map(|(i, _)| all.cloud.world(*i)).collect();
    let mut heights = vec![f32::NAN; all.own_len];
    for ((_, own), height) in own.iter().zip(surface.heights(&world)) {
        heights[*own as usize] = height as f32;
    }
    heights
}

/// Elevations at the centres of the tile's cells with points and in the gaps between them.
fn raster(all: &Surroundings, params: &DtmParams, surface: &Surface) -> Raster {
    let mut raster = Raster::covering(&all.tile_rect, params.cell_m);
    let window = raster.window();
    let around = window.grown(2 * params.gap_cells());
    let mut occupied = vec![false; around.len()];
    for i in 0..all.cloud.len() {
        let [x, y, _] = all.cloud.world(i);
        let [column, row] = [x, y].map(|value| (value / params.cell_m).floor() as i64);
        if around.contains(column, row) {
            occupied[around.index(column, row)] = true;
        }
    }
    let shown = closing::closed(&occupied, window, params.gap_cells());
    let places: Vec<usize> = (0..raster.values.len()).filter(|i| shown[*i]).collect();
    let columns = raster.columns.max(1);
    let centre = |&i: &usize| raster.centre(i as u32 % columns, i as u32 / columns);
    let centres: Vec<[f64; 2]> = places.iter().map(centre).collect();
    for (index, elevation) in places.into_iter().zip(surface.elevations(&centres)) {
        raster.values[index] = elevation;
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

/// The surface of a stored model, for positions in a world rectangle within its tile;
/// `max_distance_m` as in the parameters that made it.
#[must_use]
pub fn surface_of(model: &GroundModel, rect: Rect, max_distance_m: f64) -> Surface {
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
    Surface::from_patches(patches.collect(), rect, max_distance_m)
}

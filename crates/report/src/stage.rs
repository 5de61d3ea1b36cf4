//! The stage `map`: a map of every site of a campaign.
//!
//! Tiles are read one after the other, twice: to find the sites, and to draw. Memory holds one tile
//! and the rasters of one map, whose number of cells is bounded.

mod plot_map;
mod tree_pictures;

pub use plot_map::{Params as PlotMapParams, PlotMapStage};
pub use tree_pictures::{
    ColourBy, Params as TreePicturesParams, TreePicturesStage, tree_picture, wood_of_points,
};

use crate::figure::LONGEST_PX;
use crate::map::{MapContents, MapTree, draw};
use crate::text::grouped;
use crate::{Canvas, Grid};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use timberline_artefact::kinds::{GroundModel, Heights, Outputs, PointTile, Trees};
use timberline_artefact::stage::{Context, InputSpec, Inputs, Stage, StageError, StageInfo};
use timberline_artefact::{Crs, Facts, Kind, OutputFolder, UnitKind};
use timberline_pointcloud::sites::file_name;
use timberline_pointcloud::{Bounds3, Footprint, Rect, TileId, Window, closing, gridding};

/// Parameters of the stage `map`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Edge of a cell of the canopy on the map; doubled until there are 1.5 points a cell on
    /// average and the map is not too large.
    #[schemars(range(min = 0.05, max = 20.0), extend("x-unit" = "m"))]
    pub cell_m: f64,
    /// Widest gap in the points across which the terrain is drawn.
    #[schemars(
        range(min = 0.0, max = 500.0),
        extend("x-unit" = "m", "x-source" = "morphological closing, Serra 1982")
    )]
    pub gap_m: f64,
    /// Draw the crown outlines.
    pub crowns: bool,
}

impl Default for Params {
    fn default() -> Self {
        Self { cell_m: 0.25, gap_m: 30.0, crowns: true }
    }
}

impl timberline_artefact::stage::Params for Params {}

/// Maps as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct MapStage;

const NAME: &str = "map";

/// Points that a cell of the canopy should have on average.
const POINTS_A_CELL: f64 = 1.5;
/// Cells around an empty one that are looked at to fill it.
const FILL_CELLS: u32 = 2;

const INPUTS: &[InputSpec] = &[
    InputSpec::all(PointTile::NAME),
    InputSpec::all(Heights::NAME),
    InputSpec::all(GroundModel::NAME),
    InputSpec::all(Trees::NAME),
];

impl Stage for MapStage {
    type Params = Params;

    fn info() -> StageInfo {
        StageInfo {
            name: NAME,
            version: 1,
            summary: "map of every site: shaded relief (Mark 1992), canopy, treetops, crowns",
            unit: UnitKind::Campaign,
            inputs: INPUTS,
            outputs: &[Outputs::NAME],
        }
    }

    /// One tile of points and the rasters of one map.
    fn memory_bytes(_params: &Params, points: u64) -> u64 {
        const LARGEST_TILE: u64 = 1_000_000;
        const BYTES_PER_POINT: u64 = 300;
        const MAP: u64 = 300 << 20;
        MAP + points.min(LARGEST_TILE) * BYTES_PER_POINT
    }

    fn run(params: &Params, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let mut folder = OutputFolder::open(context.outputs_folder(), NAME)?;
        let survey = Survey::of(inputs, context)?;
        let sites = survey.footprint.sites();
        for (number, extent) in sites.iter().enumerate() {
            let site = Site { number, of: sites.len(), extent: *extent };
            let canvas = draw_site(&site, &survey, params, inputs, context)?;
            canvas.write_png(&folder.file(&file_name(NAME, "png", number, sites.len())))?;
        }
        let files = folder.publish(is_ours)?;
        let totals = BTreeMap::from([("sites".to_owned(), sites.len() as u64)]);
        context.emit(&Outputs { files, totals }, survey.facts())?;
        Ok(())
    }
}

/// Whether a file in the outputs folder is this stage's.
fn is_ours(name: &str) -> bool {
    let site = name.strip_prefix("map-").and_then(|rest| rest.strip_suffix(".png"));
    let numbered = site.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    name == "map.png" || numbered
}

/// What the first reading finds.
struct Survey {
    footprint: Footprint,
    tiles: Vec<TileFacts>,
    located: Facts,
}

struct TileFacts {
    tile: TileId,
    bounds: Bounds3,
    points: u64,
    /// Square metres of the world's lattice of whole metres that hold points.
    occupied_m2: u64,
}

impl Survey {
    fn of(inputs: &Inputs, context: &Context<'_>) -> Result<Self, StageError> {
        let mut survey =
            Self { footprint: Footprint::new(), tiles: Vec::new(), located: Facts::default() };
        for tile in inputs.tiles_of(PointTile::NAME) {
            context.check_cancelled()?;
            let path = inputs.tile_path(PointTile::NAME, tile)?;
            let (header, PointTile { cloud }) = timberline_artefact::read::<PointTile>(path)?;
            survey.located.crs = survey.located.crs.take().or(header.facts.crs);
            survey.located.grid = survey.located.grid.or(header.facts.grid);
            let mut bounds = Bounds3::EMPTY;
            let mut squares = Vec::with_capacity(cloud.len());
            for index in 0..cloud.len() {
                let world = cloud.world(index);
                bounds.include(world);
                survey.footprint.include(world[0], world[1]);
                squares.push([world[0].floor() as i64, world[1].floor() as i64]);
            }
            squares.sort_unstable();
            squares.dedup();
            let (points, occupied_m2) = (cloud.len() as u64, squares.len() as u64);
            survey.tiles.push(TileFacts { tile, bounds, points, occupied_m2 });
        }
        Ok(survey)
    }

    fn facts(&self) -> Facts {
        let bounds = self.tiles.iter().map(|tile| tile.bounds).reduce(|a, b| a.union(&b));
        Facts { bounds: bounds.filter(|bounds| !bounds.is_empty()), ..self.located.clone() }
    }

    /// The tiles with points in a rectangle.
    fn tiles_in(&self, rect: &Rect) -> impl Iterator<Item = &TileFacts> {
        let rect = *rect;
        self.tiles.iter().filter(move |tile| tile.bounds.rect().touches(&rect))
    }

    /// Points in a rectangle's tiles.
    fn points(&self, rect: &Rect) -> u64 {
        self.tiles_in(rect).map(|tile| tile.points).sum()
    }

    /// Points in a square metre that has any.
    fn density(&self, rect: &Rect) -> f64 {
        let occupied: u64 = self.tiles_in(rect).map(|tile| tile.occupied_m2).sum();
        self.points(rect) as f64 / (occupied as f64).max(1.0)
    }
}

struct Site {
    number: usize,
    of: usize,
    extent: Rect,
}

fn draw_site(
    site: &Site,
    survey: &Survey,
    params: &Params,
    inputs: &Inputs,
    context: &Context<'_>,
) -> Result<Canvas, StageError> {
    let [width, height] = site.extent.size();
    let density = survey.density(&site.extent);
    let mut cell_m = params.cell_m;
    while cell_m * cell_m * density < POINTS_A_CELL || width.max(height) / cell_m > LONGEST_PX {
        cell_m *= 2.0;
    }
    let mut layers = Layers::new(site, cell_m);
    for tile in survey.tiles_in(&site.extent) {
        context.check_cancelled()?;
        layers.add_tile(tile.tile, inputs, params)?;
        context.advance(tile.points);
    }
    let occupied = layers.mask(params.gap_m);
    layers.fill();
    let crs = survey.located.crs.clone().unwrap_or_default();
    let name = &context.campaign().name;
    let name = if name.is_empty() { "Trees and canopy" } else { name };
    let title = match site.of {
        1 => name.to_owned(),
        of => format!("{name}, site {} of {of}", site.number + 1),
    };
    let hectares = occupied as f64 * cell_m * cell_m / 10_000.0;
    Ok(draw(&MapContents {
        title: &title,
        subtitle: &layers.subtitle(hectares, survey.points(&site.extent), &crs),
        extent: site.extent,
        crs: &crs,
        terrain: layers.terrain.as_ref().unwrap_or(&Grid::empty(layers.canopy.window, cell_m)),
        canopy: &layers.canopy,
        trees: &layers.trees,
    })?)
}

/// What the map of a site is made of.
struct Layers {
    extent: Rect,
    canopy: Grid,
    terrain: Option<Grid>,
    trees: Vec<MapTree>,
    tallest_m: f64,
}

impl Layers {
    fn new(site: &Site, cell_m: f64) -> Self {
        Self {
            extent: site.extent,
            canopy: Grid::empty(Window::touching(&site.extent, cell_m), cell_m),
            terrain: None,
            trees: Vec::new(),
            tallest_m: 0.0,
        }
    }

    fn add_tile(
        &mut self,
        tile: TileId,
        inputs: &Inputs,
        params: &Params,
    ) -> Result<(), StageError> {
        let PointTile { cloud } = inputs.of_tile::<PointTile>(tile)?;
        let Heights { height_m } = inputs.of_tile::<Heights>(tile)?;
        let (window, values) = gridding::highest(&cloud, &height_m, self.canopy.cell_m);
        self.canopy.raise(window, &values);
        self.add_terrain(&Grid::from(&inputs.of_tile::<GroundModel>(tile)?.raster));
        // Where a stage failed on the way to the trees, the rest is drawn all the same.
        if inputs.tile_path(Trees::NAME, tile).is_err() {
            return Ok(());
        }
        let Trees { trees } = inputs.of_tile::<Trees>(tile)?;
        for tree in trees {
            self.tallest_m = self.tallest_m.max(tree.height_m);
            let crown_m = if params.crowns { tree.crown_m } else { Vec::new() };
            self.trees.push(MapTree { top_m: [tree.apex_m[0], tree.apex_m[1]], crown_m });
        }
        Ok(())
    }

    /// Takes every so manieth cell of the terrain, so that the map's has about as many cells as its
    /// canopy: cells are picked, not averaged, so that it does not matter how tiles cut them.
    fn add_terrain(&mut self, tile: &Grid) {
        let mut step = 1;
        while tile.cell_m * (step * 2) as f64 <= self.canopy.cell_m {
            step *= 2;
        }
        let cell_m = tile.cell_m * step as f64;
        let extent = self.extent;
        let terrain = self
            .terrain
            .get_or_insert_with(|| Grid::empty(Window::touching(&extent, cell_m), cell_m));
        let window = tile.window;
        for row in (window.row0..window.end_row()).filter(|row| row.rem_euclid(step) == step / 2) {
            for column in window.column0..window.end_column() {
                let (to_column, to_row) = (column.div_euclid(step), row.div_euclid(step));
                if column.rem_euclid(step) == step / 2 && terrain.window.contains(to_column, to_row)
                {
                    let place = terrain.window.index(to_column, to_row);
                    terrain.values[place] = tile.values[window.index(column, row)];
                }
            }
        }
    }

    /// Removes the terrain beyond the points; returns the number of canopy cells with points or in
    /// small gaps between them.
    fn mask(&mut self, gap_m: f64) -> usize {
        let cell_m = self.canopy.cell_m;
        let window = self.canopy.window;
        let reach = (gap_m / 2.0 / cell_m).ceil() as u32;
        let around = window.grown(2 * reach);
        let mut occupied = vec![false; around.len()];
        for row in window.row0..window.end_row() {
            for column in window.column0..window.end_column() {
                occupied[around.index(column, row)] = self.canopy.get(column, row).is_some();
            }
        }
        let inside = closing::closed(&occupied, window, reach);
        if let Some(terrain) = &mut self.terrain {
            let centre = |index: i64| (index as f64 + 0.5) * terrain.cell_m;
            let own = terrain.window;
            for row in own.row0..own.end_row() {
                for column in own.column0..own.end_column() {
                    let [c, r] = self.canopy.cell_at([centre(column), centre(row)]);
                    if !(window.contains(c, r) && inside[window.index(c, r)]) {
                        terrain.values[own.index(column, row)] = f32::NAN;
                    }
                }
            }
        }
        inside.iter().filter(|cell| **cell).count()
    }

    /// Fills small gaps in the canopy.
    fn fill(&mut self) {
        let window = self.canopy.window;
        let mut around = Grid::empty(window.grown(FILL_CELLS), self.canopy.cell_m);
        around.raise(window, &std::mem::take(&mut self.canopy.values));
        self.canopy.values = gridding::fill_gaps(&around.values, window, FILL_CELLS);
    }

    fn subtitle(&self, hectares: f64, points: u64, crs: &Crs) -> String {
        let trees = grouped(self.trees.len() as i64);
        let mut parts = vec![format!("{trees} trees"), format!("{hectares:.2} ha")];
        let density = points as f64 / (hectares * 10_000.0).max(1e-9);
        parts.push(format!("{density:.1} points/m²"));
        if self.tallest_m > 0.0 {
            parts.push(format!("tallest {:.1} m", self.tallest_m));
        }
        parts.push(crs_name(crs));
        parts.join("  ·  ")
    }
}

/// The name of a CRS: by its EPSG code where it is known only by that.
fn crs_name(crs: &Crs) -> String {
    if crs.is_unknown() {
        return "coordinate system unknown".to_owned();
    }
    let bare = |code: &u32| crs.name == format!("EPSG:{code}");
    let defined = || crs_definitions::from_code(u16::try_from(crs.epsg.filter(bare)?).ok()?);
    let name = defined().and_then(|definition| definition.wkt.split('"').nth(1));
    name.map_or_else(|| crs.name.clone(), |name| format!("{name} ({})", crs.name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_files_are_known_by_name() {
        assert!(["map.png", "map-3.png"].into_iter().all(is_ours));
        assert!(!["map-.png", "map-old.png", "treemap.png", "dtm.tif"].into_iter().any(is_ours));
    }

    #[test]
    fn a_bare_code_gets_its_name() {
        let crs = |name: &str| Crs { epsg: Some(3005), name: name.to_owned(), ..Crs::default() };
        assert_eq!(crs_name(&crs("EPSG:3005")), "NAD83 / BC Albers (EPSG:3005)");
        assert_eq!(crs_name(&crs("my own")), "my own");
        assert_eq!(crs_name(&Crs::default()), "coordinate system unknown");
    }

    #[test]
    fn terrain_is_picked_however_tiles_are_cut() {
        let extent = Rect { min: [0.0, 0.0], max: [40.0, 8.0] };
        let whole = Grid {
            cell_m: 1.0,
            window: Window { column0: 0, row0: 0, columns: 41, rows: 9 },
            values: (0..41 * 9).map(|i| i as f32).collect(),
        };
        let part = |column0: i64, columns: u32| {
            let mut part = Grid::empty(Window { column0, columns, ..whole.window }, 1.0);
            part.raise(whole.window, &whole.values);
            part
        };
        let drawn = |tiles: &[Grid]| {
            let mut layers = Layers::new(&Site { number: 0, of: 1, extent }, 4.0);
            tiles.iter().for_each(|tile| layers.add_terrain(tile));
            layers.terrain.unwrap()
        };
        let reference = drawn(std::slice::from_ref(&whole));
        assert_eq!(reference.cell_m, 4.0);
        assert_eq!(reference.get(0, 0), Some(f64::from(2 * 41 + 2)));
        let cut = drawn(&[part(0, 7), part(7, 20), part(27, 14)]);
        let bits = |grid: &Grid| grid.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&cut), bits(&reference));
    }
}

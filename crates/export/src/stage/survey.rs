//! The first reading of a campaign.

use super::Params;
use crate::las::{Colour, Dimension, DimensionType, is_standard_field};
use crate::sorted_trees::SortedTrees;
use crate::{Error, Mosaic};
use std::collections::BTreeMap;
use std::path::Path;
use timberline_artefact::kinds::{GroundModel, Heights, PointTile, Trees};
use timberline_artefact::stage::{Context, Inputs, StageError};
use timberline_artefact::{Crs, Facts, Header, Kind};
use timberline_pointcloud::{Bounds3, Column, Footprint, PointCloud, TileGrid, TileId, gridding};

/// Seconds in a week: GPS times beyond it cannot be seconds of the week.
const WEEK_S: f64 = 604_800.0;

/// What a campaign holds, with rasters and trees in scratch files.
pub(super) struct Survey {
    pub(super) crs: Option<Crs>,
    pub(super) grid: Option<TileGrid>,
    pub(super) footprint: Footprint,
    pub(super) chm: Mosaic,
    pub(super) dtm: Mosaic,
    pub(super) dtm_cell_m: f64,
    pub(super) trees: SortedTrees,
    /// Name and type of all extra columns of the points.
    pub(super) columns: BTreeMap<String, DimensionType>,
    /// Stages that made the inputs: name, version and parameters.
    pub(super) stages: BTreeMap<String, (u32, String)>,
    pub(super) points: u64,
    /// Square metres of the lattice of whole metres that hold points.
    occupied_m2: u64,
    latest_gps_time: f64,
    bounds: Bounds3,
    tiles: u64,
}

impl Survey {
    /// Reads all tiles once.
    pub(super) fn of(
        tiles: &[TileId],
        params: &Params,
        inputs: &Inputs,
        context: &Context<'_>,
        scratch: &Path,
    ) -> Result<Self, StageError> {
        let mut survey = Self {
            crs: None,
            grid: None,
            footprint: Footprint::new(),
            chm: Mosaic::new(scratch)?,
            dtm: Mosaic::new(scratch)?,
            dtm_cell_m: 1.0,
            trees: SortedTrees::new(&scratch.join("trees.sqlite"))?,
            columns: BTreeMap::new(),
            stages: BTreeMap::new(),
            points: 0,
            occupied_m2: 0,
            latest_gps_time: 0.0,
            bounds: Bounds3::EMPTY,
            tiles: tiles.len() as u64,
        };
        for tile in tiles {
            context.check_cancelled()?;
            survey.add_points(*tile, params, inputs)?;
            survey.add_terrain(*tile, inputs)?;
            if !has_trees(inputs, *tile) {
                let message = "its trees are missing: a stage failed on it or beside it";
                context.warn(format!("tile {tile}"), message);
                continue;
            }
            let (header, trees) = read::<Trees>(inputs, *tile)?;
            survey.note_stage(&header);
            survey.trees.add(&trees.trees)?;
        }
        Ok(survey)
    }

    fn add_points(
        &mut self,
        tile: TileId,
        params: &Params,
        inputs: &Inputs,
    ) -> Result<(), StageError> {
        let (header, PointTile { cloud }) = read::<PointTile>(inputs, tile)?;
        let (heights_header, heights) = read::<Heights>(inputs, tile)?;
        self.note_stage(&header);
        self.note_stage(&heights_header);
        if self.crs.is_none() {
            self.crs.clone_from(&header.facts.crs);
        }
        self.grid = self.grid.or(header.facts.grid);
        self.note_columns(&cloud)?;
        self.points += cloud.len() as u64;
        let times = cloud.gps_time.iter().copied().filter(|time| time.is_finite());
        self.latest_gps_time = times.fold(self.latest_gps_time, f64::max);
        self.add_places(&cloud);
        if params.write_rasters {
            let (window, values) = gridding::highest(&cloud, &heights.height_m, params.chm_cell_m);
            self.chm.push(window, &values)?;
        }
        Ok(())
    }

    fn add_places(&mut self, cloud: &PointCloud) {
        let mut squares = Vec::with_capacity(cloud.len());
        for index in 0..cloud.len() {
            let world = cloud.world(index);
            self.bounds.include(world);
            self.footprint.include(world[0], world[1]);
            squares.push([world[0].floor() as i64, world[1].floor() as i64]);
        }
        squares.sort_unstable();
        squares.dedup();
        // Edges of tiles are whole metres, so no square is counted twice.
        self.occupied_m2 += squares.len() as u64;
    }

    /// Points in a square metre that has any.
    pub(super) fn density_per_m2(&self) -> f64 {
        self.points as f64 / (self.occupied_m2 as f64).max(1.0)
    }

    /// Takes the terrain of a tile, in the units of the vertical system of the CRS.
    fn add_terrain(&mut self, tile: TileId, inputs: &Inputs) -> Result<(), StageError> {
        let (header, GroundModel { raster, .. }) = read::<GroundModel>(inputs, tile)?;
        self.note_stage(&header);
        let window = raster.window();
        if window.is_empty() {
            return Ok(());
        }
        self.dtm_cell_m = raster.cell_m;
        let per_unit = self.crs.as_ref().map_or(1.0, |crs| crs.vertical_m_per_unit);
        let values: Vec<f32> = raster.values.iter().map(|z| (z / per_unit) as f32).collect();
        Ok(self.dtm.push(window, &values)?)
    }

    fn note_columns(&mut self, cloud: &PointCloud) -> Result<(), Error> {
        for (name, column) in &cloud.extra {
            let kind = DimensionType::of(column);
            let known = *self.columns.entry(name.clone()).or_insert(kind);
            if known != kind {
                return Err(Error::DimensionType {
                    path: "points.laz".into(),
                    name: name.clone(),
                    expected: known.name(),
                    found: kind.name(),
                });
            }
        }
        Ok(())
    }

    fn note_stage(&mut self, header: &Header) {
        self.stages
            .entry(header.stage.clone())
            .or_insert_with(|| (header.stage_version, header.params.to_string()));
    }

    /// The bounds of all points; `None` without points.
    pub(super) fn bounds(&self) -> Option<Bounds3> {
        (!self.bounds.is_empty()).then_some(self.bounds)
    }

    /// Facts for the header of the manifest.
    pub(super) fn facts(&self) -> Facts {
        super::facts_of(self)
    }

    /// The campaign's totals.
    pub(super) fn totals(&self) -> BTreeMap<String, u64> {
        let sites = self.footprint.sites().len() as u64;
        [
            ("points", self.points),
            ("trees", self.trees.len()),
            ("tiles", self.tiles),
            ("sites", sites),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .into()
    }

    /// Whether GPS times are adjusted standard time.
    pub(super) fn has_standard_time(&self) -> bool {
        self.latest_gps_time > WEEK_S
    }

    /// The colours that the points have.
    pub(super) fn colour(&self) -> Colour {
        let has = |name: &&str| self.columns.get(*name) == Some(&DimensionType::U16);
        if !["red", "green", "blue"].iter().all(has) {
            Colour::None
        } else if has(&"nir") {
            Colour::RgbNir
        } else {
            Colour::Rgb
        }
    }

    /// The source's own extra dimensions, renamed where a name is taken.
    pub(super) fn source_dimensions(&self) -> Vec<(String, Dimension)> {
        let own = self.columns.iter().filter(|(name, _)| !is_standard_field(name));
        own.map(|(name, kind)| {
            let description = "from the source".to_owned();
            let dimension = Dimension { name: renamed(name), kind: *kind, description };
            (name.clone(), dimension)
        })
        .collect()
    }
}

/// The name under which a column of the source is written: results keep theirs.
fn renamed(name: &str) -> String {
    let taken = super::points::RESULTS.iter().any(|(result, ..)| *result == name);
    if taken { format!("source_{name}") } else { name.to_owned() }
}

/// A cloud with a column under another name.
pub(super) fn rename(cloud: &mut PointCloud, from: &str, to: &str) {
    if from != to
        && let Some(column) = cloud.extra.remove(from)
    {
        cloud.extra.insert(to.to_owned(), column);
    }
}

/// Adds a column, replacing one of the same name.
pub(super) fn put(cloud: &mut PointCloud, name: &str, column: Column) {
    cloud.extra.insert(name.to_owned(), column);
}

/// Whether a tile has its trees. Where a stage failed on the way to them, points and terrain are there
/// all the same.
fn has_trees(inputs: &Inputs, tile: TileId) -> bool {
    inputs.tile_path(Trees::NAME, tile).is_ok()
}

/// Reads an artefact of a tile with its header.
pub(super) fn read<K: Kind>(inputs: &Inputs, tile: TileId) -> Result<(Header, K), StageError> {
    Ok(timberline_artefact::read(inputs.tile_path(K::NAME, tile)?)?)
}

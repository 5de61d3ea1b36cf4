//! Runs one stage outside the orchestrator: for tests, examples and for looking into one failed unit.

use crate::kinds::PointTile;
use crate::stage::{Campaign, Context, InputFile, Inputs, Stage, StageError, Task};
use crate::{Facts, Kind, UnitId};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use timberline_pointcloud::order::canonical_order;
use timberline_pointcloud::{PointCloud, TileGrid, TileId};

/// A folder of artefacts made one by one, without keys.
#[derive(Debug, Clone)]
pub struct Alone {
    folder: PathBuf,
    /// What the campaign has in common.
    pub campaign: Campaign,
    /// The artefacts so far; a stage finds its inputs among them.
    pub files: Vec<InputFile>,
    /// Where the files are that parameters name.
    pub named: BTreeMap<String, PathBuf>,
    /// What stages said to the log of the run.
    pub log: Vec<String>,
}

impl Alone {
    /// Begins in a folder.
    #[must_use]
    pub fn new(folder: &Path, campaign: Campaign) -> Self {
        let (files, named, log) = (Vec::new(), BTreeMap::new(), Vec::new());
        Self { folder: folder.to_path_buf(), campaign, files, named, log }
    }

    /// The folder for files that campaign stages write.
    #[must_use]
    pub fn outputs(&self) -> PathBuf {
        self.folder.join("outputs")
    }

    /// Puts an artefact there by hand.
    ///
    /// # Errors
    /// Those of writing it.
    pub fn put<K: Kind>(
        &mut self,
        unit: UnitId,
        value: &K,
        facts: Facts,
    ) -> Result<PathBuf, StageError> {
        self.record("by-hand", &unit, serde_json::Value::Null, &[K::NAME], |context| {
            context.emit(value, facts).map_err(StageError::from)
        })
    }

    /// Cuts points into tiles and puts them there, each tile in canonical order. Returns the tiles
    /// with their points and facts, sorted.
    ///
    /// # Errors
    /// Those of writing them.
    pub fn put_tiles(
        &mut self,
        cloud: &PointCloud,
        grid: TileGrid,
    ) -> Result<Vec<(TileId, PointCloud, Facts)>, StageError> {
        let mut own: BTreeMap<TileId, Vec<u32>> = BTreeMap::new();
        for index in canonical_order(cloud) {
            let [x, y, _] = cloud.world(index as usize);
            own.entry(grid.tile_at(x, y)).or_default().push(index);
        }
        let mut tiles = Vec::new();
        for (tile, indices) in own {
            let part = cloud.select(&indices);
            let lowest = part.z.iter().fold(f64::INFINITY, |low, z| low.min(*z));
            let lowest = lowest + cloud.frame.origin_m[2] as f64;
            let part = part.in_frame(PointTile::frame(&grid, tile, lowest));
            let facts = Facts { frame: Some(part.frame), grid: Some(grid), ..Facts::default() }
                .count("points", part.len());
            self.put(UnitId::Tile(tile), &PointTile { cloud: part.clone() }, facts.clone())?;
            tiles.push((tile, part, facts));
        }
        Ok(tiles)
    }

    /// Reads an artefact of a unit that was put there or emitted.
    ///
    /// # Errors
    /// As [`Inputs::own`].
    pub fn read<K: Kind>(&self, unit: UnitId) -> Result<K, StageError> {
        Ok(Inputs::new(unit, None, self.files.clone()).own()?.1)
    }

    /// Runs a stage on a unit with the artefacts so far (those its declaration names, of all units)
    /// and adds what it emits. Returns the first emitted file.
    ///
    /// # Errors
    /// The stage's, or that it emitted other kinds than it declares.
    pub fn run<S: Stage>(
        &mut self,
        unit: UnitId,
        raw: Option<crate::stage::RawFile>,
        params: &S::Params,
    ) -> Result<PathBuf, StageError> {
        let info = S::info();
        let declared = |file: &&InputFile| info.inputs.iter().any(|input| input.kind == file.kind);
        let files = self.files.iter().filter(declared).cloned().collect();
        let inputs = Inputs::new(unit.clone(), raw, files);
        let value = serde_json::to_value(params)?;
        self.record(info.name, &unit, value, info.outputs, |context| {
            S::run(params, &inputs, context)
        })
    }

    fn record(
        &mut self,
        stage: &str,
        unit: &UnitId,
        params: serde_json::Value,
        declared: &[&'static str],
        work: impl FnOnce(&Context<'_>) -> Result<(), StageError>,
    ) -> Result<PathBuf, StageError> {
        let task = Task {
            key: "0".repeat(32),
            stage: stage.to_owned(),
            stage_version: 0,
            unit: unit.clone(),
            params,
            inputs: Vec::new(),
        };
        let (outputs, cancel) = (self.outputs(), AtomicBool::new(false));
        std::fs::create_dir_all(&outputs)?;
        let context = Context::new(&task, &self.campaign, &self.folder, &outputs, &cancel)
            .with_files(self.named.clone());
        let worked = work(&context);
        self.log.extend(context.take_log());
        worked?;
        let published = context.publish(declared)?;
        let first = published.first().map(|(_, path)| path.clone());
        self.files.extend(published.into_iter().map(|(kind, path)| InputFile {
            kind: kind.to_owned(),
            unit: unit.clone(),
            path,
        }));
        first.ok_or_else(|| "the stage emitted nothing".into())
    }
}

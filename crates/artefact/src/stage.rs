//! The stage contract: stage crates implement [`Stage`], only the orchestrator runs it.
//!
//! A stage declares nothing twice: name, version, unit, inputs, outputs and parameters (with unit,
//! range, default and source, in their JSON Schema) are read from the trait by everything else.

use crate::container::ContainerWriter;
use crate::publish::{Staged, TEMP_PREFIX};
use crate::{Error, Facts, Header, InputRef, Kind, UnitId, UnitKind, Warning};
use schemars::JsonSchema;
use serde::{Serialize, de::DeserializeOwned};
use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::marker::PhantomData;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use tempfile::TempDir;
use timberline_pointcloud::{TileGrid, TileId};

/// What a stage may return as an error: any error with a message fit for a user.
pub type StageError = Box<dyn std::error::Error + Send + Sync>;

/// Parameters of a stage: one flat struct whose JSON Schema carries range (`minimum`, `maximum`),
/// unit (`x-unit`) and source (`x-source`) of every field. A field marked `x-limit` only bounds what a
/// task may take and can change no result: it is no part of the key.
pub trait Params:
    Serialize + DeserializeOwned + JsonSchema + Default + Clone + Send + Sync + 'static
{
    /// What is wrong with the values together (each alone is checked by the schema).
    fn check(&self) -> Vec<String> {
        Vec::new()
    }
}

/// Which units' artefacts of a kind a task reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// Its own unit's (for a tile that reads shards: those of the files with points in the tile).
    Own,
    /// Its own tile's and those of the tiles within the halo.
    Halo,
    /// All.
    All,
}

/// One input of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InputSpec {
    /// The kind read.
    pub kind: &'static str,
    /// Of which units.
    pub scope: Scope,
}

impl InputSpec {
    /// An input of the task's own unit.
    #[must_use]
    pub const fn own(kind: &'static str) -> Self {
        Self { kind, scope: Scope::Own }
    }

    /// An input of the task's tile and the tiles within the halo.
    #[must_use]
    pub const fn halo(kind: &'static str) -> Self {
        Self { kind, scope: Scope::Halo }
    }

    /// An input of all units.
    #[must_use]
    pub const fn all(kind: &'static str) -> Self {
        Self { kind, scope: Scope::All }
    }
}

/// What is fixed about a stage.
#[derive(Debug, Clone, Copy)]
pub struct StageInfo {
    /// Its name in pipeline files.
    pub name: &'static str,
    /// Raised by hand whenever its output could change.
    pub version: u32,
    /// What it does, in a line, with the method's source.
    pub summary: &'static str,
    /// What one task works on.
    pub unit: UnitKind,
    /// Artefacts it reads. A stage with unit [`UnitKind::File`] reads the raw file besides.
    pub inputs: &'static [InputSpec],
    /// Kinds it writes, all of them for every unit.
    pub outputs: &'static [&'static str],
}

/// A file that a parameter names: a script, a table. Its contents are part of the task's key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedFile {
    /// As it stands in the parameter; a relative path counts from the pipeline file's folder.
    pub name: String,
    /// The parameter.
    pub param: &'static str,
    /// Whether it must be there. What may be a file's name or not is one if there is such a file.
    pub required: bool,
}

/// One stage of a pipeline.
pub trait Stage: Send + Sync + 'static {
    /// Its parameters.
    type Params: Params;

    /// What is fixed about it.
    fn info() -> StageInfo;

    /// How far beyond its tile a task reads, in metres.
    fn halo_m(_params: &Self::Params) -> f64 {
        0.0
    }

    /// The files its parameters name, which a task finds by [`Context::file`].
    fn files(_params: &Self::Params) -> Vec<NamedFile> {
        Vec::new()
    }

    /// Estimate of a task's peak memory in bytes, given the number of points in its unit
    /// (for a raw file: in the file) and in the halo around it.
    fn memory_bytes(_params: &Self::Params, points: u64) -> u64 {
        const BYTES_PER_POINT: u64 = 300;
        points * BYTES_PER_POINT
    }

    /// Does the task: reads `inputs`, emits every output kind through `context`.
    ///
    /// # Errors
    /// When the unit as a whole fails; a single bad tree is a warning instead.
    fn run(params: &Self::Params, inputs: &Inputs, context: &Context<'_>)
    -> Result<(), StageError>;
}

/// A raw file of the campaign.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RawFile {
    /// Path relative to the campaign: the name of its unit.
    pub name: String,
    /// Where it is.
    pub path: PathBuf,
}

/// One artefact given to a task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputFile {
    /// Kind.
    pub kind: String,
    /// Unit it belongs to.
    pub unit: UnitId,
    /// Where it is.
    pub path: PathBuf,
}

/// What a task may read.
#[derive(Debug, Clone)]
pub struct Inputs {
    unit: UnitId,
    raw: Option<RawFile>,
    files: Vec<InputFile>,
}

impl Inputs {
    /// The inputs of a unit. Files are sorted by kind and unit.
    #[must_use]
    pub fn new(unit: UnitId, raw: Option<RawFile>, mut files: Vec<InputFile>) -> Self {
        files.sort_by(|a, b| (&a.kind, &a.unit).cmp(&(&b.kind, &b.unit)));
        Self { unit, raw, files }
    }

    /// The unit.
    #[must_use]
    pub fn unit(&self) -> &UnitId {
        &self.unit
    }

    /// The unit's tile.
    ///
    /// # Errors
    /// [`Error::MissingInput`] when the unit is no tile.
    pub fn tile(&self) -> Result<TileId, Error> {
        self.unit.tile().ok_or_else(|| self.missing("tile", &self.unit))
    }

    /// The unit's raw file.
    ///
    /// # Errors
    /// [`Error::MissingInput`] when the unit is no raw file.
    pub fn raw(&self) -> Result<&RawFile, Error> {
        self.raw.as_ref().ok_or_else(|| self.missing("raw file", &self.unit))
    }

    /// All files of a kind, sorted by unit.
    pub fn files_of<'a>(&'a self, kind: &'a str) -> impl Iterator<Item = &'a InputFile> {
        self.files.iter().filter(move |file| file.kind == kind)
    }

    /// The tiles that have a file of a kind, sorted.
    #[must_use]
    pub fn tiles_of(&self, kind: &str) -> Vec<TileId> {
        self.files_of(kind).filter_map(|file| file.unit.tile()).collect()
    }

    /// Where the unit's own artefact of a kind is.
    ///
    /// # Errors
    /// [`Error::MissingInput`].
    pub fn own_path(&self, kind: &str) -> Result<&Path, Error> {
        self.path_of(kind, &self.unit)
    }

    /// Where a tile's artefact of a kind is.
    ///
    /// # Errors
    /// [`Error::MissingInput`].
    pub fn tile_path(&self, kind: &str, tile: TileId) -> Result<&Path, Error> {
        self.path_of(kind, &UnitId::Tile(tile))
    }

    /// Reads the unit's own artefact of a kind.
    ///
    /// # Errors
    /// As [`crate::read`], and [`Error::MissingInput`].
    pub fn own<K: Kind>(&self) -> Result<(Header, K), Error> {
        crate::read(self.own_path(K::NAME)?)
    }

    /// Reads a tile's artefact of a kind.
    ///
    /// # Errors
    /// As [`crate::read`], and [`Error::MissingInput`].
    pub fn of_tile<K: Kind>(&self, tile: TileId) -> Result<K, Error> {
        crate::read(self.tile_path(K::NAME, tile)?).map(|(_, value)| value)
    }

    /// Reads all artefacts of a kind, one after the other, sorted by unit.
    pub fn each<K: Kind>(&self) -> impl Iterator<Item = Result<(UnitId, Header, K), Error>> {
        self.files_of(K::NAME).map(|file| {
            crate::read(&file.path).map(|(header, value)| (file.unit.clone(), header, value))
        })
    }

    fn path_of(&self, kind: &str, unit: &UnitId) -> Result<&Path, Error> {
        // `new` has sorted them; a campaign stage looks up every tile of large campaigns.
        let place = self
            .files
            .binary_search_by(|file| (file.kind.as_str(), &file.unit).cmp(&(kind, unit)))
            .map_err(|_| self.missing(kind, unit))?;
        Ok(&self.files[place].path)
    }

    fn missing(&self, kind: &str, unit: &UnitId) -> Error {
        Error::MissingInput { kind: kind.to_owned(), unit: unit.to_string() }
    }
}

/// What determines a task, for the headers of what it emits.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Key of the task.
    pub key: String,
    /// Stage name.
    pub stage: String,
    /// Stage version.
    pub stage_version: u32,
    /// Unit.
    pub unit: UnitId,
    /// Effective parameters.
    pub params: serde_json::Value,
    /// Inputs, sorted.
    pub inputs: Vec<InputRef>,
}

/// What the whole campaign has in common.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Campaign {
    /// Its name, for titles.
    pub name: String,
    /// Tile grid; part of the key of the stages that read raw files.
    pub grid: Option<TileGrid>,
    /// CRS that replaces what the files say; part of the key of the stages that read raw files.
    pub crs: Option<crate::Crs>,
}

/// The running task's surroundings: where results go, progress, warnings, cancellation.
pub struct Context<'a> {
    task: &'a Task,
    campaign: &'a Campaign,
    store: &'a Path,
    outputs: &'a Path,
    cancel: &'a AtomicBool,
    progress: AtomicU64,
    warnings: Mutex<Vec<Warning>>,
    log: Mutex<Vec<String>>,
    files: BTreeMap<String, PathBuf>,
    staged: Mutex<Vec<(&'static str, Staged)>>,
}

/// A task noticed that it should stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped on request")]
pub struct Cancelled;

impl<'a> Context<'a> {
    /// The context of a task that puts artefacts into the folder `store` and files for people into
    /// the folder `outputs`.
    #[must_use]
    pub fn new(
        task: &'a Task,
        campaign: &'a Campaign,
        store: &'a Path,
        outputs: &'a Path,
        cancel: &'a AtomicBool,
    ) -> Self {
        let progress = AtomicU64::new(0);
        let (warnings, log, staged) = (Mutex::default(), Mutex::default(), Mutex::default());
        let files = BTreeMap::new();
        Self { task, campaign, store, outputs, cancel, progress, warnings, log, files, staged }
    }

    /// The same with the files that the stage's parameters name, by their names.
    #[must_use]
    pub fn with_files(mut self, files: BTreeMap<String, PathBuf>) -> Self {
        self.files = files;
        self
    }

    /// Where a file is that the parameters name (see [`Stage::files`]): an absolute path.
    #[must_use]
    pub fn file(&self, name: &str) -> Option<&Path> {
        self.files.get(name).map(PathBuf::as_path)
    }

    /// The unit.
    #[must_use]
    pub fn unit(&self) -> &UnitId {
        &self.task.unit
    }

    /// A folder for what the task needs only while it runs; it vanishes with the returned value. What
    /// a killed process leaves there, the next run removes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn scratch(&self) -> Result<TempDir, Error> {
        let folder = self.store.join(&self.task.stage);
        std::fs::create_dir_all(&folder).map_err(Error::io(&folder, "create"))?;
        let made = tempfile::Builder::new().prefix(TEMP_PREFIX).tempdir_in(&folder);
        made.map_err(Error::io(&folder, "write in"))
    }

    /// What the campaign has in common.
    #[must_use]
    pub fn campaign(&self) -> &Campaign {
        self.campaign
    }

    /// The folder for files people take away; only campaign stages write there.
    #[must_use]
    pub fn outputs_folder(&self) -> &Path {
        self.outputs
    }

    /// Adds to the number of points worked off, for the progress display.
    pub fn advance(&self, points: u64) {
        self.progress.fetch_add(points, Ordering::Relaxed);
    }

    /// Points worked off so far.
    #[must_use]
    pub fn progress(&self) -> u64 {
        self.progress.load(Ordering::Relaxed)
    }

    /// Notes something the reader of the result should know. The order of calls does not matter.
    /// Call it before [`Context::emit`]: warnings travel in the headers of what is emitted after.
    pub fn warn(&self, subject: impl Into<String>, message: impl Into<String>) {
        let warning = Warning { subject: subject.into(), message: message.into() };
        lock(&self.warnings).push(warning);
    }

    /// The warnings so far, sorted.
    #[must_use]
    pub fn warnings(&self) -> Vec<Warning> {
        let mut warnings = lock(&self.warnings).clone();
        warnings.sort();
        warnings
    }

    /// Adds a text to the log of the run, kept whether the task succeeds or fails: what a program
    /// said that the task called. It is no part of any result.
    pub fn log(&self, text: impl Into<String>) {
        lock(&self.log).push(text.into());
    }

    /// The texts of [`Context::log`] so far, which are taken out.
    #[must_use]
    pub fn take_log(&self) -> Vec<String> {
        std::mem::take(&mut *lock(&self.log))
    }

    /// Returns an error when the task should stop; long loops ask now and then.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub fn check_cancelled(&self) -> Result<(), Cancelled> {
        if self.cancel.load(Ordering::Relaxed) { Err(Cancelled) } else { Ok(()) }
    }

    /// Writes a result to a temporary file; it appears in the store when the whole task has succeeded.
    ///
    /// # Errors
    /// [`Error::Encode`] or [`Error::Io`].
    pub fn emit<K: Kind>(&self, value: &K, facts: Facts) -> Result<(), Error> {
        let header = self.header::<K>(facts);
        let mut staged = Staged::new(&self.target::<K>())?;
        value.encode(&header, staged.file())?;
        lock(&self.staged).push((K::NAME, staged));
        Ok(())
    }

    /// As [`Context::emit`], for a payload written as a stream; its facts are known at the end.
    ///
    /// # Errors
    /// The writer's errors, as a [`StageError`].
    pub fn emit_stream<K: Kind>(
        &self,
        write: impl FnOnce(
            &mut ContainerWriter<BufWriter<&mut std::fs::File>>,
        ) -> Result<Facts, StageError>,
    ) -> Result<(), StageError> {
        let mut staged = Staged::new(&self.target::<K>())?;
        let mut writer = ContainerWriter::new(BufWriter::with_capacity(1 << 20, staged.file()))?;
        let facts = write(&mut writer)?;
        writer.finish(&self.header::<K>(facts).to_json()?)?.flush()?;
        lock(&self.staged).push((K::NAME, staged));
        Ok(())
    }

    /// Lets all results appear, and returns the kind and place of each in the order of emission.
    /// Called by the orchestrator after the task has succeeded.
    ///
    /// # Errors
    /// [`Error::Undeclared`] when the kinds are not exactly those `declared`; [`Error::Io`].
    pub fn publish(self, declared: &[&'static str]) -> Result<Vec<(&'static str, PathBuf)>, Error> {
        let staged = self.staged.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        let sorted = |mut kinds: Vec<&'static str>| {
            kinds.sort_unstable();
            kinds
        };
        let written = sorted(staged.iter().map(|(kind, _)| *kind).collect());
        let declared = sorted(declared.to_vec());
        if written != declared {
            let stage = self.task.stage.clone();
            return Err(Error::Undeclared { stage, declared, written });
        }
        staged.into_iter().map(|(kind, file)| Ok((kind, file.publish()?))).collect()
    }

    fn header<K: Kind>(&self, facts: Facts) -> Header {
        Header {
            kind: K::NAME.to_owned(),
            kind_version: K::VERSION,
            key: self.task.key.clone(),
            stage: self.task.stage.clone(),
            stage_version: self.task.stage_version,
            unit: self.task.unit.clone(),
            params: self.task.params.clone(),
            inputs: self.task.inputs.clone(),
            tool_version: env!("CARGO_PKG_VERSION").to_owned(),
            facts,
            warnings: self.warnings(),
        }
    }

    fn target<K: Kind>(&self) -> PathBuf {
        artefact_path(
            self.store,
            &self.task.stage,
            &self.task.unit,
            &self.task.key,
            K::NAME,
            K::EXTENSION,
        )
    }
}

/// Where an artefact of a store is: `<store>/<stage>/<unit>-<key>.<kind>.<extension>`.
#[must_use]
pub fn artefact_path(
    store: &Path,
    stage: &str,
    unit: &UnitId,
    key: &str,
    kind: &str,
    extension: &str,
) -> PathBuf {
    store.join(stage).join(format!("{}-{key}.{kind}.{extension}", unit.file_stem()))
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// A stage without its types, for the orchestrator.
pub trait DynStage: Send + Sync {
    /// What is fixed about it.
    fn info(&self) -> StageInfo;

    /// JSON Schema of its parameters.
    fn schema(&self) -> serde_json::Value;

    /// Effective parameters: those given, the defaults for the others.
    ///
    /// # Errors
    /// What does not fit, in words.
    fn effective(&self, given: &serde_json::Value) -> Result<serde_json::Value, String>;

    /// What is wrong with effective parameters taken together.
    ///
    /// # Errors
    /// As [`DynStage::effective`].
    fn check(&self, effective: &serde_json::Value) -> Result<Vec<String>, String>;

    /// See [`Stage::halo_m`].
    ///
    /// # Errors
    /// As [`DynStage::effective`].
    fn halo_m(&self, effective: &serde_json::Value) -> Result<f64, String>;

    /// See [`Stage::files`].
    ///
    /// # Errors
    /// As [`DynStage::effective`].
    fn files(&self, effective: &serde_json::Value) -> Result<Vec<NamedFile>, String>;

    /// See [`Stage::memory_bytes`].
    ///
    /// # Errors
    /// As [`DynStage::effective`].
    fn memory_bytes(&self, effective: &serde_json::Value, points: u64) -> Result<u64, String>;

    /// See [`Stage::run`].
    ///
    /// # Errors
    /// The stage's.
    fn run(
        &self,
        effective: &serde_json::Value,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError>;
}

struct Erased<S>(PhantomData<fn() -> S>);

/// A stage for the orchestrator's list.
#[must_use]
pub fn erase<S: Stage>() -> Box<dyn DynStage> {
    Box::new(Erased::<S>(PhantomData))
}

impl<S: Stage> Erased<S> {
    fn parse(value: &serde_json::Value) -> Result<S::Params, String> {
        serde_json::from_value(value.clone()).map_err(|error| error.to_string())
    }
}

impl<S: Stage> DynStage for Erased<S> {
    fn info(&self) -> StageInfo {
        S::info()
    }

    fn schema(&self) -> serde_json::Value {
        schemars::schema_for!(S::Params).to_value()
    }

    fn effective(&self, given: &serde_json::Value) -> Result<serde_json::Value, String> {
        serde_json::to_value(Self::parse(given)?).map_err(|error| error.to_string())
    }

    fn check(&self, effective: &serde_json::Value) -> Result<Vec<String>, String> {
        Self::parse(effective).map(|params| params.check())
    }

    fn halo_m(&self, effective: &serde_json::Value) -> Result<f64, String> {
        Self::parse(effective).map(|params| S::halo_m(&params))
    }

    fn files(&self, effective: &serde_json::Value) -> Result<Vec<NamedFile>, String> {
        Self::parse(effective).map(|params| S::files(&params))
    }

    fn memory_bytes(&self, effective: &serde_json::Value, points: u64) -> Result<u64, String> {
        Self::parse(effective).map(|params| S::memory_bytes(&params, points))
    }

    fn run(
        &self,
        effective: &serde_json::Value,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        S::run(&Self::parse(effective)?, inputs, context)
    }
}

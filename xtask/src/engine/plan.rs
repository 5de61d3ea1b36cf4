//! What there is to do: units, keys, inputs.
//!
//! A key is known before anything runs, because it depends on the keys of the inputs and not on
//! their contents. So the same code plans (nothing runs) and runs (stage by stage).

use super::notes::{Stamp, content_hash};
use super::store::{Found, KEY_LEN, Store};
use super::survey::Survey;
use crate::config::{Pipeline, PipelineStage};
use crate::registry::{CRS, GRID, NAMED, RAW};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use timberline_artefact::container::CONTAINER_VERSION;
use timberline_artefact::kinds;
use timberline_artefact::stage::{InputFile, InputSpec, RawFile, Scope, Task};
use timberline_artefact::{InputRef, TreeUnit, UnitId, UnitKind};
use timberline_pointcloud::TileId;

/// Where a unit of an earlier stage stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// Its artefacts are in the store.
    Ready,
    /// It would run first.
    WillRun,
    /// It is not there and will not be: it failed, or this run does not make it.
    Absent,
}

/// A unit of an earlier stage.
#[derive(Debug, Clone)]
pub struct Made {
    /// Its key.
    pub key: String,
    /// Where it stands.
    pub standing: Standing,
    /// Points in it, as far as known.
    pub points: u64,
    /// Tiles it holds points for (raw files).
    pub parts: Vec<TileId>,
    /// Trees it names as units of work, with what it holds of each.
    pub trees: Vec<TreeUnit>,
}

/// The units of the stages before, by position in the pipeline.
pub type Progressed = Vec<BTreeMap<UnitId, Made>>;

/// A unit to be dealt with.
#[derive(Debug, Clone)]
pub struct UnitPlan {
    /// All that determines it, and its key.
    pub task: Task,
    /// The artefacts it reads.
    pub files: Vec<InputFile>,
    /// The raw file it reads.
    pub raw: Option<RawFile>,
    /// Points of the unit itself, the halo not counted.
    pub points: u64,
    /// Estimate of its peak memory.
    pub memory_bytes: u64,
    /// What the store has.
    pub found: Found,
    /// Inputs that are not there, as `stage/unit`; the unit cannot run when this is not empty.
    pub absent: Vec<String>,
    /// Inputs that a campaign stage goes on without.
    pub losses: Vec<String>,
    /// Tiles it would hold points for, by the extent of its raw file.
    pub expected_parts: Vec<TileId>,
    /// The files that its stage's parameters name.
    pub named: Arc<[Named]>,
}

/// A file that a stage's parameters name, as it was when the stage was planned.
#[derive(Debug, Clone)]
pub struct Named {
    /// As it stands in the pipeline file.
    pub name: String,
    /// Where it is.
    pub path: PathBuf,
    stamp: Option<Stamp>,
    hash: String,
}

impl Named {
    fn look(name: &str, path: &Path) -> Result<Self, String> {
        let stamp = Stamp::of(path);
        let hash = match path.is_dir() {
            true => "a folder, whose contents do not count".to_owned(),
            false => content_hash(path).map_err(|error| {
                format!(
                    "{} cannot be read: {error}; its contents are part of the key",
                    path.display()
                )
            })?,
        };
        Ok(Self { name: name.to_owned(), path: path.to_owned(), stamp, hash })
    }

    /// Whether the file is still what it was when the stage was planned.
    #[must_use]
    pub fn is_unchanged(&self) -> bool {
        let touched = self.stamp.is_none() || self.stamp != Stamp::of(&self.path);
        !touched || Self::look(&self.name, &self.path).is_ok_and(|now| now.hash == self.hash)
    }
}

impl UnitPlan {
    /// The unit.
    #[must_use]
    pub fn unit(&self) -> &UnitId {
        &self.task.unit
    }

    /// Whether the store has it.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        matches!(self.found, Found::Whole(_))
    }
}

/// Plans one stage, given the stages before it. Units come sorted.
///
/// # Errors
/// What the stage says about its parameters; a file that they name and that cannot be read.
pub fn plan_stage(
    pipeline: &Pipeline,
    position: usize,
    survey: &Survey,
    store: &Store,
    before: &Progressed,
) -> Result<Vec<UnitPlan>, String> {
    let planner = Planner::new(pipeline, position, survey, store, before)?;
    planner.units().into_iter().map(|unit| planner.unit(unit)).collect()
}

struct Planner<'a> {
    pipeline: &'a Pipeline,
    position: usize,
    survey: &'a Survey,
    store: &'a Store,
    before: &'a Progressed,
    halo_m: Result<f64, String>,
    named: Arc<[Named]>,
    /// The raw files with points in a tile, for every stage before that works on raw files.
    by_tile: BTreeMap<usize, BTreeMap<TileId, Vec<Source<'a>>>>,
    /// The trees, as the last stage before that names some does.
    trees: BTreeMap<u64, TreeUnit>,
}

/// A unit of an earlier stage.
type Source<'a> = (&'a UnitId, &'a Made);

impl<'a> Planner<'a> {
    fn new(
        pipeline: &'a Pipeline,
        position: usize,
        survey: &'a Survey,
        store: &'a Store,
        before: &'a Progressed,
    ) -> Result<Self, String> {
        let stage = &pipeline.stages[position];
        let halo_m = stage.stage.halo_m(&stage.params);
        let by_tile = BTreeMap::new();
        let named = stage.files.iter().map(|(name, path)| Named::look(name, path));
        let named = named.collect::<Result<_, _>>()?;
        let mut planner = Self {
            pipeline,
            position,
            survey,
            store,
            before,
            halo_m,
            named,
            by_tile,
            trees: trees(before),
        };
        let froms: BTreeSet<usize> = planner.inputs().map(|(_, from)| from).collect();
        for from in froms {
            if planner.kind_of(from) != UnitKind::File {
                continue;
            }
            let mut index: BTreeMap<TileId, Vec<Source<'a>>> = BTreeMap::new();
            for (unit, made) in &before[from] {
                made.parts
                    .iter()
                    .for_each(|part| index.entry(*part).or_default().push((unit, made)));
            }
            planner.by_tile.insert(from, index);
        }
        Ok(planner)
    }

    fn stage(&self) -> &'a PipelineStage {
        &self.pipeline.stages[self.position]
    }

    /// The inputs with the stage that makes them.
    fn inputs(&self) -> impl Iterator<Item = (&'static InputSpec, usize)> + use<> {
        let specs = self.stage().stage.info().inputs;
        let producers = self.pipeline.producers(self.position);
        specs.iter().zip(producers).filter_map(|(spec, from)| Some((spec, from?)))
    }

    fn kind_of(&self, position: usize) -> UnitKind {
        self.pipeline.stages[position].stage.info().unit
    }

    fn units(&self) -> Vec<UnitId> {
        match self.stage().stage.info().unit {
            UnitKind::File => {
                self.survey.files.iter().map(|file| UnitId::File(file.raw.name.clone())).collect()
            }
            UnitKind::Campaign => vec![UnitId::Campaign],
            UnitKind::Tile => self.tiles().into_iter().map(UnitId::Tile).collect(),
            UnitKind::Tree => self.trees.keys().map(|tree| UnitId::Tree(*tree)).collect(),
        }
    }

    fn tiles(&self) -> BTreeSet<TileId> {
        let mut tiles = BTreeSet::new();
        for (_, from) in self.inputs() {
            for (unit, made) in &self.before[from] {
                tiles.extend(unit.tile());
                tiles.extend(made.parts.iter().filter(|_| made.standing != Standing::Absent));
            }
        }
        tiles
    }

    fn unit(&self, unit: UnitId) -> Result<UnitPlan, String> {
        let (stage, info) = (self.stage(), self.stage().stage.info());
        let halo_m = self.halo_m.clone()?;
        let mut draft = Draft::default();
        for (spec, from) in self.inputs() {
            for (of, made) in self.sources(&unit, spec, from, halo_m) {
                self.take(&mut draft, spec, from, of, made, &unit);
            }
        }
        let file = match &unit {
            UnitId::File(name) => self.survey.files.iter().find(|file| file.raw.name == *name),
            _ => None,
        };
        if info.unit == UnitKind::File {
            self.take_raw(&mut draft, &unit, file.map(|file| file.hash.clone()));
        }
        draft.refs.extend(self.named.iter().map(|named| InputRef {
            kind: NAMED.to_owned(),
            unit: UnitId::File(named.name.clone()),
            key: named.hash.clone(),
        }));
        draft.refs.sort();
        let most = |points: &BTreeMap<_, u64>| points.values().copied().max().unwrap_or(0);
        let of_tree = unit.tree().and_then(|tree| self.trees.get(&tree)).map(|tree| tree.points);
        let known = file.map(|file| file.facts.points).or(of_tree);
        let (read, points) = match known {
            Some(points) => (points, points),
            None => (most(&draft.points), most(&draft.own_points)),
        };
        let task = Task {
            key: key(stage, &unit, &draft.refs),
            stage: info.name.to_owned(),
            stage_version: info.version,
            unit,
            params: stage.params.clone(),
            inputs: draft.refs,
        };
        let grid = self.survey.campaign.grid;
        Ok(UnitPlan {
            found: self.store.find(&info, &task.unit, &task.key),
            memory_bytes: stage.stage.memory_bytes(&stage.params, read)?,
            raw: file.map(|file| file.raw.clone()),
            expected_parts: file
                .zip(grid)
                .map(|(file, grid)| file.tiles(&grid))
                .unwrap_or_default(),
            task,
            files: draft.files,
            points,
            absent: draft.absent,
            losses: draft.losses,
            named: Arc::clone(&self.named),
        })
    }

    /// The units of an earlier stage that a unit reads, sorted.
    fn sources(
        &self,
        unit: &UnitId,
        spec: &InputSpec,
        from: usize,
        halo_m: f64,
    ) -> Vec<Source<'a>> {
        let all = &self.before[from];
        if let Some(tree) = unit.tree().filter(|_| spec.scope != Scope::All) {
            return self.sources_of_tree(tree, all);
        }
        let Some(tile) = unit.tile().filter(|_| spec.scope != Scope::All) else {
            let everything = *unit == UnitId::Campaign || spec.scope == Scope::All;
            return match everything {
                true => all.iter().collect(),
                false => all.get_key_value(unit).into_iter().collect(),
            };
        };
        let near = match (spec.scope, self.survey.campaign.grid) {
            (Scope::Halo, Some(grid)) => grid.neighbours(tile, halo_m),
            _ => vec![tile],
        };
        if let Some(index) = self.by_tile.get(&from) {
            let files = near.iter().filter_map(|tile| index.get(tile)).flatten();
            let unique: BTreeMap<&UnitId, &Made> =
                files.map(|(unit, made)| (*unit, *made)).collect();
            return unique.into_iter().collect();
        }
        let campaign = all.get_key_value(&UnitId::Campaign);
        let tiles = near.into_iter().filter_map(|tile| all.get_key_value(&UnitId::Tile(tile)));
        tiles.chain(campaign).collect()
    }

    /// What a tree reads of an earlier stage: its own, that of the campaign, and that of the tiles
    /// it reaches into.
    fn sources_of_tree(&self, tree: u64, all: &'a BTreeMap<UnitId, Made>) -> Vec<Source<'a>> {
        let own = [UnitId::Tree(tree), UnitId::Campaign];
        let own = own.iter().filter_map(|unit| all.get_key_value(unit)).collect::<Vec<_>>();
        let (Some(tree), Some(grid), true) =
            (self.trees.get(&tree), self.survey.campaign.grid, own.is_empty())
        else {
            return own;
        };
        let tiles = grid.tiles_touching(&tree.bounds.rect());
        tiles.into_iter().filter_map(|tile| all.get_key_value(&UnitId::Tile(tile))).collect()
    }

    fn take(
        &self,
        draft: &mut Draft,
        spec: &InputSpec,
        from: usize,
        of: &UnitId,
        made: &Made,
        unit: &UnitId,
    ) {
        let producer = self.pipeline.stages[from].name();
        if made.standing == Standing::Absent {
            let name = format!("{producer}/{of}");
            let lossy = *unit == UnitId::Campaign || self.kind_of(from) == UnitKind::File;
            if lossy {
                draft.losses.push(name);
            } else {
                draft.absent.push(name);
            }
            return;
        }
        let path = self.store.path(producer, of, &made.key, spec.kind);
        draft.files.push(InputFile { kind: spec.kind.to_owned(), unit: of.clone(), path });
        draft.refs.push(InputRef {
            kind: spec.kind.to_owned(),
            unit: of.clone(),
            key: made.key.clone(),
        });
        // A tile reads its own part of a raw file's shards only.
        let shared = matches!((of, unit), (UnitId::File(_), UnitId::Tile(_)));
        let points =
            if shared { made.points / made.parts.len().max(1) as u64 } else { made.points };
        *draft.points.entry(spec.kind).or_default() += points;
        if shared || of == unit || *unit == UnitId::Campaign {
            *draft.own_points.entry(spec.kind).or_default() += points;
        }
    }

    fn take_raw(&self, draft: &mut Draft, unit: &UnitId, hash: Option<String>) {
        let mut add = |kind: &str, unit: UnitId, key: String| {
            draft.refs.push(InputRef { kind: kind.to_owned(), unit, key });
        };
        add(RAW, unit.clone(), hash.unwrap_or_default());
        if let Some(grid) = self.survey.campaign.grid {
            let [x, y] = grid.origin_m;
            add(GRID, UnitId::Campaign, format!("tiles of {} m from {x}, {y}", grid.edge_m));
        }
        if let Some(crs) = &self.survey.campaign.crs {
            let text = serde_json::to_string(crs).unwrap_or_default();
            let hash = blake3::hash(text.as_bytes()).to_hex();
            add(CRS, UnitId::Campaign, format!("{} ({})", crs.name, &hash[..8]));
        }
    }
}

/// The trees that the last stage to name some does; what several of its units hold of one tree is
/// put together.
fn trees(before: &Progressed) -> BTreeMap<u64, TreeUnit> {
    let mut trees: BTreeMap<u64, TreeUnit> = BTreeMap::new();
    let names_some = |units: &&BTreeMap<UnitId, Made>| units.values().any(|m| !m.trees.is_empty());
    let named = before.iter().rev().find(names_some);
    for tree in named.iter().flat_map(|units| units.values()).flat_map(|made| &made.trees) {
        let part = trees.entry(tree.tree_id);
        part.and_modify(|known| *known = known.with(tree)).or_insert(*tree);
    }
    trees
}

#[derive(Default)]
struct Draft {
    refs: Vec<InputRef>,
    files: Vec<InputFile>,
    absent: Vec<String>,
    losses: Vec<String>,
    points: BTreeMap<&'static str, u64>,
    own_points: BTreeMap<&'static str, u64>,
}

/// The key of a unit: everything that determines its artefacts, hashed.
fn key(stage: &PipelineStage, unit: &UnitId, refs: &[InputRef]) -> String {
    let info = stage.stage.info();
    let mut hasher = blake3::Hasher::new_derive_key("timberline unit key 1");
    let mut add = |text: &str| {
        // The length keeps neighbouring parts apart.
        hasher.update(&(text.len() as u64).to_le_bytes());
        hasher.update(text.as_bytes());
    };
    add(info.name);
    add(&unit.to_string());
    add(&info.version.to_string());
    add(&CONTAINER_VERSION.to_string());
    for kinds::KindInfo { name: kind, version, .. } in kinds::all() {
        if info.outputs.contains(&kind) {
            add(&format!("{kind} {version}"));
        }
    }
    add(&canonical(&stage.key_params()));
    for input in refs {
        add(&input.kind);
        add(&input.unit.to_string());
        add(&input.key);
    }
    hasher.finalize().to_hex()[..KEY_LEN].to_owned()
}

/// JSON with sorted keys.
#[must_use]
pub fn canonical(value: &Value) -> String {
    match value {
        Value::Object(object) => {
            let sorted: BTreeMap<&String, &Value> = object.iter().collect();
            let entry = |(key, value): (&String, &Value)| {
                format!("{}:{}", Value::from(key.as_str()), canonical(value))
            };
            let entries: Vec<String> = sorted.into_iter().map(entry).collect();
            format!("{{{}}}", entries.join(","))
        }
        Value::Array(values) => {
            let values: Vec<String> = values.iter().map(canonical).collect();
            format!("[{}]", values.join(","))
        }
        other => other.to_string(),
    }
}

/// Where the artefacts of a planned unit are or will be.
#[must_use]
pub fn targets(store: &Store, stage: &PipelineStage, plan: &UnitPlan) -> Vec<PathBuf> {
    let info = stage.stage.info();
    info.outputs
        .iter()
        .map(|kind| store.path(info.name, plan.unit(), &plan.task.key, kind))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Named, canonical};
    use serde_json::json;
    use std::path::Path;

    #[test]
    fn a_named_file_that_cannot_be_read_has_no_key() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        assert!(Named::look("a", &path).unwrap_err().contains("cannot be read"));
        std::fs::write(&path, "one").unwrap();
        let named = Named::look("a", &path).unwrap();
        assert!(named.is_unchanged());
        std::fs::write(&path, "other").unwrap();
        assert!(!named.is_unchanged());
        std::fs::remove_file(&path).unwrap();
        assert!(!named.is_unchanged());
        assert!(Named::look("..", Path::new("..")).is_ok(), "contents of folders do not count");
    }

    #[test]
    fn canonical_json_is_sorted() {
        assert_eq!(
            canonical(&json!({"b": [1, 2.5, null], "a": {"d": "x\"", "c": true}})),
            r#"{"a":{"c":true,"d":"x\""},"b":[1,2.5,null]}"#
        );
    }
}

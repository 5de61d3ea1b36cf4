//! Why a unit would run: the first difference between its key today and what the store has.

use super::plan::{Made, Progressed, Standing, UnitPlan, plan_stage};
use super::store::{Entry, Found, Store};
use super::survey::Survey;
use crate::config::{Pipeline, PipelineStage, Place, Source};
use crate::registry::{CRS, GRID, NAMED, RAW};
use serde::Serialize;
use serde_json::Value;
use std::cell::{OnceCell, RefCell};
use std::collections::BTreeMap;
use std::path::Path;
use timberline_artefact::{Header, InputRef, UnitId, UnitKind, kinds};

/// A difference between two keys of one unit.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "what", rename_all = "kebab-case")]
pub enum Difference {
    /// The stage's version.
    StageVersion {
        /// On disk.
        old: u32,
        /// Today.
        new: u32,
    },
    /// Version of the kind it writes.
    KindVersion {
        /// Kind.
        kind: String,
        /// On disk.
        old: u32,
        /// Today.
        new: u32,
    },
    /// A parameter.
    Param {
        /// Name.
        name: String,
        /// On disk.
        old: Option<Value>,
        /// Today.
        new: Option<Value>,
        /// Where today's value stands.
        place: Option<Place>,
    },
    /// Something it read is not read any more.
    InputRemoved {
        /// Kind.
        kind: String,
        /// Unit.
        unit: UnitId,
    },
    /// Something it did not read before.
    InputAdded {
        /// Kind.
        kind: String,
        /// Unit.
        unit: UnitId,
    },
    /// Something it reads has another key.
    InputChanged {
        /// Kind.
        kind: String,
        /// Unit.
        unit: UnitId,
        /// On disk.
        old: String,
        /// Today.
        new: String,
    },
}

/// Why a unit is not up to date.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "cause", rename_all = "kebab-case")]
pub enum Cause {
    /// The store has never had it.
    New,
    /// An artefact is damaged.
    Corrupt {
        /// Which.
        path: std::path::PathBuf,
        /// How.
        error: String,
    },
    /// Part of its artefacts is gone.
    Incomplete,
    /// Something it reads is not there.
    Blocked {
        /// What.
        absent: Vec<String>,
    },
    /// Its key changed; all differences, the first one first.
    Changed {
        /// The differences.
        differences: Vec<Difference>,
    },
}

/// A unit that would run, and why.
#[derive(Debug, Clone, Serialize)]
pub struct Explained {
    /// Stage.
    pub stage: String,
    /// Unit.
    pub unit: UnitId,
    /// Its key today.
    pub key: String,
    /// Its own cause.
    pub cause: Cause,
    /// The cause in words.
    pub words: String,
    /// Where it began: the first stage upstream with a cause of its own.
    pub root: Option<Root>,
}

/// Where a change began.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Root {
    /// Stage.
    pub stage: String,
    /// Unit.
    pub unit: UnitId,
    /// Cause in words.
    pub words: String,
}

/// A whole pipeline planned without running anything.
pub struct DryRun<'a> {
    pipeline: &'a Pipeline,
    store: &'a Store,
    /// The units of every stage.
    pub stages: Vec<Vec<UnitPlan>>,
    /// What the store holds of every stage, listed when first asked for.
    entries: Vec<OnceCell<Entries>>,
    /// Where the change of a unit of a stage began, for those asked for before.
    roots: RefCell<BTreeMap<(usize, UnitId), Root>>,
}

/// Artefacts of a stage by the file stem of their unit.
type Entries = BTreeMap<String, Vec<Entry>>;

impl<'a> DryRun<'a> {
    /// Plans all stages as if everything that would run had succeeded.
    ///
    /// # Errors
    /// What a stage says about its parameters.
    pub fn new(pipeline: &'a Pipeline, survey: &Survey, store: &'a Store) -> Result<Self, String> {
        let (mut before, mut stages) = (Progressed::new(), Vec::new());
        for position in 0..pipeline.stages.len() {
            let plans = plan_stage(pipeline, position, survey, store, &before)?;
            before.push(plans.iter().map(|plan| (plan.unit().clone(), assumed(plan))).collect());
            stages.push(plans);
        }
        store.save();
        let entries = stages.iter().map(|_| OnceCell::new()).collect();
        Ok(Self { pipeline, store, stages, entries, roots: RefCell::default() })
    }

    /// The stage that must run before the units of a stage are known: the last one before the trees.
    #[must_use]
    pub fn units_known_after(&self, position: usize) -> Option<&'static str> {
        let info = |at: usize| self.pipeline.stages[at].stage.info();
        let will_run = |at: &usize| {
            info(*at).unit != UnitKind::Tree && self.stages[*at].iter().any(|plan| !plan.is_whole())
        };
        let asks = info(position).unit == UnitKind::Tree;
        (0..position).rev().find(will_run).filter(|_| asks).map(|at| info(at).name)
    }

    fn entries(&self, position: usize) -> &Entries {
        let list = || self.store.entries(self.pipeline.stages[position].name());
        self.entries[position].get_or_init(list)
    }

    /// Why every unit of a stage that is not up to date would run.
    #[must_use]
    pub fn explain(&self, position: usize) -> Vec<Explained> {
        let stale = self.stages[position].iter().filter(|plan| !plan.is_whole());
        stale.map(|plan| self.explain_unit(position, plan)).collect()
    }

    fn explain_unit(&self, position: usize, plan: &UnitPlan) -> Explained {
        let stage = &self.pipeline.stages[position];
        let cause = cause(stage, plan, self.entries(position));
        Explained {
            stage: stage.name().to_owned(),
            unit: plan.unit().clone(),
            key: plan.task.key.clone(),
            words: words(stage, &self.pipeline.path, &cause),
            root: self.root(position, &cause),
            cause,
        }
    }

    /// Follows changed and added inputs upwards to the stage where a change began.
    fn root(&self, position: usize, cause: &Cause) -> Option<Root> {
        let Cause::Changed { differences } = cause else { return None };
        let (kind, unit) = match differences.first()? {
            Difference::InputChanged { kind, unit, .. } | Difference::InputAdded { kind, unit } => {
                (kind, unit)
            }
            _ => return None,
        };
        let inputs = self.pipeline.stages[position].stage.info().inputs;
        let at = inputs.iter().position(|input| input.kind == kind)?;
        let from = self.pipeline.producers(position).get(at).copied().flatten()?;
        if let Some(known) = self.roots.borrow().get(&(from, unit.clone())) {
            return Some(known.clone());
        }
        let plan = self.stages[from].iter().find(|plan| plan.unit() == unit)?;
        let stage = &self.pipeline.stages[from];
        let entries = self.entries(from);
        let cause = match plan.is_whole() {
            true => changed(stage, plan, entries)?,
            false => self::cause(stage, plan, entries),
        };
        let here = || Root {
            stage: stage.name().to_owned(),
            unit: unit.clone(),
            words: words(stage, &self.pipeline.path, &cause),
        };
        let root = self.root(from, &cause).unwrap_or_else(here);
        self.roots.borrow_mut().insert((from, unit.clone()), root.clone());
        Some(root)
    }
}

fn assumed(plan: &UnitPlan) -> Made {
    let key = plan.task.key.clone();
    let (points, parts, trees) = (plan.points, plan.expected_parts.clone(), Vec::new());
    match &plan.found {
        Found::Whole(known) => Made {
            key,
            standing: Standing::Ready,
            points: known.points,
            parts: known.parts.clone(),
            trees: known.trees.clone(),
        },
        _ if plan.absent.is_empty() => {
            Made { key, standing: Standing::WillRun, points, parts, trees }
        }
        _ => Made { key, standing: Standing::Absent, points: 0, parts: Vec::new(), trees },
    }
}

fn cause(stage: &PipelineStage, plan: &UnitPlan, entries: &Entries) -> Cause {
    if !plan.absent.is_empty() {
        return Cause::Blocked { absent: plan.absent.clone() };
    }
    if let Found::Corrupt { path, error } = &plan.found {
        return Cause::Corrupt { path: path.clone(), error: error.clone() };
    }
    let here = entries.get(&plan.unit().file_stem());
    if here.is_some_and(|all| all.iter().any(|entry| entry.key == plan.task.key)) {
        return Cause::Incomplete;
    }
    changed(stage, plan, entries).unwrap_or(Cause::New)
}

/// The differences to the artefact on disk that is most like today's unit (the newest of several).
fn changed(stage: &PipelineStage, plan: &UnitPlan, entries: &Entries) -> Option<Cause> {
    let others =
        entries.get(&plan.unit().file_stem())?.iter().filter(|entry| entry.key != plan.task.key);
    let compared = others.filter_map(|entry| {
        let header = timberline_artefact::read_header(&entry.path).ok()?;
        let age = std::fs::metadata(&entry.path).and_then(|meta| meta.modified()).ok();
        Some((differences(stage, plan, &header), std::cmp::Reverse(age)))
    });
    let nearest = compared.min_by(|a, b| (a.0.len(), a.1).cmp(&(b.0.len(), b.1)))?;
    Some(Cause::Changed { differences: nearest.0 })
}

/// All differences, in the order in which they explain each other.
#[must_use]
pub fn differences(stage: &PipelineStage, plan: &UnitPlan, old: &Header) -> Vec<Difference> {
    let mut found = Vec::new();
    if old.stage_version != plan.task.stage_version {
        found.push(Difference::StageVersion {
            old: old.stage_version,
            new: plan.task.stage_version,
        });
    }
    let version = kinds::info(&old.kind).map(|info| info.version);
    if let Some(new) = version.filter(|new| *new != old.kind_version) {
        found.push(Difference::KindVersion { kind: old.kind.clone(), old: old.kind_version, new });
    }
    found.extend(param_differences(stage, &old.params, &plan.task.params));
    found.extend(input_differences(&old.inputs, &plan.task.inputs));
    found
}

fn param_differences(stage: &PipelineStage, old: &Value, new: &Value) -> Vec<Difference> {
    let none = serde_json::Map::new();
    let (old, new) = (old.as_object().unwrap_or(&none), new.as_object().unwrap_or(&none));
    let names: std::collections::BTreeSet<&String> = old.keys().chain(new.keys()).collect();
    let differ = names
        .into_iter()
        .filter(|name| old.get(*name) != new.get(*name) && !stage.limits.contains(*name));
    let mut found: Vec<Difference> = differ
        .map(|name| Difference::Param {
            name: name.clone(),
            old: old.get(name).cloned(),
            new: new.get(name).cloned(),
            place: stage.places.get(name).copied(),
        })
        .collect();
    // Values that stand in the file come first: that is where the user looks.
    found.sort_by_key(|difference| matches!(difference, Difference::Param { place: None, .. }));
    found
}

fn input_differences(old: &[InputRef], new: &[InputRef]) -> Vec<Difference> {
    let index = |refs: &[InputRef]| -> BTreeMap<(String, UnitId), String> {
        refs.iter().map(|r| ((r.kind.clone(), r.unit.clone()), r.key.clone())).collect()
    };
    let (old, new) = (index(old), index(new));
    let added = new.keys().filter(|key| !old.contains_key(*key));
    let removed = old.keys().filter(|key| !new.contains_key(*key));
    let changed = new.iter().filter_map(|((kind, unit), now)| {
        let before = old.get(&(kind.clone(), unit.clone())).filter(|before| *before != now)?;
        Some(Difference::InputChanged {
            kind: kind.clone(),
            unit: unit.clone(),
            old: before.clone(),
            new: now.clone(),
        })
    });
    let own = |kind: &str| matches!(kind, RAW | GRID | CRS | NAMED);
    let mut found: Vec<Difference> = added
        .map(|(kind, unit)| Difference::InputAdded { kind: kind.clone(), unit: unit.clone() })
        .chain(removed.map(|(kind, unit)| Difference::InputRemoved {
            kind: kind.clone(),
            unit: unit.clone(),
        }))
        .chain(changed)
        .collect();
    found.sort_by_key(|difference| match difference {
        Difference::InputChanged { kind, .. }
        | Difference::InputAdded { kind, .. }
        | Difference::InputRemoved { kind, .. }
            if own(kind) =>
        {
            0
        }
        Difference::InputAdded { .. } => 1,
        Difference::InputRemoved { .. } => 2,
        _ => 3,
    });
    found
}

/// A cause in words.
#[must_use]
pub fn words(stage: &PipelineStage, file: &Path, cause: &Cause) -> String {
    match cause {
        Cause::New => "not made before".to_owned(),
        Cause::Incomplete => "part of its artefacts is gone".to_owned(),
        Cause::Blocked { absent } => format!("cannot run: {} missing", absent.join(", ")),
        Cause::Corrupt { path, error } => match error.contains(&*path.to_string_lossy()) {
            true => error.clone(),
            false => format!("{}: {error}", path.display()),
        },
        Cause::Changed { differences } => differences.first().map_or_else(
            || "its key changed".to_owned(),
            |first| difference_words(stage, file, first),
        ),
    }
}

/// A difference in words.
#[must_use]
pub fn difference_words(stage: &PipelineStage, file: &Path, difference: &Difference) -> String {
    match difference {
        Difference::StageVersion { old, new } => {
            format!("stage `{}` is now version {new}, was {old}", stage.name())
        }
        Difference::KindVersion { kind, old, new } => {
            format!("the form of `{kind}` is now version {new}, was {old}")
        }
        Difference::Param { name, old, new, .. } => {
            param_words(stage, file, name, old.as_ref(), new.as_ref())
        }
        Difference::InputAdded { kind, .. } if kind == CRS => {
            "[crs] was added to the campaign file".to_owned()
        }
        Difference::InputRemoved { kind, .. } if kind == CRS => {
            "[crs] was taken out of the campaign file".to_owned()
        }
        Difference::InputAdded { kind, unit } if kind == NAMED => {
            format!("[{}] now names the file {}", stage.name(), name_of(unit))
        }
        Difference::InputRemoved { kind, unit } if kind == NAMED => {
            format!("[{}] no longer names the file {}", stage.name(), name_of(unit))
        }
        Difference::InputChanged { kind, unit, .. } if kind == NAMED => {
            format!("contents of {}, named in [{}], changed", name_of(unit), stage.name())
        }
        Difference::InputAdded { kind, unit } => format!("input added: {kind} of {unit}"),
        Difference::InputRemoved { kind, unit } => format!("input removed: {kind} of {unit}"),
        Difference::InputChanged { kind, old, new, .. } if kind == GRID => {
            format!("tile grid: {old} -> {new}")
        }
        Difference::InputChanged { kind, old, new, .. } if kind == CRS => {
            format!("[crs] of the campaign: {old} -> {new}")
        }
        Difference::InputChanged { kind, unit, .. } if kind == RAW => {
            format!("contents of {unit} changed")
        }
        Difference::InputChanged { kind, unit, .. } => format!("input changed: {kind} of {unit}"),
    }
}

/// A file's own name.
fn name_of(unit: &UnitId) -> String {
    if let UnitId::File(name) = unit { name.clone() } else { unit.to_string() }
}

fn param_words(
    stage: &PipelineStage,
    file: &Path,
    name: &str,
    old: Option<&Value>,
    new: Option<&Value>,
) -> String {
    let place = match stage.source(name) {
        Source::File(place) => format!("{}:{}:{}", file.display(), place.line, place.column),
        Source::Default => {
            format!("default, not set in [{}], {}:{}", stage.name(), file.display(), stage.at.line)
        }
    };
    match (old, new) {
        (Some(old), Some(new)) => format!("parameter `{name}` {old} -> {new} ({place})"),
        (Some(old), None) => format!("parameter `{name}` (was {old}) no longer exists"),
        (None, Some(new)) => format!("parameter `{name}` is new: {new} ({place})"),
        (None, None) => format!("parameter `{name}`"),
    }
}

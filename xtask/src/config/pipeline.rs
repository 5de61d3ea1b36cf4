//! Pipeline files: which stages run, with which parameters.

use super::document::{Content, Node};
use super::{Document, Place, Problem, Problems, check, nearest};
use crate::registry::{AnyStage, Registry};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::{Path, PathBuf};

/// A pipeline in effect: every parameter has its value.
#[derive(Clone)]
pub struct Pipeline {
    /// The file it came from.
    pub path: PathBuf,
    /// Its name.
    pub name: String,
    /// What it is for.
    pub description: String,
    /// Its stages, in the order in which they run.
    pub stages: Vec<PipelineStage>,
}

/// One stage with its effective parameters.
#[derive(Clone)]
pub struct PipelineStage {
    /// The implementation.
    pub stage: AnyStage,
    /// All parameters, those not named in the file at their defaults.
    pub params: Value,
    /// Where the values named in the file stand.
    pub places: BTreeMap<String, Place>,
    /// Where the stage's table stands, or its name in `stages`.
    pub at: Place,
    /// The files its parameters name, by name: where they are.
    pub files: BTreeMap<String, PathBuf>,
    /// Its parameters that can change no result and are no part of a key.
    pub limits: BTreeSet<String>,
}

/// Where an effective value comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The stage's default.
    Default,
    /// The pipeline file.
    File(Place),
}

impl Pipeline {
    /// Reads a pipeline file.
    ///
    /// # Errors
    /// [`Problems`]: all its faults.
    pub fn load(path: &Path, registry: &Registry) -> Result<Self, Problems> {
        Self::resolve(&Document::read(path)?, registry)
    }

    /// Resolves a parsed pipeline file.
    ///
    /// # Errors
    /// [`Problems`]: all its faults.
    pub fn resolve(document: &Document, registry: &Registry) -> Result<Self, Problems> {
        let mut found = Vec::new();
        let (own, tables) = split(&document.root);
        check::check(&document.path, &own, &frame_schema(), &mut found);
        let listed = listed(document, registry, &mut found);
        check_tables(document, &tables, registry, &listed, &mut found);
        let stages = listed
            .iter()
            .filter_map(|(stage, at)| resolve_stage(document, stage, *at, &tables, &mut found))
            .collect();
        check_wiring(document, &listed, &mut found);
        Problems::check(found)?;
        let text =
            |key: &str| own.get(key).and_then(|node| node.to_json().as_str().map(str::to_owned));
        Ok(Self {
            path: document.path.clone(),
            name: text("name").unwrap_or_default(),
            description: text("description").unwrap_or_default(),
            stages,
        })
    }

    /// The position of a stage.
    #[must_use]
    pub fn position(&self, name: &str) -> Option<usize> {
        self.stages.iter().position(|stage| stage.name() == name)
    }

    /// The stages that make a stage's inputs, in the order of its input list; `None` for raw files.
    #[must_use]
    pub fn producers(&self, position: usize) -> Vec<Option<usize>> {
        let writes = |kind: &str| {
            self.stages[..position].iter().rposition(|s| s.stage.info().outputs.contains(&kind))
        };
        self.stages[position].stage.info().inputs.iter().map(|input| writes(input.kind)).collect()
    }

    /// The stages that depend on one, directly or not, in order.
    #[must_use]
    pub fn downstream(&self, position: usize) -> Vec<&str> {
        let mut reached = vec![position];
        for later in position + 1..self.stages.len() {
            if self.producers(later).iter().flatten().any(|from| reached.contains(from)) {
                reached.push(later);
            }
        }
        reached[1..].iter().map(|&index| self.stages[index].name()).collect()
    }
}

impl PipelineStage {
    /// The stage's name.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.stage.info().name
    }

    /// The parameters that are part of a key.
    #[must_use]
    pub fn key_params(&self) -> Value {
        let mut params = self.params.clone();
        if let Some(object) = params.as_object_mut() {
            object.retain(|name, _| !self.limits.contains(name));
        }
        params
    }

    /// Where a parameter's value comes from.
    #[must_use]
    pub fn source(&self, param: &str) -> Source {
        self.places.get(param).map_or(Source::Default, |place| Source::File(*place))
    }
}

/// JSON Schema of pipeline files over the stages of a registry.
#[must_use]
pub fn schema(registry: &Registry) -> Value {
    let mut whole = frame_schema();
    for stage in registry.stages() {
        let name = stage.info().name;
        let mut table = stage.schema();
        move_references(&mut table, &format!("#/properties/{name}"));
        if let Some(object) = table.as_object_mut() {
            object.remove("$schema");
            object.insert("description".into(), stage.info().summary.into());
        }
        whole["properties"][name] = table;
    }
    let names: Vec<&str> = registry.stages().map(|stage| stage.info().name).collect();
    whole["properties"]["stages"]["items"] = json!({ "type": "string", "enum": names });
    whole
}

fn frame_schema() -> Value {
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Timberline pipeline file",
        "type": "object",
        "properties": {
            "name": { "type": "string", "description": "Name of the pipeline." },
            "description": { "type": "string", "description": "What it is for." },
            "stages": {
                "type": "array", "items": { "type": "string" }, "minItems": 1, "uniqueItems": true,
                "description": "The stages, in the order in which they run."
            }
        },
        "required": ["name", "stages"],
        "additionalProperties": false
    })
}

fn move_references(schema: &mut Value, to: &str) {
    match schema {
        Value::Object(object) => {
            if let Some(Value::String(reference)) = object.get_mut("$ref")
                && let Some(rest) = reference.strip_prefix('#')
            {
                *reference = format!("{to}{rest}");
            }
            object.values_mut().for_each(|value| move_references(value, to));
        }
        Value::Array(values) => values.iter_mut().for_each(|value| move_references(value, to)),
        _ => {}
    }
}

/// The file's own keys apart from the stages' tables.
fn split(root: &Node) -> (Node, BTreeMap<String, Node>) {
    let Content::Table(entries) = &root.content else { return (root.clone(), BTreeMap::new()) };
    let table = |node: &Node| matches!(node.content, Content::Table(_));
    let (tables, own): (BTreeMap<_, _>, BTreeMap<_, _>) =
        entries.clone().into_iter().partition(|(_, node)| table(node));
    (Node { content: Content::Table(own), ..root.clone() }, tables)
}

/// The stages of the `stages` list that exist, each once.
fn listed(
    document: &Document,
    registry: &Registry,
    found: &mut Vec<Problem>,
) -> Vec<(AnyStage, Place)> {
    let Some(Node { content: Content::List(items), .. }) = document.root.get("stages") else {
        return Vec::new();
    };
    let mut stages: Vec<(AnyStage, Place)> = Vec::new();
    for item in items {
        let Content::Scalar(Value::String(name)) = &item.content else { continue };
        match registry.get(name) {
            None => found.push(unknown_stage(document, name, item.at, registry)),
            Some(stage)
                if stages.iter().any(|(other, _)| other.info().name == stage.info().name) =>
            {
                let what = format!("stage `{name}` is listed twice");
                found.push(Problem::new(&document.path, Some(item.at), what));
            }
            Some(stage) => stages.push((stage, item.at)),
        }
    }
    stages
}

fn unknown_stage(document: &Document, name: &str, at: Place, registry: &Registry) -> Problem {
    let names: Vec<&str> = registry.stages().map(|stage| stage.info().name).collect();
    let hint = match nearest(name, names.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("known stages: {}", names.join(", ")),
    };
    Problem::new(&document.path, Some(at), format!("there is no stage `{name}`")).hint(Some(hint))
}

/// Tables that belong to no stage of the list.
fn check_tables(
    document: &Document,
    tables: &BTreeMap<String, Node>,
    registry: &Registry,
    listed: &[(AnyStage, Place)],
    found: &mut Vec<Problem>,
) {
    for (name, node) in tables {
        if listed.iter().any(|(stage, _)| stage.info().name == name) {
            continue;
        }
        found.push(match registry.get(name) {
            None => unknown_stage(document, name, node.key_at, registry),
            Some(_) => {
                let what = format!("stage `{name}` has parameters but is not in `stages`");
                Problem::new(&document.path, Some(node.key_at), what)
            }
        });
    }
}

fn resolve_stage(
    document: &Document,
    stage: &AnyStage,
    at: Place,
    tables: &BTreeMap<String, Node>,
    found: &mut Vec<Problem>,
) -> Option<PipelineStage> {
    let name = stage.info().name;
    let table = tables.get(name);
    let before = found.len();
    if let Some(table) = table {
        let mut own = Vec::new();
        check::check(&document.path, table, &stage.schema(), &mut own);
        own.iter_mut()
            .for_each(|problem| problem.what = format!("{} (stage {name})", problem.what));
        found.append(&mut own);
    }
    if found.len() > before {
        return None;
    }
    let at = table.map_or(at, |table| table.key_at);
    let given = table.map_or_else(|| Value::Object(Map::new()), Node::to_json);
    match crate::registry::effective(stage, &given) {
        Ok(params) => {
            let places = table.map(places).unwrap_or_default();
            let files = named_files(document, stage, &params, &places, at, found);
            let limits = limits(&stage.schema());
            Some(PipelineStage { stage: stage.clone(), params, places, at, files, limits })
        }
        Err(faults) => {
            let fault =
                |what: String| Problem::new(&document.path, Some(at), format!("[{name}] {what}"));
            found.extend(faults.into_iter().map(fault));
            None
        }
    }
}

/// The files that the parameters of a stage name; those that must be there and are not are faults.
fn named_files(
    document: &Document,
    stage: &AnyStage,
    params: &Value,
    places: &BTreeMap<String, Place>,
    at: Place,
    found: &mut Vec<Problem>,
) -> BTreeMap<String, PathBuf> {
    let folder = document.path.parent().unwrap_or(Path::new(""));
    let folder = std::path::absolute(folder.join(".")).unwrap_or_else(|_| folder.to_owned());
    let mut files = BTreeMap::new();
    for named in stage.files(params).unwrap_or_default() {
        let path = folder.join(&named.name);
        let fault = if !path.exists() {
            let hint = format!("relative paths count from {}", folder.display());
            named.required.then(|| ("there is no such file".to_owned(), hint))
        } else if let Err(error) = first_byte(&path) {
            let hint = "its contents are part of the key: make it readable".to_owned();
            Some((format!("it cannot be read ({error})"), hint))
        } else {
            files.insert(named.name.clone(), path);
            None
        };
        if let Some((fault, hint)) = fault {
            let what = format!("`{}` names `{}`: {fault}", named.param, named.name);
            let place = places.get(named.param).copied().unwrap_or(at);
            found.push(Problem::new(&document.path, Some(place), what).hint(Some(hint)));
        }
    }
    files
}

/// Reads the beginning of a file; a folder has none.
fn first_byte(path: &Path) -> std::io::Result<()> {
    if path.is_dir() { Ok(()) } else { std::fs::File::open(path)?.read(&mut [0]).map(drop) }
}

/// The parameters that a schema marks as limits.
fn limits(schema: &Value) -> BTreeSet<String> {
    let properties = schema.get("properties").and_then(Value::as_object);
    let marked = |property: &Value| property.get("x-limit") == Some(&Value::Bool(true));
    let marked = properties.into_iter().flatten().filter(|(_, property)| marked(property));
    marked.map(|(name, _)| name.clone()).collect()
}

fn places(table: &Node) -> BTreeMap<String, Place> {
    match &table.content {
        Content::Table(entries) => {
            entries.iter().map(|(key, node)| (key.clone(), node.key_at)).collect()
        }
        _ => BTreeMap::new(),
    }
}

/// Every input must be written by an earlier stage.
fn check_wiring(document: &Document, listed: &[(AnyStage, Place)], found: &mut Vec<Problem>) {
    for (position, (stage, at)) in listed.iter().enumerate() {
        for input in stage.info().inputs {
            let written =
                |(earlier, _): &(AnyStage, Place)| earlier.info().outputs.contains(&input.kind);
            if listed[..position].iter().any(written) {
                continue;
            }
            let what = format!(
                "stage `{}` reads `{}`, which no stage before it writes",
                stage.info().name,
                input.kind
            );
            let later = listed[position..].iter().find(|entry| written(entry));
            let hint = later.map(|(later, _)| {
                format!("stage `{}` writes it: list it earlier", later.info().name)
            });
            found.push(Problem::new(&document.path, Some(*at), what).hint(hint));
        }
    }
}

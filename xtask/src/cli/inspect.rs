//! `inspect`: what an artefact holds.

mod of_trees;

use super::out::{self, Table};
use super::{DONE, Usage, picture};
use crate::engine::progress::{bytes, short};
use anyhow::{Context, Result};
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use timberline_artefact::kinds::{
    self, Consolidated, CrownModels, Detections, GroundModel, GroundPoints, Heights, Labels,
    ModelFiles, Outputs, PictureFiles, PointTile, Qsm, Shards, Skeletons, Stems, TreeCloud, Trees,
    Treetops,
};
use timberline_artefact::{Header, InputRef, Kind, Opened};

/// Inputs of a unit that are listed one by one.
const INPUTS_SHOWN: usize = 12;
/// Warnings that are shown.
const WARNINGS_SHOWN: usize = 10;

/// Arguments of `inspect`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// The artefact, a file of a store
    artefact: PathBuf,
    /// Rows of its tables to show
    #[arg(long, default_value_t = 5)]
    rows: usize,
    /// Draw it into this file as well
    #[arg(long, value_name = "FILE")]
    png: Option<PathBuf>,
    /// Print everything but the rows as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// When the file is no artefact, or damaged.
pub fn run(args: &Args) -> Result<u8> {
    let path = &args.artefact;
    if !path.is_file() {
        return Err(Usage(format!("{}: there is no such file", path.display())).into());
    }
    let mut opened = Opened::open(path)?;
    opened.verify()?;
    let header = opened.header().clone();
    drop(opened);
    if let Some(target) = &args.png {
        picture::write(path, &header, target)?;
    }
    let tables = tables(path, &header)?;
    if args.json {
        let ranges: Vec<Value> = tables.iter().map(|(name, rows)| json!({ "table": name, "rows": rows.len(), "columns": ranges(rows) })).collect();
        out::json(
            &json!({ "header": header, "lineage": lineage(path, &header), "tables": ranges }),
        )?;
        return Ok(DONE);
    }
    print_header(path, &header);
    for line in lineage(path, &header) {
        out::line(&format!("  made from      {line}"));
    }
    for (name, rows) in &tables {
        print_table(name, rows, args.rows);
    }
    Ok(DONE)
}

fn print_header(path: &Path, header: &Header) {
    let size = std::fs::metadata(path).map_or(0, |meta| meta.len());
    out::line(&path.display().to_string());
    let field = |name: &str, value: String| out::line(&format!("  {name:<14} {value}"));
    field("kind", format!("{} ({}), {}", header.kind, version(header), bytes(size)));
    field("unit", header.unit.to_string());
    field("key", header.key.clone());
    field(
        "stage",
        format!(
            "{} (version {}), program {}",
            header.stage, header.stage_version, header.tool_version
        ),
    );
    if let Some(crs) = &header.facts.crs {
        let code = crs.epsg.map_or(String::new(), |code| format!(", EPSG:{code}"));
        field("crs", format!("{}{code}", crs.name));
    }
    if let Some(frame) = &header.facts.frame {
        field("frame", format!("origin {:?} m", frame.origin_m));
    }
    if let Some(bounds) = header.facts.bounds.filter(|bounds| !bounds.is_empty()) {
        field("bounds", format!("{:?} to {:?} m", bounds.min, bounds.max));
    }
    header
        .facts
        .counts
        .iter()
        .for_each(|(name, count)| field("count", format!("{name} = {count}")));
    if !header.facts.parts.is_empty() {
        let parts: Vec<String> = header.facts.parts.iter().map(ToString::to_string).collect();
        field("tiles", format!("{}: {}", parts.len(), parts.join(" ")));
    }
    for (name, value) in header.params.as_object().into_iter().flatten() {
        field("parameter", format!("{name} = {value}"));
    }
    for warning in header.warnings.iter().take(WARNINGS_SHOWN) {
        field("warning", format!("{}: {}", warning.subject, warning.message));
    }
    if header.warnings.len() > WARNINGS_SHOWN {
        field("warning", format!("... {} in all", header.warnings.len()));
    }
}

/// The version of the kind, and as what an older one is shown.
fn version(header: &Header) -> String {
    let own = header.kind_version;
    match kinds::info(&header.kind).map(|info| info.version) {
        Some(now) if now != own => format!("version {own}, shown as version {now}"),
        _ => format!("version {own}"),
    }
}

/// What the artefact was made from, back to the raw files.
fn lineage(path: &Path, header: &Header) -> Vec<String> {
    let mut lines = Vec::new();
    for input in header.inputs.iter().take(INPUTS_SHOWN) {
        let from = producer(path, input).map_or(String::new(), |stage| format!(" by {stage}"));
        lines.push(format!("{} of {}{from}, key {}", input.kind, input.unit, input.key));
    }
    if header.inputs.len() > INPUTS_SHOWN {
        lines.push(format!("... {} inputs in all", header.inputs.len()));
    }
    lines
}

/// The stage whose folder holds an input: the store is known from the artefact's own place.
fn producer(path: &Path, input: &InputRef) -> Option<String> {
    let store = path.parent()?.parent()?;
    let front = format!("{}-{}.{}.", input.unit.file_stem(), input.key, input.kind);
    let folders = std::fs::read_dir(store).ok()?.filter_map(Result::ok);
    let holds = |folder: &Path| {
        let files = std::fs::read_dir(folder).ok()?;
        files
            .filter_map(Result::ok)
            .find(|file| file.file_name().to_string_lossy().starts_with(&front))
    };
    let mut names = folders.filter(|folder| holds(&folder.path()).is_some());
    names.next().map(|folder| folder.file_name().to_string_lossy().into_owned())
}

type Rows = Vec<Map<String, Value>>;

/// The tables inside an artefact: name and rows.
fn tables(path: &Path, header: &Header) -> Result<Vec<(String, Rows)>> {
    let value = match header.kind.as_str() {
        GroundPoints::NAME => payload::<GroundPoints>(path)?,
        GroundModel::NAME => payload::<GroundModel>(path)?,
        Heights::NAME => payload::<Heights>(path)?,
        Treetops::NAME => payload::<Treetops>(path)?,
        CrownModels::NAME => payload::<CrownModels>(path)?,
        Detections::NAME => payload::<Detections>(path)?,
        Labels::NAME => payload::<Labels>(path)?,
        Trees::NAME => payload::<Trees>(path)?,
        Outputs::NAME => payload::<Outputs>(path)?,
        PointTile::NAME => {
            let (_, tile) = timberline_artefact::read::<PointTile>(path)?;
            serde_json::to_value(&tile.cloud)?
        }
        Stems::NAME => payload::<Stems>(path)?,
        TreeCloud::NAME => of_trees::tree_cloud(path)?,
        Consolidated::NAME => of_trees::consolidated(path)?,
        Skeletons::NAME => payload::<Skeletons>(path)?,
        Qsm::NAME => of_trees::qsm(path)?,
        ModelFiles::NAME => {
            of_trees::files(&timberline_artefact::read::<ModelFiles>(path)?.1.files)
        }
        PictureFiles::NAME => {
            of_trees::files(&timberline_artefact::read::<PictureFiles>(path)?.1.files)
        }
        Shards::NAME => Value::Null,
        other => anyhow::bail!("`{other}` is a kind this program does not know"),
    };
    Ok(split(&value))
}

fn payload<K: Kind + Serialize>(path: &Path) -> Result<Value> {
    let (_, value) = timberline_artefact::read::<K>(path)?;
    serde_json::to_value(&value).context("its contents have no text form")
}

/// Lists of numbers of one length become the columns of one table, lists of objects tables of their own.
fn split(value: &Value) -> Vec<(String, Rows)> {
    let mut tables: Vec<(String, Rows)> = Vec::new();
    let mut columns: Vec<(&String, &Vec<Value>)> = Vec::new();
    for (name, field) in value.as_object().into_iter().flatten() {
        match field {
            Value::Array(rows) if rows.first().is_some_and(Value::is_object) => {
                tables.push((
                    name.clone(),
                    rows.iter().filter_map(Value::as_object).cloned().collect(),
                ));
            }
            Value::Array(rows) if !rows.is_empty() => columns.push((name, rows)),
            Value::Object(_) if name != "frame" => {
                tables.extend(
                    split(field).into_iter().map(|(inner, rows)| (format!("{name}.{inner}"), rows)),
                );
            }
            _ => {}
        }
    }
    let longest = columns.iter().map(|(_, rows)| rows.len()).max().unwrap_or(0);
    if longest > 0 {
        let row = |index: usize| {
            let cell = |(name, rows): &(&String, &Vec<Value>)| {
                Some(((*name).clone(), rows.get(index)?.clone()))
            };
            columns.iter().filter_map(cell).collect()
        };
        tables.insert(0, ("values".to_owned(), (0..longest).map(row).collect()));
    }
    tables
}

/// Smallest and largest value of every numeric column, and how many are missing.
fn ranges(rows: &Rows) -> Map<String, Value> {
    let names: std::collections::BTreeSet<&String> = rows.iter().flat_map(Map::keys).collect();
    let range = |name: &String| {
        let numbers: Vec<f64> = rows.iter().filter_map(|row| row.get(name)?.as_f64()).collect();
        let low = numbers.iter().copied().reduce(f64::min)?;
        let high = numbers.iter().copied().reduce(f64::max)?;
        let missing = rows.iter().filter(|row| row.get(name).is_none_or(Value::is_null)).count();
        Some((name.clone(), json!({ "min": low, "max": high, "missing": missing })))
    };
    names.into_iter().filter_map(range).collect()
}

fn print_table(name: &str, rows: &Rows, shown: usize) {
    out::line(&format!("\n{name}: {} rows", rows.len()));
    let mut table = Table::new(&["  column", "min", "max", "missing"]);
    for (column, range) in ranges(rows) {
        let cell = |key: &str| range.get(key).map(number).unwrap_or_default();
        table.row([format!("  {column}"), cell("min"), cell("max"), cell("missing")]);
    }
    out::line(&table.text());
    for row in rows.iter().take(shown) {
        let cells: Vec<String> =
            row.iter().map(|(key, value)| format!("{key}={}", cell(value))).collect();
        out::line(&format!("  {}", cells.join(" ")));
    }
}

fn number(value: &Value) -> String {
    match value.as_f64() {
        Some(number) if number != 0.0 && number.abs() < 1e-3 => format!("{number:.1e}"),
        Some(number) if number.fract() != 0.0 => format!("{number:.4}"),
        _ => value.to_string(),
    }
}

fn cell(value: &Value) -> String {
    match value {
        Value::Array(items) if items.len() > 4 => format!("[{} values]", short(items.len() as f64)),
        Value::Array(items) => {
            format!("[{}]", items.iter().map(number).collect::<Vec<_>>().join(", "))
        }
        other => number(other),
    }
}

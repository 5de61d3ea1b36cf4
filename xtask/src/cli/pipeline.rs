//! `pipeline`: list, check, show.

use super::out::{self, Table};
use super::{DONE, Program};
use crate::config::check::{allowed, property};
use crate::config::{Pipeline, PipelineStage, Source};
use anyhow::{Context, Result};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Arguments of `pipeline`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// List the pipelines of a folder
    List {
        /// The folder
        #[arg(default_value = "pipelines")]
        folder: PathBuf,
        /// Print the list as JSON
        #[arg(long)]
        json: bool,
    },
    /// Check pipeline files
    Check {
        /// The files
        #[arg(required = true)]
        files: Vec<PathBuf>,
    },
    /// Print every parameter in effect: value, unit, range, where it comes from
    Show {
        /// The file
        file: PathBuf,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
}

/// Runs the command.
///
/// # Errors
/// Faults of the files.
pub fn run(program: &Program, args: &Args) -> Result<u8> {
    match &args.what {
        What::List { folder, json } => list(program, folder, *json),
        What::Check { files } => {
            for file in files {
                let pipeline = Pipeline::load(file, &program.registry)?;
                out::line(&format!(
                    "{}: {} stages, no fault",
                    file.display(),
                    pipeline.stages.len()
                ));
            }
            Ok(DONE)
        }
        What::Show { file, json } => show(&Pipeline::load(file, &program.registry)?, *json),
    }
}

fn list(program: &Program, folder: &Path, as_json: bool) -> Result<u8> {
    let entries =
        std::fs::read_dir(folder).with_context(|| format!("cannot read {}", folder.display()))?;
    let mut paths: Vec<PathBuf> =
        entries.filter_map(Result::ok).map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    paths.sort();
    let mut rows = Vec::new();
    let mut table = Table::new(&["file", "stages", "description"]).with_text();
    for path in paths {
        let pipeline = Pipeline::load(&path, &program.registry)?;
        let stages: Vec<&str> = pipeline.stages.iter().map(PipelineStage::name).collect();
        table.row([
            path.display().to_string(),
            stages.len().to_string(),
            pipeline.description.clone(),
        ]);
        rows.push(json!({ "file": path, "name": pipeline.name, "description": pipeline.description, "stages": stages }));
    }
    if as_json {
        out::json(&rows)?;
    } else {
        out::line(&table.text());
    }
    Ok(DONE)
}

fn show(pipeline: &Pipeline, as_json: bool) -> Result<u8> {
    if as_json {
        let stage = |stage: &PipelineStage| {
            let info = stage.stage.info();
            json!({ "name": info.name, "version": info.version, "summary": info.summary, "params": params_json(stage) })
        };
        let stages: Vec<Value> = pipeline.stages.iter().map(stage).collect();
        out::json(
            &json!({ "name": pipeline.name, "description": pipeline.description, "stages": stages }),
        )?;
        return Ok(DONE);
    }
    out::line(&format!("{}: {}", pipeline.name, pipeline.description));
    for (position, stage) in pipeline.stages.iter().enumerate() {
        let info = stage.stage.info();
        out::line(&format!("\n[{}] version {}: {}", info.name, info.version, info.summary));
        out::line(&format!("  {}", wiring(pipeline, position)));
        let mut table =
            Table::new(&["  parameter", "value", "unit", "from", "allowed; source"]).with_text();
        for row in rows(stage) {
            let from = match stage.source(&row.name) {
                Source::Default => "default".to_owned(),
                Source::File(place) => format!("line {}", place.line),
            };
            let notes = [row.allowed, row.source].into_iter().filter(|text| !text.is_empty());
            table.row([
                format!("  {}", row.name),
                row.value,
                row.unit,
                from,
                notes.collect::<Vec<_>>().join("; "),
            ]);
        }
        out::line(&table.text());
    }
    Ok(DONE)
}

fn wiring(pipeline: &Pipeline, position: usize) -> String {
    let info = pipeline.stages[position].stage.info();
    let from = pipeline.producers(position);
    let mut reads: Vec<String> = info
        .inputs
        .iter()
        .zip(from)
        .map(|(input, from)| match from {
            Some(from) => format!("{} ({})", input.kind, pipeline.stages[from].name()),
            None => input.kind.to_owned(),
        })
        .collect();
    if info.unit == timberline_artefact::UnitKind::File {
        reads.insert(0, "the raw file".to_owned());
    }
    format!("reads {}; writes {}", reads.join(", "), info.outputs.join(", "))
}

struct Row {
    name: String,
    value: String,
    unit: String,
    allowed: String,
    source: String,
}

fn rows(stage: &PipelineStage) -> Vec<Row> {
    let schema = stage.stage.schema();
    let none = serde_json::Map::new();
    let params = stage.params.as_object().unwrap_or(&none);
    params
        .iter()
        .map(|(name, value)| {
            let own = property(&schema, name).unwrap_or_default();
            let text =
                |key: &str| own.get(key).and_then(Value::as_str).unwrap_or_default().to_owned();
            Row {
                name: name.clone(),
                value: value.to_string(),
                unit: text("x-unit"),
                allowed: allowed(&own),
                source: text("x-source"),
            }
        })
        .collect()
}

fn params_json(stage: &PipelineStage) -> Value {
    let row = |row: Row| {
        let from = match stage.source(&row.name) {
            Source::Default => json!("default"),
            Source::File(place) => json!(place),
        };
        let value = stage.params.get(&row.name).cloned();
        (
            row.name,
            json!({ "value": value, "unit": row.unit, "allowed": row.allowed, "source": row.source, "from": from }),
        )
    };
    Value::Object(rows(stage).into_iter().map(row).collect())
}

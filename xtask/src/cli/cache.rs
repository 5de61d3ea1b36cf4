//! `cache`: what the store takes, and removal of what nothing uses.

use super::open::{Opened, Place};
use super::out::{self, Table};
use super::{DONE, Program, Usage};
use crate::engine::explain::DryRun;
use crate::engine::plan::targets;
use crate::engine::progress::bytes;
use crate::engine::runlog::{self, Event};
use crate::engine::store::parse_name;
use crate::engine::workdir::walk;
use anyhow::{Context, Result};
use serde_json::json;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Arguments of `cache`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Show how much each stage takes
    Size {
        #[command(flatten)]
        place: Place,
        /// Print the answer as JSON
        #[arg(long)]
        json: bool,
    },
    /// Remove artefacts that neither the pipeline as it is now nor a pinned run uses
    Gc {
        /// Pipeline file [default: that of the last run]
        pipeline: Option<PathBuf>,
        #[command(flatten)]
        place: Place,
        /// Only show what would be removed
        #[arg(long)]
        dry_run: bool,
        /// Print the answer as JSON
        #[arg(long)]
        json: bool,
    },
    /// Keep everything a run used, whatever changes later
    Pin {
        /// Name of the run [default: the last]
        run: Option<String>,
        #[command(flatten)]
        place: Place,
        /// Take the pin away
        #[arg(long)]
        remove: bool,
    },
}

/// Runs the command.
///
/// # Errors
/// Faults of the files, or the system's.
pub fn run(program: &Program, args: &Args) -> Result<u8> {
    match &args.what {
        What::Size { place, json } => size(place, *json),
        What::Gc { pipeline, place, dry_run, json } => {
            gc(program, place, pipeline.as_deref(), *dry_run, *json)
        }
        What::Pin { run, place, remove } => pin(place, run.as_deref(), *remove),
    }
}

/// Bytes of the files below a folder.
#[must_use]
pub fn folder_bytes(folder: &Path) -> u64 {
    let mut sum = 0;
    walk(folder, &mut |path| sum += std::fs::metadata(path).map_or(0, |meta| meta.len()));
    sum
}

fn size(place: &Place, json: bool) -> Result<u8> {
    let store = place.work_dir().store();
    let folders = std::fs::read_dir(&store)
        .with_context(|| format!("there is no store at {}", store.display()))?;
    let mut rows: Vec<(String, usize, u64)> = Vec::new();
    for folder in folders.filter_map(Result::ok) {
        let mut files = 0;
        walk(&folder.path(), &mut |_| files += 1);
        rows.push((
            folder.file_name().to_string_lossy().into_owned(),
            files,
            folder_bytes(&folder.path()),
        ));
    }
    rows.sort();
    if json {
        let rows: Vec<_> =
            rows.iter().map(|(s, n, b)| json!({ "stage": s, "files": n, "bytes": b })).collect();
        out::json(&rows)?;
        return Ok(DONE);
    }
    let mut table = Table::new(&["stage", "files", "size"]);
    rows.iter().for_each(|(stage, files, size)| {
        table.row([stage.clone(), files.to_string(), bytes(*size)]);
    });
    let (files, total) = rows.iter().fold((0, 0), |(n, b), row| (n + row.1, b + row.2));
    table.row(["total".to_owned(), files.to_string(), bytes(total)]);
    out::line(&table.text());
    Ok(DONE)
}

fn gc(
    program: &Program,
    place: &Place,
    pipeline: Option<&Path>,
    dry_run: bool,
    json: bool,
) -> Result<u8> {
    let opened = Opened::new(program, place, pipeline)?;
    let dry =
        DryRun::new(&opened.pipeline, &opened.survey, &opened.store).map_err(anyhow::Error::msg)?;
    let mut used: BTreeSet<PathBuf> = BTreeSet::new();
    for (stage, plans) in opened.pipeline.stages.iter().zip(&dry.stages) {
        used.extend(plans.iter().flat_map(|plan| targets(&opened.store, stage, plan)));
    }
    let pinned = pinned_keys(&opened)?;
    let (mut files, mut freed) = (Vec::new(), 0);
    walk(opened.store.folder(), &mut |path| {
        let keep = used.contains(path)
            || parse_name(path).is_none_or(|(_, entry)| pinned.contains(&entry.key));
        if !keep {
            freed += std::fs::metadata(path).map_or(0, |meta| meta.len());
            files.push(path.to_owned());
        }
    });
    if !dry_run {
        for path in &files {
            std::fs::remove_file(path)
                .with_context(|| format!("cannot remove {}", path.display()))?;
        }
    }
    if json {
        out::json(&json!({ "files": files, "bytes": freed, "removed": !dry_run }))?;
    } else {
        let verb = if dry_run { "would be removed" } else { "removed" };
        out::line(&format!("{} artefacts ({}) {verb}", files.len(), bytes(freed)));
    }
    Ok(DONE)
}

fn pinned_keys(opened: &Opened) -> Result<BTreeSet<String>> {
    let mut keys = BTreeSet::new();
    for id in pins(&opened.work.note("pins.json")) {
        for event in runlog::read(&opened.work.runs(), &id)? {
            if let Event::Unit(unit) = event {
                keys.insert(unit.key);
            }
        }
    }
    Ok(keys)
}

fn pins(path: &Path) -> BTreeSet<String> {
    std::fs::read(path)
        .ok()
        .and_then(|bytes| serde_json::from_slice(&bytes).ok())
        .unwrap_or_default()
}

fn pin(place: &Place, run: Option<&str>, remove: bool) -> Result<u8> {
    let work = place.work_dir();
    let known = runlog::list(&work.runs());
    let id = match run {
        Some(id) => id.to_owned(),
        None => known.last().cloned().ok_or_else(|| Usage("there is no run to pin".to_owned()))?,
    };
    if !known.contains(&id) {
        return Err(
            Usage(format!("there is no run `{id}`; the runs are {}", known.join(", "))).into()
        );
    }
    let path = work.note("pins.json");
    let mut all = pins(&path);
    if remove {
        all.remove(&id)
    } else {
        all.insert(id.clone())
    };
    timberline_artefact::publish::write_atomic(&path, &serde_json::to_vec(&all)?)?;
    out::line(&format!("{id} is {}pinned", if remove { "no longer " } else { "" }));
    Ok(DONE)
}

//! `export`: what a run left for people, copied elsewhere.

use super::open::Place;
use super::{DONE, Usage, out};
use crate::engine::progress::bytes;
use crate::engine::workdir::walk;
use anyhow::{Context, Result};
use std::path::PathBuf;

/// Arguments of `export`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "The run itself writes trees.csv, trees.gpkg, dtm.tif, chm.tif, points.laz and map.png."
)]
pub struct Args {
    /// Folder to copy to; it is made if need be
    to: PathBuf,
    /// Only these files: globs such as `*.gpkg`
    #[arg(value_name = "PATTERN")]
    only: Vec<String>,
    #[command(flatten)]
    place: Place,
    /// Overwrite files that are there
    #[arg(long)]
    force: bool,
}

/// Runs the command.
///
/// # Errors
/// When there is nothing to copy, or a file is in the way.
pub fn run(args: &Args) -> Result<u8> {
    let outputs = args.place.work_dir().outputs();
    let parse = |text: &String| {
        glob::Pattern::new(text).map_err(|error| Usage(format!("`{text}`: {error}")))
    };
    let patterns: Vec<glob::Pattern> = args.only.iter().map(parse).collect::<Result<_, _>>()?;
    let mut files = Vec::new();
    walk(&outputs, &mut |path| {
        let name = path.strip_prefix(&outputs).unwrap_or(path).to_owned();
        if patterns.is_empty() || patterns.iter().any(|pattern| pattern.matches_path(&name)) {
            files.push(name);
        }
    });
    if files.is_empty() {
        return Err(Usage(format!(
            "no such file in {}: run the pipeline first",
            outputs.display()
        ))
        .into());
    }
    for name in &files {
        let target = args.to.join(name);
        if target.exists() && !args.force {
            return Err(Usage(format!(
                "{} is there already; --force overwrites it",
                target.display()
            ))
            .into());
        }
        if let Some(folder) = target.parent() {
            std::fs::create_dir_all(folder)
                .with_context(|| format!("cannot make {}", folder.display()))?;
        }
        let size = std::fs::copy(outputs.join(name), &target)
            .with_context(|| format!("cannot write {}", target.display()))?;
        out::line(&format!("{} ({})", target.display(), bytes(size)));
    }
    Ok(DONE)
}

//! `doctor`.

use super::open::Place;
use super::out;
use super::{DONE, LOSSES};
use crate::engine::progress::bytes;
use crate::engine::store::{parse_name, verify};
use crate::engine::workdir::{leftovers, walk};
use anyhow::Result;
use rayon::prelude::*;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Arguments of `doctor`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    place: Place,
    /// Remove what is corrupt or left over; the next run rebuilds it
    #[arg(long)]
    fix: bool,
    /// Print the findings as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command. Exit code 3 when something is wrong.
///
/// # Errors
/// When a file cannot be removed.
pub fn run(args: &Args) -> Result<u8> {
    let work = args.place.work_dir();
    let mut files = Vec::new();
    walk(&work.store(), &mut |path| files.push(path.to_owned()));
    let stray = leftovers(work.root());
    files.retain(|path| !stray.contains(path));
    let found: Vec<(PathBuf, String)> = files
        .par_iter()
        .filter_map(|path| examine(path).err().map(|error| (path.clone(), error)))
        .collect();
    if args.fix {
        for path in found.iter().map(|(path, _)| path).chain(&stray) {
            if path.is_dir() { std::fs::remove_dir_all(path)? } else { std::fs::remove_file(path)? }
        }
    }
    let bad = !found.is_empty() || !stray.is_empty();
    if args.json {
        let corrupt: Vec<_> =
            found.iter().map(|(path, error)| json!({ "path": path, "error": error })).collect();
        out::json(
            &json!({ "checked": files.len(), "corrupt": corrupt, "left_over": stray, "removed": args.fix && bad }),
        )?;
    } else {
        print(&files, &found, &stray, args.fix);
    }
    Ok(if bad { LOSSES } else { DONE })
}

fn examine(path: &Path) -> Result<(), String> {
    let Some((_, entry)) = parse_name(path) else { return Err("does not belong here".to_owned()) };
    let header = verify(path)?;
    if header.key == entry.key && header.kind == entry.kind {
        return Ok(());
    }
    Err(format!("holds `{}` under the key {}: it was renamed", header.kind, header.key))
}

fn print(files: &[PathBuf], found: &[(PathBuf, String)], stray: &[PathBuf], fix: bool) {
    for (path, error) in found {
        let place = path.display().to_string();
        out::line(&if error.contains(&place) {
            error.clone()
        } else {
            format!("{place}: {error}")
        });
    }
    for path in stray {
        out::line(&format!(
            "{}: left over by a process that was killed, or in use",
            path.display()
        ));
    }
    let size: u64 =
        files.iter().filter_map(|path| std::fs::metadata(path).ok()).map(|meta| meta.len()).sum();
    out::line(&format!(
        "{} artefacts checked ({}), {} corrupt, {} left over",
        files.len(),
        bytes(size),
        found.len(),
        stray.len()
    ));
    let bad = !found.is_empty() || !stray.is_empty();
    if bad && !fix {
        out::talk("`doctor --fix` removes them; a run rebuilds what is needed");
    }
}

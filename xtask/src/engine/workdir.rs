//! The workspace of runs: `store/`, `runs/`, `outputs/`, and what keeps processes apart.

use anyhow::{Context, Result};
use std::fs::{File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};
use timberline_artefact::publish::TEMP_PREFIX;

/// Name of the workspace inside a campaign's folder.
pub const DEFAULT_NAME: &str = ".timberline";

/// A workspace.
#[derive(Debug, Clone)]
pub struct WorkDir {
    root: PathBuf,
}

/// While it lives, no other process takes this one's temporary files for left-overs.
#[derive(Debug)]
pub struct Presence {
    _lock: File,
}

impl WorkDir {
    /// The workspace at a folder, which need not exist yet.
    #[must_use]
    pub fn new(root: &Path) -> Self {
        Self { root: root.to_owned() }
    }

    /// The workspace of a campaign: `--work` or `.timberline` in its folder.
    #[must_use]
    pub fn of(campaign: &Path, work: Option<&Path>) -> Self {
        work.map_or_else(|| Self::new(&campaign.join(DEFAULT_NAME)), Self::new)
    }

    /// Its folder.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Artefacts by stage and unit.
    #[must_use]
    pub fn store(&self) -> PathBuf {
        self.root.join("store")
    }

    /// What ran.
    #[must_use]
    pub fn runs(&self) -> PathBuf {
        self.root.join("runs")
    }

    /// What users take away.
    #[must_use]
    pub fn outputs(&self) -> PathBuf {
        self.root.join("outputs")
    }

    /// A file of the engine's own notes, all of which can be made again.
    #[must_use]
    pub fn note(&self, name: &str) -> PathBuf {
        self.root.join("notes").join(name)
    }

    /// Lock of a unit of a stage.
    #[must_use]
    pub fn lock(&self, stage: &str, unit_stem: &str) -> PathBuf {
        self.root.join("locks").join(format!("{stage}-{unit_stem}.lock"))
    }

    /// Makes the folders, removes what killed processes left behind, and announces this process.
    ///
    /// # Errors
    /// When the folders cannot be made.
    pub fn enter(&self) -> Result<Presence> {
        for folder in [
            self.store(),
            self.runs(),
            self.outputs(),
            self.root.join("locks"),
            self.root.join("notes"),
        ] {
            std::fs::create_dir_all(&folder)
                .with_context(|| format!("cannot make the folder {}", folder.display()))?;
        }
        let path = self.root.join("presence");
        let open = OpenOptions::new().create(true).truncate(false).write(true).open(&path);
        let lock = open.with_context(|| format!("cannot open {}", path.display()))?;
        match lock.try_lock() {
            Ok(()) => {
                self.sweep();
                lock.unlock().context("cannot release the workspace")?;
            }
            Err(TryLockError::WouldBlock) => {
                tracing::info!("another process works on {}", self.root.display());
            }
            Err(TryLockError::Error(error)) => {
                tracing::warn!("{}: locks do not work here: {error}", path.display());
                return Ok(Presence { _lock: lock });
            }
        }
        lock.lock_shared().with_context(|| format!("cannot lock {}", path.display()))?;
        Ok(Presence { _lock: lock })
    }

    /// Removes temporary files and locks. Only to be called while nobody else is at work.
    fn sweep(&self) {
        for path in leftovers(&self.root) {
            let removed = match path.is_dir() {
                true => std::fs::remove_dir_all(&path),
                false => std::fs::remove_file(&path),
            };
            match removed {
                Ok(()) => tracing::info!("removed left-over {}", path.display()),
                Err(error) => tracing::warn!("cannot remove {}: {error}", path.display()),
            }
        }
    }
}

/// Temporary files and folders, and locks, below a workspace, sorted.
#[must_use]
pub fn leftovers(root: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let Ok(entries) = std::fs::read_dir(root) else { return found };
    for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with(TEMP_PREFIX) || name.ends_with(".lock") {
            found.push(path);
        } else if path.is_dir() {
            found.extend(leftovers(&path));
        }
    }
    found.sort();
    found
}

/// Calls `each` for every file below a folder, sorted; folders that cannot be read or that hold work
/// in progress are passed over.
pub fn walk(folder: &Path, each: &mut dyn FnMut(&Path)) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let mut paths: Vec<PathBuf> =
        entries.filter_map(Result::ok).map(|entry| entry.path()).collect();
    paths.sort();
    for path in paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if !path.is_dir() {
            each(&path);
        } else if !name.starts_with(TEMP_PREFIX) {
            walk(&path, each);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leftovers_go_when_nobody_else_works() {
        let folder = tempfile::tempdir().unwrap();
        let work = WorkDir::new(&folder.path().join("w"));
        let first = work.enter().unwrap();
        let half = work.store().join(format!("{TEMP_PREFIX}x"));
        std::fs::write(&half, "half").unwrap();
        drop(work.enter().unwrap());
        assert!(half.exists(), "the first process may still write it");
        drop(first);
        drop(work.enter().unwrap());
        assert!(!half.exists());
    }
}

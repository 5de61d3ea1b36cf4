//! What the engine remembers about files so that it need not read them again.
//!
//! A note holds as long as size, modification time and inode are unchanged. Notes can be deleted at
//! any time; nothing but work is lost.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use timberline_artefact::publish::write_atomic;

/// What tells an unchanged file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    bytes: u64,
    modified_ns: u64,
    inode: u64,
}

impl Stamp {
    /// The stamp of a file as it is now.
    #[must_use]
    pub fn of(path: &Path) -> Option<Self> {
        let meta = std::fs::metadata(path).ok()?;
        let modified = meta.modified().ok()?.duration_since(std::time::UNIX_EPOCH).ok()?;
        Some(Self {
            bytes: meta.len(),
            modified_ns: modified.as_nanos() as u64,
            inode: inode(&meta),
        })
    }

    /// Size of the file.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

#[cfg(unix)]
fn inode(meta: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::ino(meta)
}

#[cfg(not(unix))]
fn inode(_: &Metadata) -> u64 {
    0
}

/// Notes about files, kept in one JSON file.
#[derive(Debug)]
pub struct Notes<T> {
    path: PathBuf,
    /// The entries, and whether they differ from the file.
    entries: Mutex<(Entries<T>, bool)>,
}

type Entries<T> = BTreeMap<PathBuf, (Stamp, T)>;

impl<T: Clone + Serialize + for<'a> Deserialize<'a>> Notes<T> {
    /// Reads the notes; a missing or broken file means there are none.
    #[must_use]
    pub fn open(path: PathBuf) -> Self {
        let read = std::fs::read(&path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
        Self { path, entries: Mutex::new((read.unwrap_or_default(), false)) }
    }

    /// What is known about a file, if it has not changed since.
    #[must_use]
    pub fn get(&self, path: &Path) -> Option<T> {
        let now = Stamp::of(path)?;
        let guard = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        guard.0.get(path).filter(|(stamp, _)| *stamp == now).map(|(_, value)| value.clone())
    }

    /// Notes something about a file. `stamp` is that of before the file was read.
    pub fn put(&self, path: &Path, stamp: Stamp, value: T) {
        let mut guard = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        guard.0.insert(path.to_owned(), (stamp, value));
        guard.1 = true;
    }

    /// Forgets a file.
    pub fn forget(&self, path: &Path) {
        let mut guard = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        guard.1 |= guard.0.remove(path).is_some();
    }

    /// Forgets files that are gone and writes the notes if they changed.
    pub fn save(&self) {
        let mut guard = self.entries.lock().unwrap_or_else(PoisonError::into_inner);
        if !guard.1 {
            return;
        }
        guard.0.retain(|path, _| path.exists());
        let written = serde_json::to_vec(&guard.0).map_err(|error| error.to_string());
        match written.and_then(|bytes| write_atomic(&self.path, &bytes).map_err(|e| e.to_string()))
        {
            Ok(()) => guard.1 = false,
            Err(error) => tracing::warn!("{}: not saved: {error}", self.path.display()),
        }
    }
}

/// blake3 of a file's contents, hexadecimal.
///
/// # Errors
/// The system's.
pub fn content_hash(path: &Path) -> std::io::Result<String> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(std::fs::File::open(path)?)?;
    Ok(hasher.finalize().to_hex().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_note_ends_with_the_files_contents() {
        let folder = tempfile::tempdir().unwrap();
        let (file, notes) = (folder.path().join("a"), folder.path().join("n.json"));
        std::fs::write(&file, "one").unwrap();
        let first = Notes::open(notes.clone());
        first.put(&file, Stamp::of(&file).unwrap(), 7u32);
        first.save();
        let again = Notes::<u32>::open(notes);
        assert_eq!(again.get(&file), Some(7));
        std::fs::write(&file, "other").unwrap();
        assert_eq!(again.get(&file), None);
    }
}

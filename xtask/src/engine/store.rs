//! The store of artefacts: what is there, and whether it is whole.

use super::notes::{Notes, Stamp, content_hash};
use super::workdir::WorkDir;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use timberline_artefact::kinds::{self, Outputs};
use timberline_artefact::stage::{StageInfo, artefact_path};
use timberline_artefact::{Header, Kind, Opened, TreeUnit, UnitId};
use timberline_pointcloud::TileId;

/// What the engine needs to know of an artefact that is whole.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Known {
    /// Points in it.
    pub points: u64,
    /// Tiles it holds points for.
    pub parts: Vec<TileId>,
    /// Trees it names as units of work.
    pub trees: Vec<TreeUnit>,
    /// Number of its warnings.
    pub warnings: usize,
}

/// Whether the store has a unit of a stage under a key.
#[derive(Debug, Clone, PartialEq)]
pub enum Found {
    /// All its artefacts are there and whole; what they say together.
    Whole(Known),
    /// At least one is not there.
    Missing,
    /// One is there but cannot be used.
    Corrupt {
        /// Which.
        path: PathBuf,
        /// Why.
        error: String,
    },
}

/// An artefact by its file name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Its key.
    pub key: String,
    /// Its kind.
    pub kind: String,
    /// Where it is.
    pub path: PathBuf,
}

/// The store of a workspace.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    outputs: PathBuf,
    notes: Notes<Known>,
    hashes: Notes<String>,
}

impl Store {
    /// The store of a workspace.
    #[must_use]
    pub fn open(work: &WorkDir) -> Self {
        Self {
            folder: work.store(),
            outputs: work.outputs(),
            notes: Notes::open(work.note("artefacts.json")),
            hashes: Notes::open(work.note("outputs.json")),
        }
    }

    /// Its folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where a unit's artefact of a kind is.
    #[must_use]
    pub fn path(&self, stage: &str, unit: &UnitId, key: &str, kind: &str) -> PathBuf {
        let extension = kinds::info(kind).map_or(kinds::TABLE_EXTENSION, |info| info.extension);
        artefact_path(&self.folder, stage, unit, key, kind, extension)
    }

    /// Looks for all artefacts of a unit.
    #[must_use]
    pub fn find(&self, info: &StageInfo, unit: &UnitId, key: &str) -> Found {
        let mut all = Known::default();
        for kind in info.outputs {
            let path = self.path(info.name, unit, key, kind);
            if !path.exists() {
                return Found::Missing;
            }
            match self.check(&path, kind, key) {
                Ok(known) => all = merge(all, known),
                Err(error) => return Found::Corrupt { path, error },
            }
        }
        match self.changed_output(info, unit, key) {
            Some((path, error)) => Found::Corrupt { path, error },
            None => Found::Whole(all),
        }
    }

    /// Checks one artefact, every byte of it unless that was done before.
    fn check(&self, path: &Path, kind: &str, key: &str) -> Result<Known, String> {
        if let Some(known) = self.notes.get(path) {
            return Ok(known);
        }
        let stamp = Stamp::of(path).ok_or("cannot be read")?;
        let header = verify(path)?;
        if (header.kind.as_str(), header.key.as_str()) != (kind, key) {
            return Err(format!("holds `{}` under the key {}", header.kind, header.key));
        }
        let known = Known {
            points: header.facts.counts.get("points").copied().unwrap_or(0),
            parts: header.facts.parts,
            trees: header.facts.trees,
            warnings: header.warnings.len(),
        };
        self.notes.put(path, stamp, known.clone());
        Ok(known)
    }

    /// A file for people that is no longer what the unit's manifest says.
    fn changed_output(
        &self,
        info: &StageInfo,
        unit: &UnitId,
        key: &str,
    ) -> Option<(PathBuf, String)> {
        if !info.outputs.contains(&Outputs::NAME) {
            return None;
        }
        let path = self.path(info.name, unit, key, Outputs::NAME);
        let (_, manifest) = timberline_artefact::read::<Outputs>(&path).ok()?;
        manifest.files.into_iter().find_map(|file| {
            let path = self.outputs.join(&file.name);
            match self.hash(&path) {
                Ok(hash) if hash == file.hash => None,
                Ok(_) => Some((path, "was changed after the run".to_owned())),
                Err(error) => Some((path, error.to_string())),
            }
        })
    }

    fn hash(&self, path: &Path) -> std::io::Result<String> {
        if let Some(hash) = self.hashes.get(path) {
            return Ok(hash);
        }
        let stamp = Stamp::of(path);
        let hash = content_hash(path)?;
        if let Some(stamp) = stamp {
            self.hashes.put(path, stamp, hash.clone());
        }
        Ok(hash)
    }

    /// Forgets that an artefact was found whole.
    pub fn doubt(&self, path: &Path) {
        self.notes.forget(path);
    }

    /// Writes the notes.
    pub fn save(&self) {
        self.notes.save();
        self.hashes.save();
    }

    /// All artefacts of a stage by the file stem of their unit.
    #[must_use]
    pub fn entries(&self, stage: &str) -> BTreeMap<String, Vec<Entry>> {
        let mut found: BTreeMap<String, Vec<Entry>> = BTreeMap::new();
        super::workdir::walk(&self.folder.join(stage), &mut |path| {
            if let Some((stem, entry)) = parse_name(path) {
                found.entry(stem).or_default().push(entry);
            }
        });
        found
    }
}

fn merge(a: Known, b: Known) -> Known {
    Known {
        points: a.points.max(b.points),
        parts: if a.parts.is_empty() { b.parts } else { a.parts },
        trees: if a.trees.is_empty() { b.trees } else { a.trees },
        warnings: a.warnings.max(b.warnings),
    }
}

/// Checks every byte of an artefact and returns its header.
///
/// # Errors
/// What is wrong, in words.
pub fn verify(path: &Path) -> Result<Header, String> {
    let mut opened = Opened::open(path).map_err(|error| error.to_string())?;
    opened.verify().map_err(|error| error.to_string())?;
    Ok(opened.header().clone())
}

/// `<unit>-<key>.<kind>.<extension>` taken apart.
#[must_use]
pub fn parse_name(path: &Path) -> Option<(String, Entry)> {
    let name = path.file_name()?.to_str()?;
    let mut parts = name.split('.');
    let (front, kind) = (parts.next()?, parts.next()?);
    let (stem, key) = front.rsplit_once('-')?;
    let is_key = key.len() == KEY_LEN && key.bytes().all(|byte| byte.is_ascii_hexdigit());
    let entry = Entry { key: key.to_owned(), kind: kind.to_owned(), path: path.to_owned() };
    is_key.then(|| (stem.to_owned(), entry))
}

/// Hexadecimal digits of a key: 128 bits.
pub const KEY_LEN: usize = 32;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_taken_apart() {
        let key = "0123456789abcdef0123456789abcdef";
        let path = artefact_path(
            Path::new("s"),
            "dtm",
            &UnitId::Tile(TileId { ix: -3, iy: 4 }),
            key,
            "heights",
            "tmbr",
        );
        let (stem, entry) = parse_name(&path).unwrap();
        assert_eq!(
            (stem.as_str(), entry.key.as_str(), entry.kind.as_str()),
            ("-3_4", key, "heights")
        );
        assert!(parse_name(Path::new("s/.partial-x")).is_none());
    }
}

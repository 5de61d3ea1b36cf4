//! The header every artefact carries.

use crate::Crs;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;
use timberline_pointcloud::{Bounds3, Frame, TileGrid, TileId};

/// What one task of a stage works on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum UnitKind {
    /// One raw file.
    File,
    /// One tile of the campaign's grid.
    Tile,
    /// One tree, named by an earlier stage in [`Facts::trees`].
    Tree,
    /// The whole campaign.
    Campaign,
}

/// One unit. Written `file:NAME`, `tile:COLUMN_ROW`, `tree:ID` or `campaign`.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum UnitId {
    /// A raw file, by its path relative to the campaign.
    File(String),
    /// A tile.
    Tile(TileId),
    /// A tree, by its id.
    Tree(u64),
    /// The campaign.
    Campaign,
}

impl UnitId {
    /// The tile, if this is one.
    #[must_use]
    pub fn tile(&self) -> Option<TileId> {
        if let Self::Tile(tile) = self { Some(*tile) } else { None }
    }

    /// The tree's id, if this is one.
    #[must_use]
    pub fn tree(&self) -> Option<u64> {
        if let Self::Tree(tree) = self { Some(*tree) } else { None }
    }

    /// A name fit for a file: a tile as `12_-7`, a raw file by its stem and a hash of its path.
    #[must_use]
    pub fn file_stem(&self) -> String {
        match self {
            Self::File(name) => {
                let stem = name.rsplit(['/', '\\']).next().unwrap_or(name);
                let plain: String = stem
                    .chars()
                    .map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' })
                    .take(60)
                    .collect();
                format!("{plain}-{}", &blake3::hash(name.as_bytes()).to_hex()[..8])
            }
            Self::Tile(tile) => tile.to_string(),
            Self::Tree(tree) => tree.to_string(),
            Self::Campaign => "campaign".to_owned(),
        }
    }
}

impl fmt::Display for UnitId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File(name) => write!(f, "file:{name}"),
            Self::Tile(tile) => write!(f, "tile:{tile}"),
            Self::Tree(tree) => write!(f, "tree:{tree}"),
            Self::Campaign => write!(f, "campaign"),
        }
    }
}

impl FromStr for UnitId {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            Some(("file", name)) => Ok(Self::File(name.to_owned())),
            Some(("tile", tile)) => tile.parse().map(Self::Tile),
            Some(("tree", tree)) => {
                tree.parse().map(Self::Tree).map_err(|_| format!("`{tree}` is no tree id"))
            }
            None if text == "campaign" => Ok(Self::Campaign),
            _ => Err(format!(
                "`{text}` is no unit; expected file:NAME, tile:COLUMN_ROW, tree:ID or campaign"
            )),
        }
    }
}

impl Serialize for UnitId {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for UnitId {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// An input of a task: what it was and the key that determined it.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct InputRef {
    /// Kind of the input; `raw` for a file of the campaign.
    pub kind: String,
    /// The unit it belongs to.
    pub unit: UnitId,
    /// Its key; for a raw file the hash of its contents.
    pub key: String,
}

/// Something a reader of the result should know: a tree that was skipped and why.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Warning {
    /// What it is about: `tree 6307`, `file a.laz`.
    pub subject: String,
    /// What happened, with values.
    pub message: String,
}

/// What a stage says about a result besides the result itself.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Facts {
    /// The CRS the positions came from (positions themselves are in metres).
    pub crs: Option<Crs>,
    /// The local frame of positions in the payload, where they are local.
    pub frame: Option<Frame>,
    /// World bounds of what is inside, metres.
    pub bounds: Option<Bounds3>,
    /// The tile grid the unit belongs to.
    pub grid: Option<TileGrid>,
    /// Numbers worth adding up: points kept, points dropped by each rule, trees.
    pub counts: BTreeMap<String, u64>,
    /// The tiles for which a file's shards hold points, sorted.
    pub parts: Vec<TileId>,
    /// The trees in it, sorted by id: the units of stages that work on trees.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub trees: Vec<TreeUnit>,
}

/// A tree as a unit of work.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TreeUnit {
    /// Its id.
    pub tree_id: u64,
    /// Number of its points, as far as known.
    pub points: u64,
    /// World bounds of its points, m.
    pub bounds: Bounds3,
}

impl TreeUnit {
    /// The same tree with another part of its points.
    #[must_use]
    pub fn with(&self, part: &Self) -> Self {
        Self {
            tree_id: self.tree_id,
            points: self.points + part.points,
            bounds: self.bounds.union(&part.bounds),
        }
    }
}

impl Facts {
    /// Facts of a result that lies in the same place as another: its CRS, frame, bounds and grid.
    #[must_use]
    pub fn located_like(other: &Self) -> Self {
        Self { counts: BTreeMap::new(), parts: Vec::new(), trees: Vec::new(), ..other.clone() }
    }

    /// Adds a count.
    #[must_use]
    pub fn count(mut self, name: &str, value: usize) -> Self {
        self.counts.insert(name.to_owned(), value as u64);
        self
    }
}

/// Everything known about an artefact without its payload.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Kind, see [`crate::kinds`].
    pub kind: String,
    /// Version of the kind.
    pub kind_version: u32,
    /// Hash of all that determines the contents (32 hex digits).
    pub key: String,
    /// Stage that made it.
    pub stage: String,
    /// Version of the stage.
    pub stage_version: u32,
    /// Unit it belongs to.
    pub unit: UnitId,
    /// The stage's effective parameters.
    pub params: serde_json::Value,
    /// All inputs, sorted.
    pub inputs: Vec<InputRef>,
    /// Version of the program that wrote it.
    pub tool_version: String,
    /// What the stage said about it.
    pub facts: Facts,
    /// What the reader should know.
    pub warnings: Vec<Warning>,
}

impl Header {
    /// The header as canonical JSON: fields in declared order, maps sorted.
    ///
    /// # Errors
    /// [`crate::Error::Encode`] when a value has no JSON form (a bound that is not finite).
    pub fn to_json(&self) -> Result<Vec<u8>, crate::Error> {
        serde_json::to_vec(self)
            .map_err(|error| crate::Error::Encode { kind: "header", detail: error.to_string() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_read_back() {
        for text in ["file:a/b.laz", "tile:3_-4", "tree:6307", "campaign"] {
            assert_eq!(text.parse::<UnitId>().unwrap().to_string(), text);
        }
        assert!("tile:x".parse::<UnitId>().is_err());
        assert!("tree:-1".parse::<UnitId>().is_err());
    }

    #[test]
    fn two_files_of_one_name_have_two_stems() {
        let stem = |name: &str| UnitId::File(name.into()).file_stem();
        assert_ne!(stem("a/x.laz"), stem("b/x.laz"));
        assert!(!stem("a/ü x.laz").contains(['/', ' ', '.']));
    }
}

//! Files about one tree for people to take away. Raise the version when the fields change.

use super::table_kind;
use serde::{Deserialize, Serialize};

/// A file for people to take away, not yet in the outputs folder.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TreeFile {
    /// Its name, without a folder.
    pub name: String,
    /// Its contents.
    pub bytes: Vec<u8>,
}

/// Tables and models of one tree.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ModelFiles {
    /// The files, sorted by name.
    pub files: Vec<TreeFile>,
}

/// Pictures of one tree.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PictureFiles {
    /// The files, sorted by name.
    pub files: Vec<TreeFile>,
}

table_kind!(ModelFiles, "model-files", 1, "tables and models of one tree");
table_kind!(PictureFiles, "picture-files", 1, "pictures of one tree");

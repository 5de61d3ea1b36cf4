//! What a stage left in the outputs folder. Raise the version when the fields change.

use super::table_kind;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Files a campaign stage wrote for people to take away, and the campaign's totals.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Outputs {
    /// The files, sorted by name.
    pub files: Vec<OutputFile>,
    /// Totals over the campaign.
    pub totals: BTreeMap<String, u64>,
}

/// One file in the outputs folder.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct OutputFile {
    /// Name relative to the outputs folder.
    pub name: String,
    /// Size in bytes.
    pub bytes: u64,
    /// blake3 of the contents, hexadecimal.
    pub hash: String,
}

impl OutputFile {
    /// Describes a file as it is on disk.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn describe(folder: &Path, name: &str) -> Result<Self, crate::Error> {
        let path = folder.join(name);
        let mut hasher = blake3::Hasher::new();
        let mut file = std::fs::File::open(&path).map_err(crate::Error::io(&path, "open"))?;
        let bytes =
            std::io::copy(&mut file, &mut hasher).map_err(crate::Error::io(&path, "read"))?;
        Ok(Self { name: name.to_owned(), bytes, hash: hasher.finalize().to_hex().to_string() })
    }
}

table_kind!(Outputs, "outputs", 1, "files written for people, with their hashes");

//! One raw file's points bucketed by tile. The layout inside the payload belongs to the stage that
//! writes it; raise the version here when it changes.

use super::{Kind, TABLE_EXTENSION};
use crate::{Error, Header, Opened};
use std::fs::File;
use std::path::Path;

/// A shard file: opened for its sections, never read as a whole.
///
/// It is written through [`crate::stage::Context::emit_stream`]; the tiles it holds points for are
/// `parts` of its header. Sections carry their own checksums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shards;

impl Kind for Shards {
    const NAME: &'static str = "shards";
    const VERSION: u32 = 1;
    const EXTENSION: &'static str = TABLE_EXTENSION;
    const SUMMARY: &'static str = "one raw file's points bucketed by tile";

    fn encode(&self, _: &Header, _: &mut File) -> Result<(), Error> {
        Err(Error::Encode { kind: Self::NAME, detail: "shards are written as a stream".to_owned() })
    }

    fn decode(_: &Path, opened: &mut Opened) -> Result<Self, Error> {
        opened.verify().map(|()| Self)
    }
}

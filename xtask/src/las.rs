//! Looking at point clouds for the engine.

use crate::engine::survey::{FileFacts, Surveyor};
use std::path::Path;
use timberline_ingest::{UnitChoice, survey};

/// The surveyor for point clouds of all formats.
#[derive(Debug, Clone, Copy, Default)]
pub struct LasSurveyor;

impl Surveyor for LasSurveyor {
    fn look(&self, path: &Path) -> Result<FileFacts, String> {
        let facts = survey::survey(path, UnitChoice::default(), None).map_err(|error| {
            let (text, place) = (error.to_string(), format!("{}: ", path.display()));
            text.strip_prefix(&place).unwrap_or(&text).to_owned()
        })?;
        Ok(FileFacts {
            points: facts.points,
            rect_m: facts.bounds.map(|bounds| bounds.rect()),
            density_per_m2: facts.density_per_m2,
            crs: (!facts.crs.is_unknown()).then_some(facts.crs),
            notes: facts.notes,
        })
    }

    fn tile_edge_m(&self, files: &[FileFacts], points: u32) -> u32 {
        let facts = |file: &FileFacts| survey::FileFacts {
            las: None,
            container: "",
            points: file.points,
            crs: file.crs.clone().unwrap_or_default(),
            bounds: None,
            density_per_m2: file.density_per_m2,
            notes: Vec::new(),
        };
        let files: Vec<survey::FileFacts> = files.iter().map(facts).collect();
        survey::tile_edge_m(&files, points)
    }
}

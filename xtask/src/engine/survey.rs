//! A first look at the raw files: contents, extent, and the grid of tiles that follows from them.

use super::notes::{Notes, Stamp, content_hash};
use crate::config::{Campaign, Platform, campaign::CrsFile};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use timberline_artefact::Crs;
use timberline_artefact::stage::{self, RawFile};
use timberline_pointcloud::{Rect, TileGrid, TileId};

/// Points of a tile unless the campaign says otherwise: the block of Tittmann et al. 2011, section 3.
pub const TILE_POINTS: u32 = 150_000;

/// The same for scans from the ground, whose tiles would be a few metres wide: what is around a tile would
/// be most of what is read.
const TERRESTRIAL_TILE_POINTS: u32 = 500_000;

/// What the header of a raw file says.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FileFacts {
    /// Points in it.
    pub points: u64,
    /// Its extent in metres, if the header gives one.
    pub rect_m: Option<Rect>,
    /// Points per square metre of covered ground, if they can be told.
    pub density_per_m2: Option<f64>,
    /// Its CRS, if it names one.
    pub crs: Option<Crs>,
    /// What the user should know about it.
    pub notes: Vec<String>,
}

/// Looks at raw files; the engine does not know their formats.
pub trait Surveyor: Send + Sync {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// Why the file cannot be used.
    fn look(&self, path: &Path) -> Result<FileFacts, String>;

    /// Edge in metres of tiles of about so many points for files like these.
    fn tile_edge_m(&self, files: &[FileFacts], points: u32) -> u32;
}

/// A raw file that can be used.
#[derive(Debug, Clone)]
pub struct Surveyed {
    /// The file.
    pub raw: RawFile,
    /// Its size.
    pub bytes: u64,
    /// Hash of its contents.
    pub hash: String,
    /// What its header says.
    pub facts: FileFacts,
}

impl Surveyed {
    /// The tiles its extent touches: at least those it has points in.
    #[must_use]
    pub fn tiles(&self, grid: &TileGrid) -> Vec<TileId> {
        self.facts.rect_m.map(|rect| grid.tiles_touching(&rect)).unwrap_or_default()
    }
}

/// A file of the campaign that cannot be used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lost {
    /// Its name.
    pub name: String,
    /// Why.
    pub error: String,
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Survey {
    /// Usable files, sorted by name.
    pub files: Vec<Surveyed>,
    /// The others.
    pub lost: Vec<Lost>,
    /// Grid and CRS.
    pub campaign: stage::Campaign,
}

/// What is kept of a look.
type Look = (String, Result<FileFacts, String>);

/// Looks at all raw files of a campaign; those seen before are not read again.
///
/// # Errors
/// When the files do not fit together, in words.
pub fn survey(
    campaign: &Campaign,
    surveyor: &dyn Surveyor,
    notes: &Notes<Look>,
) -> Result<Survey, String> {
    let looked: Vec<Result<Surveyed, Lost>> =
        campaign.files.par_iter().map(|file| look(file, surveyor, notes)).collect();
    notes.save();
    let (mut files, mut lost) = (Vec::new(), Vec::new());
    for result in looked {
        match result {
            Ok(file) => files.push(file),
            Err(file) => lost.push(file),
        }
    }
    drop_twins(&mut files, &mut lost);
    let campaign = layout(campaign, &files, surveyor)?;
    Ok(Survey { files, lost, campaign })
}

fn look(
    file: &crate::config::campaign::RawFile,
    surveyor: &dyn Surveyor,
    notes: &Notes<Look>,
) -> Result<Surveyed, Lost> {
    let lost = |error: String| Lost { name: file.name.clone(), error };
    let stamp = Stamp::of(&file.path).ok_or_else(|| lost("cannot be read".to_owned()))?;
    let (hash, facts) = match notes.get(&file.path) {
        Some(known) => known,
        None => {
            let hash = content_hash(&file.path).map_err(|error| lost(error.to_string()))?;
            let known = (hash, surveyor.look(&file.path));
            notes.put(&file.path, stamp, known.clone());
            known
        }
    };
    let raw = RawFile { name: file.name.clone(), path: file.path.clone() };
    Ok(Surveyed { raw, bytes: stamp.bytes(), hash, facts: facts.map_err(lost)? })
}

/// The same contents under two names would double every point.
fn drop_twins(files: &mut Vec<Surveyed>, lost: &mut Vec<Lost>) {
    let mut seen: BTreeMap<String, String> = BTreeMap::new();
    files.retain(|file| match seen.get(&file.hash) {
        Some(first) => {
            let error = format!("has the same contents as {first}; only that one is used");
            lost.push(Lost { name: file.raw.name.clone(), error });
            false
        }
        None => {
            seen.insert(file.hash.clone(), file.raw.name.clone());
            true
        }
    });
}

fn layout(
    campaign: &Campaign,
    files: &[Surveyed],
    surveyor: &dyn Surveyor,
) -> Result<stage::Campaign, String> {
    let facts: Vec<FileFacts> = files.iter().map(|file| file.facts.clone()).collect();
    let tiles = campaign.file.tiles.clone().unwrap_or_default();
    let grid = if facts.is_empty() {
        None
    } else {
        let usual = match campaign.file.platform {
            Platform::Als | Platform::Uls => TILE_POINTS,
            Platform::Tls | Platform::Mls => TERRESTRIAL_TILE_POINTS,
        };
        let points = tiles.points.unwrap_or(usual);
        let edge = tiles.edge_m.unwrap_or_else(|| surveyor.tile_edge_m(&facts, points));
        Some(
            TileGrid::new(edge, tiles.origin_m.unwrap_or([0, 0]))
                .map_err(|error| error.to_string())?,
        )
    };
    let crs = match &campaign.file.crs {
        Some(given) => Some(overridden(common(files), given)),
        None => {
            agree(files)?;
            None
        }
    };
    Ok(stage::Campaign { name: campaign.file.name.clone(), grid, crs })
}

fn common(files: &[Surveyed]) -> Crs {
    files.iter().find_map(|file| file.facts.crs.clone()).unwrap_or_default()
}

fn overridden(base: Crs, given: &CrsFile) -> Crs {
    let mut crs = base;
    if given.epsg.is_some() || given.wkt.is_some() {
        let name =
            given.epsg.map_or_else(|| "given as WKT".to_owned(), |code| format!("EPSG:{code}"));
        crs = Crs { wkt: given.wkt.clone(), epsg: given.epsg, name, ..Crs::default() };
    }
    crs.vertical_epsg = given.vertical_epsg.or(crs.vertical_epsg);
    if let Some(unit) = given.horizontal_unit {
        crs.horizontal_m_per_unit = unit.metres();
        crs.vertical_m_per_unit = unit.metres();
    }
    if let Some(unit) = given.vertical_unit {
        crs.vertical_m_per_unit = unit.metres();
    }
    crs
}

/// Files that name different systems cannot be one campaign.
fn agree(files: &[Surveyed]) -> Result<(), String> {
    let mut systems: BTreeMap<String, &str> = BTreeMap::new();
    for file in files {
        if let Some(crs) = file.facts.crs.as_ref().filter(|crs| !crs.is_unknown()) {
            let code = crs.epsg.map_or_else(|| crs.name.clone(), |code| format!("EPSG:{code}"));
            let units = (crs.horizontal_m_per_unit, crs.vertical_m_per_unit);
            systems
                .entry(format!("{code}, units of {} m and {} m", units.0, units.1))
                .or_insert(&file.raw.name);
        }
    }
    if systems.len() < 2 {
        return Ok(());
    }
    let list: Vec<String> =
        systems.iter().map(|(crs, file)| format!("\n    {file}: {crs}")).collect();
    Err(format!(
        "the files are in different coordinate systems:{}\n    split them into campaigns, or say in \
         [crs] of campaign.toml what all of them are in",
        list.concat()
    ))
}

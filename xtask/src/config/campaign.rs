//! `campaign.toml`: which scans belong to a survey, and what cannot be read from them.

use super::{Document, Problem, Problems, check};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Name of the file in a campaign's folder.
pub const FILE_NAME: &str = "campaign.toml";

/// How the scans were taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Platform {
    /// From an aeroplane or helicopter.
    Als,
    /// From a drone.
    Uls,
    /// From a tripod.
    Tls,
    /// Carried or driven.
    Mls,
}

/// Unit of lengths in the scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Unit {
    /// Metre.
    Metre,
    /// International foot, 0.3048 m.
    Foot,
    /// US survey foot, 1200/3937 m.
    UsSurveyFoot,
}

impl Unit {
    /// Length in metres.
    #[must_use]
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Foot => 0.3048,
            Self::UsSurveyFoot => 1200.0 / 3937.0,
        }
    }
}

/// A campaign as the user writes it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Timberline campaign file")]
pub struct CampaignFile {
    /// Name of the survey, used in reports.
    pub name: String,
    /// How the scans were taken.
    pub platform: Platform,
    /// Raw files: paths or globs (`scans/*.laz`, `**/*.e57`), relative to the campaign's folder.
    #[schemars(length(min = 1))]
    pub inputs: Vec<String>,
    /// Paths or globs of files to leave out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub exclude: Vec<String>,
    /// Coordinate system, where the scans do not say it or say it wrong.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crs: Option<CrsFile>,
    /// How the work is cut up. Results do not depend on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tiles: Option<TilesFile>,
    /// Measurements in the field.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field: Option<FieldFile>,
    /// Exact truth, where the scans are simulated or every tree is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthFile>,
}

/// `[crs]`: overrides what the scans say.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CrsFile {
    /// EPSG code of the horizontal or compound system.
    #[schemars(range(min = 1024, max = 32767))]
    pub epsg: Option<u32>,
    /// EPSG code of the vertical system.
    #[schemars(range(min = 1024, max = 32767))]
    pub vertical_epsg: Option<u32>,
    /// Well-known text, instead of a code.
    pub wkt: Option<String>,
    /// Unit of x and y.
    pub horizontal_unit: Option<Unit>,
    /// Unit of z.
    pub vertical_unit: Option<Unit>,
}

/// `[tiles]`: fixes the grid that is otherwise chosen from the density of the scans.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TilesFile {
    /// Points a tile should hold about, where `edge_m` is not given [default: 150000; 500000 of scans
    /// from the ground].
    #[schemars(range(min = 1000, max = 100_000_000))]
    pub points: Option<u32>,
    /// Edge of a tile.
    #[schemars(range(min = 4, max = 4096), extend("x-unit" = "m"))]
    pub edge_m: Option<u32>,
    /// World position of a tile corner, whole metres.
    #[schemars(extend("x-unit" = "m"))]
    pub origin_m: Option<[i64; 2]>,
}

/// `[field]`: tables measured on the ground.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FieldFile {
    /// Plots, a CSV file.
    pub plots: Option<PathBuf>,
    /// Trees on the plots, a CSV file.
    pub trees: Option<PathBuf>,
    /// Stands with their boundaries, a CSV file.
    pub stands: Option<PathBuf>,
}

/// `[truth]`: what a simulated or fully measured stand really holds.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TruthFile {
    /// Every tree, a CSV file (columns: see `cargo xtask evaluate --help`).
    pub trees: Option<PathBuf>,
    /// Terrain, an ESRI ASCII raster.
    pub dtm: Option<PathBuf>,
    /// Wood of every tree as cylinders, a CSV file (columns: see `cargo xtask evaluate --help`).
    pub cylinders: Option<PathBuf>,
}

/// A raw file of the campaign.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct RawFile {
    /// Path relative to the campaign's folder, with `/`: its name everywhere.
    pub name: String,
    /// Where it is.
    pub path: PathBuf,
}

/// A campaign as the engine sees it.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// Its folder.
    pub folder: PathBuf,
    /// The file it came from.
    pub path: PathBuf,
    /// What the file says.
    pub file: CampaignFile,
    /// The raw files its globs name, sorted by name.
    pub files: Vec<RawFile>,
}

impl Campaign {
    /// Reads `campaign.toml` in a folder (or the file itself) and finds its raw files.
    ///
    /// # Errors
    /// [`Problems`]: all faults of the file, or globs that name nothing.
    pub fn load(folder_or_file: &Path) -> Result<Self, Problems> {
        let (folder, path) = locate(folder_or_file);
        let document = Document::read(&path).map_err(|problems| advise(problems, &folder))?;
        let file = parse(&document)?;
        let files = find_files(&folder, &file, &document)?;
        Ok(Self { folder, path, file, files })
    }

    /// A path of the campaign file, relative to its folder.
    #[must_use]
    pub fn resolve(&self, path: &Path) -> PathBuf {
        self.folder.join(path)
    }
}

/// JSON Schema of `campaign.toml`.
#[must_use]
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(CampaignFile).to_value()
}

fn locate(given: &Path) -> (PathBuf, PathBuf) {
    if given.is_file() {
        let folder = given.parent().map_or_else(PathBuf::new, Path::to_path_buf);
        return (folder, given.to_owned());
    }
    (given.to_owned(), given.join(FILE_NAME))
}

fn advise(mut problems: Problems, folder: &Path) -> Problems {
    for problem in problems.0.iter_mut().filter(|problem| problem.place.is_none()) {
        let folder = folder.display();
        problem.hint =
            Some(format!("`cargo xtask init {folder}` writes one from a folder of scans"));
    }
    problems
}

fn parse(document: &Document) -> Result<CampaignFile, Problems> {
    let mut found = Vec::new();
    check::check(&document.path, &document.root, &schema(), &mut found);
    if let Some(crs) = document.root.get("crs")
        && let (Some(_), Some(wkt)) = (crs.get("epsg"), crs.get("wkt"))
    {
        let what = "`epsg` and `wkt` are both given; one of them must go";
        found.push(Problem::new(&document.path, Some(wkt.key_at), what));
    }
    Problems::check(found)?;
    serde_json::from_value(document.root.to_json())
        .map_err(|error| Problems::one(Problem::new(&document.path, None, error.to_string())))
}

fn find_files(
    folder: &Path,
    file: &CampaignFile,
    document: &Document,
) -> Result<Vec<RawFile>, Problems> {
    let place = |key: &str| document.root.get(key).map(|node| node.at);
    let fault = |key: &str, what: String| Problem::new(&document.path, place(key), what);
    let mut found = Vec::new();
    let mut expand = |key: &str, patterns: &[String], must_match: bool| {
        let mut paths = BTreeSet::new();
        for pattern in patterns {
            match matching(folder, pattern) {
                Err(reason) => found.push(fault(key, format!("`{pattern}`: {reason}"))),
                Ok(some) if some.is_empty() && must_match => {
                    let what = format!("`{pattern}` names no file in {}", folder.display());
                    found.push(fault(key, what));
                }
                Ok(some) => paths.extend(some),
            }
        }
        paths
    };
    let mut paths = expand("inputs", &file.inputs, true);
    let excluded = expand("exclude", &file.exclude, false);
    Problems::check(found)?;
    paths.retain(|path| !excluded.contains(path));
    let mut files: Vec<RawFile> =
        paths.into_iter().map(|path| RawFile { name: name_in(folder, &path), path }).collect();
    files.sort();
    Ok(files)
}

fn matching(folder: &Path, pattern: &str) -> Result<Vec<PathBuf>, String> {
    let base = glob::Pattern::escape(&folder.to_string_lossy());
    let whole = if Path::new(pattern).is_absolute() || base.is_empty() {
        pattern.to_owned()
    } else {
        format!("{base}/{pattern}")
    };
    let hits = glob::glob(&whole).map_err(|error| error.to_string())?;
    Ok(hits.filter_map(Result::ok).filter(|path| path.is_file()).collect())
}

/// A path relative to the campaign with `/`, or the whole path when it lies elsewhere.
fn name_in(folder: &Path, path: &Path) -> String {
    let inner = path.strip_prefix(folder).unwrap_or(path);
    let parts: Vec<_> = inner.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    parts.join("/").replace("//", "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_with(toml: &str, files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(FILE_NAME), toml).unwrap();
        for name in files {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, name).unwrap();
        }
        folder
    }

    #[test]
    fn globs_are_sorted_unique_and_excluded() {
        let toml = "name = \"x\"\nplatform = \"als\"\ninputs = [\"**/*.laz\", \"b.laz\"]\nexclude = [\"c*\"]";
        let folder = folder_with(toml, &["b.laz", "a/d.laz", "c.laz", "e.txt"]);
        let campaign = Campaign::load(folder.path()).unwrap();
        let names: Vec<_> = campaign.files.iter().map(|file| file.name.as_str()).collect();
        assert_eq!(names, ["a/d.laz", "b.laz"]);
    }

    #[test]
    fn all_faults_at_once() {
        let folder = folder_with(
            "name = 3\nplatfrm = \"als\"\ninputs = [\"*.laz\"]\n[tiles]\nedge_m = 1",
            &[],
        );
        let text = Campaign::load(folder.path()).unwrap_err().to_string();
        for part in [
            ":1:8: `name` is 3",
            ":2:1: unknown key `platfrm`",
            "did you mean `platform`",
            ":5:10: `edge_m` is 1; it must be a whole number from 4 to 4096 m",
            "`platform` is missing",
        ] {
            assert!(text.contains(part), "{part} in\n{text}");
        }
    }

    #[test]
    fn a_glob_without_a_file_and_a_missing_campaign() {
        let folder =
            folder_with("name = \"x\"\nplatform = \"als\"\ninputs = [\"*.las\"]", &["a.laz"]);
        let text = Campaign::load(folder.path()).unwrap_err().to_string();
        assert!(text.contains(":3:10: `*.las` names no file"), "{text}");
        let text = Campaign::load(&folder.path().join("nowhere")).unwrap_err().to_string();
        assert!(text.contains("there is no such file") && text.contains("xtask init"), "{text}");
    }
}

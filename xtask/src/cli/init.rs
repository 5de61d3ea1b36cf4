//! `init`: a campaign.toml for a folder of scans.

use super::out;
use super::{DONE, Program, Usage};
use crate::config::Platform;
use crate::config::campaign::FILE_NAME;
use crate::engine::progress::short;
use crate::engine::survey::FileFacts;
use crate::engine::workdir::{DEFAULT_NAME, walk};
use anyhow::{Context, Result};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use timberline_artefact::publish::write_atomic;

/// Arguments of `init`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder of the campaign; it is made if need be
    folder: PathBuf,
    /// Scans that lie elsewhere; without any, those in the folder
    scans: Vec<PathBuf>,
    /// Name of the campaign [default: that of the folder]
    #[arg(long)]
    name: Option<String>,
    /// How the scans were taken [default: tls from 1000 points per m2 on, als below]
    #[arg(long, value_parser = ["als", "uls", "tls", "mls"])]
    platform: Option<String>,
    /// Overwrite a campaign.toml that is there
    #[arg(long)]
    force: bool,
}

/// Endings of point clouds. Files of the last three are often something else.
const ENDINGS: [&str; 10] = ["las", "laz", "e57", "ply", "pcd", "pts", "xyz", "txt", "asc", "csv"];
const OFTEN_OTHER: [&str; 3] = ["txt", "asc", "csv"];

/// Scans from the air have tens to a few hundred points per m2, scans from the ground many thousands.
const DENSITY_OF_TERRESTRIAL: f64 = 1000.0;

struct Scan {
    /// As it stands in the campaign file.
    pattern: String,
    facts: Result<FileFacts, String>,
}

/// Runs the command.
///
/// # Errors
/// When there are no scans, or a campaign.toml is in the way.
pub fn run(program: &Program, args: &Args) -> Result<u8> {
    let target = args.folder.join(FILE_NAME);
    if target.exists() && !args.force {
        return Err(
            Usage(format!("{} is there already; --force overwrites it", target.display())).into()
        );
    }
    let scans = look(program, args)?;
    if scans.iter().all(|scan| scan.facts.is_err()) {
        report(&scans);
        let place = args.folder.display();
        return Err(
            Usage(format!("no usable point cloud ({}) in {place}", ENDINGS.join(", "))).into()
        );
    }
    std::fs::create_dir_all(&args.folder)
        .with_context(|| format!("cannot make {}", args.folder.display()))?;
    let platform = platform(args, &scans)?;
    write_atomic(&target, text(args, platform, &scans)?.as_bytes())?;
    report(&scans);
    out::line(&target.display().to_string());
    let pipeline = match platform {
        Platform::Als | Platform::Uls => "als-inventory",
        Platform::Tls | Platform::Mls => "tls-trees",
    };
    let folder = args.folder.display();
    out::talk(&format!("next: cargo xtask run pipelines/{pipeline}.toml --campaign {folder}"));
    Ok(DONE)
}

fn look(program: &Program, args: &Args) -> Result<Vec<Scan>> {
    let mut paths: Vec<(String, PathBuf)> = Vec::new();
    if args.scans.is_empty() {
        walk(&args.folder, &mut |path| {
            let inner = path.strip_prefix(&args.folder).unwrap_or(path);
            if is_scan(path) && !inner.starts_with(DEFAULT_NAME) {
                paths.push((inner.to_string_lossy().replace('\\', "/"), path.to_owned()));
            }
        });
    }
    for scan in &args.scans {
        let whole = scan.canonicalize().with_context(|| format!("{}", scan.display()))?;
        paths.push((whole.to_string_lossy().into_owned(), whole));
    }
    let scan =
        |(pattern, path): (String, PathBuf)| Scan { pattern, facts: program.surveyor.look(&path) };
    Ok(paths.into_par_iter().map(scan).collect())
}

fn is_scan(path: &Path) -> bool {
    has_ending(path, &ENDINGS)
}

fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension()
        .is_some_and(|ending| endings.iter().any(|known| ending.eq_ignore_ascii_case(known)))
}

impl Scan {
    /// A text that is no point cloud, such as a table of trees: none of the campaign's scans.
    fn is_other(&self) -> bool {
        self.facts.is_err() && has_ending(Path::new(&self.pattern), &OFTEN_OTHER)
    }
}

fn report(scans: &[Scan]) {
    for scan in scans {
        match &scan.facts {
            Ok(facts) => {
                let crs = facts.crs.as_ref().map_or("no CRS", |crs| crs.name.as_str());
                out::talk(&format!(
                    "{}: {} points, {crs}",
                    scan.pattern,
                    short(facts.points as f64)
                ));
                facts.notes.iter().for_each(|note| out::talk(&format!("    {note}")));
            }
            Err(error) => out::talk(&format!("{}: left out: {error}", scan.pattern)),
        }
    }
}

/// What the arguments say, or what the density of the scans tells.
fn platform(args: &Args, scans: &[Scan]) -> Result<Platform> {
    if let Some(platform) = &args.platform {
        return Ok(serde_json::from_value(platform.as_str().into())?);
    }
    let known = scans.iter().filter_map(|scan| scan.facts.as_ref().ok()?.density_per_m2);
    let densest = known.fold(0.0, f64::max);
    let platform = if densest >= DENSITY_OF_TERRESTRIAL { Platform::Tls } else { Platform::Als };
    Ok(platform)
}

fn text(args: &Args, platform: Platform, scans: &[Scan]) -> Result<String> {
    let folder = args.folder.canonicalize().unwrap_or_else(|_| args.folder.clone());
    let own_name = folder.file_name().map(|name| name.to_string_lossy().into_owned());
    let name = args.name.clone().or(own_name).unwrap_or_else(|| "campaign".to_owned());
    let platform = serde_json::to_value(platform)?;
    let mut text = format!(
        "name = {}\nplatform = {platform}\ninputs = {}",
        quote(&name),
        list(&patterns(args, scans))
    );
    text.push_str(&excluded(args, scans));
    let known =
        scans.iter().filter_map(|scan| scan.facts.as_ref().ok()).any(|facts| facts.crs.is_some());
    if !known {
        text.push_str("\n# The scans do not say their coordinate system. If you know it:\n# [crs]\n# epsg = 32610\n");
    }
    Ok(text)
}

/// A text as TOML.
fn quote(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}

/// Patterns as a TOML list, one a line.
fn list(patterns: &[String]) -> String {
    let items: Vec<String> =
        patterns.iter().map(|pattern| format!("    {},\n", quote(pattern))).collect();
    format!("[\n{}]\n", items.concat())
}

/// The key `exclude` for files that the globs name and that cannot be read, with the reasons.
fn excluded(args: &Args, scans: &[Scan]) -> String {
    let globs = patterns(args, scans);
    let is_named = |scan: &&Scan| {
        let matches =
            |glob: &String| glob::Pattern::new(glob).is_ok_and(|glob| glob.matches(&scan.pattern));
        !scan.is_other() || globs.iter().any(matches)
    };
    let bad: Vec<&Scan> =
        scans.iter().filter(|scan| scan.facts.is_err()).filter(is_named).collect();
    if bad.is_empty() {
        return String::new();
    }
    let mut text = "# Files that cannot be read, or are no point clouds:\n".to_owned();
    for scan in &bad {
        let error = scan.facts.as_ref().err().map_or("", String::as_str);
        text.push_str(&format!("#   {}: {}\n", scan.pattern, error.replace('\n', " ")));
    }
    let names: Vec<String> = bad.iter().map(|scan| escape(&scan.pattern)).collect();
    text.push_str(&format!("exclude = {}", list(&names)));
    text
}

/// One glob for each ending and depth that occurs, or the files by name when they lie elsewhere.
fn patterns(args: &Args, scans: &[Scan]) -> Vec<String> {
    let usable = scans.iter().filter(|scan| scan.facts.is_ok());
    if !args.scans.is_empty() {
        return usable.map(|scan| escape(&scan.pattern)).collect();
    }
    let glob = |scan: &Scan| {
        let ending = scan.pattern.rsplit('.').next().unwrap_or("las").to_owned();
        let depth = if scan.pattern.contains('/') { "**/*" } else { "*" };
        format!("{depth}.{ending}")
    };
    let all: BTreeSet<String> = usable.map(glob).collect();
    // `**/*.laz` also names the files of the folder itself.
    let wider = |pattern: &String| all.contains(&format!("**/{pattern}"));
    all.iter().filter(|pattern| !wider(pattern)).cloned().collect()
}

/// A path as a glob that names it alone.
fn escape(path: &str) -> String {
    glob::Pattern::escape(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(pattern: &str, usable: bool) -> Scan {
        let facts = FileFacts {
            points: 1,
            rect_m: None,
            density_per_m2: None,
            crs: None,
            notes: Vec::new(),
        };
        let facts = if usable { Ok(facts) } else { Err("no points".to_owned()) };
        Scan { pattern: pattern.to_owned(), facts }
    }

    fn no_arguments() -> Args {
        let (folder, scans) = (PathBuf::new(), Vec::new());
        Args { folder, scans, name: None, platform: None, force: false }
    }

    #[test]
    fn tables_are_excluded_only_where_a_glob_names_them() {
        let args = no_arguments();
        let table = || scan("trees.csv", false);
        assert_eq!(excluded(&args, &[scan("a.xyz", true), table()]), "");
        let listed = excluded(&args, &[scan("a.csv", true), table()]);
        assert!(listed.contains("exclude = [\n    \"trees.csv\",\n]"), "{listed}");
        assert!(excluded(&args, &[scan("a.xyz", true), scan("b.e57", false)]).contains("b.e57"));
    }

    #[test]
    fn dense_scans_are_terrestrial_unless_told_otherwise() {
        let of = |density: Option<f64>, platform: Option<&str>| {
            let mut one = scan("a.laz", true);
            if let Ok(facts) = &mut one.facts {
                facts.density_per_m2 = density;
            }
            let args = Args { platform: platform.map(str::to_owned), ..no_arguments() };
            super::platform(&args, &[one]).unwrap()
        };
        assert_eq!(of(None, None), Platform::Als);
        assert_eq!(of(Some(40.0), None), Platform::Als);
        assert_eq!(of(Some(6000.0), None), Platform::Tls);
        assert_eq!(of(Some(6000.0), Some("mls")), Platform::Mls);
    }

    #[test]
    fn endings_of_all_formats_are_known() {
        for name in ["a.LAS", "b.copc.laz", "c.e57", "d.ply", "e.pcd", "f.pts", "g.xyz", "h.TXT"] {
            assert!(is_scan(Path::new(name)), "{name}");
        }
        assert!(!is_scan(Path::new("campaign.toml")) && !is_scan(Path::new("las")));
    }
}

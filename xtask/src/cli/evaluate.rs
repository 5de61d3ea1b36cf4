//! `evaluate`: the trees and the terrain of a run against known ones.

use super::open::{Opened, Place};
use super::{DONE, Program, Usage, out};
use crate::engine::explain::DryRun;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use timberline_artefact::Kind;
use timberline_artefact::kinds::{self, GroundModel, Trees};
use timberline_artefact::raster::Raster;
use timberline_evaluate::{ErrorStats, MatchParams, MatchRule, Report, Tree, assess_trees, layers};

/// Radius in which the top height is taken that tells the layer of a tree: plots of 0.03 ha.
const LAYER_RADIUS_M: f64 = 10.0;

/// Arguments of `evaluate`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Columns of a table of trees (CSV with a heading; metres; others are passed over):\n  \
    tree_id or id (else lines are counted); height_m or top_above_ground_m;\n  \
    for --position apex: top_x_m, top_y_m or x, y; for --position stem: base_x_m, base_y_m or stem_x, stem_y;\n  \
    optional: crown_diameter_m or crown_radius_m; visible (0 leaves the tree out unless --hidden).\n\
    The terrain is an ESRI ASCII raster."
)]
pub struct Args {
    /// Pipeline file [default: that of the last run]
    pipeline: Option<PathBuf>,
    #[command(flatten)]
    place: Place,
    /// Known trees [default: `trees` in [truth] of campaign.toml]
    #[arg(long, value_name = "CSV")]
    truth: Option<PathBuf>,
    /// Known terrain [default: `dtm` in [truth] of campaign.toml]
    #[arg(long, value_name = "ASC")]
    dtm: Option<PathBuf>,
    /// Trees to judge [default: those of the run]
    #[arg(long, value_name = "CSV")]
    trees: Option<PathBuf>,
    /// Which position is compared
    #[arg(long, value_enum, default_value_t = Position::Apex)]
    position: Position,
    /// Largest distance at which two trees may be the same, m
    #[arg(long, value_name = "M", default_value_t = 2.0)]
    distance: f64,
    /// Largest difference of their heights, m [default: no limit]
    #[arg(long, value_name = "M")]
    height_difference: Option<f64>,
    /// Pair as many trees as possible instead of letting the tallest choose first
    #[arg(long)]
    optimal: bool,
    /// Leave out trees below this height, m
    #[arg(long, value_name = "M", default_value_t = 2.0)]
    min_height: f64,
    /// Borders between classes of height, m
    #[arg(long, value_name = "M", value_delimiter = ',', default_values_t = [5.0, 10.0, 15.0, 20.0, 30.0, 40.0])]
    classes: Vec<f64>,
    /// Count known trees that the scanner cannot see
    #[arg(long)]
    hidden: bool,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Position {
    /// Highest point
    Apex,
    /// Stem
    Stem,
}

/// Runs the command.
///
/// # Errors
/// When there is nothing to compare.
pub fn run(program: &Program, args: &Args) -> Result<u8> {
    let opened = Opened::new(program, &args.place, args.pipeline.as_deref())?;
    let known = opened.campaign.file.truth.clone().unwrap_or_default();
    let of_campaign = |path: Option<PathBuf>| path.map(|path| opened.campaign.resolve(&path));
    let truth = args.truth.clone().or_else(|| of_campaign(known.trees));
    let dtm = args.dtm.clone().or_else(|| of_campaign(known.dtm));
    if truth.is_none() && dtm.is_none() {
        let what = "nothing to compare with: give --truth or --dtm, or [truth] in campaign.toml";
        return Err(Usage(what.to_owned()).into());
    }
    let mut report =
        Report::new(format!("{} over {}", opened.pipeline.name, opened.campaign.file.name));
    let dry =
        DryRun::new(&opened.pipeline, &opened.survey, &opened.store).map_err(anyhow::Error::msg)?;
    if let Some(path) = truth {
        add_trees(&mut report, args, &opened, &dry, &path)?;
    }
    if let Some(path) = dtm {
        report.add_errors("terrain", "m", terrain(&opened, &dry, &path)?);
    }
    if args.json {
        out::json(&report)?;
    } else {
        out::line(report.to_string().trim_end());
    }
    Ok(DONE)
}

fn add_trees(
    report: &mut Report,
    args: &Args,
    opened: &Opened,
    dry: &DryRun<'_>,
    truth: &Path,
) -> Result<()> {
    let mut reference = read_trees(truth, args)?;
    for (tree, layer) in
        reference.clone().iter().zip(layers(&reference, LAYER_RADIUS_M)?).enumerate()
    {
        reference[tree].layer = layer.1;
    }
    let detected = match &args.trees {
        Some(path) => read_trees(path, args)?,
        None => trees_of_run(opened, dry, args)?,
    };
    let rule = if args.optimal { MatchRule::Optimal } else { MatchRule::TallestFirst };
    let params = MatchParams {
        max_distance_m: args.distance,
        max_height_difference_m: args.height_difference,
        rule,
    };
    report.trees = Some(assess_trees(&reference, &detected, &params, &args.classes)?);
    Ok(())
}

/// The artefacts of a kind that are in the store.
fn artefacts(opened: &Opened, dry: &DryRun<'_>, kind: &str) -> Result<Vec<PathBuf>> {
    let writes = |stage: &crate::config::PipelineStage| stage.stage.info().outputs.contains(&kind);
    let stages = &opened.pipeline.stages;
    let position =
        stages.iter().rposition(writes).with_context(|| format!("no stage writes `{kind}`"))?;
    let whole = dry.stages[position].iter().filter(|plan| plan.is_whole());
    let path = |plan: &crate::engine::plan::UnitPlan| {
        opened.store.path(stages[position].name(), plan.unit(), &plan.task.key, kind)
    };
    let paths: Vec<PathBuf> = whole.map(path).collect();
    if paths.is_empty() {
        return Err(Usage(format!("the store has no `{kind}`: run the pipeline first")).into());
    }
    Ok(paths)
}

fn trees_of_run(opened: &Opened, dry: &DryRun<'_>, args: &Args) -> Result<Vec<Tree>> {
    let mut trees = Vec::new();
    for path in artefacts(opened, dry, Trees::NAME)? {
        let (_, table) = timberline_artefact::read::<Trees>(&path)?;
        trees.extend(table.trees.iter().map(|tree| as_tree(tree, args.position)));
    }
    trees.retain(|tree: &Tree| tree.height_m >= args.min_height);
    Ok(trees)
}

fn as_tree(tree: &kinds::Tree, position: Position) -> Tree {
    let at_m = match position {
        Position::Apex => [tree.apex_m[0], tree.apex_m[1]],
        Position::Stem => tree.position_m,
    };
    let crown_diameter_m =
        if tree.crown_area_m2 > 0.0 { tree.crown_diameter_mean_m } else { f64::NAN };
    Tree { id: tree.id, at_m, height_m: tree.height_m, crown_diameter_m, layer: None }
}

fn read_trees(path: &Path, args: &Args) -> Result<Vec<Tree>> {
    let place = || path.display().to_string();
    let mut reader = csv::Reader::from_path(path).with_context(place)?;
    let heading = reader.headers().with_context(place)?.clone();
    let column =
        |names: &[&str]| names.iter().find_map(|name| heading.iter().position(|own| own == *name));
    let needed = |names: &[&str]| {
        column(names).ok_or_else(|| Usage(format!("{}: no column {}", place(), names.join(" or "))))
    };
    let (x, y) = match args.position {
        Position::Apex => (needed(&["top_x_m", "x_m", "x"])?, needed(&["top_y_m", "y_m", "y"])?),
        Position::Stem => (
            needed(&["base_x_m", "stem_x", "x_m", "x"])?,
            needed(&["base_y_m", "stem_y", "y_m", "y"])?,
        ),
    };
    let height = needed(&["top_above_ground_m", "height_m", "height"])?;
    let (id, visible) = (column(&["tree_id", "id"]), column(&["visible"]));
    let (diameter, radius) = (column(&["crown_diameter_m"]), column(&["crown_radius_m"]));
    let mut trees = Vec::new();
    for (index, row) in reader.records().enumerate() {
        let row = row.with_context(place)?;
        let number = |at: usize| {
            row.get(at).and_then(|text| text.trim().parse::<f64>().ok()).unwrap_or(f64::NAN)
        };
        let seen = args.hidden || visible.is_none_or(|at| number(at) != 0.0);
        let crown = diameter.map(&number).or_else(|| radius.map(|at| 2.0 * number(at)));
        let own_id = id.and_then(|at| row.get(at)?.parse().ok());
        let tree = Tree {
            id: own_id.unwrap_or(index as u64 + 1),
            at_m: [number(x), number(y)],
            height_m: number(height),
            crown_diameter_m: crown.unwrap_or(f64::NAN),
            layer: None,
        };
        let high = tree.height_m.is_nan() || tree.height_m >= args.min_height;
        if seen && high && tree.at_m.iter().all(|value| value.is_finite()) {
            trees.push(tree);
        }
    }
    Ok(trees)
}

/// Errors of the terrain model at the cell centres of a known one.
fn terrain(opened: &Opened, dry: &DryRun<'_>, truth: &Path) -> Result<ErrorStats> {
    let known = read_ascii_raster(truth)?;
    let mut errors = Vec::new();
    for path in artefacts(opened, dry, GroundModel::NAME)? {
        let (header, model) = timberline_artefact::read::<GroundModel>(&path)?;
        let tile = header.facts.grid.zip(header.unit.tile()).map(|(grid, tile)| grid.rect(tile));
        let inside = |at: &[f64; 2]| tile.is_none_or(|rect| rect.contains(at[0], at[1]));
        let own = known.iter().filter(|(at, _)| inside(at));
        errors.extend(own.filter_map(|(at, z)| Some(sample(&model.raster, *at)? - z)));
    }
    Ok(ErrorStats::of(errors))
}

fn sample(raster: &Raster, at: [f64; 2]) -> Option<f64> {
    raster.sample(at[0], at[1]).filter(|value| value.is_finite())
}

/// Cell centres and values of an ESRI ASCII raster.
fn read_ascii_raster(path: &Path) -> Result<Vec<([f64; 2], f64)>> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let heading = |name: &str| {
        let line = text.lines().take(6).find(|line| line.to_ascii_lowercase().starts_with(name));
        let value = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<f64>().ok());
        value.with_context(|| format!("{}: no `{name}` in its heading", path.display()))
    };
    let (columns, rows) = (heading("ncols")? as usize, heading("nrows")? as usize);
    let (x, y, cell) = (heading("xllcorner")?, heading("yllcorner")?, heading("cellsize")?);
    let nodata = heading("nodata_value").unwrap_or(f64::NAN);
    let values: Vec<f64> = text
        .lines()
        .skip(6)
        .flat_map(str::split_whitespace)
        .filter_map(|word| word.parse().ok())
        .collect();
    anyhow::ensure!(
        values.len() == columns * rows,
        "{}: {} values for {columns} x {rows} cells",
        path.display(),
        values.len()
    );
    let centre = |index: usize| {
        let (row, column) = (index / columns, index % columns);
        [x + (column as f64 + 0.5) * cell, y + ((rows - 1 - row) as f64 + 0.5) * cell]
    };
    let cells = values.iter().enumerate().filter(|(_, value)| **value != nodata);
    Ok(cells.map(|(index, value)| (centre(index), *value)).collect())
}

//! `evaluate`: the trees, the tree models and the terrain of a run against known ones.

mod models;

use super::known::{
    Filter, Position, STEMS, artefacts, as_tree, clusters, read_trees, stems_of_found, trees_of_run,
};
use super::open::{Opened, Place};
use super::{DONE, Program, Usage, out};
use crate::engine::explain::DryRun;
use anyhow::{Context, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use timberline_artefact::Kind;
use timberline_artefact::kinds::{self, GroundModel};
use timberline_artefact::raster::Raster;
use timberline_artefact::stage::Stage;
use timberline_crowns::CrownFitParams;
use timberline_crowns::stage::CrownFitStage;
use timberline_evaluate::report::MethodErrors;
use timberline_evaluate::{ErrorStats, MatchParams, MatchRule, Report, Tree, assess_trees, layers};
use timberline_experiment::crowns::{Comparison, Outcome, compare, plan};

/// Radius in which the top height is taken that tells the layer of a tree: plots of 0.03 ha.
const LAYER_RADIUS_M: f64 = 10.0;

const NO_CYLINDERS: &str = "nothing to compare the tree models with: give --cylinders, or `cylinders` \
    in [truth] of campaign.toml";

/// Arguments of `evaluate`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Columns of a table of trees (CSV with a heading; metres; others are passed over):\n  \
    tree_id or id (else lines are counted); height_m or top_above_ground_m;\n  \
    for --position apex: top_x_m, top_y_m or x, y; for --position stem: base_x_m, base_y_m or stem_x, stem_y;\n  \
    optional: crown_diameter_m or crown_radius_m; visible (0 leaves the tree out with --visible).\n\
    The terrain is an ESRI ASCII raster.\n\
    Where the run made tree models: dbh_cm, stem_m3, branches_from_5cm_m3, branches_below_5cm_m3 of the trees, and the \
    table of cylinders with tree_id, cylinder, parent (0: none), branch, order (0: stem), start_x_m, start_y_m, start_z_m, \
    end_x_m, end_y_m, end_z_m, start_radius_mm, end_radius_mm; positions in the world or from any corner at whole metres.\n\
    With base_x_m, base_y_m or stem_x, stem_y, the crowns of the run are fitted by every method, and their distances to the stems \
    are printed side by side: as the run chose, hull centroid, highest point, L2, L1, L1 with the run's prior."
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
    /// Known wood as cylinders, for tree models [default: `cylinders` in [truth] of campaign.toml]
    #[arg(long, value_name = "CSV")]
    cylinders: Option<PathBuf>,
    /// Trees to judge [default: those of the run]
    #[arg(long, value_name = "CSV")]
    trees: Option<PathBuf>,
    /// Which position is compared
    #[arg(long, value_enum, default_value_t = Position::Apex)]
    position: Position,
    /// Largest distance at which two trees may be the same, m [default: 2; of stems with models 0.5]
    #[arg(long, value_name = "M")]
    distance: Option<f64>,
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
    /// Count only known trees over whose top nothing hangs; found ones that are hidden then count as
    /// false
    #[arg(long)]
    visible: bool,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
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
    match truth {
        Some(path) if args.trees.is_none() && models::made_by(&opened) => {
            let cylinders = args.cylinders.clone().or_else(|| of_campaign(known.cylinders));
            let cylinders = cylinders.ok_or_else(|| Usage(NO_CYLINDERS.to_owned()))?;
            report.models = Some(models::assess(args, &opened, &dry, [&path, &cylinders])?);
        }
        Some(path) => add_trees(&mut report, args, &opened, &dry, &path)?,
        None => {}
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
    let filter = Filter { min_height_m: args.min_height, hidden: !args.visible };
    let mut reference = read_trees(truth, args.position.columns(), filter)?;
    for (tree, layer) in
        reference.clone().iter().zip(layers(&reference, LAYER_RADIUS_M)?).enumerate()
    {
        reference[tree].layer = layer.1;
    }
    let own = match &args.trees {
        Some(_) => Vec::new(),
        None => trees_of_run(opened, dry, args.min_height)?,
    };
    let detected = match &args.trees {
        Some(path) => read_trees(path, args.position.columns(), filter)?,
        None => own.iter().map(|tree| as_tree(tree, args.position)).collect(),
    };
    let found = assess_trees(&reference, &detected, &match_params(args), &args.classes)?;
    // Tables that do not tell stems from tops, or trees that are not the run's, say nothing here.
    if let (false, Ok(stems)) = (own.is_empty(), read_trees(truth, STEMS, filter)) {
        let stems = stems_of_found(&found.matching, &reference, &detected, &stems);
        report.positions = positions(opened, dry, &own, &stems)?;
    }
    report.trees = Some(found);
    Ok(())
}

fn match_params(args: &Args) -> MatchParams {
    MatchParams {
        max_distance_m: args.distance.unwrap_or(MatchParams::default().max_distance_m),
        max_height_difference_m: args.height_difference,
        rule: if args.optimal { MatchRule::Optimal } else { MatchRule::TallestFirst },
    }
}

/// How far from the stem each method of fitting puts the crowns of the run, the run's own positions
/// first.
fn positions(
    opened: &Opened,
    dry: &DryRun<'_>,
    own: &[kinds::Tree],
    stems: &BTreeMap<u64, Tree>,
) -> Result<Vec<MethodErrors>> {
    let params = fit_params(opened);
    let clusters = clusters(opened, dry, stems)?;
    let by_id: BTreeMap<u64, &kinds::Tree> = own.iter().map(|tree| (tree.id, tree)).collect();
    let error = |id: u64| {
        let (stem, tree) = (stems.get(&id)?, by_id.get(&id)?);
        let [dx, dy] = [0, 1].map(|axis| tree.position_m[axis] - stem.at_m[axis]);
        Some((dx * dx + dy * dy).sqrt())
    };
    let run = MethodErrors {
        method: "positions of the run".to_owned(),
        without_surface: None,
        errors: ErrorStats::of(clusters.iter().filter_map(|cluster| error(cluster.id))),
    };
    let settings = plan::side_by_side(params.prior_half_width_m);
    let found = compare(&clusters, &settings, params.cell_m, &|| ())?;
    let of_method = |one: &Comparison| MethodErrors {
        method: one.setting.to_string(),
        without_surface: (!one.setting.sees_points())
            .then(|| one.outcomes.iter().filter(|outcome| !outcome.is_usable()).count()),
        errors: ErrorStats::of(one.outcomes.iter().map(Outcome::error_m)),
    };
    Ok(std::iter::once(run).chain(found.iter().map(of_method)).collect())
}

/// The run's parameters of `crown-fit`, or its defaults.
fn fit_params(opened: &Opened) -> CrownFitParams {
    let name = CrownFitStage::info().name;
    let stage = opened.pipeline.stages.iter().find(|stage| stage.name() == name);
    let given = stage.map(|stage| serde_json::from_value(stage.params.clone()));
    given.and_then(Result::ok).unwrap_or_default()
}

/// Errors of the terrain model at the cell centres of a known one.
fn terrain(opened: &Opened, dry: &DryRun<'_>, truth: &Path) -> Result<ErrorStats> {
    let known = read_ascii_raster(truth)?;
    let mut errors = Vec::new();
    for path in artefacts(opened, dry, GroundModel::NAME)?.values() {
        let (header, model) = timberline_artefact::read::<GroundModel>(path)?;
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

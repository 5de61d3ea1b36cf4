//! `experiment`: the papers' experiments, on generated data or on a run with known stems.

mod consolidation;
mod detection;
mod figures;
mod real;
mod segmentation;
mod segmentation_figures;

use super::known::{Filter, Position, as_tree, clusters, read_trees, stems_of_found, trees_of_run};
use super::open::{Opened, Place};
use super::{DONE, Program, Usage, out};
use crate::engine::explain::DryRun;
use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use timberline_artefact::publish::write_atomic;
use timberline_evaluate::{MatchParams, match_trees};
use timberline_experiment::crowns::{Assessed, Cluster, Experiment, assess, plan, text};

/// Arguments of `experiment`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// Position of a tree from its crown: hull centroid, highest point, StarSac, L2 and L1
    /// paraboloids with and without a prior, over omega and delta (Polewski et al., section 6)
    Crowns(Crowns),
    /// Trees found and points gathered by every segmenter: stands of five kinds, from thin to dense
    /// scans
    Segmentation(segmentation::Args),
    /// The models behind the scores of treetops and trees
    Detection(detection::Args),
    /// Models of trees with and without consolidation, in the manner of AdTree and by default
    Consolidation(consolidation::Args),
}

/// Arguments of `experiment crowns`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Without --campaign two datasets are generated in the manner of the paper's: I, Norway spruce with clean \
    segments, and II, Douglas fir with errors of the segmentation. With --campaign the crowns of a finished run are used: the points \
    on the surface of every tree that `evaluate` matches to a known one (columns base_x_m, base_y_m or stem_x, stem_y for the stem).\n\n\
    Files in the output folder:\n  \
    report.md        data, methods beside the paper's figures, sweeps, differences to the paper\n  \
    methods.csv      a line for every dataset, method, parameters and cell size\n  \
    trees.csv        a line for every tree with each of them\n  \
    clusters.csv     a line for every tree: reference, size, density\n  \
    experiment.json  all parameters and figures\n  \
    figure4.png, .svg          error over omega and over delta, in the layout of the paper's Figure 4\n  \
    figure4-cell*.png, .svg    the same for the other cell sizes\n\n\
    The same arguments give the same bytes, whatever the number of threads."
)]
struct Crowns {
    /// Pipeline file, with --campaign [default: that of the last run]
    #[arg(requires = "campaign")]
    pipeline: Option<PathBuf>,
    /// Folder of a campaign with a finished run and known trees
    #[arg(long, value_name = "DIR")]
    campaign: Option<PathBuf>,
    /// Workspace of the run [default: .timberline in the campaign's folder]
    #[arg(long, value_name = "DIR", requires = "campaign")]
    work: Option<PathBuf>,
    /// Known trees [default: `trees` in [truth] of campaign.toml]
    #[arg(long, value_name = "CSV", requires = "campaign")]
    truth: Option<PathBuf>,
    /// Folder to write to
    #[arg(long, value_name = "DIR", default_value = "target/experiment-crowns")]
    out: PathBuf,
    /// Seed of the generated data
    #[arg(long, default_value_t = 1, conflicts_with = "campaign")]
    seed: u32,
    /// Trees of a dataset in each repetition
    #[arg(long, default_value_t = 110, conflicts_with = "campaign", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    trees: u32,
    /// Repetitions, each with trees of its own
    #[arg(long, default_value_t = 5, conflicts_with = "campaign", value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: u32,
    /// Edges of the cells to which crowns are thinned, m; the last one is that of figure4
    #[arg(long, value_name = "M", value_delimiter = ',', default_values_t = [0.4, 0.5])]
    cells: Vec<f64>,
    /// Threads [default: one a processor]
    #[arg(long)]
    jobs: Option<usize>,
    /// Print the figures as JSON
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// When the data cannot be made or read, or a file cannot be written.
pub fn run(program: &Program, args: &Args) -> Result<u8> {
    match &args.what {
        What::Crowns(args) => crowns(program, args),
        What::Segmentation(args) => segmentation::run(args),
        What::Detection(args) => detection::run(args),
        What::Consolidation(args) => consolidation::run(program, args),
    }
}

fn crowns(program: &Program, args: &Crowns) -> Result<u8> {
    if args.cells.is_empty() || !args.cells.iter().all(|cell| (0.05..=5.0).contains(cell)) {
        return Err(Usage("--cells are edges in metres, from 0.05 to 5".to_owned()).into());
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.unwrap_or(0)).build()?;
    let (datasets, experiment) = match &args.campaign {
        Some(campaign) => (vec![of_campaign(program, args, campaign)?], None),
        None => {
            let experiment = experiment(args);
            (pool.install(|| generated(&experiment))?, Some(experiment))
        }
    };
    let all = pool.install(|| assess_all(datasets, &args.cells))?;
    let json = serde_json::json!({
        "experiment": experiment,
        "datasets": all.iter().map(|one| serde_json::json!({
            "facts": one.facts,
            "methods": one.rows,
        })).collect::<Vec<_>>(),
    });
    write(&args.out, &all, &args.cells, &json)?;
    if args.json {
        out::json(&json)?;
    } else {
        out::raw(text::markdown(&all, &args.cells).as_bytes());
        out::talk(&format!("written to {}", args.out.display()));
    }
    Ok(DONE)
}

fn experiment(args: &Crowns) -> Experiment {
    Experiment {
        seed: u64::from(args.seed),
        trees: args.trees as usize,
        repeats: u64::from(args.repeats),
        cells_m: args.cells.clone(),
        ..Experiment::default()
    }
}

/// A dataset's name and clusters.
type Named = (String, Vec<Cluster>);

fn generated(experiment: &Experiment) -> Result<Vec<Named>> {
    let one = |dataset: &timberline_experiment::crowns::DatasetParams| {
        out::talk(&format!(
            "dataset {}: {} x {} trees",
            dataset.name, experiment.repeats, experiment.trees
        ));
        Ok((dataset.name.clone(), experiment.clusters(dataset)?))
    };
    experiment.datasets.iter().map(one).collect()
}

/// The crowns of a run whose stems are known.
fn of_campaign(program: &Program, args: &Crowns, campaign: &Path) -> Result<Named> {
    let place = Place { campaign: campaign.to_owned(), work: args.work.clone() };
    let opened = Opened::new(program, &place, args.pipeline.as_deref())?;
    let known = opened.campaign.file.truth.clone().unwrap_or_default().trees;
    let truth = args.truth.clone().or_else(|| known.map(|path| opened.campaign.resolve(&path)));
    let missing = || {
        let what = "no known trees: give --truth, or [truth] in campaign.toml";
        Usage(what.to_owned())
    };
    let truth = truth.ok_or_else(missing)?;
    let dry =
        DryRun::new(&opened.pipeline, &opened.survey, &opened.store).map_err(anyhow::Error::msg)?;
    let filter = Filter { min_height_m: 2.0, hidden: true };
    let stems = read_trees(&truth, Position::Stem.columns(), filter)?;
    // Tops are matched with tops where the table tells them apart, as `evaluate` does.
    let reference =
        read_trees(&truth, Position::Apex.columns(), filter).unwrap_or_else(|_| stems.clone());
    let found: Vec<_> = trees_of_run(&opened, &dry, filter.min_height_m)?
        .iter()
        .map(|tree| as_tree(tree, Position::Apex))
        .collect();
    let matching = match_trees(&reference, &found, &MatchParams::default())?;
    let stems = stems_of_found(&matching, &reference, &found, &stems);
    let clusters = clusters(&opened, &dry, &stems)?;
    if clusters.is_empty() {
        return Err(Usage("no tree of the run is one of the known trees".to_owned()).into());
    }
    let (found, known) = (clusters.len(), reference.len());
    out::talk(&format!("{found} of {known} known trees found"));
    Ok((opened.campaign.file.name.clone(), clusters))
}

fn assess_all(datasets: Vec<Named>, cells_m: &[f64]) -> Result<Vec<Assessed>> {
    let settings = plan::sweeps();
    let clusters: usize = datasets.iter().map(|(_, clusters)| clusters.len()).sum();
    let bar = bar("crowns", (clusters * cells_m.len()) as u64);
    out::talk(&format!(
        "{clusters} crowns, {} methods and parameters, {} cell sizes",
        settings.len(),
        cells_m.len()
    ));
    let one =
        |(name, clusters): Named| Ok(assess(&name, clusters, &settings, cells_m, &|| bar.inc(1))?);
    let all: Result<Vec<Assessed>> = datasets.into_iter().map(one).collect();
    bar.finish_and_clear();
    all
}

/// A bar on a terminal, nothing elsewhere.
fn bar(what: &'static str, of: u64) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::with_draw_target(Some(of), ProgressDrawTarget::stderr());
    let template = "{prefix:>14} {bar:30} {pos}/{len}, {elapsed}, ETA {eta}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_prefix(what);
    bar
}

/// The end of the report.
const FIGURE: &str = "\n## Figure\n\n![Median error over omega and over delta](figure4.png)\n";

fn write(folder: &Path, all: &[Assessed], cells_m: &[f64], json: &serde_json::Value) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let json = serde_json::to_string_pretty(json)? + "\n";
    let files = [
        ("report.md", text::markdown(all, cells_m) + FIGURE),
        ("methods.csv", text::methods_csv(all)),
        ("trees.csv", text::trees_csv(all)),
        ("clusters.csv", text::clusters_csv(all)),
        ("experiment.json", json),
    ];
    for (name, text) in files {
        write_atomic(&folder.join(name), text.as_bytes())?;
    }
    for (index, &cell_m) in cells_m.iter().enumerate() {
        let last = index + 1 == cells_m.len();
        let name = if last { "figure4".to_owned() } else { format!("figure4-cell{cell_m}") };
        let chart = figures::figure4(all, cell_m);
        chart.write_png(&folder.join(format!("{name}.png")))?;
        write_atomic(&folder.join(format!("{name}.svg")), chart.svg()?.as_bytes())?;
    }
    Ok(())
}

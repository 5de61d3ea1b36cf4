//! `experiment segmentation`: all segmenters on generated stands.

use super::{bar, real, segmentation_figures};
use crate::cli::{DONE, Usage, out};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use timberline_artefact::publish::write_atomic;
use timberline_experiment::segmentation::{
    BoxRow, Chain, ClipRow, Experiment, Method, Outcome, Pooled, StandKind, compare, method,
    methods, pool, real as real_scans, text,
};

/// Arguments of `experiment segmentation`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Stands are grown and scanned, trees are found by the airborne chain with its default parameters, and every \
    segmenter gives the points their trees; trees and points are compared with the truth.\n\n\
    Files in the output folder:\n  \
    report.md           recall, precision, F, errors, points and crowns by stand, segmenter and density\n  \
    cases.csv           lines for every case and segmenter: all trees, visible ones, classes of height, layers\n  \
    trees.csv           a line for every true tree and every false one, for every case and segmenter\n  \
    experiment.json     all parameters and figures\n  \
    density.png, .svg   F of trees over density, for every kind of stand\n  \
    segments.png, .svg  F of segments over density, for every kind of stand and segmenter\n  \
    layers.png, .svg    F of trees by canopy layer, at the density nearest to 10 points per square metre\n  \
    clips.csv           a line for every measured tree and segmenter, with --data\n\n\
    The same arguments give the same bytes, whatever the number of threads."
)]
pub(super) struct Args {
    /// Seed of the generated stands
    #[arg(long, default_value_t = 1)]
    seed: u32,
    /// Repetitions, each with trees of its own
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: u32,
    /// Densities of points, all returns, 1/m²
    #[arg(long, value_name = "N", value_delimiter = ',', default_values_t = [2.0, 5.0, 10.0, 20.0, 60.0])]
    densities: Vec<f64>,
    /// Kinds of stand [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    stands: Vec<String>,
    /// Segmenters [default: all]
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    segmenters: Vec<String>,
    /// Edge of the square in which trees are judged, m
    #[arg(long, value_name = "M", default_value_t = 100.0)]
    edge: f64,
    /// Width of the crowns, relative to that of the kind of stand
    #[arg(long, value_name = "X", default_value_t = 1.0)]
    crown_scale: f64,
    /// Slope of the ground, degrees
    #[arg(long, value_name = "DEG", default_value_t = 6.0)]
    slope: f64,
    /// How far crowns are dented, relative to what is common in their species; 0 leaves them smooth
    #[arg(long, value_name = "X", default_value_t = 0.0)]
    crown_relief: f64,
    /// Folder of real scans with truth, of which als/neon_SJER_052 and uas_treeclips are read
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Folder to write to
    #[arg(long, value_name = "DIR", default_value = "target/experiment-segmentation")]
    out: PathBuf,
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
/// When an argument makes no sense, a stage fails, or a file cannot be written.
pub(super) fn run(args: &Args) -> Result<u8> {
    let experiment = experiment(args)?;
    let methods = segmenters(&args.segmenters)?;
    let pool_of_threads =
        rayon::ThreadPoolBuilder::new().num_threads(args.jobs.unwrap_or(0)).build()?;
    let cases = experiment.cases().len();
    out::talk(&format!("{cases} stands, {} segmenters", methods.len()));
    let bar = bar("stands", cases as u64);
    let chain = Chain::default();
    let outcomes =
        pool_of_threads.install(|| compare(&experiment, &chain, &methods, &|| bar.inc(1)))?;
    bar.finish_and_clear();
    let (boxes, clips) = match &args.data {
        Some(data) => pool_of_threads.install(|| on_real_scans(data, &chain, &methods))?,
        None => Default::default(),
    };
    let pooled = pool(&outcomes, &experiment.height_edges_m);
    let found = Found { experiment, chain, outcomes, pooled, boxes, clips };
    found.write(&args.out)?;
    if args.json {
        out::json(&found.json())?;
    } else {
        out::raw(found.report().as_bytes());
        out::talk(&format!("written to {}", args.out.display()));
    }
    Ok(DONE)
}

fn experiment(args: &Args) -> Result<Experiment> {
    let stands: Result<Vec<StandKind>, _> = args.stands.iter().map(|name| name.parse()).collect();
    let stands = stands.map_err(|error| Usage(error.to_string()))?;
    let experiment = Experiment {
        seed: args.seed,
        repeats: args.repeats,
        stands: if stands.is_empty() { StandKind::ALL.to_vec() } else { stands },
        densities_per_m2: args.densities.clone(),
        judged_edge_m: args.edge,
        slope_deg: args.slope,
        crown_scale: args.crown_scale,
        crown_relief: args.crown_relief,
        ..Experiment::default()
    };
    experiment.check().map_err(|error| Usage(error.to_string()))?;
    Ok(experiment)
}

fn segmenters(names: &[String]) -> Result<Vec<Method>> {
    if names.is_empty() {
        return Ok(methods());
    }
    let chosen: Result<Vec<Method>, _> = names.iter().map(|name| method(name)).collect();
    Ok(chosen.map_err(|error| Usage(error.to_string()))?)
}

fn on_real_scans(
    folder: &Path,
    chain: &Chain,
    methods: &[Method],
) -> Result<(Vec<BoxRow>, Vec<ClipRow>)> {
    let (boxed, clips) = real::read(folder)?;
    out::talk(&format!("{} scan(s) with boxes, {} measured trees", boxed.len(), clips.len()));
    let boxes = real_scans::boxes(&boxed, chain, methods)?;
    Ok((boxes, real_scans::clips(&clips, chain, methods)?))
}

/// All that was found.
struct Found {
    experiment: Experiment,
    chain: Chain,
    outcomes: Vec<Outcome>,
    pooled: Vec<Pooled>,
    boxes: Vec<BoxRow>,
    clips: Vec<ClipRow>,
}

/// The end of the report.
const FIGURES: &str = "\n## Figures\n\n![F of trees over density](density.png)\n\n\
    ![F of segments over density](segments.png)\n\n![F by canopy layer](layers.png)\n";

impl Found {
    fn report(&self) -> String {
        let generated = text::markdown(&self.experiment, &self.pooled);
        generated + &text::real_markdown(&self.boxes, &self.clips)
    }

    fn json(&self) -> serde_json::Value {
        serde_json::json!({
            "experiment": self.experiment,
            "chain": self.chain,
            "cases": self.outcomes,
            "pooled": self.pooled,
            "boxes": self.boxes,
            "clips": self.clips,
        })
    }

    fn write(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let mut files = vec![
            ("report.md", self.report() + FIGURES),
            ("cases.csv", text::cases_csv(&self.outcomes)),
            ("trees.csv", text::trees_csv(&self.outcomes)),
            ("experiment.json", serde_json::to_string_pretty(&self.json())? + "\n"),
        ];
        if !self.clips.is_empty() {
            files.push(("clips.csv", text::clips_csv(&self.clips)));
        }
        for (name, text) in files {
            write_atomic(&folder.join(name), text.as_bytes())?;
        }
        let (experiment, trees) = (&self.experiment, text::tree_sets(&self.pooled));
        let charts = [
            ("density", segmentation_figures::density(experiment, &trees)),
            ("segments", segmentation_figures::segments(experiment, &self.pooled)),
            ("layers", segmentation_figures::layers(experiment, &trees)),
        ];
        for (name, chart) in charts {
            chart.write_png(&folder.join(format!("{name}.png")))?;
            write_atomic(&folder.join(format!("{name}.svg")), chart.svg()?.as_bytes())?;
        }
        Ok(())
    }
}

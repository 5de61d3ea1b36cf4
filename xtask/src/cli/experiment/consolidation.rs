//! `experiment consolidation`: models of a run's trees with and without consolidation.

use super::bar;
use crate::cli::known::artefacts;
use crate::cli::open::{Opened, Place};
use crate::cli::{DONE, Program, Usage, out};
use crate::engine::explain::DryRun;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use timberline_artefact::kinds::TreeCloud;
use timberline_artefact::publish::write_atomic;
use timberline_artefact::{Kind, read};
use timberline_experiment::consolidation::{Assessed, Case, assess, changes, text};

/// Arguments of `experiment consolidation`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Every tree cloud of finished runs is modelled in the mode `adtree` and by default, each along a skeleton from \
    the points as scanned, from points consolidated in the paper's mode, and from points consolidated by default; `kept` is what \
    the stage `cylinders` makes of it. Distances are those of the points as scanned.\n\n\
    Files in the output folder:\n  \
    report.md        changes over all trees, by tree, and all figures\n  \
    models.csv       a line for every model of every tree, lengths in metres\n  \
    experiment.json  all figures\n\n\
    The same runs give the same bytes, whatever the number of threads."
)]
pub(super) struct Args {
    /// Folders of campaigns with a finished run of the terrestrial chain
    #[arg(required = true, value_name = "CAMPAIGN")]
    campaigns: Vec<PathBuf>,
    /// Pipeline file [default: that of the last run]
    #[arg(long, value_name = "FILE")]
    pipeline: Option<PathBuf>,
    /// Workspaces of the runs, one for each campaign [default: .timberline in the campaign's folder]
    #[arg(long, value_name = "DIR")]
    work: Vec<PathBuf>,
    /// Only the trees with the most points of each campaign
    #[arg(long, value_name = "N")]
    largest: Option<usize>,
    /// Folder to write to
    #[arg(long, value_name = "DIR", default_value = "target/experiment-consolidation")]
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
/// When a run cannot be read, a tree cannot be consolidated, or a file cannot be written.
pub(super) fn run(program: &Program, args: &Args) -> Result<u8> {
    if !args.work.is_empty() && args.work.len() != args.campaigns.len() {
        let (workspaces, campaigns) = (args.work.len(), args.campaigns.len());
        let what = format!("{workspaces} --work for {campaigns} campaigns: give one for each");
        return Err(Usage(what).into());
    }
    let mut clouds = Vec::new();
    for (index, campaign) in args.campaigns.iter().enumerate() {
        let work = args.work.get(index).cloned();
        clouds.extend(of_campaign(program, args, campaign, work)?);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.unwrap_or(0)).build()?;
    let bar = bar("trees", clouds.len() as u64);
    let mut all: Vec<Assessed> = Vec::new();
    for (name, path) in &clouds {
        let case = case(name, path)?;
        all.push(pool.install(|| assess(&case)).with_context(|| format!("tree {name}"))?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    let json = serde_json::json!({ "changes": changes(&all), "trees": all });
    write(&args.out, &all, &json)?;
    if args.json {
        out::json(&json)?;
    } else {
        out::raw(text::markdown(&all).as_bytes());
        out::talk(&format!("written to {}", args.out.display()));
    }
    Ok(DONE)
}

/// Names and files of the tree clouds of a run.
fn of_campaign(
    program: &Program,
    args: &Args,
    campaign: &Path,
    work: Option<PathBuf>,
) -> Result<Vec<(String, PathBuf)>> {
    let place = Place { campaign: campaign.to_owned(), work };
    let opened = Opened::new(program, &place, args.pipeline.as_deref())?;
    let dry =
        DryRun::new(&opened.pipeline, &opened.survey, &opened.store).map_err(anyhow::Error::msg)?;
    let found = artefacts(&opened, &dry, TreeCloud::NAME)
        .with_context(|| campaign.display().to_string())?;
    let mut clouds = Vec::new();
    for (unit, path) in &found {
        let points = timberline_artefact::read_header(path)?.facts.counts.get("points").copied();
        clouds.push((points.unwrap_or(0), unit.to_string(), path.clone()));
    }
    clouds.sort_by(|a, b| b.0.cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    clouds.truncate(args.largest.unwrap_or(usize::MAX));
    let campaign = &opened.campaign.file.name;
    let name = |unit: String| {
        let only = found.len() == 1;
        if only { campaign.clone() } else { format!("{campaign} {}", unit.replace(':', " ")) }
    };
    Ok(clouds.into_iter().map(|(_, unit, path)| (name(unit), path)).collect())
}

/// A tree as the stages read it.
fn case(name: &str, path: &Path) -> Result<Case> {
    let (_, TreeCloud { stem, cloud }) = read::<TreeCloud>(path)?;
    let wood = cloud.extra.get(TreeCloud::WOOD);
    let wood = wood.map(|wood| (0..cloud.len()).map(|index| wood.value(index) as f32).collect());
    Ok(Case {
        name: name.to_owned(),
        points_m: (0..cloud.len()).map(|index| cloud.local(index)).collect(),
        wood,
        base_m: cloud.frame.local_from_world(stem.base_m),
        dbh_m: Some(stem.dbh_m).filter(|dbh_m| dbh_m.is_finite()),
    })
}

fn write(folder: &Path, all: &[Assessed], json: &serde_json::Value) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let json = serde_json::to_string_pretty(json)? + "\n";
    let files = [
        ("report.md", text::markdown(all)),
        ("models.csv", text::models_csv(all)),
        ("experiment.json", json),
    ];
    for (name, text) in files {
        write_atomic(&folder.join(name), text.as_bytes())?;
    }
    Ok(())
}

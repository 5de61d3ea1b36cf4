//! `bench`: speed and memory of the whole chain on generated stands.

use super::out::{self, Table};
use super::sample::utm_crs;
use super::{DONE, Usage};
use crate::config::campaign::FILE_NAME;
use crate::engine::progress::{bytes, duration, short};
use crate::engine::runlog::StageSummary;
use crate::engine::workdir::walk;
use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;
use timberline_export::las::{LasOptions, offset_for, write_las};
use timberline_ingest::{LasFile, UnitChoice};
use timberline_pointcloud::TileGrid;
use timberline_synth::{Scene, benchmark};

/// Edge of the files of a generated stand, m: about 1.6 M points each.
const FILE_EDGE_M: u32 = 360;
/// Seed of the generated stands.
const SEED: u64 = 20_26;
/// CRS of the generated stands: UTM zone 10 north.
const EPSG: u32 = 26910;

/// Arguments of `bench`.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, clap::Subcommand)]
enum What {
    /// The airborne chain
    Als {
        /// Sizes of the stands in millions of points
        #[arg(long, value_delimiter = ',', default_values_t = [5.0, 10.0, 20.0])]
        points: Vec<f64>,
        /// Pipeline file
        #[arg(long, default_value = "pipelines/als-inventory.toml")]
        pipeline: PathBuf,
        /// Threads [default: one a processor]
        #[arg(long)]
        jobs: Option<usize>,
        /// Folder for the stands, kept for the next time
        #[arg(long, default_value = "target/bench-als")]
        folder: PathBuf,
        /// Print the results as JSON
        #[arg(long)]
        json: bool,
    },
}

/// What was measured on one stand.
#[derive(Debug, Serialize)]
struct Measured {
    points: u64,
    file_bytes: u64,
    seconds: f64,
    /// Wall time of decoding the files alone with as many threads.
    decode_seconds: f64,
    peak_rss_bytes: Option<u64>,
    stages: Vec<StageSummary>,
}

/// Runs the command.
///
/// # Errors
/// When a stand cannot be generated or a run fails.
pub fn run(args: &Args) -> Result<u8> {
    let What::Als { points, pipeline, jobs, folder, json } = &args.what;
    if points.iter().any(|millions| !(0.01..=10_000.0).contains(millions)) {
        return Err(Usage("--points are millions, from 0.01 to 10000".to_owned()).into());
    }
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let jobs = jobs.unwrap_or(processors);
    let mut all = Vec::new();
    for millions in points {
        let campaign = folder.join(format!("{millions}M"));
        let count = generate(&campaign, (millions * 1e6) as u64)?;
        all.push(measure(&campaign, pipeline, jobs, count)?);
    }
    if *json {
        out::json(&serde_json::json!({ "machine": machine(), "jobs": jobs, "stands": all }))?;
    } else {
        print(&all, jobs);
    }
    Ok(DONE)
}

/// Writes the stand unless it is there; returns its number of points.
fn generate(campaign: &Path, points: u64) -> Result<u64> {
    let done = campaign.join("points.txt");
    if let Ok(text) = std::fs::read_to_string(&done) {
        return text.trim().parse().with_context(|| done.display().to_string());
    }
    out::talk(&format!("generating {} points in {}", short(points as f64), campaign.display()));
    let (scene, crs) = (Scene::new(benchmark::stand(points, SEED))?, utm_crs(EPSG));
    let mut total = 0;
    for (tile, cloud) in scene.blocks(TileGrid::new(FILE_EDGE_M, [0, 0])?) {
        let low = cloud.frame.world_from_local(cloud.bounds().min);
        let options = LasOptions { offset: offset_for(&crs, low), ..LasOptions::default() };
        write_las(
            &campaign.join(format!("{tile}.laz")),
            std::slice::from_ref(&cloud),
            &crs,
            &options,
        )?;
        total += cloud.len() as u64;
    }
    std::fs::write(
        campaign.join(FILE_NAME),
        "name = \"bench\"\nplatform = \"als\"\ninputs = [\"*.laz\"]\n",
    )?;
    std::fs::write(done, total.to_string())?;
    Ok(total)
}

fn measure(campaign: &Path, pipeline: &Path, jobs: usize, points: u64) -> Result<Measured> {
    let work = campaign.join("work");
    if work.exists() {
        std::fs::remove_dir_all(&work).with_context(|| work.display().to_string())?;
    }
    let (file_bytes, decode_seconds) = decode(campaign, jobs)?;
    out::talk(&format!("running {} points", short(points as f64)));
    // A process of its own, so that its memory is that of the run alone.
    let output = Command::new(std::env::current_exe()?)
        .args(["run", "--json", "--jobs", &jobs.to_string()])
        .arg(pipeline)
        .arg("--campaign")
        .arg(campaign)
        .arg("--work")
        .arg(&work)
        .stderr(Stdio::inherit())
        .output()?;
    ensure!(output.status.success(), "the run ended with {}", output.status);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout)?;
    let stages: Vec<StageSummary> = serde_json::from_value(report["stages"].clone())?;
    Ok(Measured {
        points,
        file_bytes,
        seconds: report["seconds"].as_f64().unwrap_or(0.0),
        decode_seconds,
        peak_rss_bytes: stages.iter().filter_map(|stage| stage.peak_rss_bytes).max(),
        stages,
    })
}

/// Size of the files of a stand and the wall time of decoding them with so many threads.
fn decode(campaign: &Path, jobs: usize) -> Result<(u64, f64)> {
    let mut files = Vec::new();
    walk(campaign, &mut |path| {
        if path.extension().is_some_and(|ending| ending == "laz") {
            files.push(path.to_owned());
        }
    });
    let pool = rayon::ThreadPoolBuilder::new().num_threads(jobs).build()?;
    let begun = Instant::now();
    let read = |path: &PathBuf| -> Result<()> {
        let mut file = LasFile::open(path, UnitChoice::default(), None)?;
        while file.next_batch()?.is_some() {}
        Ok(())
    };
    pool.install(|| files.par_iter().try_for_each(read))?;
    let seconds = begun.elapsed().as_secs_f64();
    let sizes = files.iter().filter_map(|path| std::fs::metadata(path).ok());
    Ok((sizes.map(|meta| meta.len()).sum(), seconds))
}

fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|line| line.strip_prefix("model name"));
    model.map_or("unknown".to_owned(), |line| line.trim_start_matches([' ', '\t', ':']).to_owned())
}

fn print(all: &[Measured], jobs: usize) {
    out::line(&format!("{}, {jobs} threads", machine()));
    for stand in all {
        let per_second =
            |seconds: f64| format!("{}/s", short(stand.points as f64 / seconds.max(1e-9)));
        out::line(&format!("\n{} points, {}", short(stand.points as f64), bytes(stand.file_bytes)));
        let mut table = Table::new(&["stage", "time", "share", "points", "peak memory"]);
        for stage in &stand.stages {
            let share = format!("{:.0} %", 100.0 * stage.seconds / stand.seconds);
            let peak = stage.peak_rss_bytes.map_or("-".to_owned(), bytes);
            table.row([
                stage.stage.clone(),
                duration(stage.seconds),
                share,
                per_second(stage.seconds),
                peak,
            ]);
        }
        let peak = stand.peak_rss_bytes.map_or("-".to_owned(), bytes);
        table.row([
            "whole".into(),
            duration(stand.seconds),
            "100 %".into(),
            per_second(stand.seconds),
            peak,
        ]);
        out::line(&table.text());
        let share = 100.0 * stand.decode_seconds / stand.seconds;
        let rate = per_second(stand.decode_seconds);
        out::line(&format!(
            "LAZ decoding alone: {}, {rate}, {share:.0} % of the whole",
            duration(stand.decode_seconds)
        ));
    }
}

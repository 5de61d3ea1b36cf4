//! `experiment detection`: the models behind the scores of treetops and trees.

use super::bar;
use crate::cli::{DONE, Usage, out};
use anyhow::{Context, Result};
use std::path::PathBuf;
use timberline_artefact::publish::write_atomic;
use timberline_boosting::{Params, Sample, fit, source};
use timberline_experiment::detection::{Training, trees, treetops};
use timberline_experiment::segmentation::{Chain, Experiment};

/// Arguments of `experiment detection`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Candidates on generated stands, each known to be a tree or not, give the models behind their scores: boosted decision trees. \
    That of treetops comes first: build it in (crates/treetops/src/model.rs), then find that of trees \
    (crates/crowns/src/detection/model.rs). The same arguments give the same bytes, whatever the number of threads."
)]
pub(super) struct Args {
    /// Whose score
    #[arg(value_enum)]
    of: Of,
    /// Seed of the generated stands; stands of other seeds are free for tests
    #[arg(long, default_value_t = Training::default().experiment.seed)]
    seed: u32,
    /// Repetitions, each with trees of its own
    #[arg(long, default_value_t = Training::default().experiment.repeats)]
    repeats: u32,
    /// Edge of the square from which candidates are taken, m
    #[arg(long, value_name = "M", default_value_t = 100.0)]
    edge: f64,
    /// Source file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Threads [default: one a processor]
    #[arg(long)]
    jobs: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Of {
    /// Of candidates, by the points around them
    Treetops,
    /// Of candidates with crown models, by these and their rivals
    Trees,
}

/// Runs the command.
///
/// # Errors
/// When an argument makes no sense, a stage fails, or the file cannot be written.
pub(super) fn run(args: &Args) -> Result<u8> {
    let default = Training::default();
    let experiment = Experiment {
        seed: args.seed,
        repeats: args.repeats,
        judged_edge_m: args.edge,
        ..default.experiment.clone()
    };
    experiment.check().map_err(|error| Usage(error.to_string()))?;
    let training = Training { experiment, ..default };
    let bar = bar("stands", training.experiment.cases().len() as u64);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.unwrap_or(0)).build()?;
    let chain = Chain::default();
    let text = pool.install(|| -> Result<String> {
        Ok(match args.of {
            Of::Treetops => fitted(&treetops(&training, &chain.treetops, &|| bar.inc(1))?, args),
            Of::Trees => fitted(&trees(&training, &chain, &|| bar.inc(1))?, args),
        })
    })?;
    bar.finish_and_clear();
    write_atomic(&args.out, text.as_bytes())
        .with_context(|| format!("`{}` cannot be written", args.out.display()))?;
    out::talk(&format!("written to {}", args.out.display()));
    Ok(DONE)
}

fn fitted<const N: usize>(samples: &[Sample<N>], args: &Args) -> String {
    let fitted = fit(samples, &Params::default());
    let right = samples.iter().filter(|sample| sample.is_right).count();
    let of = match args.of {
        Of::Treetops => "treetops",
        Of::Trees => "trees",
    };
    out::talk(&format!("{} candidates, {right} trees, loss {:.4}", samples.len(), fitted.loss));
    let about = format!(
        "The model behind the score of {of}, as `cargo xtask experiment detection {of} --seed {} --repeats {}\n\
         --edge {}` finds them: {} candidates, {right} of them trees.",
        args.seed,
        args.repeats,
        args.edge,
        samples.len()
    );
    source::source(&fitted, &about)
}

//! The command line. Results go to stdout, talk to stderr; every command returns an exit code.

pub mod bench;
pub mod cache;
pub mod diff;
pub mod doctor;
pub mod evaluate;
pub mod experiment;
pub mod explain;
pub mod export;
pub mod init;
pub mod inspect;
pub mod known;
pub mod open;
pub mod out;
pub mod picture;
pub mod pipeline;
pub mod plan;
pub mod run;
pub mod sample;
pub mod schema;
pub mod status;

use crate::config::Problems;
use crate::engine::Surveyor;
use crate::registry::Registry;
use clap::{CommandFactory, Parser, Subcommand};
use std::sync::atomic::AtomicBool;

/// Everything went well.
pub const DONE: u8 = 0;
/// The command failed.
pub const FAILED: u8 = 1;
/// The command line or a configuration file is wrong.
pub const USAGE: u8 = 2;
/// The run ended, but something was lost on the way.
pub const LOSSES: u8 = 3;

/// Forest laser scans in, tree inventories out.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", version, disable_help_subcommand = true)]
#[command(
    after_help = "Exit codes: 0 done, 1 failed, 2 usage or configuration, 3 finished with losses.\n\
    Log output: set RUST_LOG=debug. Colours: set NO_COLOR=1 to turn them off."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a pipeline over a campaign; what is up to date is not run again
    Run(run::Args),
    /// Show what `run` would do, and why
    Plan(plan::Args),
    /// Show the last run and what is up to date now
    Status(status::Args),
    /// Tell why a stage, or one unit of it, would run again
    Explain(explain::Args),
    /// Show what an artefact holds: header, lineage, value ranges, first rows
    Inspect(inspect::Args),
    /// Check every byte of a store
    Doctor(doctor::Args),
    /// Size of the store, removal of what is no longer used
    Cache(cache::Args),
    /// Compare two runs: parameters, inputs, units, times
    Diff(diff::Args),
    /// List, check and print pipelines
    Pipeline(pipeline::Args),
    /// Print the JSON Schema of pipeline or campaign files
    Schema(schema::Args),
    /// Write a campaign.toml for a folder of scans
    Init(init::Args),
    /// Generate the sample campaigns in data-samples
    Sample(sample::Args),
    /// Copy what a run left for people to another folder
    Export(export::Args),
    /// Compare the trees of a run with known ones
    Evaluate(evaluate::Args),
    /// Repeat the papers' experiments
    Experiment(experiment::Args),
    /// Measure speed and memory on a generated stand
    Bench(bench::Args),
    /// Print shell completions
    Completions {
        /// For which shell
        shell: clap_complete::Shell,
    },
}

/// What the command line works with.
pub struct Program {
    /// The stages.
    pub registry: Registry,
    /// How raw files are looked at.
    pub surveyor: Box<dyn Surveyor>,
    /// Set when the user wants to stop.
    pub cancel: &'static AtomicBool,
}

/// A mistake in how a command was called.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Usage(pub String);

impl Program {
    /// Runs the command line and returns the exit code.
    #[must_use]
    pub fn main(&self, args: impl IntoIterator<Item = std::ffi::OsString>) -> u8 {
        let cli = match Cli::try_parse_from(args) {
            Ok(cli) => cli,
            Err(error) => {
                // Nothing sensible is left to do when the terminal is gone.
                let _ = error.print();
                return if error.use_stderr() { USAGE } else { DONE };
            }
        };
        match self.dispatch(cli.command) {
            Ok(code) => code,
            Err(error) => report(&error),
        }
    }

    fn dispatch(&self, command: Command) -> anyhow::Result<u8> {
        match command {
            Command::Run(args) => run::run(self, &args),
            Command::Plan(args) => plan::run(self, &args),
            Command::Status(args) => status::run(self, &args),
            Command::Explain(args) => explain::run(self, &args),
            Command::Inspect(args) => inspect::run(&args),
            Command::Doctor(args) => doctor::run(&args),
            Command::Cache(args) => cache::run(self, &args),
            Command::Diff(args) => diff::run(&args),
            Command::Pipeline(args) => pipeline::run(self, &args),
            Command::Schema(args) => schema::run(self, &args),
            Command::Init(args) => init::run(self, &args),
            Command::Sample(args) => sample::run(&args),
            Command::Export(args) => export::run(&args),
            Command::Evaluate(args) => evaluate::run(self, &args),
            Command::Experiment(args) => experiment::run(self, &args),
            Command::Bench(args) => bench::run(&args),
            Command::Completions { shell } => {
                let mut script = Vec::new();
                clap_complete::generate(shell, &mut Cli::command(), "cargo-xtask", &mut script);
                out::raw(&script);
                Ok(DONE)
            }
        }
    }
}

/// Prints an error and finds its exit code.
fn report(error: &anyhow::Error) -> u8 {
    if let Some(problems) = error.downcast_ref::<Problems>() {
        for problem in &problems.0 {
            out::error(&problem.to_string());
        }
        if problems.0.len() > 1 {
            out::talk(&format!("{} problems", problems.0.len()));
        }
        return USAGE;
    }
    out::error(&format!("{error:#}"));
    if error.is::<Usage>() { USAGE } else { FAILED }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}

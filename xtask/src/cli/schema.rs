//! `schema`.

use super::{DONE, Program, out};
use anyhow::Result;

/// Arguments of `schema`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Of which file
    #[arg(value_enum)]
    of: Of,
}

#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Of {
    /// Pipeline files
    Pipeline,
    /// campaign.toml
    Campaign,
}

/// Runs the command.
///
/// # Errors
/// None in practice.
pub fn run(program: &Program, args: &Args) -> Result<u8> {
    match args.of {
        Of::Pipeline => out::json(&crate::config::pipeline::schema(&program.registry))?,
        Of::Campaign => out::json(&crate::config::campaign::schema())?,
    }
    Ok(DONE)
}

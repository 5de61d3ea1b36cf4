//! `bench`.

use super::DONE;
use anyhow::Result;

/// Arguments of `bench`.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs the command.
///
/// # Errors
/// None.
pub fn run(_: &Args) -> Result<u8> {
    Ok(DONE)
}

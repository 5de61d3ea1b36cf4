//! `evaluate`.

use super::DONE;
use anyhow::Result;

/// Arguments of `evaluate`.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs the command.
///
/// # Errors
/// None.
pub fn run(_: &Args) -> Result<u8> {
    Ok(DONE)
}

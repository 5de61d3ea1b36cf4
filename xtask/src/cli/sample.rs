//! `sample`: the sample campaigns, byte for byte the same every time.

use super::{DONE, out};
use crate::config::campaign::FILE_NAME;
use crate::engine::progress::bytes;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use timberline_artefact::Crs;
use timberline_artefact::publish::write_atomic;
use timberline_export::las::{LasOptions, write_las};
use timberline_pointcloud::PointCloud;
use timberline_synth::sample::{self, SampleStand};

/// Arguments of `sample`.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder to write to
    #[arg(long, value_name = "DIR", default_value = "data-samples")]
    out: PathBuf,
}

/// Runs the command.
///
/// # Errors
/// When a file cannot be written.
pub fn run(args: &Args) -> Result<u8> {
    write(&args.out.join("als-stand"), sample::als_stand()?)?;
    write(&args.out.join("tls-plot"), sample::tls_plot()?)?;
    Ok(DONE)
}

/// Writes the files of a sample.
fn write(folder: &Path, stand: SampleStand) -> Result<()> {
    let crs = utm_crs(u32::from(stand.epsg));
    for tile in &stand.tiles {
        write_scan(&folder.join(&tile.name), &tile.cloud, &crs)?;
    }
    let campaign = (FILE_NAME.to_owned(), stand.campaign_toml);
    for (name, text) in stand.tables.iter().chain([&campaign]) {
        let path = folder.join(name);
        write_atomic(&path, text.as_bytes())?;
        out::line(&format!("{} ({})", path.display(), bytes(text.len() as u64)));
    }
    Ok(())
}

/// Writes points as LAZ (by the path's ending).
///
/// # Errors
/// When the file cannot be written.
pub fn write_scan(path: &Path, cloud: &PointCloud, crs: &Crs) -> Result<()> {
    let low = cloud.frame.world_from_local(cloud.bounds().min);
    let offset = timberline_export::las::offset_for(crs, low);
    let options = LasOptions { offset, ..LasOptions::default() };
    write_las(path, std::slice::from_ref(cloud), crs, &options)?;
    let size = std::fs::metadata(path).with_context(|| format!("{}", path.display()))?.len();
    out::line(&format!("{} ({} points, {})", path.display(), cloud.len(), bytes(size)));
    Ok(())
}

/// A projected CRS in metres by its code.
#[must_use]
pub fn utm_crs(epsg: u32) -> Crs {
    Crs { epsg: Some(epsg), name: format!("EPSG:{epsg}"), ..Crs::default() }
}

//! The samples that are kept with the program: a virtual airborne survey of one stand, and a virtual
//! terrestrial one of one plot.

pub mod als_stand;
pub mod tls_plot;

pub use als_stand::{EPSG, TILE_M, als_stand, als_stand_params, field_plots};
pub use tls_plot::{tls_plot, tls_plot_scene};

use timberline_pointcloud::{PointCloud, Rect};

/// One file of points.
#[derive(Debug, Clone)]
pub struct SampleTile {
    /// Path of the file within the sample's folder.
    pub name: String,
    /// What the file covers.
    pub rect: Rect,
    /// Its points.
    pub cloud: PointCloud,
}

/// All that a sample's folder holds.
#[derive(Debug, Clone)]
pub struct SampleStand {
    /// Point files.
    pub tiles: Vec<SampleTile>,
    /// Text files: path within the folder, contents.
    pub tables: Vec<(String, String)>,
    /// Contents of `campaign.toml`.
    pub campaign_toml: String,
    /// CRS of all positions.
    pub epsg: u16,
}

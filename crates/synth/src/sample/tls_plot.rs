//! A virtual terrestrial survey of one plot, one file for each of five scan positions.

use super::{SampleStand, SampleTile};
use crate::Error;
use crate::terrestrial::{LabelledPoints, PlotParams, PlotScene, ScanParams, plot, truth};
use timberline_pointcloud::Rect;

/// CRS of the sample: ETRS89 / UTM zone 33N.
pub const EPSG: u16 = 25833;
/// Seed of the sample; any other gives another plot of the same kind.
const SEED: u64 = 20_261_122;
/// Angle between pulses, degrees.
const STEP_DEG: f64 = 0.13;
/// Edge of the cells of which one point is kept, m: on the ground, and above it.
const VOXEL_M: [f64; 2] = [0.08, 0.02];
/// Height up to which points are thinned as ground, m.
const LOW_M: f64 = 0.2;
/// How far points reach beyond the plot, m.
const MARGIN_M: f64 = 1.0;
/// Steps of the intensities that are kept: a difference of less is noise.
const INTENSITY_STEP: u16 = 512;
/// Radius below which a twig is left out of the list of cylinders, m. The tables of trees count it.
const LEAST_RADIUS_M: f64 = 0.0022;
/// Cells of the true ground that is kept with the sample, m.
const DTM_CELL_M: f64 = 0.25;

/// The sample's plot.
///
/// # Errors
/// None with the sample's own parameters; see [`plot()`].
pub fn tls_plot_scene() -> Result<PlotScene, Error> {
    let scan = ScanParams { step_deg: STEP_DEG, max_range_m: 40.0, ..ScanParams::tls() };
    plot(SEED, &PlotParams { scan, ..PlotParams::default() })
}

/// The sample: thinned points of five scan positions, truth, and the campaign file.
///
/// # Errors
/// None with the sample's own parameters; see [`plot()`].
pub fn tls_plot() -> Result<SampleStand, Error> {
    let scene = tls_plot_scene()?;
    let points = thinned(&scene, &scene.scan());
    let tiles = scene.stations.iter().map(|station| tile(&points, station.source_id)).collect();
    let table = |path: &str, text: String| (path.to_owned(), text);
    let tables = vec![
        table("truth/trees.csv", truth::trees(&scene)),
        table("truth/cylinders.csv", truth::cylinders(&scene, LEAST_RADIUS_M)),
        table("truth/dtm.asc", truth::terrain(&scene, DTM_CELL_M)),
    ];
    Ok(SampleStand { tiles, tables, campaign_toml: CAMPAIGN_TOML.to_owned(), epsg: EPSG })
}

/// The points on and beside the plot, thinned over all scan positions together: coarsely near the
/// ground, finely above.
fn thinned(scene: &PlotScene, points: &LabelledPoints) -> LabelledPoints {
    let reach = scene.rect().grown(MARGIN_M);
    let height = |i: usize| {
        let [x, y, z] = points.cloud.world(i);
        reach.contains(x, y).then(|| z - scene.terrain.elevation_m(x, y))
    };
    let low = points.filter(|i| height(i).is_some_and(|h| h < LOW_M)).thinned(VOXEL_M[0]);
    let high = points.filter(|i| height(i).is_some_and(|h| h >= LOW_M)).thinned(VOXEL_M[1]);
    low.joined(&high)
}

/// The points of a scan position, neighbours following each other, which packs best.
fn tile(points: &LabelledPoints, source_id: u16) -> SampleTile {
    let mut cloud = points.of_station(source_id).cloud.in_canonical_order();
    for intensity in &mut cloud.intensity {
        *intensity = (*intensity / INTENSITY_STEP).max(1) * INTENSITY_STEP;
    }
    let rect: Rect = cloud.bounds().rect();
    let [dx, dy, _] = cloud.frame.origin_m.map(|value| value as f64);
    SampleTile {
        name: format!("scans/position_{source_id}.laz"),
        rect: rect.moved([dx, dy]),
        cloud,
    }
}

const CAMPAIGN_TOML: &str = r#"# A virtual terrestrial survey of a plot of 22 x 22 m: what `cargo xtask sample` wrote.
# The truth is in `truth/`.
name = "tls-plot"
platform = "tls"
inputs = ["scans/*.laz"]

[truth]
trees = "truth/trees.csv"
dtm = "truth/dtm.asc"
cylinders = "truth/cylinders.csv"
"#;

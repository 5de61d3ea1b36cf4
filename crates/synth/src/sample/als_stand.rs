//! A virtual airborne survey of one stand, in four files.

use super::{SampleStand, SampleTile};
use crate::plots::{self, PlotKind, PlotSite, Protocol};
use crate::pulse::Undergrowth;
use crate::scanner::ScannerParams;
use crate::scene::{Scene, SceneParams};
use crate::stand::{Stand, StandParams};
use crate::terrain::{Gully, TerrainParams};
use crate::{Error, FieldPlot, tables};
use timberline_pointcloud::Rect;

/// CRS of the sample: NAD83 / UTM zone 10N, whose elevations are taken as metres.
pub const EPSG: u16 = 26910;
/// Edge of a tile, m: four of them make 4.84 ha.
pub const TILE_M: f64 = 110.0;
/// World position of the lower left corner. On no round number, so that tiles of the pipeline and
/// tiles of the files do not coincide.
const CORNER_M: [f64; 2] = [560_037.0, 4_904_081.0];
/// How far the forest goes on around the area, m.
const MARGIN_M: f64 = 25.0;
/// Seed of the sample; any other gives another forest of the same kind.
const SEED: u64 = 20_260_117;
/// Cells of the true ground that is kept with the sample, m.
const DTM_CELL_M: f64 = 2.0;

/// The sample's scene.
#[must_use]
pub fn als_stand_params() -> SceneParams {
    let area = Rect { min: CORNER_M, max: CORNER_M.map(|value| value + 2.0 * TILE_M) };
    SceneParams {
        seed: SEED,
        origin_m: CORNER_M.map(|value| value as i64),
        area,
        terrain: terrain(),
        stands: stands(),
        crown_relief: 0.0,
        undergrowth: Undergrowth::default(),
        scanner: ScannerParams {
            altitude_m: 520.0,
            half_angle_deg: 15.0,
            sidelap: 0.58,
            heading_deg: 74.0,
            divergence_mrad: 0.5,
            ..ScannerParams::default()
        }
        .with_density(7.0),
    }
}

/// A hillside of 14 degrees with relief, a ridge, and a gully 7 m deep with a side arm.
fn terrain() -> TerrainParams {
    let main = Gully {
        through_m: [128.0, 0.0],
        direction_deg: 76.0,
        depth_m: 7.0,
        half_width_m: 8.0,
        meander_m: 18.0,
        meander_wavelength_m: 42.0,
    };
    let arm = Gully {
        through_m: [40.0, 150.0],
        direction_deg: -22.0,
        depth_m: 3.0,
        half_width_m: 4.0,
        meander_m: 5.0,
        meander_wavelength_m: 40.0,
    };
    let gullies = vec![main, arm];
    TerrainParams {
        base_m: 690.0,
        slope_deg: 14.0,
        uphill_deg: 68.0,
        gullies,
        ..TerrainParams::default()
    }
}

/// Old mixed conifers in the south-west, a plantation in the north-west, broadleaves along the gully
/// and east of it.
fn stands() -> Vec<Stand> {
    let (low, high) = (-MARGIN_M, 2.0 * TILE_M + MARGIN_M);
    let border =
        [[118.0, low], [126.0, 40.0], [134.0, 85.0], [141.0, 112.0], [158.0, 165.0], [176.0, high]];
    let stand = |name: &str, corners: Vec<[f64; 2]>, params: StandParams| Stand {
        name: name.to_owned(),
        boundary_m: corners.iter().map(|c| [CORNER_M[0] + c[0], CORNER_M[1] + c[1]]).collect(),
        params,
    };
    let middle = [low, 128.0];
    let mut south = vec![middle, [low, low]];
    south.extend(&border[..4]);
    let mut north = vec![[low, high], middle];
    north.extend(&border[3..]);
    let mut east: Vec<[f64; 2]> = border.to_vec();
    east.extend([[high, high], [high, low]]);
    vec![
        stand("mixed-conifer", south, StandParams::multilayer_mixed()),
        stand("plantation", north, StandParams::conifer_plantation()),
        stand("broadleaf", east, StandParams::broadleaf()),
    ]
}

/// Six plots of 400 m² and eight of a basal area factor of 5, spread over the stands.
fn sites() -> Vec<PlotSite> {
    let fixed = [[38., 36.], [84., 74.], [42., 178.], [112., 186.], [170., 60.], [194., 150.]];
    let variable = [
        [30., 84.],
        [72., 28.],
        [108., 108.],
        [24., 146.],
        [78., 158.],
        [96., 204.],
        [186., 100.],
        [158., 24.],
    ];
    let site = |prefix: &str, index: usize, at: &[f64; 2], kind| PlotSite {
        name: format!("{prefix}{}", index + 1),
        kind,
        centre_m: [CORNER_M[0] + at[0], CORNER_M[1] + at[1]],
    };
    let circles = fixed
        .iter()
        .enumerate()
        .map(|(i, at)| site("F", i, at, PlotKind::Fixed { radius_m: 11.28 }));
    let angles = variable
        .iter()
        .enumerate()
        .map(|(i, at)| site("V", i, at, PlotKind::Variable { baf_m2_per_ha: 5.0 }));
    circles.chain(angles).collect()
}

/// The field plots of the sample.
///
/// # Errors
/// None with the sample's own plots; see [`plots::measure`].
pub fn field_plots(scene: &Scene) -> Result<Vec<FieldPlot>, Error> {
    plots::measure(scene, &sites(), &Protocol::default())
}

/// The sample: points of four tiles, field data, truth, and the campaign file.
///
/// # Errors
/// None with the sample's own parameters; see [`Scene::new`].
pub fn als_stand() -> Result<SampleStand, Error> {
    let scene = Scene::new(als_stand_params())?;
    let area = scene.params().area;
    let plots = field_plots(&scene)?;
    let table = |path: &str, text: String| (path.to_owned(), text);
    let tables = vec![
        table("plots.csv", tables::plots(&plots)),
        table("field_trees.csv", tables::field_trees(&plots)),
        table("stands.csv", tables::stands(&scene)),
        table("truth/trees.csv", tables::truth_trees(&scene, &area)),
        table("truth/plots.csv", tables::truth_plots(&plots)),
        table("truth/plot_trees.csv", tables::truth_plot_trees(&plots)),
        table("truth/dtm.asc", tables::truth_dtm(&scene, &area, DTM_CELL_M)),
    ];
    let tiles = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|place| tile(&scene, place)).into();
    Ok(SampleStand { tiles, tables, campaign_toml: CAMPAIGN_TOML.to_owned(), epsg: EPSG })
}

fn tile(scene: &Scene, place: [u32; 2]) -> SampleTile {
    let min = [0, 1].map(|i| CORNER_M[i] + f64::from(place[i]) * TILE_M);
    let rect = Rect { min, max: min.map(|value| value + TILE_M) };
    let name = format!("scans/stand_{}_{}.laz", min[0] as i64, min[1] as i64);
    SampleTile { name, rect, cloud: scene.points_in(&rect) }
}

const CAMPAIGN_TOML: &str = r#"# A virtual survey of 4.84 ha: what `cargo xtask sample` wrote. The truth is in `truth/`.
name = "als-stand"
platform = "als"
inputs = ["scans/*.laz"]

[field]
plots = "plots.csv"
trees = "field_trees.csv"
stands = "stands.csv"

[truth]
trees = "truth/trees.csv"
dtm = "truth/dtm.asc"
"#;

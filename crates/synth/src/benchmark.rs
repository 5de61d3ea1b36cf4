//! Large scenes of a given number of points, for measurements of speed and memory.

use crate::pulse::Undergrowth;
use crate::scanner::ScannerParams;
use crate::scene::SceneParams;
use crate::stand::{Stand, StandParams};
use crate::terrain::{Gully, TerrainParams};
use timberline_pointcloud::Rect;

/// Returns per square metre of the scene, measured: 8 pulses, 1.5 returns of each.
const POINTS_PER_M2: f64 = 12.0;
/// World position of the scene's corner, UTM zone 10 north.
const ORIGIN_M: [i64; 2] = [520_000, 5_010_000];
/// How far the forest goes on around the area, m.
const MARGIN_M: f64 = 25.0;
/// Edge of the pieces into which the area is divided among kinds of forest, m.
const STAND_M: f64 = 250.0;

/// A square of mixed forest on hilly ground with about the given number of points (within 10 %).
#[must_use]
pub fn stand(points: u64, seed: u64) -> SceneParams {
    let edge = (points as f64 / POINTS_PER_M2).sqrt().ceil();
    let origin = ORIGIN_M.map(|value| value as f64);
    let area = Rect { min: origin, max: origin.map(|value| value + edge) };
    SceneParams {
        seed,
        origin_m: ORIGIN_M,
        area,
        terrain: terrain(edge),
        stands: stands(&area.grown(MARGIN_M)),
        crown_relief: 0.0,
        undergrowth: Undergrowth::default(),
        scanner: ScannerParams {
            altitude_m: 900.0,
            divergence_mrad: 0.3,
            ..ScannerParams::default()
        }
        .with_density(8.0),
    }
}

fn terrain(edge: f64) -> TerrainParams {
    let channel = |share: f64| Gully {
        through_m: [share * edge, 0.0],
        direction_deg: 80.0,
        depth_m: 9.0,
        half_width_m: 12.0,
        meander_m: 25.0,
        meander_wavelength_m: 120.0,
    };
    let count = (edge / 400.0).ceil() as u32;
    let gullies = (0..count).map(|i| channel((f64::from(i) + 0.5) / f64::from(count))).collect();
    TerrainParams { slope_deg: 4.0, gullies, ..TerrainParams::default() }
}

/// Squares of the five kinds of forest, in turn.
fn stands(rect: &Rect) -> Vec<Stand> {
    let kinds = [
        ("plantation", StandParams::conifer_plantation()),
        ("mixed", StandParams::multilayer_mixed()),
        ("open", StandParams::open_conifer()),
        ("broadleaf", StandParams::broadleaf()),
        ("savanna", StandParams::savanna()),
    ];
    let cells = rect.size().map(|edge| (edge / STAND_M).ceil() as u32);
    let mut stands = Vec::new();
    for row in 0..cells[1] {
        for column in 0..cells[0] {
            let low =
                [rect.min[0] + f64::from(column) * STAND_M, rect.min[1] + f64::from(row) * STAND_M];
            let high = [(low[0] + STAND_M).min(rect.max[0]), (low[1] + STAND_M).min(rect.max[1])];
            let (name, params) = &kinds[((column + 2 * row) % 5) as usize];
            stands.push(Stand {
                name: format!("{name}-{column}-{row}"),
                boundary_m: vec![low, [high[0], low[1]], high, [low[0], high[1]]],
                params: params.clone(),
            });
        }
    }
    stands
}

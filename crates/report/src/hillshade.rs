//! Relief by light from several directions.
//!
//! R. K. Mark 1992, Multidirectional, oblique-weighted, shaded-relief image of the Island of Hawaii,
//! USGS Open-File Report 92-422: lights from 225, 270, 315 and 360 degrees at 30 degrees above the
//! horizon, each weighted by how obliquely it strikes the slope.

use crate::Grid;
use timberline_pointcloud::Window;

/// Azimuths of the lights, degrees clockwise from north.
const AZIMUTHS_DEG: [f64; 4] = [225.0, 270.0, 315.0, 360.0];
/// Height of the lights above the horizon, degrees.
const ALTITUDE_DEG: f64 = 30.0;

/// Light on the cells of a window of a surface, 0 to 1 (level ground: 0.5); NaN where the surface has
/// no value.
///
/// `exaggeration` multiplies heights. Slopes are those of Horn (1981, Proceedings of the IEEE 69),
/// missing neighbours taken level with the cell.
#[must_use]
pub fn hillshade(surface: &Grid, exaggeration: f64, window: Window) -> Grid {
    let (lights, height) = (AZIMUTHS_DEG.map(direction), direction(ALTITUDE_DEG));
    let mut values = Vec::with_capacity(window.len());
    for row in window.row0..window.end_row() {
        for column in window.column0..window.end_column() {
            let slope = slopes(surface, column, row).map(|slope| slope.map(|s| s * exaggeration));
            values.push(slope.map_or(f32::NAN, |slope| shade(slope, &lights, height) as f32));
        }
    }
    Grid { cell_m: surface.cell_m, window, values }
}

/// Sine and cosine of an angle in degrees.
fn direction(degrees: f64) -> [f64; 2] {
    libm::sincos(degrees.to_radians()).into()
}

/// By how much heights are best multiplied: so that slopes that only a tenth of the cells exceed are
/// drawn as 40 %, at least once and at most five times.
#[must_use]
pub fn exaggeration(surface: &Grid) -> f64 {
    const DRAWN_SLOPE: f64 = 0.4;
    let window = surface.window;
    let cells = (window.row0..window.end_row())
        .flat_map(|row| (window.column0..window.end_column()).map(move |column| (column, row)));
    let slopes = cells.filter_map(|(column, row)| slopes(surface, column, row));
    let steepness = slopes.map(|[east, north]| (east * east + north * north).sqrt() as f32);
    match crate::grid::range(steepness, 0.1) {
        Some([_, steep]) if steep > 0.0 => (DRAWN_SLOPE / steep).clamp(1.0, 5.0),
        _ => 1.0,
    }
}

/// Rise to the east and to the north, metres a metre.
fn slopes(surface: &Grid, column: i64, row: i64) -> Option<[f64; 2]> {
    let own = surface.get(column, row)?;
    let at = |dc: i64, dr: i64| surface.get(column + dc, row + dr).unwrap_or(own);
    let sum = |a: f64, b: f64, c: f64| a + 2.0 * b + c;
    let east = sum(at(1, -1), at(1, 0), at(1, 1)) - sum(at(-1, -1), at(-1, 0), at(-1, 1));
    let north = sum(at(-1, 1), at(0, 1), at(1, 1)) - sum(at(-1, -1), at(0, -1), at(1, -1));
    Some([east / (8.0 * surface.cell_m), north / (8.0 * surface.cell_m)])
}

/// Light on a slope, from lights by sine and cosine of their azimuths and of their common height.
fn shade([east, north]: [f64; 2], lights: &[[f64; 2]], [sine, cosine]: [f64; 2]) -> f64 {
    let steepness2 = east * east + north * north;
    let cos_slope = 1.0 / (1.0 + steepness2).sqrt();
    let (mut light, mut weights) = (0.0, 0.0);
    for [to_east, to_north] in lights {
        // Cosine of the angle between the light and the surface's normal.
        let towards = -(east * to_east + north * to_north);
        let incidence = (cos_slope * (sine + cosine * towards)).clamp(0.0, 1.0);
        // Oblique weighting: sin² of the angle between light and slope direction (Mark 1992).
        let across = east * to_north - north * to_east;
        let weight = if steepness2 > 1e-12 { across * across / steepness2 } else { 0.5 };
        light += weight * incidence;
        weights += weight;
    }
    light / weights
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(east: f64, north: f64) -> Grid {
        let window = Window { column0: -2, row0: 7, columns: 5, rows: 4 };
        let mut grid = Grid::empty(window, 0.5);
        for row in window.row0..window.end_row() {
            for column in window.column0..window.end_column() {
                let z = (column as f64 * east + row as f64 * north) * 0.5;
                grid.values[window.index(column, row)] = z as f32;
            }
        }
        grid
    }

    #[test]
    fn slopes_of_a_plane() {
        let [east, north] = slopes(&plane(0.3, -0.2), 0, 9).unwrap();
        assert!((east - 0.3).abs() < 1e-6 && (north + 0.2).abs() < 1e-6);
    }

    #[test]
    fn gentle_terrain_is_exaggerated() {
        let found = [0.0, 0.01, 0.2, 0.9].map(|slope| exaggeration(&plane(slope, 0.0)));
        assert_eq!([found[0], found[1], found[3]], [1.0, 5.0, 1.0]);
        assert!((found[2] - 2.0).abs() < 1e-5);
    }

    #[test]
    fn slopes_towards_the_north_west_are_light() {
        let middle = |east, north| {
            let plane = plane(east, north);
            hillshade(&plane, 1.0, plane.window).values[7]
        };
        assert!((middle(0.0, 0.0) - 0.5).abs() < 1e-6);
        assert!(middle(0.5, -0.5) > 0.55 && middle(-0.5, 0.5) < 0.3);
        let window = Window { column0: 0, row0: 0, columns: 1, rows: 1 };
        assert!(hillshade(&Grid::empty(window, 1.0), 1.0, window).values[0].is_nan());
    }
}

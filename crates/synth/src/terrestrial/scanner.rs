//! The virtual terrestrial scanner.

use super::beam::{Beam, Echo};
use super::ground_mesh::GroundMesh;
use super::points::LabelledPoints;
use super::scan_params::{ScanParams, Station};
use super::targets::Targets;
use super::tree_model::TreeModel;
use super::vector::{Vec3, along};
use crate::Error;
use crate::noise::gradient_noise;
use crate::random::{Domain, Stream};
use rayon::prelude::*;
use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::{Bounds3, Frame, Point, PointCloud, Rect};

/// How far the ground of a single tree reaches beyond its crown, m.
const GROUND_MARGIN_M: f64 = 2.0;
/// Edge of the cells of that ground, m.
const GROUND_CELL_M: f64 = 0.05;
/// Height of its bumps, m, and distance between them, m.
const BUMP_M: [f64; 2] = [0.02, 0.3];
/// Intensity of a white target across the beam.
const FULL_INTENSITY: f64 = 40_000.0;
/// ASPRS class of points nobody has classified.
const UNCLASSIFIED: u8 = 1;

/// Scans a single tree from the positions of `params.layout`. Points are in the order of scan
/// positions, azimuths, elevations and returns; their frame is near the tree.
///
/// # Errors
/// [`Error::Parameter`] for a parameter out of range.
pub fn scan_tree(
    tree: &TreeModel,
    params: &ScanParams,
    seed: u64,
) -> Result<LabelledPoints, Error> {
    params.check()?;
    let frame = Frame::near(tree.base_m);
    let ground = params.ground.then(|| level_ground(tree, frame, seed));
    let targets = Targets::new(frame, std::slice::from_ref(tree), &[], ground);
    Ok(scan(&targets, &params.stations(tree.base_m), params, seed))
}

/// Level ground around a tree, with small bumps.
fn level_ground(tree: &TreeModel, frame: Frame, seed: u64) -> GroundMesh {
    let mut bounds = Bounds3::EMPTY;
    let ends = tree.cylinders.iter().map(|piece| piece.end_m);
    ends.chain([tree.base_m]).for_each(|at| bounds.include(frame.local_from_world(at)));
    let rect: Rect = bounds.rect().grown(GROUND_MARGIN_M);
    let base = frame.local_from_world(tree.base_m);
    let salt = Stream::new(seed, Domain::Noise, 0).bits();
    GroundMesh::new(&rect, GROUND_CELL_M, |x, y| {
        base[2] + BUMP_M[0] * gradient_noise(x / BUMP_M[1], y / BUMP_M[1], salt).0
    })
}

/// One column of pulses: a position and an azimuth.
struct ScanColumn<'a> {
    station: &'a Station,
    azimuth_deg: f64,
    /// First and last index of the elevations.
    rows: [i64; 2],
    /// Number of its random stream.
    stream: u64,
}

/// Scans targets from some positions.
pub(crate) fn scan(
    targets: &Targets,
    stations: &[Station],
    params: &ScanParams,
    seed: u64,
) -> LabelledPoints {
    let bounds = targets.bounds();
    let columns: Vec<ScanColumn> = stations
        .iter()
        .enumerate()
        .flat_map(|(index, station)| columns(index, station, params, targets.frame, &bounds))
        .collect();
    let found: Vec<Vec<Measured>> =
        columns.par_iter().map(|column| sweep(targets, column, params, seed)).collect();
    let mut points = LabelledPoints {
        cloud: PointCloud::new(targets.frame),
        stations: stations.to_vec(),
        ..LabelledPoints::default()
    };
    for measured in found.iter().flatten() {
        points.cloud.push_local(measured.at, &measured.point);
        points.tree_id.push(measured.echo.owner.tree);
        points.label.push(measured.echo.owner.label);
        points.cylinder.push(measured.echo.owner.cylinder);
        points.mixed.push(measured.echo.mixed);
    }
    points
}

/// The columns of a position that may meet something.
fn columns<'a>(
    index: usize,
    station: &'a Station,
    params: &'a ScanParams,
    frame: Frame,
    bounds: &Bounds3,
) -> impl Iterator<Item = ScanColumn<'a>> + use<'a> {
    let at = frame.local_from_world(station.position_m);
    let window = Window::around(at, bounds);
    let step = params.step_deg;
    let [first, last] = station.azimuth_deg;
    let count = ((last - first) / step + 1e-9).floor() as u64 + 1;
    let lowest = station.elevation_deg[0].max(window.elevation_deg[0]);
    let highest = station.elevation_deg[1].min(window.elevation_deg[1]);
    let rows = [(lowest / step).ceil() as i64, (highest / step).floor() as i64];
    (0..count).filter_map(move |column| {
        let azimuth_deg = first + step * column as f64;
        let stream = ((index as u64) << 32) | column;
        let seen = count == 1 || window.has_azimuth(azimuth_deg);
        seen.then_some(ScanColumn { station, azimuth_deg, rows, stream })
    })
}

/// Directions in which a box is seen from a position.
#[derive(Debug, Clone, Copy)]
struct Window {
    centre_deg: f64,
    half_deg: f64,
    elevation_deg: [f64; 2],
}

impl Window {
    const EVERYTHING: Self =
        Self { centre_deg: 0.0, half_deg: 180.0, elevation_deg: [-180.0, 90.0] };

    /// Everything, unless the position is beside the box and not above or below all of it.
    fn around(at: Vec3, bounds: &Bounds3) -> Self {
        let rect = bounds.rect();
        let near = [0, 1].map(|i| (rect.min[i] - at[i]).max(at[i] - rect.max[i]).max(0.0));
        let nearest = libm::hypot(near[0], near[1]);
        if bounds.is_empty() || nearest < 0.1 || at[2] > bounds.max[2] {
            return Self::EVERYTHING;
        }
        let middle = [0, 1].map(|i| 0.5 * (rect.min[i] + rect.max[i]) - at[i]);
        let centre_deg = libm::atan2(middle[1], middle[0]).to_degrees();
        let mut half_deg = 0.0_f64;
        for (x, y) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let corner =
                [[rect.min[0], rect.max[0]][x] - at[0], [rect.min[1], rect.max[1]][y] - at[1]];
            let azimuth = libm::atan2(corner[1], corner[0]).to_degrees();
            half_deg = half_deg.max(turn_between(azimuth, centre_deg).abs());
        }
        let steepest = |dz: f64| libm::atan2(dz, nearest).to_degrees();
        let low = if bounds.min[2] < at[2] { steepest(bounds.min[2] - at[2]) } else { 0.0 };
        let high = if bounds.max[2] > at[2] { steepest(bounds.max[2] - at[2]) } else { 0.0 };
        // A little more than the box, for the width of the beam.
        let elevation_deg = [low - 0.5, high + 0.5];
        Self { centre_deg, half_deg: half_deg + 0.5, elevation_deg }
    }

    fn has_azimuth(&self, azimuth_deg: f64) -> bool {
        turn_between(azimuth_deg, self.centre_deg).abs() <= self.half_deg
    }
}

/// The turn from one azimuth to another, from -180 to 180 degrees.
fn turn_between(to_deg: f64, from_deg: f64) -> f64 {
    let turn = (to_deg - from_deg) % 360.0;
    if turn > 180.0 {
        turn - 360.0
    } else if turn < -180.0 {
        turn + 360.0
    } else {
        turn
    }
}

/// A point before it joins the others.
struct Measured {
    at: Vec3,
    point: Point,
    echo: Echo,
}

/// The points of a column, elevation by elevation.
fn sweep(targets: &Targets, column: &ScanColumn, params: &ScanParams, seed: u64) -> Vec<Measured> {
    let mut stream = Stream::new(seed, Domain::Beam, column.stream);
    let origin = targets.frame.local_from_world(column.station.position_m);
    let (sin_a, cos_a) = libm::sincos(column.azimuth_deg.to_radians());
    let beam = Beam::new(targets, params, origin);
    let (mut points, mut echoes) = (Vec::new(), Vec::new());
    for row in column.rows[0]..=column.rows[1] {
        let (sin, cos) = libm::sincos((row as f64 * params.step_deg).to_radians());
        let direction = [cos * cos_a, cos * sin_a, sin];
        beam.shoot(direction, &mut stream, &mut echoes);
        for (number, echo) in echoes.iter().enumerate() {
            let range = echo.range + params.range_noise_m * stream.bell();
            let world = targets.frame.world_from_local(along(origin, direction, range));
            let at = targets.frame.local_from_world(world.map(quantise));
            let intensity = (FULL_INTENSITY * echo.brightness).round().clamp(1.0, 65_535.0);
            let point = Point {
                intensity: intensity as u16,
                return_number: number as u8 + 1,
                number_of_returns: echoes.len() as u8,
                classification: UNCLASSIFIED,
                source_id: column.station.source_id,
                ..Point::default()
            };
            points.push(Measured { at, point, echo: *echo });
        }
    }
    points
}

#[cfg(test)]
#[path = "scanner/tests.rs"]
mod tests;

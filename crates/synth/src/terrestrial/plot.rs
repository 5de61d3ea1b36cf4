//! A plot: trees and understorey on a slope, and the positions from which it is scanned.

use super::ground_mesh::GroundMesh;
use super::growth::grow;
use super::points::LabelledPoints;
use super::scan_params::{ScanParams, Station};
use super::scanner::scan;
use super::size::TreeSize;
use super::species::TreeSpecies;
use super::targets::Targets;
use super::tree_model::TreeModel;
use super::understorey::{self, Understorey};
use crate::Error;
use crate::error::check;
use crate::noise::gradient_noise;
use crate::random::{Domain, Stream, mix};
use crate::terrain::{Relief, Terrain, TerrainParams};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use timberline_pointcloud::{Frame, Rect};

/// Distance of trees from the plot's edge, m.
const EDGE_M: f64 = 1.5;
/// Smallest distance of an instrument from a tree, m.
const CLEARANCE_M: f64 = 1.4;
/// How far the ground goes on around the plot, m.
const MARGIN_M: f64 = 4.0;
/// Edge of the cells of the ground that beams meet, m.
const GROUND_CELL_M: f64 = 0.05;
/// Draws of a place before neighbours may be nearer.
const DRAWS: u32 = 200;

/// Everything that determines a plot but its seed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PlotParams {
    /// World position of the lower left corner, whole metres.
    pub origin_m: [i64; 2],
    /// Edge of the square, m.
    pub edge_m: f64,
    /// The ground.
    pub terrain: TerrainParams,
    /// Height of the bumps that the true terrain does not show, m, and distance between them, m.
    pub bumps_m: [f64; 2],
    /// The trees, in the order of their numbers.
    pub trees: Vec<(TreeSpecies, TreeSize)>,
    /// Distance between trees, where there is room, m.
    pub spacing_m: f64,
    /// What grows below them.
    pub understorey: Understorey,
    /// Scan positions: the first in the middle, the others around it.
    pub positions: u32,
    /// Height of the instrument above the ground, m.
    pub instrument_m: f64,
    /// The instrument; its layout is not used.
    pub scan: ScanParams,
}

impl Default for PlotParams {
    /// Twelve trees of four species on a slope of 9 degrees, 22 m wide, seen from five positions.
    fn default() -> Self {
        let relief = [(25.0, 0.8), (7.0, 0.25)]
            .map(|(wavelength_m, amplitude_m)| Relief { wavelength_m, amplitude_m });
        let terrain = TerrainParams {
            base_m: 640.0,
            slope_deg: 9.0,
            uphill_deg: 120.0,
            relief: relief.into(),
            ridges: Vec::new(),
            gullies: Vec::new(),
        };
        Self {
            origin_m: [432_110, 5_371_240],
            edge_m: 22.0,
            terrain,
            bumps_m: [0.02, 0.35],
            trees: mixed_trees(),
            spacing_m: 3.4,
            understorey: Understorey::default(),
            positions: 5,
            instrument_m: 1.6,
            scan: ScanParams::tls(),
        }
    }
}

/// Conifers with needles, broadleaved trees with and without leaves; a leaning one, a suppressed one
/// and one with a low fork among them.
fn mixed_trees() -> Vec<(TreeSpecies, TreeSize)> {
    use TreeSpecies::{EuropeanBeech, NorwaySpruce, PedunculateOak, ScotsPine};
    let of = |species, dbh_cm: f64| (species, TreeSize::of_dbh(species, 0.01 * dbh_cm));
    let mut trees = vec![
        of(PedunculateOak, 44.6),
        of(NorwaySpruce, 37.2),
        of(EuropeanBeech, 34.1),
        of(NorwaySpruce, 30.4),
        of(ScotsPine, 28.8),
        of(EuropeanBeech, 26.3),
        of(ScotsPine, 24.9),
        of(NorwaySpruce, 22.7),
        of(PedunculateOak, 20.8),
        of(EuropeanBeech, 16.9),
        of(NorwaySpruce, 13.2),
        of(EuropeanBeech, 8.4),
    ];
    trees[0].1 = trees[0].1.leafless();
    trees[2].1 = trees[2].1.leafless();
    trees[5].1 = trees[5].1.forked_at(3.2).leafless();
    trees[6].1 = trees[6].1.leaning(7.0, 200.0);
    trees[9].1 = trees[9].1.leaning(4.0, 330.0);
    trees[10].1 = trees[10].1.suppressed();
    trees
}

impl PlotParams {
    fn check(&self) -> Result<(), Error> {
        self.scan.check()?;
        check("edge_m", self.edge_m, 4.0 * EDGE_M..=200.0, "6 to 200 m")?;
        check("bumps_m", self.bumps_m[0], 0.0..=0.5, "0 to 0.5 m")?;
        check("bumps_m", self.bumps_m[1], 0.05..=10.0, "0.05 to 10 m between bumps")?;
        check("spacing_m", self.spacing_m, 0.0..=50.0, "0 to 50 m")?;
        check("herbs_per_m2", self.understorey.herbs_per_m2, 0.0..=100.0, "0 to 100")?;
        check("positions", f64::from(self.positions), 1.0..=100.0, "1 to 100")?;
        check("instrument_m", self.instrument_m, 0.5..=30.0, "0.5 to 30 m")
    }
}

/// A plot with its truth, ready to be scanned.
#[derive(Debug, Clone)]
pub struct PlotScene {
    /// What determines it.
    pub params: PlotParams,
    /// The seed.
    pub seed: u64,
    /// Frame with its origin at the lower left corner.
    pub frame: Frame,
    /// The true ground, without its smallest bumps.
    pub terrain: Terrain,
    /// The trees, numbered from 1.
    pub trees: Vec<TreeModel>,
    /// Shrubs, saplings and herbs.
    pub understorey: Vec<TreeModel>,
    /// Scan positions.
    pub stations: Vec<Station>,
}

/// Plants a plot: places drawn at random, each tree grown from a seed of its own.
///
/// # Errors
/// [`Error::Parameter`] for a parameter out of range.
pub fn plot(seed: u64, params: &PlotParams) -> Result<PlotScene, Error> {
    params.check()?;
    let frame = Frame::new([params.origin_m[0], params.origin_m[1], 0]);
    let terrain = Terrain::new(&params.terrain, frame, seed)?;
    let mut stream = Stream::new(seed, Domain::TerrestrialPlot, 0);
    let mut taken: Vec<[f64; 2]> = Vec::new();
    for _ in &params.trees {
        let place = free_place(params, &taken, &mut stream);
        taken.push(place);
    }
    let grown: Result<Vec<TreeModel>, Error> = (1_u32..)
        .zip(&params.trees)
        .zip(&taken)
        .map(|((id, (species, size)), &[x, y])| {
            let base = frame.world_from_local([x, y, terrain.local(x, y).z]);
            Ok(grow(*species, size, mix(seed ^ (u64::from(id) << 24)))?.at(base).with_id(id))
        })
        .collect();
    let stations = stations(params, &taken, &terrain, frame, &mut stream);
    let low = low_vegetation(params, &taken, &stations, &terrain, frame, &mut stream)?;
    let params = params.clone();
    Ok(PlotScene { params, seed, frame, terrain, trees: grown?, understorey: low, stations })
}

fn squared(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1])
}

fn is_free(at: [f64; 2], taken: &[[f64; 2]], distance: f64) -> bool {
    taken.iter().all(|&other| squared(at, other) >= distance * distance)
}

/// A place away from the others; they may be the nearer the longer it takes.
fn free_place(params: &PlotParams, taken: &[[f64; 2]], stream: &mut Stream) -> [f64; 2] {
    let mut distance = params.spacing_m;
    loop {
        for _ in 0..DRAWS {
            let at = [0; 2].map(|_| stream.within(EDGE_M, params.edge_m - EDGE_M));
            if is_free(at, taken, distance) {
                return at;
            }
        }
        // Ends at the latest when no distance is asked for.
        distance = if distance < 0.1 { 0.0 } else { 0.8 * distance };
    }
}

/// One position near the middle, the others near a circle around it, all away from trees.
fn stations(
    params: &PlotParams,
    trees: &[[f64; 2]],
    terrain: &Terrain,
    frame: Frame,
    stream: &mut Stream,
) -> Vec<Station> {
    let middle = 0.5 * params.edge_m;
    let mut stations = Vec::new();
    for index in 0..params.positions {
        let around = f64::from(index.saturating_sub(1)) / f64::from((params.positions - 1).max(1));
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * (around + 0.125));
        let away = if index == 0 { 0.0 } else { 0.82 * middle };
        let mut at = [middle + away * cos, middle + away * sin];
        let (wanted, mut reach) = (at, 0.0);
        while !is_free(at, trees, CLEARANCE_M) {
            let [x, y] = stream.direction();
            at = [wanted[0] + reach * x, wanted[1] + reach * y];
            reach += 0.05;
        }
        let z = terrain.local(at[0], at[1]).z + params.instrument_m;
        let position_m = frame.world_from_local([at[0], at[1], z]);
        stations.push(params.scan.tripod(position_m, index as u16 + 1));
    }
    stations
}

fn low_vegetation(
    params: &PlotParams,
    trees: &[[f64; 2]],
    stations: &[Station],
    terrain: &Terrain,
    frame: Frame,
    stream: &mut Stream,
) -> Result<Vec<TreeModel>, Error> {
    let instruments: Vec<[f64; 2]> = stations
        .iter()
        .map(|station| frame.local_from_world(station.position_m))
        .map(|[x, y, _]| [x, y])
        .collect();
    let place = |stream: &mut Stream, clear: f64| loop {
        let at = [0; 2].map(|_| stream.within(0.0, params.edge_m));
        if is_free(at, &instruments, clear) && is_free(at, trees, 0.4 * clear) {
            return frame.world_from_local([at[0], at[1], terrain.local(at[0], at[1]).z]);
        }
    };
    let mut models = Vec::new();
    for _ in 0..params.understorey.shrubs {
        let at = place(stream, 2.0);
        models.push(understorey::shrub(at, stream));
    }
    for _ in 0..params.understorey.saplings {
        let at = place(stream, 2.0);
        models.push(understorey::sapling(at, stream)?);
    }
    let herbs = params.understorey.herbs_per_m2 * params.edge_m * params.edge_m;
    for _ in 0..herbs as u32 {
        let at = place(stream, 0.5);
        models.push(understorey::herb(at, stream));
    }
    Ok(models)
}

impl PlotScene {
    /// The area of the plot, world.
    #[must_use]
    pub fn rect(&self) -> Rect {
        let min = self.params.origin_m.map(|value| value as f64);
        Rect { min, max: min.map(|value| value + self.params.edge_m) }
    }

    /// All points from all positions, in the order of positions, azimuths, elevations and returns.
    #[must_use]
    pub fn scan(&self) -> LabelledPoints {
        scan(&self.targets(), &self.stations, &self.params.scan, self.seed)
    }

    /// Everything that beams meet.
    pub(crate) fn targets(&self) -> Targets {
        let edge = self.params.edge_m;
        let rect = Rect { min: [0.0; 2], max: [edge; 2] }.grown(MARGIN_M);
        let salt = Stream::new(self.seed, Domain::TerrestrialPlot, 1).bits();
        let [height, apart] = self.params.bumps_m;
        let ground = GroundMesh::new(&rect, GROUND_CELL_M, |x, y| {
            let bump = gradient_noise(x / apart, y / apart, salt).0;
            self.terrain.local(x, y).z + height * bump
        });
        Targets::new(self.frame, &self.trees, &self.understorey, Some(ground))
    }

    /// Distance of every labelled point of wood from its tree's true surface, m; NaN for others.
    #[must_use]
    pub fn wood_distances_m(&self, points: &LabelledPoints) -> Vec<f64> {
        let surfaces: Vec<_> = self.trees.iter().map(TreeModel::surface).collect();
        (0..points.len())
            .into_par_iter()
            .map(|i| {
                let on_wood = points.cylinder[i] != u32::MAX;
                let surface = (points.tree_id[i] as usize).checked_sub(1);
                let surface = surface.filter(|_| on_wood).and_then(|index| surfaces.get(index));
                surface.map_or(f64::NAN, |s| s.signed_distance_m(points.cloud.world(i)).abs())
            })
            .collect()
    }
}

#[cfg(test)]
#[path = "plot/tests.rs"]
mod tests;

//! A terrain, a forest and a scanner: a scene that gives its points piece by piece.

use crate::Error;
use crate::error::check;
use crate::foliage::Optics;
use crate::forest::Forest;
use crate::pulse::{
    GroundGuess, HIGHEST_OUTLIER_M, LOWEST_OUTLIER_M, Return, Scratch, Target, Undergrowth, World,
    passes,
};
use crate::random::{Domain, Stream, mix};
use crate::scanner::{Flight, Line, ScannerParams, Sweep};
use crate::stand::Stand;
use crate::terrain::{Terrain, TerrainParams};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use timberline_pointcloud::frame::world_from_ticks;
use timberline_pointcloud::{Frame, Point, PointCloud, Rect, TileGrid, TileId};

/// Everything that determines a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneParams {
    /// Seed of all that is random.
    pub seed: u64,
    /// World position from which terrain and stands are counted, whole metres.
    pub origin_m: [i64; 2],
    /// The area that is flown, world x and y.
    pub area: Rect,
    /// The ground.
    pub terrain: TerrainParams,
    /// The stands; may reach beyond the area, so that crowns hang in from outside.
    pub stands: Vec<Stand>,
    /// How far crowns are dented between their boughs and leaders, relative to what is common in
    /// their species; 0 leaves their envelopes smooth. The highest foliage of a dented crown may be
    /// lower than its top, and elsewhere.
    pub crown_relief: f64,
    /// Low vegetation.
    pub undergrowth: Undergrowth,
    /// The instrument and the flight.
    pub scanner: ScannerParams,
}

/// A scene with its truth, ready to be scanned.
#[derive(Debug, Clone)]
pub struct Scene {
    params: SceneParams,
    frame: Frame,
    terrain: Terrain,
    forest: Forest,
    optics: Vec<Optics>,
    flight: Flight,
    guess: GroundGuess,
    tallest_m: f64,
}

/// Classes of ASPRS.
const UNCLASSIFIED: u8 = 1;
const GROUND: u8 = 2;
const LOW_NOISE: u8 = 7;
const HIGH_NOISE: u8 = 18;
/// Flags of [`Point::flags`].
const WITHHELD: u8 = 1 << 2;
const OVERLAP: u8 = 1 << 3;
const EDGE: u8 = 1 << 4;
/// How far the ground is known around the area to aim beams, m.
const GUESS_MARGIN_M: f64 = 80.0;
/// How far a return may lie beside the axis of its beam (noise, errors of lines), m.
const ASIDE_M: f64 = 2.0;

impl Scene {
    /// Grows the forest and plans the flight.
    ///
    /// # Errors
    /// [`Error`] for an empty area and for any parameter out of range.
    pub fn new(params: SceneParams) -> Result<Self, Error> {
        let (frame, terrain) = ground(&params)?;
        let forest = Forest::grow(&params.stands, &terrain, frame, params.seed)?;
        Self::assemble(params, frame, terrain, forest)
    }

    /// The scene of given trees instead of grown ones, in the frame at `params.origin_m`; the stands
    /// only give the trees their names. [`Forest::of`] makes a forest of trees.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_forest(params: SceneParams, forest: Forest) -> Result<Self, Error> {
        let (frame, terrain) = ground(&params)?;
        Self::assemble(params, frame, terrain, forest)
    }

    fn assemble(
        params: SceneParams,
        frame: Frame,
        terrain: Terrain,
        forest: Forest,
    ) -> Result<Self, Error> {
        let area = local_rect(frame, &params.area);
        let wide = area.grown(GUESS_MARGIN_M);
        let guess = GroundGuess::new(&terrain, wide.min, wide.max);
        let flight = Flight::plan(&params.scanner, &area, guess.mean_m, params.seed);
        let optics = |tree| {
            Optics::new(tree, mix(params.seed ^ (u64::from(tree.id) << 20)), params.crown_relief)
        };
        let optics = forest.trees.iter().map(optics).collect();
        let above = |tree: &crate::Tree| tree.top_above_ground_m().max(tree.height_m);
        let tallest_m = forest.trees.iter().map(above).fold(0.0, f64::max);
        Ok(Self { params, frame, terrain, forest, optics, flight, guess, tallest_m })
    }

    /// What determines the scene.
    #[must_use]
    pub fn params(&self) -> &SceneParams {
        &self.params
    }

    /// The frame of the trees' positions: origin as in the parameters, elevations from sea level.
    #[must_use]
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// The true ground.
    #[must_use]
    pub fn terrain(&self) -> &Terrain {
        &self.terrain
    }

    /// The true trees.
    #[must_use]
    pub fn forest(&self) -> &Forest {
        &self.forest
    }

    /// The points within a world rectangle (its upper edges excluded) inside the area, in the order
    /// in which they were measured: by flight line, pulse and return.
    ///
    /// The points of two rectangles side by side are those of their union, whatever the thread count.
    #[must_use]
    pub fn points_in(&self, rect: &Rect) -> PointCloud {
        self.measure(rect, |_| ())
    }

    /// The points of [`Self::points_in`], each with the number of the tree it comes from (as in
    /// [`crate::Tree::id`]); 0 for the ground, the undergrowth and outliers. A return of several
    /// targets belongs to the one that most of its light comes from.
    #[must_use]
    pub fn labelled_points_in(&self, rect: &Rect) -> (PointCloud, Vec<u32>) {
        let mut trees = Vec::new();
        let cloud = self.measure(rect, |tree| trees.push(tree));
        (cloud, trees)
    }

    /// Scans a rectangle; `visit` gets the tree of every point in turn.
    fn measure(&self, rect: &Rect, mut visit: impl FnMut(u32)) -> PointCloud {
        let area = &self.params.area;
        let rect = Rect {
            min: [rect.min[0].max(area.min[0]), rect.min[1].max(area.min[1])],
            max: [rect.max[0].min(area.max[0]), rect.max[1].min(area.max[1])],
        };
        let mut cloud = PointCloud::new(Frame::near([rect.min[0], rect.min[1], 0.0]));
        if rect.min[0] >= rect.max[0] || rect.min[1] >= rect.max[1] {
            return cloud;
        }
        let view = self.view(&rect);
        for line in &self.flight.lines {
            let sweeps = self.flight.sweeps_over(line, &view.local, view.z[0]);
            let measured: Vec<Vec<Measured>> =
                sweeps.into_par_iter().map(|sweep| self.scan_sweep(line, sweep, &view)).collect();
            for one in measured.iter().flatten() {
                cloud.push_world(one.world, &one.point);
                visit(one.tree);
            }
        }
        cloud
    }

    /// Goes through the tiles of a grid that touch the area, column by column, holding the points
    /// of one tile at a time. Tiles without points are passed over.
    pub fn blocks(&self, grid: TileGrid) -> impl Iterator<Item = (TileId, PointCloud)> + '_ {
        let Rect { min, max } = self.params.area;
        let (first, last) = (grid.tile_at(min[0], min[1]), grid.tile_at(max[0], max[1]));
        let columns = first.ix..=last.ix;
        let tiles =
            columns.flat_map(move |ix| (first.iy..=last.iy).map(move |iy| TileId { ix, iy }));
        tiles
            .map(move |tile| (tile, self.points_in(&grid.rect(tile))))
            .filter(|(_, c)| !c.is_empty())
    }

    fn view(&self, rect: &Rect) -> View {
        let local = local_rect(self.frame, rect);
        let [low, high] = self.guess.range_m(local.min, local.max);
        let highest = high + self.tallest_m.max(HIGHEST_OUTLIER_M);
        View { world: *rect, local: local.grown(ASIDE_M), z: [low - LOWEST_OUTLIER_M, highest] }
    }

    fn world(&self) -> World<'_> {
        World {
            terrain: &self.terrain,
            guess: &self.guess,
            canopy: &self.forest.canopy,
            optics: &self.optics,
            undergrowth: self.params.undergrowth,
            threshold: self.params.undergrowth.threshold(),
            salt: mix(!self.params.seed),
        }
    }

    fn scan_sweep(&self, line: &Line, index: u32, view: &View) -> Vec<Measured> {
        let (flight, world) = (&self.flight, self.world());
        let sweep = flight.sweep(line, index);
        let pulses = flight.pulses_over(line, &sweep, &view.local, view.z);
        let mut points = Vec::with_capacity(2 * pulses.len());
        let mut scratch = Scratch::default();
        for pulse in pulses {
            let ray = flight.ray(line, &sweep, pulse);
            let ends = view.z.map(|z| ray.at(ray.range_at(z)));
            if !passes(&view.local, &ends) {
                continue;
            }
            let name = (u64::from(line.source_id) << 44) | flight.pulse_number(&sweep, pulse);
            let mut stream = Stream::new(self.params.seed, Domain::Pulse, name);
            world.shoot(&ray, &view.local, &flight.params, &mut stream, &mut scratch);
            self.record(
                line,
                &sweep,
                pulse,
                &scratch.returns,
                &mut stream,
                &view.world,
                &mut points,
            );
        }
        points
    }

    /// Turns the returns of a pulse into points, and keeps those within the rectangle.
    #[allow(
        clippy::too_many_arguments,
        reason = "the state of one pulse; a struct would only rename it"
    )]
    fn record(
        &self,
        line: &Line,
        sweep: &Sweep,
        pulse: u32,
        returns: &[Return],
        stream: &mut Stream,
        rect: &Rect,
        points: &mut Vec<Measured>,
    ) {
        let params = &self.flight.params;
        let aside = [0, 1].map(|i| params.horizontal_noise_m * stream.bell() + line.error_m[i]);
        for (number, echo) in returns.iter().enumerate() {
            let up = params.range_noise_m * stream.bell() + line.error_m[2];
            let found = stream.unit();
            let [x, y, z] = echo.position;
            let measured = [x + aside[0], y + aside[1], z + up];
            let world = self.frame.world_from_local(measured).map(|value| self.rounded(value));
            if !rect.contains(world[0], world[1]) {
                continue;
            }
            let (classification, mut flags) = self.class(echo, found);
            flags |= if self.flight.is_edge(pulse) { EDGE } else { 0 };
            let overlap = params.flag_overlap && self.flight.is_overlap(line, [x, y]);
            flags |= if overlap { OVERLAP } else { 0 };
            let point = Point {
                intensity: (params.intensity_scale * echo.light).round().clamp(1.0, 65_535.0)
                    as u16,
                return_number: number as u8 + 1,
                number_of_returns: returns.len() as u8,
                classification,
                flags,
                scan_angle_deg: self.flight.angle_deg(sweep, pulse),
                gps_time: self.flight.time_s(line, sweep, pulse),
                source_id: line.source_id,
            };
            points.push(Measured { world, point, tree: echo.tree });
        }
    }

    fn rounded(&self, world_m: f64) -> f64 {
        let unit = i64::from(self.flight.params.position_ticks);
        let units = (world_m * (10_000.0 / unit as f64)).round() as i64;
        world_from_ticks(units * unit)
    }

    /// Class and flags that the supplier gives a return.
    fn class(&self, echo: &Return, found: f64) -> (u8, u8) {
        let params = &self.flight.params;
        let noise = |class: u8| {
            if found >= params.outliers_found {
                (UNCLASSIFIED, 0)
            } else if found < params.outliers_found * params.outliers_withheld {
                (class, WITHHELD)
            } else {
                (class, 0)
            }
        };
        match echo.target {
            Target::Above => noise(HIGH_NOISE),
            Target::Below => noise(LOW_NOISE),
            _ if !params.true_classes => (UNCLASSIFIED, 0),
            Target::Ground => (GROUND, 0),
            Target::Vegetation => {
                let [x, y, z] = echo.position;
                let height = z - self.terrain.local(x, y).z;
                // Low, medium and high vegetation.
                (
                    if height < 0.5 {
                        3
                    } else if height < 2.0 {
                        4
                    } else {
                        5
                    },
                    0,
                )
            }
        }
    }
}

/// Frame and terrain of a scene whose parameters are sound.
fn ground(params: &SceneParams) -> Result<(Frame, Terrain), Error> {
    let Rect { min, max } = params.area;
    if !(min[0] < max[0] && min[1] < max[1]) {
        return Err(Error::EmptyArea { min, max });
    }
    params.scanner.check()?;
    check("crown_relief", params.crown_relief, 0.0..=3.0, "0 to 3")?;
    check("undergrowth cover", params.undergrowth.cover, 0.0..=0.7, "0 to 0.7")?;
    check("undergrowth patch_m", params.undergrowth.patch_m, 0.1..=1e4, "0.1 to 10000 m")?;
    let frame = Frame::new([params.origin_m[0], params.origin_m[1], 0]);
    Ok((frame, Terrain::new(&params.terrain, frame, params.seed)?))
}

/// One recorded return.
struct Measured {
    world: [f64; 3],
    point: Point,
    /// Number of its tree, 0 for none.
    tree: u32,
}

/// A rectangle to be scanned.
#[derive(Debug, Clone, Copy)]
struct View {
    world: Rect,
    /// The same in the scene's frame, with room for noise.
    local: Rect,
    /// Elevations between which all returns within it lie.
    z: [f64; 2],
}

fn local_rect(frame: Frame, rect: &Rect) -> Rect {
    let local = |corner: [f64; 2]| {
        let [x, y, _] = frame.local_from_world([corner[0], corner[1], 0.0]);
        [x, y]
    };
    Rect { min: local(rect.min), max: local(rect.max) }
}

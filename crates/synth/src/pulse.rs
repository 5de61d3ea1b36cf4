//! From one pulse to its returns.
//!
//! A beam is five rays of equal energy over its Gaussian footprint. Each ends somewhere: in foliage,
//! at a stem, in the undergrowth or on the ground. Ends close in range become one return, as far as
//! the light suffices.

use crate::canopy::Canopy;
use crate::foliage::{Optics, Passage, Ray};
use crate::noise::gradient_noise;
use crate::random::Stream;
use crate::scanner::ScannerParams;
use crate::terrain::{Surface, Terrain};
use serde::{Deserialize, Serialize};
use timberline_pointcloud::Rect;

/// Rays of a beam.
pub(crate) const RAYS: usize = 5;
/// Distance of the outer rays from the axis, in radii at 1/e² of the intensity: the median radius of
/// the energy outside the innermost fifth, from 1 - exp(-2 (r/w)^2) = 0.6.
pub(crate) const OUTER: f64 = 0.676_87;
/// Share of light thrown back by bare ground and by wood.
const GROUND_REFLECTANCE: f64 = 0.27;
const WOOD_REFLECTANCE: f64 = 0.22;
const SHRUB_REFLECTANCE: f64 = 0.40;
/// Length in range of a pulse of 5 ns, m: light from within it adds up.
const PULSE_LENGTH_M: f64 = 0.75;
/// Relative deviation of the light of a ray (speckle and texture).
const TEXTURE: f64 = 0.18;

/// Low vegetation between the trees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Undergrowth {
    /// Mean share of the ground that it hides.
    pub cover: f64,
    /// Its largest height, m.
    pub height_m: f64,
    /// Size of its patches, m.
    pub patch_m: f64,
}

impl Default for Undergrowth {
    fn default() -> Self {
        Self { cover: 0.15, height_m: 1.4, patch_m: 9.0 }
    }
}

impl Undergrowth {
    /// Bare ground.
    #[must_use]
    pub const fn none() -> Self {
        Self { cover: 0.0, height_m: 0.0, patch_m: 1.0 }
    }

    /// Value of the patch noise from which there is undergrowth, such that the mean cover is right.
    ///
    /// The distribution of gradient noise is close to logistic: over 400,000 draws this gives the
    /// cover within a tenth between 0.02 and 0.6.
    pub(crate) fn threshold(&self) -> f64 {
        let share = (self.cover / DENSEST).clamp(1e-9, 1.0 - 1e-9);
        -0.1 * (libm::log(share / (1.0 - share)) + 0.85)
    }

    /// Cover at a place: nothing between patches, dense within them.
    fn cover_at(&self, x: f64, y: f64, threshold: f64, salt: u64) -> f64 {
        if self.cover == 0.0 {
            return 0.0;
        }
        let (noise, _) = gradient_noise(x / self.patch_m, y / self.patch_m, salt);
        (4.0 * (noise - threshold)).clamp(0.0, DENSEST)
    }
}

/// Cover in the middle of a patch of undergrowth.
pub(crate) const DENSEST: f64 = 0.75;

/// What a return comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Target {
    Ground,
    Vegetation,
    /// A bird.
    Above,
    /// An echo with a detour.
    Below,
}

/// One return before noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Return {
    pub(crate) position: [f64; 3],
    /// Share of the light of the pulse, relative to a perfect target at the nominal range.
    pub(crate) light: f64,
    pub(crate) target: Target,
    /// Number of the tree that most of the light comes from; 0 for none.
    pub(crate) tree: u32,
}

#[derive(Debug, Clone, Copy)]
struct Hit {
    range: f64,
    light: f64,
    ground: bool,
    /// Number of the tree, 0 for none.
    tree: u32,
}

/// What beams meet.
#[derive(Debug)]
pub(crate) struct World<'a> {
    pub(crate) terrain: &'a Terrain,
    pub(crate) guess: &'a GroundGuess,
    pub(crate) canopy: &'a Canopy,
    pub(crate) optics: &'a [Optics],
    pub(crate) undergrowth: Undergrowth,
    /// See [`Undergrowth::threshold`].
    pub(crate) threshold: f64,
    pub(crate) salt: u64,
}

/// Buffers that one thread uses for pulse after pulse.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    passages: Vec<Passage>,
    seen: Vec<u32>,
    pub(crate) returns: Vec<Return>,
}

/// Elevations on a coarse lattice, from which the search for the ground starts.
#[derive(Debug, Clone)]
pub(crate) struct GroundGuess {
    corner: [f64; 2],
    size: [usize; 2],
    heights: Vec<f64>,
    pub(crate) mean_m: f64,
}

/// Edge of the cells of that lattice, m.
const GUESS_CELL_M: f64 = 8.0;

impl GroundGuess {
    pub(crate) fn new(terrain: &Terrain, low: [f64; 2], high: [f64; 2]) -> Self {
        let size = [0, 1].map(|i| ((high[i] - low[i]) / GUESS_CELL_M).ceil() as usize + 2);
        let at = |cell: usize| {
            let x = low[0] + (cell % size[0]) as f64 * GUESS_CELL_M;
            let y = low[1] + (cell / size[0]) as f64 * GUESS_CELL_M;
            terrain.local(x, y).z
        };
        let heights: Vec<f64> = (0..size[0] * size[1]).map(at).collect();
        let mean_m = heights.iter().sum::<f64>() / heights.len() as f64;
        Self { corner: low, size, heights, mean_m }
    }

    fn at(&self, x: f64, y: f64) -> f64 {
        let place = |value: f64, axis: usize| {
            let cells = ((value - self.corner[axis]) / GUESS_CELL_M).max(0.0);
            let index = (cells as usize).min(self.size[axis] - 2);
            (index, (cells - index as f64).min(1.0))
        };
        let ((i, u), (j, v)) = (place(x, 0), place(y, 1));
        let row = |j: usize| {
            let first = j * self.size[0] + i;
            self.heights[first] + u * (self.heights[first + 1] - self.heights[first])
        };
        row(j) + v * (row(j + 1) - row(j))
    }

    /// Lowest and highest ground over a rectangle, with room for what the lattice does not show.
    pub(crate) fn range_m(&self, low: [f64; 2], high: [f64; 2]) -> [f64; 2] {
        let index = |value: f64, axis: usize| {
            let cells = ((value - self.corner[axis]) / GUESS_CELL_M).max(0.0);
            (cells as usize).min(self.size[axis] - 2)
        };
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for j in index(low[1], 1)..=index(high[1], 1) + 1 {
            for i in index(low[0], 0)..=index(high[0], 0) + 1 {
                least = least.min(self.heights[j * self.size[0] + i]);
                most = most.max(self.heights[j * self.size[0] + i]);
            }
        }
        [least - GUESS_CELL_M, most + GUESS_CELL_M]
    }
}

impl World<'_> {
    /// Fills `scratch.returns` with the returns of a pulse, nearest first; with none when none can lie
    /// within a rectangle.
    pub(crate) fn shoot(
        &self,
        ray: &Ray,
        rect: &Rect,
        params: &ScannerParams,
        stream: &mut Stream,
        scratch: &mut Scratch,
    ) {
        scratch.returns.clear();
        let (ground_range, surface) = self.ground(ray);
        let foot = ray.at(ground_range);
        let rise = (self.canopy.ceiling_m(foot[0], foot[1]) - foot[2]).max(0.0);
        let up = ray.at(ground_range - rise / ray.descent());
        if !passes(rect, &[foot, up]) || self.outlier(foot, params, stream, &mut scratch.returns) {
            return;
        }
        self.collect(ray, foot, up, params.footprint_radius_m(), scratch);
        let cover = self.undergrowth.cover_at(foot[0], foot[1], self.threshold, self.salt);
        let offsets = footprint(ray, params.footprint_radius_m(), stream);
        let mut hits = offsets.map(|offset| {
            self.end(ray, offset, (ground_range, &surface, cover), &scratch.passages, stream)
        });
        hits.sort_unstable_by(|a, b| a.range.total_cmp(&b.range));
        group(ray, &hits, params, &mut scratch.returns);
    }

    /// Range at which the ray meets the ground, by Newton's method on the exact surface.
    pub(crate) fn ground(&self, ray: &Ray) -> (f64, Surface) {
        let mut range = ray.range_at(self.guess.mean_m);
        for _ in 0..3 {
            let [x, y, _] = ray.at(range);
            range = ray.range_at(self.guess.at(x, y));
        }
        let mut surface = Surface { z: 0.0, gradient: [0.0; 2] };
        // Starting within decimetres, two rounds leave less than a micrometre.
        for _ in 0..2 {
            let [x, y, z] = ray.at(range);
            surface = self.terrain.local(x, y);
            let [gx, gy] = surface.gradient;
            let closing = ray.direction[2] - gx * ray.direction[0] - gy * ray.direction[1];
            range -= (z - surface.z) / closing;
        }
        (range, surface)
    }

    /// Replaces the pulse by an outlier, seldom.
    fn outlier(
        &self,
        ground: [f64; 3],
        params: &ScannerParams,
        stream: &mut Stream,
        returns: &mut Vec<Return>,
    ) -> bool {
        let draw = stream.unit();
        let [x, y, z] = ground;
        let far = stream.exponential().min(4.0);
        let (height, target) = if draw < params.high_outliers {
            (HIGHEST_OUTLIER_M * (0.4 + 0.15 * far), Target::Above)
        } else if draw < params.high_outliers + params.low_outliers {
            (-0.8 - 3.5 * far, Target::Below)
        } else {
            return false;
        };
        returns.push(Return { position: [x, y, z + height], light: 0.05, target, tree: 0 });
        true
    }

    /// Finds the crowns near the beam between the ground and the canopy's ceiling, and sorts them by
    /// the range of their tops.
    fn collect(
        &self,
        ray: &Ray,
        foot: [f64; 3],
        up: [f64; 3],
        radius_m: f64,
        scratch: &mut Scratch,
    ) {
        scratch.passages.clear();
        scratch.seen.clear();
        if up[2] <= foot[2] {
            return;
        }
        let way = std::array::from_fn(|axis| up[axis] - foot[axis]);
        let (passages, seen) = (&mut scratch.passages, &mut scratch.seen);
        self.canopy.along(foot, way, |trees| {
            for &tree in trees {
                if !seen.contains(&tree) {
                    seen.push(tree);
                    passages.extend(self.optics[tree as usize].passage(tree, ray, radius_m));
                }
            }
        });
        passages
            .sort_unstable_by(|a, b| a.top_range.total_cmp(&b.top_range).then(a.tree.cmp(&b.tree)));
    }

    /// Where one ray of the beam ends.
    fn end(
        &self,
        ray: &Ray,
        offset: [f64; 2],
        ground: (f64, &Surface, f64),
        passages: &[Passage],
        stream: &mut Stream,
    ) -> Hit {
        let (centre_range, surface, cover) = ground;
        let [gx, gy] = surface.gradient;
        let closing = ray.direction[2] - gx * ray.direction[0] - gy * ray.direction[1];
        let mut range = centre_range + (gx * offset[0] + gy * offset[1]) / closing;
        // Cosine between the beam and the ground's normal.
        let incidence = -closing / (1.0 + gx * gx + gy * gy).sqrt();
        let (mut reflectance, mut is_ground) = (GROUND_REFLECTANCE * incidence, true);
        let mut tree = 0;
        if cover > 0.0 && stream.chance(cover) {
            let height = self.undergrowth.height_m * stream.unit() * stream.unit();
            range -= height / ray.descent();
            (reflectance, is_ground) = (SHRUB_REFLECTANCE, false);
        }
        for passage in passages {
            if passage.top_range >= range {
                break;
            }
            let optics = &self.optics[passage.tree as usize];
            if let Some(hit) = optics.hit(passage, offset, range, stream) {
                (range, reflectance, is_ground) = (hit, optics.reflectance(), false);
                tree = passage.tree + 1;
            }
            if let Some(hit) = optics.stem_hit(ray, offset, range) {
                (range, reflectance, is_ground) = (hit, WOOD_REFLECTANCE, false);
                tree = passage.tree + 1;
            }
        }
        let texture = (1.0 + TEXTURE * stream.bell()).max(0.1);
        Hit { range, light: reflectance * texture / RAYS as f64, ground: is_ground, tree }
    }
}

/// Whether the box around two positions touches a rectangle.
pub(crate) fn passes(rect: &Rect, ends: &[[f64; 3]; 2]) -> bool {
    let [a, b] = ends;
    let around =
        Rect { min: [a[0].min(b[0]), a[1].min(b[1])], max: [a[0].max(b[0]), a[1].max(b[1])] };
    around.touches(rect)
}

/// Highest place of a bird above the ground, m.
pub(crate) const HIGHEST_OUTLIER_M: f64 = 90.0;
/// Deepest place of a multiple echo below the ground, m.
pub(crate) const LOWEST_OUTLIER_M: f64 = 15.0;

/// Horizontal offsets of the rays: the axis and four around it, turned at random.
fn footprint(ray: &Ray, radius_m: f64, stream: &mut Stream) -> [[f64; 2]; RAYS] {
    if radius_m == 0.0 {
        return [[0.0; 2]; RAYS];
    }
    let [cos, sin] = stream.direction();
    let (long, short) = (OUTER * radius_m / ray.descent(), OUTER * radius_m);
    let (x, y) = (long * cos, short * sin);
    let (p, q) = (-long * sin, short * cos);
    [[0.0, 0.0], [x, y], [-x, -y], [p, q], [-p, -q]]
}

/// Makes returns of the hits, nearest first. The hits within a pulse's length of the first one make a
/// return at their mean range, if their light suffices; for the dead time after it the instrument is
/// blind.
fn group(ray: &Ray, hits: &[Hit; RAYS], params: &ScannerParams, returns: &mut Vec<Return>) {
    let mut first = 0;
    while first < RAYS && returns.len() < usize::from(params.max_returns) {
        let within = |reach: f64| {
            first
                + hits[first..].iter().take_while(|h| h.range - hits[first].range <= reach).count()
        };
        let members = &hits[first..within(PULSE_LENGTH_M)];
        let light: f64 = members.iter().map(|hit| hit.light).sum();
        if light < params.sensitivity {
            first += 1;
            continue;
        }
        let range = members.iter().map(|hit| hit.light * hit.range).sum::<f64>() / light;
        let spread = ray.range_at(ray.origin[2] - params.altitude_m) / range;
        let on_ground = members.iter().all(|hit| hit.ground);
        let target = if on_ground { Target::Ground } else { Target::Vegetation };
        let (position, light) = (ray.at(range), light * spread * spread);
        returns.push(Return { position, light, target, tree: brightest(members) });
        first = within(params.resolution_m.max(PULSE_LENGTH_M));
    }
}

/// The tree from which most of the light of some hits comes, 0 for none; of equals the nearest.
fn brightest(members: &[Hit]) -> u32 {
    let light = |tree: u32| -> f64 {
        members.iter().filter(|hit| hit.tree == tree).map(|hit| hit.light).sum()
    };
    let mut best = (0, 0.0);
    for hit in members {
        let found = light(hit.tree);
        if found > best.1 {
            best = (hit.tree, found);
        }
    }
    best.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_return_belongs_to_the_tree_of_most_of_its_light() {
        let hit = |tree, light| Hit { range: 1.0, light, ground: false, tree };
        assert_eq!(brightest(&[hit(7, 0.2), hit(3, 0.15), hit(3, 0.1)]), 3);
        assert_eq!(brightest(&[hit(7, 0.2), hit(3, 0.2)]), 7);
        assert_eq!(brightest(&[hit(0, 0.2), hit(3, 0.1)]), 0);
    }

    #[test]
    fn undergrowth_covers_what_it_should() {
        for cover in [0.05, 0.15, 0.4, 0.6] {
            let undergrowth = Undergrowth { cover, ..Undergrowth::default() };
            let threshold = undergrowth.threshold();
            let at = |i: i32, j: i32| {
                undergrowth.cover_at(f64::from(i) * 3.1, f64::from(j) * 3.7, threshold, 5)
            };
            let all: Vec<f64> = (0..40_000).map(|k| at(k % 200, k / 200)).collect();
            let mean = all.iter().sum::<f64>() / all.len() as f64;
            assert!((mean / cover - 1.0).abs() < 0.15, "{mean} for {cover}");
        }
    }
}

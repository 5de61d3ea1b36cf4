//! Points and cylinders seen from the side, with hidden parts hidden.

use crate::canvas::{Canvas, Paint};
use crate::colour::{PAPER, Rgb, mix};

/// Pixels drawn for one of the picture, in each direction: edges become smooth.
const FINER: usize = 2;
/// Least half width of a cylinder in drawn pixels: twigs stay visible.
const LEAST_PX: f64 = 0.9;
/// Width of a point in drawn pixels, and of points so few that they would look pale.
const POINT_PX: i64 = 2;
const FEW_POINT_PX: i64 = 3;
const FEW: usize = 50_000;
/// Light from above left in front, of length 1: across, upwards, towards the eye.
const LIGHT: [f64; 3] = [-0.48, 0.6, 0.64];
/// Light where none falls.
const AMBIENT: f64 = 0.38;
/// How much the farthest fades into the paper.
const HAZE: f64 = 0.45;

/// A cylinder with its colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rod {
    /// Centres of its ends, m.
    pub ends_m: [[f64; 3]; 2],
    /// Radius, m.
    pub radius_m: f64,
    /// Colour.
    pub colour: Rgb,
    /// Whether it ends flat where it starts: the foot of a stem.
    pub flat_start: bool,
}

impl Rod {
    pub(super) fn is_finite(&self) -> bool {
        self.ends_m.iter().flatten().chain([&self.radius_m]).all(|value| value.is_finite())
    }
}

/// A point with its colour.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball {
    /// Position, m.
    pub position_m: [f64; 3],
    /// Colour.
    pub colour: Rgb,
}

/// A level view without perspective.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// From the east; else from the south.
    pub from_east: bool,
    /// What is at the left edge: x seen from the south, y seen from the east, m.
    pub left_m: f64,
    /// Elevation at the upper edge, m.
    pub top_m: f64,
    /// Pixels in a metre.
    pub px_per_m: f64,
}

impl View {
    /// Right, down, and towards the eye, in drawn pixels.
    fn place(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let scale = self.px_per_m * FINER as f64;
        let (right, towards) = if self.from_east { (y, x) } else { (x, -y) };
        [(right - self.left_m) * scale, (self.top_m - z) * scale, towards * scale]
    }
}

/// A picture with depths.
pub(super) struct Raster {
    width: usize,
    height: usize,
    colours: Vec<Rgb>,
    depths: Vec<f64>,
}

impl Raster {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let [width, height] = [width.max(1), height.max(1)].map(|size| size * FINER);
        let count = width * height;
        Self { width, height, colours: vec![PAPER; count], depths: vec![f64::NEG_INFINITY; count] }
    }

    fn put(&mut self, [x, y]: [i64; 2], depth: f64, colour: Rgb) {
        let inside = (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y);
        let place = if inside { y as usize * self.width + x as usize } else { return };
        if depth > self.depths[place] {
            self.depths[place] = depth;
            self.colours[place] = colour;
        }
    }

    /// Draws points; the farther, the paler.
    pub(super) fn points(&mut self, view: &View, balls: impl Iterator<Item = Ball> + Clone) {
        let placed = balls.map(|ball| (view.place(ball.position_m), ball.colour));
        let placed = placed.filter(|(place, _)| place.iter().all(|value| value.is_finite()));
        let (near, far) = placed
            .clone()
            .fold((f64::NEG_INFINITY, f64::INFINITY), |(n, f), (p, _)| (n.max(p[2]), f.min(p[2])));
        let size = if placed.clone().take(FEW).count() < FEW { FEW_POINT_PX } else { POINT_PX };
        for ([x, y, depth], colour) in placed {
            let share = (near - depth) / (near - far).max(1e-9);
            let colour = mix(colour, PAPER, HAZE * share);
            let first = [x, y].map(|value| value.floor() as i64 - size / 2);
            for row in first[1]..first[1] + size {
                for column in first[0]..first[0] + size {
                    self.put([column, row], depth, colour);
                }
            }
        }
    }

    /// Draws cylinders with round ends, which close the gaps between them, in the light.
    pub(super) fn rods(&mut self, view: &View, rods: &[Rod]) {
        for rod in rods.iter().filter(|rod| rod.is_finite()) {
            let [from, to] = rod.ends_m.map(|end| view.place(end));
            let radius = (rod.radius_m * view.px_per_m * FINER as f64).max(LEAST_PX);
            let way = [to[0] - from[0], to[1] - from[1]];
            let squared = way[0] * way[0] + way[1] * way[1];
            let range = |axis: usize, end: usize| {
                let low = (from[axis].min(to[axis]) - radius).floor().max(0.0);
                let high = (from[axis].max(to[axis]) + radius).ceil().min(end as f64 - 1.0);
                low as i64..=high as i64
            };
            for row in range(1, self.height) {
                for column in range(0, self.width) {
                    let at = [column as f64 + 0.5, row as f64 + 0.5];
                    let along = (at[0] - from[0]) * way[0] + (at[1] - from[1]) * way[1];
                    let share = if squared > 0.0 { (along / squared).clamp(0.0, 1.0) } else { 0.0 };
                    let off = [at[0] - from[0] - share * way[0], at[1] - from[1] - share * way[1]];
                    let rest = radius * radius - off[0] * off[0] - off[1] * off[1];
                    if rest < 0.0 || (rod.flat_start && along < 0.0) {
                        continue;
                    }
                    let up = rest.sqrt();
                    let lit = (LIGHT[0] * off[0] - LIGHT[1] * off[1] + LIGHT[2] * up) / radius;
                    let light = AMBIENT + (1.0 - AMBIENT) * lit.max(0.0);
                    let depth = from[2] + share * (to[2] - from[2]) + up;
                    self.put([column, row], depth, crate::colour::lit(rod.colour, light));
                }
            }
        }
    }

    /// Copies the picture, every pixel the mean of those drawn for it.
    pub(super) fn copy_to(&self, canvas: &mut Canvas, [left, top]: [f64; 2]) {
        for row in 0..self.height / FINER {
            for column in 0..self.width / FINER {
                let mut sums = [0u32; 3];
                for drawn in 0..FINER * FINER {
                    let (x, y) = (column * FINER + drawn % FINER, row * FINER + drawn / FINER);
                    let colour = self.colours[y * self.width + x];
                    sums.iter_mut().zip(colour).for_each(|(sum, value)| *sum += u32::from(value));
                }
                let colour = sums.map(|sum| (sum / (FINER * FINER) as u32) as u8);
                let place = [left as i64 + column as i64, top as i64 + row as i64];
                canvas.blend(place[0], place[1], Paint::solid(colour), 1.0);
            }
        }
    }
}

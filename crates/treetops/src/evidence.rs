//! What the points around a candidate say for and against its being the top of a tree.
//!
//! All of it is relative: offsets from the candidate, and numbers of points against the number of
//! pulses that came down there, so that one model serves sparse and dense scans.

use crate::candidates::Scene;

/// How far points are looked at, m.
pub const REACH_M: f64 = 5.0;
/// Radius within which pulses are counted, m.
const DENSITY_REACH_M: f64 = 3.0;
/// Rings in which points are counted: inner and outer radius, m.
const RINGS_M: [[f64; 2]; 4] = [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0], [3.0, 5.0]];
/// Bands of elevation in which they are counted, relative to the candidate, m.
const BANDS_M: [[f64; 2]; 6] =
    [[-8.0, -3.0], [-3.0, -1.0], [-1.0, 0.0], [0.0, 1.0], [1.0, 3.0], [3.0, 10.0]];
/// Radii within which the highest point is sought, m.
const AROUND_M: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 4.5];
/// Higher points than this say no more, m.
const HIGHEST_M: f64 = 5.0;
/// Rings in which the upper surface is sought: inner and outer radius, m.
const SURFACE_M: [[f64; 2]; 5] = [[0.5, 1.0], [1.0, 1.5], [1.5, 2.25], [2.25, 3.25], [3.25, 5.0]];
/// Points so far above the candidate belong to what is above it, not to its surface, m.
const ABOVE_SURFACE_M: f64 = 2.0;
/// A surface lower than this says no more, m.
const LOWEST_M: f64 = -8.0;
/// The surface is where so large a share of the points of its ring lies below.
const SURFACE_SHARE: f64 = 0.9;

/// Number of values.
pub const LEN: usize = RINGS_M.len() * BANDS_M.len() + AROUND_M.len() + SURFACE_M.len() + 3;

/// The values: numbers of points by ring and band, the highest points, the upper surface by ring,
/// and the logarithms of the candidate's height, of the density of pulses and of what is above.
pub type Evidence = [f64; LEN];

/// A point near a candidate: distance in the plane and elevation above it, m.
type Near = (f64, f64);

/// Gathers the evidence about a candidate.
pub(crate) fn gather(scene: &Scene<'_>, index: usize) -> Evidence {
    let cloud = scene.ranked.input.cloud;
    let [x, y, z] = cloud.local(index);
    let (mut near, mut pulses): (Vec<Near>, u32) = (Vec::new(), 0);
    scene.grid.candidates(x, y, REACH_M, |i| {
        let (dx, dy) = (cloud.x[i] - x, cloud.y[i] - y);
        let distance = (dx * dx + dy * dy).sqrt();
        if distance < REACH_M && i != index && scene.is_there[i] {
            let is_first = cloud.return_number[i] <= 1;
            pulses += u32::from(is_first && distance < DENSITY_REACH_M);
            near.push((distance, cloud.z[i] - z));
        }
    });
    let density =
        f64::from(pulses + 1) / (std::f64::consts::PI * DENSITY_REACH_M * DENSITY_REACH_M);
    let near: Vec<Near> = near.into_iter().filter(|(_, dz)| *dz >= BANDS_M[0][0]).collect();
    let mut values = [0.0; LEN];
    let counts = counts(&near, density).into_iter();
    let rest = highest(&near).into_iter().chain(surface(&near)).chain([
        libm::log(scene.ranked.height(index).max(1.0)),
        libm::log(density),
        libm::log1p(near.iter().filter(|n| n.0 < DENSITY_REACH_M).map(|n| n.1).fold(0.0, f64::max)),
    ]);
    values.iter_mut().zip(counts.chain(rest)).for_each(|(value, found)| *value = found);
    values
}

fn within([low, high]: [f64; 2], value: f64) -> bool {
    low <= value && value < high
}

/// Points by ring and band, against the pulses that came down in the ring.
fn counts(near: &[Near], density: f64) -> Vec<f64> {
    let mut counts = [0u32; RINGS_M.len() * BANDS_M.len()];
    for (distance, dz) in near {
        let ring = RINGS_M.iter().position(|ring| within(*ring, *distance));
        let band = BANDS_M.iter().position(|band| within(*band, *dz));
        if let (Some(ring), Some(band)) = (ring, band) {
            counts[ring * BANDS_M.len() + band] += 1;
        }
    }
    let share = |(place, count): (usize, &u32)| {
        let [inner, outer] = RINGS_M[place / BANDS_M.len()];
        let pulses = density * std::f64::consts::PI * (outer * outer - inner * inner);
        libm::log1p(4.0 * f64::from(*count) / pulses)
    };
    counts.iter().enumerate().map(share).collect()
}

/// How far the highest point within each radius rises above the candidate.
fn highest(near: &[Near]) -> [f64; AROUND_M.len()] {
    AROUND_M.map(|reach| {
        let inside = near.iter().filter(|(distance, _)| *distance < reach);
        inside.map(|(_, dz)| dz.min(HIGHEST_M)).fold(0.0, f64::max)
    })
}

/// Elevation of the upper surface in each ring.
fn surface(near: &[Near]) -> [f64; SURFACE_M.len()] {
    SURFACE_M.map(|ring| {
        let inside = near.iter().filter(|(r, dz)| within(ring, *r) && *dz < ABOVE_SURFACE_M);
        let mut inside: Vec<f64> = inside.map(|(_, dz)| *dz).collect();
        inside.sort_unstable_by(f64::total_cmp);
        let rank = (SURFACE_SHARE * inside.len() as f64) as usize;
        inside.get(rank).copied().unwrap_or(LOWEST_M)
    })
}

//! Made-up vertices around a block that continue the slope of the ground beyond it, so that points
//! at the border of a campaign have a triangle to be judged by.

use crate::Error;
use crate::tin::solve3;
use timberline_pointcloud::Nearest2;

/// Distance of the rim from the block, metres.
const AWAY_M: f64 = 10.0;
/// Distance between the rim's vertices, metres.
const STEP_M: f64 = 8.0;
/// Vertices that a plane is fitted to.
const SUPPORT: usize = 8;
/// Pull of the slopes towards the horizontal, per vertex, m²: matters only for vertices closer
/// together than a few metres.
const RIDGE_M2: f64 = 4.0;

/// Positions of the rim for a block from (0, 0) to (edge, edge) with the given vertices.
pub(crate) fn rim(vertices: &[[f64; 3]], edge_m: f64) -> Result<Vec<[f64; 3]>, Error> {
    let flat: Vec<[f64; 2]> = vertices.iter().map(|p| [p[0], p[1]]).collect();
    let tree = Nearest2::new(&flat)?;
    let (low, high) = (-AWAY_M, edge_m + AWAY_M);
    let steps = ((high - low) / STEP_M).ceil() as usize;
    let step = (high - low) / steps as f64;
    let mut places = Vec::with_capacity(4 * steps);
    for i in 0..steps {
        let along = low + i as f64 * step;
        places.extend([
            [along, low],
            [high, along],
            [low + high - along, high],
            [low, low + high - along],
        ]);
    }
    let elevation = |place: &[f64; 2]| {
        let near = tree.nearest(place, SUPPORT);
        let support: Vec<[f64; 3]> = near.iter().map(|n| vertices[n.index]).collect();
        [place[0], place[1], continued(&support, *place)]
    };
    Ok(places.iter().map(elevation).collect())
}

/// The plane through some vertices, at a place outside them.
fn continued(support: &[[f64; 3]], place: [f64; 2]) -> f64 {
    let count = support.len() as f64;
    let mean = [0, 1, 2].map(|axis| support.iter().map(|p| p[axis]).sum::<f64>() / count);
    let ridge = RIDGE_M2 * count;
    let mut m = [[count, 0.0, 0.0], [0.0, ridge, 0.0], [0.0, 0.0, ridge]];
    let mut b = [0.0; 3];
    for p in support {
        let (dx, dy, dz) = (p[0] - mean[0], p[1] - mean[1], p[2] - mean[2]);
        m[1][1] += dx * dx;
        m[1][2] += dx * dy;
        m[2][1] += dx * dy;
        m[2][2] += dy * dy;
        b[1] += dx * dz;
        b[2] += dy * dz;
    }
    let [_, a, c] = solve3(m, b);
    mean[2] + a * (place[0] - mean[0]) + c * (place[1] - mean[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slope_goes_on() {
        let vertices: Vec<[f64; 3]> = (0..64)
            .map(|i| [f64::from(i % 8) * 12.0, f64::from(i / 8) * 12.0, f64::from(i % 8) * 12.0])
            .collect();
        for [x, y, z] in rim(&vertices, 90.0).unwrap() {
            assert!((z - x).abs() < 6.0, "{z} at {x} {y}");
        }
    }
}

//! How much of a crown the sky sees, and its social position.

use crate::canopy::Canopy;
use crate::tree::{Layer, Tree};
use rayon::prelude::*;

/// Rings and places per ring at which a crown's surface is tested.
const RINGS: usize = 4;
const PER_RING: usize = 9;
/// Share open to the sky from which a crown belongs to the upper canopy, and from which it is more
/// than a suppressed one (the definitions of Kraft's classes as shares).
const UPPER: f64 = 0.5;
const PARTLY: f64 = 0.12;
/// How much higher than its neighbours a dominant tree is.
const ABOVE: f64 = 1.08;
/// Neighbours are the trees over this distance from the top, m.
const NEIGHBOURHOOD_M: f64 = 8.0;

/// Fills in exposure, visibility and layer of all trees.
pub(crate) fn assess(trees: &mut [Tree], canopy: &Canopy) {
    let places = places();
    let found: Vec<(f64, bool)> = trees
        .par_iter()
        .enumerate()
        .map(|(index, tree)| {
            let open =
                |&[u, v]: &[f64; 2]| !covered(trees, canopy, index, tree.crown.on_surface_m(u, v));
            let count = places.iter().filter(|place| open(place)).count();
            (count as f64 / places.len() as f64, !covered(trees, canopy, index, tree.crown.top_m))
        })
        .collect();
    for (tree, (exposed, visible)) in trees.iter_mut().zip(found) {
        (tree.exposed, tree.visible) = (exposed, visible);
    }
    let layers: Vec<Layer> = trees.par_iter().map(|tree| layer(trees, canopy, tree)).collect();
    trees.iter_mut().zip(layers).for_each(|(tree, layer)| tree.layer = layer);
}

/// Places of equal area over the unit disc.
fn places() -> Vec<[f64; 2]> {
    let mut places = Vec::with_capacity(RINGS * PER_RING);
    for ring in 0..RINGS {
        let rho = ((ring as f64 + 0.5) / RINGS as f64).sqrt();
        for place in 0..PER_RING {
            let turn = (place as f64 + 0.5 * (ring % 2) as f64) / PER_RING as f64;
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * turn);
            places.push([rho * cos, rho * sin]);
        }
    }
    places
}

/// Whether another crown's surface lies above a position.
fn covered(trees: &[Tree], canopy: &Canopy, own: usize, [x, y, z]: [f64; 3]) -> bool {
    canopy.over(x, y).iter().any(|&other| {
        let crown = &trees[other as usize].crown;
        other as usize != own
            && crown.top_m[2] > z
            && crown.may_cover(x, y)
            && crown.surface_z_m(x, y).is_some_and(|surface| surface > z)
    })
}

fn layer(trees: &[Tree], canopy: &Canopy, tree: &Tree) -> Layer {
    if tree.exposed < PARTLY {
        return Layer::Suppressed;
    } else if tree.exposed < UPPER {
        return Layer::Intermediate;
    }
    let [x, y, _] = tree.crown.top_m;
    let (mut sum, mut count) = (0.0, 0);
    let mut seen: Vec<u32> = Vec::new();
    for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        for &other in canopy.over(x + dx * NEIGHBOURHOOD_M, y + dy * NEIGHBOURHOOD_M) {
            let neighbour = &trees[other as usize];
            let counts = neighbour.id != tree.id && neighbour.exposed >= UPPER;
            if counts && !seen.contains(&other) {
                seen.push(other);
                sum += neighbour.height_m;
                count += 1;
            }
        }
    }
    let above = count == 0 || tree.height_m >= ABOVE * sum / f64::from(count);
    if above { Layer::Dominant } else { Layer::Codominant }
}

//! What grows below the trees: shrubs, saplings, herbs. None of it counts as a tree.

use super::axis::{Assembly, AxisNode};
use super::cylinder::leaf;
use super::growth::grow;
use super::leaves;
use super::size::TreeSize;
use super::species::TreeSpecies;
use super::taper::{TIP_RADIUS_M, branch_radius_m};
use super::tree_model::TreeModel;
use super::vector::{Vec3, along, unit};
use crate::Error;
use crate::random::Stream;
use serde::{Deserialize, Serialize};

/// How much grows below the trees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Understorey {
    /// Shrubs of several stems, up to 2 m.
    pub shrubs: u32,
    /// Young trees of 2 to 3.5 m with diameters of 2 cm.
    pub saplings: u32,
    /// Tufts of herbs per square metre.
    pub herbs_per_m2: f64,
}

impl Default for Understorey {
    fn default() -> Self {
        Self { shrubs: 7, saplings: 5, herbs_per_m2: 1.5 }
    }
}

impl Understorey {
    /// Bare ground.
    #[must_use]
    pub const fn none() -> Self {
        Self { shrubs: 0, saplings: 0, herbs_per_m2: 0.0 }
    }
}

/// Stems of a shrub: fewest and most.
const STEMS: [f64; 2] = [4.0, 9.0];
/// Their lengths, m.
const STEM_M: [f64; 2] = [0.7, 2.0];

/// A shrub with its root at a position.
pub(crate) fn shrub(base_m: Vec3, stream: &mut Stream) -> TreeModel {
    let habit = TreeSpecies::EuropeanBeech.habit();
    let mut tree = Assembly::default();
    let count = stream.within(STEMS[0], STEMS[1]) as u32;
    for _ in 0..count {
        let [x, y] = stream.direction();
        let tilt = libm::tan(stream.within(8.0, 45.0).to_radians());
        let direction = unit([x * tilt, y * tilt, 1.0]);
        let foot = [0.08 * x, 0.08 * y, -0.05];
        let length = stream.within(STEM_M[0], STEM_M[1]);
        let stem = tree.add(shoot(foot, direction, length, 0.004 * length, stream), 0, None);
        let twigs = (length / 0.14) as u32;
        for index in 1..twigs {
            let place = stem.place(length * f64::from(index) / f64::from(twigs));
            let aside = [stream.normal(), stream.normal(), 0.4 + stream.normal()];
            let direction = unit(along(unit(aside), place.direction, 0.5));
            let reach = 0.3 * (length - 0.1 * f64::from(index)).max(0.2) * stream.factor(0.3);
            let radius = TIP_RADIUS_M.min(0.9 * place.radius);
            let at = place.insertion(direction, radius);
            let nodes = shoot(at, direction, reach, radius, stream);
            let twig = tree.add(nodes, 1, Some(place.piece));
            leaves::along_axis(&twig, habit, stream, &mut tree.leaves);
        }
        leaves::along_axis(&stem, habit, stream, &mut tree.leaves);
    }
    model(tree).at(base_m)
}

/// A slightly crooked shoot.
fn shoot(
    from: Vec3,
    direction: Vec3,
    length: f64,
    radius: f64,
    stream: &mut Stream,
) -> Vec<AxisNode> {
    let steps = (length / 0.2).ceil().max(2.0);
    let (mut at, mut direction) = (from, direction);
    let mut nodes = vec![AxisNode { at, radius }];
    for index in 1..=steps as u32 {
        at = along(at, direction, length / steps);
        let radius = branch_radius_m(radius, f64::from(index) / steps);
        nodes.push(AxisNode { at, radius });
        let swing = [stream.normal(), stream.normal(), stream.normal()];
        direction = unit(along(direction, swing, 0.08));
    }
    nodes
}

/// A young tree with its foot at a position.
pub(crate) fn sapling(base_m: Vec3, stream: &mut Stream) -> Result<TreeModel, Error> {
    let species = TreeSpecies::ALL[(stream.unit() * 4.0) as usize % 4];
    let height_m = stream.within(2.0, 3.5);
    let size = TreeSize {
        height_m,
        crown_base_m: 0.25 * height_m,
        crown_radius_m: 0.2 * height_m,
        ..TreeSize::of_dbh(species, 0.02)
    };
    Ok(grow(species, &size, stream.bits())?.at(base_m).with_id(0))
}

/// A tuft of blades with its foot at a position.
pub(crate) fn herb(base_m: Vec3, stream: &mut Stream) -> TreeModel {
    let mut tree = Assembly::default();
    let blades = 4 + (4.0 * stream.unit()) as u32;
    for _ in 0..blades {
        let [x, y] = stream.direction();
        let tilt = stream.within(0.1, 1.2);
        let tip = unit([tilt * x, tilt * y, 1.0]);
        let half_m = [stream.within(0.04, 0.16), stream.within(0.004, 0.014)];
        let centre = along([0.02 * x, 0.02 * y, 0.0], tip, half_m[0]);
        tree.leaves.push(leaf(centre, [x, y, -tilt], tip, half_m));
    }
    model(tree).at(base_m)
}

fn model(tree: Assembly) -> TreeModel {
    TreeModel {
        id: 0,
        species: None,
        base_m: [0.0; 3],
        crown_base_height_m: 0.0,
        cylinders: tree.pieces,
        leaves: tree.leaves,
    }
}

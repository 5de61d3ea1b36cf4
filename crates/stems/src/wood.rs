//! How likely points are on wood: by the shape of their neighbourhood.
//!
//! Stems are surfaces and branches are lines; leaves scatter in all directions (the features of
//! Demantke et al. 2011; their use for wood: Ma et al. 2016). A point's likelihood is smoothed over
//! its neighbours, because wood is rarely a single point.

use crate::Error;
use rayon::prelude::*;
use timberline_pointcloud::Nearest3;

/// Neighbours whose shape is looked at, at most.
const NEIGHBOURS: usize = 24;
/// Fewest neighbours with a shape.
const FEWEST: usize = 4;
/// Likelihood of a point without a shape.
const UNKNOWN: f32 = 0.5;

/// Likelihood of wood for every position, 0 to 1. The neighbourhood reaches `spacings` median
/// distances to the nearest neighbour.
///
/// # Errors
/// [`Error::Neighbours`].
pub fn likelihood(positions: &[[f64; 3]], spacings: f64) -> Result<Vec<f32>, Error> {
    if positions.len() <= FEWEST {
        return Ok(vec![UNKNOWN; positions.len()]);
    }
    let index = Nearest3::new(positions)?;
    let near: Vec<Vec<u32>> = {
        let nearest: Vec<f64> = positions
            .par_iter()
            .map(|at| index.nearest(at, 2).last().map_or(0.0, |n| n.squared_m2.sqrt()))
            .collect();
        let reach_m = spacings * median(nearest);
        let within = |at: &[f64; 3]| {
            let found = index.nearest(at, NEIGHBOURS).into_iter();
            let close = found.filter(|n| n.squared_m2 <= reach_m * reach_m);
            close.map(|n| n.index as u32).collect()
        };
        positions.par_iter().map(within).collect()
    };
    let own: Vec<f32> = near.par_iter().map(|near| shape(positions, near)).collect();
    let smooth = |near: &Vec<u32>| match near.len() {
        0 => UNKNOWN,
        len => near.iter().map(|&i| own[i as usize]).sum::<f32>() / len as f32,
    };
    Ok(near.par_iter().map(smooth).collect())
}

fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// One minus the scatter of a neighbourhood: the smallest of its three extents over the largest,
/// stretched so that a surface with as much noise as a fifth of its extent is still wood.
fn shape(positions: &[[f64; 3]], near: &[u32]) -> f32 {
    if near.len() < FEWEST {
        return UNKNOWN;
    }
    let vector = |&i: &u32| nalgebra::Vector3::from(positions[i as usize]);
    let mean = near.iter().map(vector).sum::<nalgebra::Vector3<f64>>() / near.len() as f64;
    let spread = |matrix: nalgebra::Matrix3<f64>, i: &u32| {
        let off = vector(i) - mean;
        matrix + off * off.transpose()
    };
    let matrix = near.iter().fold(nalgebra::Matrix3::zeros(), spread);
    let mut extents: Vec<f64> =
        matrix.symmetric_eigenvalues().iter().map(|value| value.max(0.0).sqrt()).collect();
    extents.sort_by(f64::total_cmp);
    if extents[2] <= 0.0 {
        return UNKNOWN;
    }
    let scatter = extents[0] / extents[2];
    (1.0 - ((scatter - 0.1) / 0.4).clamp(0.0, 1.0)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Low discrepancy values in the unit cube (Kronecker).
    fn spread(k: u32) -> [f64; 3] {
        [0.819_172_513_4, 0.671_043_606_7, 0.549_700_477_9]
            .map(|step| (f64::from(k) * step).fract())
    }

    fn mean(values: &[f32]) -> f32 {
        values.iter().sum::<f32>() / values.len() as f32
    }

    #[test]
    fn stems_and_twigs_are_wood_and_clouds_of_leaves_are_not() {
        let stem: Vec<[f64; 3]> = (0..2000)
            .map(|k| {
                let [turn, height, _] = spread(k);
                let (sin, cos) = libm::sincos(turn * std::f64::consts::TAU);
                [0.15 * cos, 0.15 * sin, height]
            })
            .collect();
        let twig: Vec<[f64; 3]> = (0..200).map(|k| [0.005 * f64::from(k), 0.0, 0.0]).collect();
        let leaves: Vec<[f64; 3]> = (0..2000).map(spread).collect();
        let of = |points: &[[f64; 3]]| mean(&likelihood(points, 6.0).unwrap());
        assert!(of(&stem) > 0.7, "{}", of(&stem));
        assert!(of(&twig) > 0.9, "{}", of(&twig));
        assert!(of(&leaves) < 0.3, "{}", of(&leaves));
    }
}

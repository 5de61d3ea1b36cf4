//! How thick a cloud is across the surface it suggests, and how far points are from that surface.

use crate::Error;
use crate::eigen::symmetric;
use nalgebra::{Matrix6, Vector3, Vector6};
use rayon::prelude::*;
use timberline_pointcloud::Nearest3;

/// A surface of six coefficients needs some more points.
const FEWEST: usize = 10;
/// Number of coefficients.
const COEFFICIENTS: f64 = 6.0;

/// Where a surface is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Query {
    /// The point in question, m.
    pub at_m: [f64; 3],
    /// Points of the cloud within this distance tell the surface, m.
    pub radius_m: f64,
    /// Which point of the original cloud it is; the surface must not be told by itself.
    pub origin: u32,
}

/// What a cloud says about a query.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Robust standard deviation of the cloud across the surface, m: 1.4826 times the median distance
    /// of the points from it, for the degrees of freedom left.
    pub thickness_m: f64,
    /// Distance of the query from the surface, which was fitted without it, m.
    pub distance_m: f64,
}

/// For every query the surface through the points of a cloud around it: a quadric over the plane of
/// least squares. `origins` says for each point which one of the original cloud it was. Nothing
/// where fewer than 10 points are near, or where they lie on a line.
///
/// # Errors
/// [`Error::Neighbours`].
pub fn measure(
    cloud: &[[f64; 3]],
    origins: &[u32],
    queries: &[Query],
) -> Result<Vec<Option<Found>>, Error> {
    let tree = Nearest3::new(cloud)?;
    let found = queries.par_iter().map(|query| {
        let near = tree.within(&query.at_m, query.radius_m);
        let others = near.iter().filter(|n| origins[n.index] != query.origin);
        let offset = |i: usize| Vector3::from(cloud[i]) - Vector3::from(query.at_m);
        one(&others.map(|n| offset(n.index)).collect::<Vec<_>>())
    });
    Ok(found.collect())
}

/// The surface through offsets from a query.
fn one(offsets: &[Vector3<f64>]) -> Option<Found> {
    if offsets.len() < FEWEST {
        return None;
    }
    let count = offsets.len() as f64;
    let mean = offsets.iter().sum::<Vector3<f64>>() / count;
    let mut scatter = [0.0; 6];
    for d in offsets.iter().map(|o| o - mean) {
        let products = [d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z];
        scatter.iter_mut().zip(products).for_each(|(sum, product)| *sum += product / count);
    }
    let (values, axes) = symmetric(scatter);
    let scale = values[0].max(0.0).sqrt();
    let [u, v, w] = axes.map(Vector3::from);
    // In units of the scale, so that the system's terms are of one size.
    let local = |o: &Vector3<f64>| {
        let from_mean = (o - mean) / scale;
        [from_mean.dot(&u), from_mean.dot(&v), from_mean.dot(&w)]
    };
    let row = |[x, y, _]: [f64; 3]| Vector6::new(1.0, x, y, x * x, x * y, y * y);
    let (mut normal, mut right) = (Matrix6::zeros(), Vector6::zeros());
    for place in offsets.iter().map(local) {
        normal += row(place) * row(place).transpose();
        right += row(place) * place[2];
    }
    // Thin branches do not tell the quadric across them: a little ridge leaves it flat there.
    let ridge = 1e-6 * count;
    (1..6).for_each(|k| normal[(k, k)] += ridge);
    let coefficients = normal.cholesky()?.solve(&right);
    let off = |place: [f64; 3]| (place[2] - row(place).dot(&coefficients)).abs() * scale;
    let mut offs: Vec<f64> = offsets.iter().map(local).map(off).collect();
    offs.sort_unstable_by(f64::total_cmp);
    let freedom = (count / (count - COEFFICIENTS)).sqrt();
    let thickness_m = 1.4826 * offs[offs.len() / 2] * freedom;
    let distance_m = off(local(&Vector3::zeros()));
    (thickness_m.is_finite() && distance_m.is_finite()).then_some(Found { thickness_m, distance_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a cylinder of 5 cm radius with a zigzag of 1 mm across the surface.
    fn rough_cylinder(amplitude_m: f64) -> Vec<[f64; 3]> {
        let at = |i: i32| {
            let (t, z) = (f64::from(i) * 2.399_963, f64::from(i) * 2e-4);
            let r = 0.05 + amplitude_m * if i % 2 == 0 { 1.0 } else { -1.0 };
            [r * libm::cos(t), r * libm::sin(t), z]
        };
        (0..5000).map(at).collect()
    }

    #[test]
    fn roughness_and_distance_are_found_on_a_cylinder() {
        let cloud = rough_cylinder(0.001);
        let origins: Vec<u32> = (0..5000).collect();
        let queries =
            [0.05, 0.054].map(|x| Query { at_m: [x, 0.0, 0.5], radius_m: 0.02, origin: 9999 });
        let found = measure(&cloud, &origins, &queries).unwrap();
        let [on, off] = [found[0].unwrap(), found[1].unwrap()];
        assert!((on.thickness_m / 1.4826 - 0.001).abs() < 3e-4, "{on:?}");
        assert!(on.distance_m < 3e-4 && (off.distance_m - 0.004).abs() < 5e-4, "{on:?} {off:?}");
    }

    #[test]
    fn few_points_and_points_on_a_line_tell_nothing_wrong() {
        let line: Vec<[f64; 3]> = (0..50).map(|i| [f64::from(i) * 0.01, 0.0, 0.0]).collect();
        let origins: Vec<u32> = (0..50).collect();
        let query = |radius_m| Query { at_m: [0.25, 0.0, 0.0], radius_m, origin: 25 };
        let found = measure(&line, &origins, &[query(0.03), query(0.2)]).unwrap();
        assert_eq!(found[0], None);
        assert!(found[1].is_none_or(|f| f.distance_m < 1e-9));
        let heap = vec![[0.1; 3]; 30];
        let at = Query { at_m: [0.1; 3], radius_m: 0.1, origin: 99 };
        assert!(
            measure(&heap, &origins[..30], &[at]).unwrap()[0].is_none_or(|f| f.distance_m < 1e-9)
        );
    }
}

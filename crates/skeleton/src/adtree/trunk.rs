//! Step 6: a cylinder fitted to the trunk's points.

use super::tree::Tree;
use crate::vector::{Vector, add, dot, norm, scale, sub, to_segment};
use nalgebra::{SMatrix, SVector};

/// Points within this many radii of the first edge are the trunk's.
const REACH: f64 = 3.5;

/// Fewest points of a cylinder with seven parameters.
const FEWEST: usize = 8;

/// Most steps of Levenberg-Marquardt, and the change of the sum of squares that ends them.
const STEPS: usize = 100;
const ENOUGH: f64 = 1e-10;

/// A cylinder without ends: a point on its axis, the axis, and the radius.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cylinder {
    at: Vector,
    along: Vector,
    radius: f64,
}

/// Radius of the cylinder through the points around the tree's first edge, m: by least squares, then
/// again with weights of 1 - |residual| / largest. `None` where there are too few points, or where the
/// fit is wider than the points it was given.
pub(super) fn radius_m(tree: &Tree, points: &[Vector]) -> Option<f64> {
    let end = tree.trunk()?;
    let [from, to] = [tree.root, end].map(|v| tree.position[v as usize]);
    let reach = REACH * tree.radius_m[end as usize];
    let near: Vec<Vector> =
        points.iter().filter(|p| to_segment(**p, from, to).0 <= reach).copied().collect();
    if near.len() < FEWEST {
        return None;
    }
    let start = Cylinder { at: from, along: sub(to, from), radius: tree.radius_m[end as usize] };
    let first = fit(&near, &vec![1.0; near.len()], start)?;
    let residuals: Vec<f64> = near.iter().map(|p| residual(&first, *p).0.abs()).collect();
    let largest = residuals.iter().copied().fold(0.0, f64::max).max(1e-12);
    let weights: Vec<f64> = residuals.iter().map(|away| 1.0 - away / largest).collect();
    let second = fit(&near, &weights, first)?;
    (second.radius > 0.0 && second.radius <= reach).then_some(second.radius)
}

/// Distance of a point from the cylinder, and its derivative by the seven parameters.
fn residual(cylinder: &Cylinder, p: Vector) -> (f64, SVector<f64, 7>) {
    let length = norm(cylinder.along).max(1e-12);
    let axis = scale(cylinder.along, 1.0 / length);
    let out = sub(p, cylinder.at);
    let along = dot(out, axis);
    let across = sub(out, scale(axis, along));
    let away = norm(across).max(1e-12);
    let n = scale(across, 1.0 / away);
    let by_axis = -along / length;
    let gradient = SVector::<f64, 7>::from([
        -n[0],
        -n[1],
        -n[2],
        by_axis * n[0],
        by_axis * n[1],
        by_axis * n[2],
        -1.0,
    ]);
    (away - cylinder.radius, gradient)
}

/// Levenberg-Marquardt (Marquardt 1963) with multiplicative damping.
fn fit(points: &[Vector], weights: &[f64], start: Cylinder) -> Option<Cylinder> {
    let cost = |cylinder: &Cylinder| {
        let each = points.iter().zip(weights);
        each.map(|(p, w)| w * residual(cylinder, *p).0 * residual(cylinder, *p).0).sum::<f64>()
    };
    let (mut at, mut best, mut damping) = (start, cost(&start), 1e-3);
    for _ in 0..STEPS {
        let (mut matrix, mut right) = (SMatrix::<f64, 7, 7>::zeros(), SVector::<f64, 7>::zeros());
        for (p, w) in points.iter().zip(weights) {
            let (value, gradient) = residual(&at, *p);
            matrix += gradient * gradient.transpose() * *w;
            right -= gradient * (value * *w);
        }
        let scale = matrix.diagonal().max().max(1e-12);
        for i in 0..7 {
            matrix[(i, i)] += damping * matrix[(i, i)].max(1e-9 * scale);
        }
        let step = matrix.cholesky()?.solve(&right);
        let next = Cylinder {
            at: add(at.at, [step[0], step[1], step[2]]),
            along: add(at.along, [step[3], step[4], step[5]]),
            radius: at.radius + step[6],
        };
        let new = cost(&next);
        if new < best {
            let gain = best - new;
            (at, best, damping) = (next, new, damping * 0.1);
            if gain <= ENOUGH * best {
                break;
            }
        } else if damping > 1e12 {
            break;
        } else {
            damping *= 10.0;
        }
    }
    Some(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaning_cylinder_is_found_from_a_poor_start() {
        let axis = crate::vector::unit([0.2, -0.1, 1.0]).unwrap();
        let [u, v] = crate::vector::across(axis);
        let points: Vec<Vector> = (0..400)
            .map(|i| {
                let (angle, along) = (f64::from(i) * 0.37, f64::from(i) * 0.004);
                let out = add(scale(u, 0.12 * libm::cos(angle)), scale(v, 0.12 * libm::sin(angle)));
                add([1.0, 2.0, 3.0], add(scale(axis, along), out))
            })
            .collect();
        let start = Cylinder { at: [1.05, 1.97, 3.0], along: [0.0, 0.0, 1.5], radius: 0.2 };
        let found = fit(&points, &[1.0; 400], start).unwrap();
        assert!((found.radius - 0.12).abs() < 1e-6, "{found:?}");
    }
}

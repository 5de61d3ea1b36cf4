//! Positions spread evenly over surfaces, the same ones every time.

use crate::vector::{across, add, along, cross, scale, sub, unit};
use crate::{Cylinder, CylinderIndex, Ends, Mesh};
use std::f64::consts::PI;

/// Turn between two positions on a spiral that keeps any number of them evenly apart (Vogel 1979, A
/// better way to construct the sunflower head): a full turn divided by the square of the golden ratio.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
/// Steps of the additive recurrence in the plane (Roberts 2018, The unreasonable effectiveness of
/// quasirandom sequences): 1/g and 1/g^2 with g^3 = g + 1.
const PLASTIC: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];

/// A position on a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The position, m.
    pub position_m: [f64; 3],
    /// Direction outwards, of length 1.
    pub normal: [f64; 3],
    /// The cylinder or triangle it lies on.
    pub item: u32,
}

/// Positions on the surface of a cylinder, about one in every square of `spacing_m`, at least one on
/// the lateral surface. None without length, or for a spacing that is not positive.
#[must_use]
pub fn on_cylinder(cylinder: &Cylinder, ends: Ends, spacing_m: f64) -> Vec<Sample> {
    let Some(axis) = cylinder.axis().filter(|_| cylinder.is_finite() && spacing_m > 0.0) else {
        return Vec::new();
    };
    let u = across(axis);
    let v = cross(axis, u);
    let out = |turn: usize| {
        let (sin, cos) = libm::sincos(turn as f64 * GOLDEN_ANGLE);
        add(scale(u, cos), scale(v, sin))
    };
    let count = count_of(cylinder.lateral_area_m2(), spacing_m).max(1);
    let mut samples = Vec::with_capacity(count);
    for turn in 0..count {
        let share = (turn as f64 + 0.5) / count as f64;
        let foot = along(cylinder.start_m, axis, share * cylinder.length_m());
        let normal = out(turn);
        let position_m = along(foot, normal, cylinder.radius_m);
        samples.push(Sample { position_m, normal, item: 0 });
    }
    let discs = [(ends.start, cylinder.start_m, -1.0), (ends.end, cylinder.end_m, 1.0)];
    for (_, centre, sign) in discs.into_iter().filter(|(closed, ..)| *closed) {
        let count = count_of(PI * cylinder.radius_m * cylinder.radius_m, spacing_m);
        for turn in 0..count {
            let radius = cylinder.radius_m * ((turn as f64 + 0.5) / count as f64).sqrt();
            let position_m = along(centre, out(turn), radius);
            samples.push(Sample { position_m, normal: scale(axis, sign), item: 0 });
        }
    }
    samples
}

/// Positions on the surface of many cylinders, without those inside another one: the surface that can
/// be seen from outside.
#[must_use]
pub fn on_cylinders(cylinders: &[Cylinder], ends: &[Ends], spacing_m: f64) -> Vec<Sample> {
    let index = CylinderIndex::with_ends(cylinders, ends);
    let mut samples = Vec::new();
    for (item, cylinder) in (0u32..).zip(cylinders) {
        let ends = ends.get(item as usize).copied().unwrap_or(Ends::BOTH);
        let own = on_cylinder(cylinder, ends, spacing_m);
        let seen =
            own.into_iter().filter(|sample| !index.is_inside_another(sample.position_m, item));
        samples.extend(seen.map(|sample| Sample { item, ..sample }));
    }
    samples
}

/// Positions on the surface of a mesh, about one in every square of `spacing_m`: one in each of equal
/// parts of the area, laid out triangle after triangle.
#[must_use]
pub fn on_mesh(mesh: &Mesh, spacing_m: f64) -> Vec<Sample> {
    if !mesh.is_valid() || spacing_m <= 0.0 {
        return Vec::new();
    }
    let total = mesh.area_m2();
    let count = count_of(total, spacing_m).max(usize::from(total > 0.0));
    let mut samples = Vec::with_capacity(count);
    let mut reached = 0.0;
    for triangle in 0..mesh.triangles.len() {
        reached += mesh.triangle_area_m2(triangle);
        let [a, b, c] = mesh.corners_m(triangle);
        let Some(normal) = unit(cross(sub(b, a), sub(c, a))) else { continue };
        let last = triangle + 1 == mesh.triangles.len();
        while samples.len() < count
            && (last || (samples.len() as f64 + 0.5) / count as f64 * total <= reached)
        {
            let [v, w] = in_triangle(samples.len());
            let position_m = along(along(a, sub(b, a), v), sub(c, a), w);
            samples.push(Sample { position_m, normal, item: triangle as u32 });
        }
    }
    samples
}

/// Place of the position of a number in a triangle: shares of two edges.
fn in_triangle(number: usize) -> [f64; 2] {
    let [v, w] = PLASTIC.map(|step| {
        let place = 0.5 + step * (number as f64 + 1.0);
        place - place.floor()
    });
    if v + w <= 1.0 { [v, w] } else { [1.0 - v, 1.0 - w] }
}

fn count_of(area_m2: f64, spacing_m: f64) -> usize {
    (area_m2 / (spacing_m * spacing_m)).round() as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MeshIndex;
    use crate::mesh::tests::block;
    use crate::vector::{distance, dot};

    const POST: Cylinder =
        Cylinder { start_m: [1.0, 2.0, 3.0], end_m: [2.0, 2.5, 4.0], radius_m: 0.3 };

    /// Distance of the two samples nearest to each other.
    fn closest(samples: &[Sample]) -> f64 {
        let mut least = f64::INFINITY;
        for (i, a) in samples.iter().enumerate() {
            for b in &samples[..i] {
                least = least.min(distance(a.position_m, b.position_m));
            }
        }
        least
    }

    #[test]
    fn samples_lie_on_a_cylinder_evenly() {
        let samples = on_cylinder(&POST, Ends::BOTH, 0.05);
        let area = POST.lateral_area_m2() + 2.0 * PI * 0.09;
        assert!((samples.len() as f64 - area / 0.0025).abs() <= 2.0, "{}", samples.len());
        assert!(samples.iter().all(|s| POST.distance_m(s.position_m) < 1e-12));
        let out = |s: &Sample| POST.signed_distance_m(along(s.position_m, s.normal, 0.01));
        assert!(samples.iter().all(|s| (out(s) - 0.01).abs() < 1e-9));
        let lateral = on_cylinder(&POST, Ends::NONE, 0.05);
        assert!(closest(&lateral) > 0.03, "{}", closest(&lateral));
    }

    #[test]
    fn what_another_cylinder_covers_is_not_sampled() {
        let inner = Cylinder { radius_m: 0.1, ..POST };
        let outer = Cylinder { start_m: [0.0, 1.5, 2.0], end_m: [3.0, 3.0, 5.0], radius_m: 0.5 };
        let ends = [Ends::BOTH; 2];
        let seen = on_cylinders(&[inner, outer], &ends, 0.1);
        assert!(seen.iter().all(|sample| sample.item == 1));
        assert_eq!(seen.len(), on_cylinder(&outer, Ends::BOTH, 0.1).len());
        // Two that stand apart are both seen whole.
        let apart = Cylinder { start_m: [9.0; 3], end_m: [9.0, 9.0, 10.0], radius_m: 0.1 };
        let both = on_cylinders(&[inner, apart], &ends, 0.1);
        assert_eq!(
            both.iter().filter(|sample| sample.item == 0).count(),
            on_cylinder(&inner, Ends::BOTH, 0.1).len()
        );
    }

    #[test]
    fn samples_lie_on_a_mesh_in_proportion_to_area() {
        let mesh = block([1.0, 2.0, 3.0]);
        let samples = on_mesh(&mesh, 0.1);
        assert_eq!(samples.len(), 2200);
        let index = MeshIndex::new(&mesh);
        assert!(samples.iter().all(|s| index.nearest(s.position_m).unwrap().1 < 1e-12));
        let outward = |s: &&Sample| dot(s.normal, [0.0, 0.0, 1.0]) > 0.99;
        assert!((samples.iter().filter(outward).count() as i64 - 200).abs() <= 2);
        let mean = samples.iter().fold([0.0; 3], |sum, s| add(sum, s.position_m));
        for (mean, centre) in mean.into_iter().zip([0.5, 1.0, 1.5]) {
            assert!((mean / 2200.0 - centre).abs() < 0.01);
        }
    }

    #[test]
    fn nothing_comes_of_nothing() {
        let dot = Cylinder { end_m: POST.start_m, ..POST };
        assert!(on_cylinder(&dot, Ends::BOTH, 0.1).is_empty());
        assert!(on_cylinder(&POST, Ends::BOTH, 0.0).is_empty());
        assert_eq!(on_cylinder(&POST, Ends::NONE, 100.0).len(), 1);
        assert!(on_mesh(&Mesh::default(), 0.1).is_empty());
    }
}

//! The points of a tree as everything here wants them: finite, each position once, in one order.

use crate::Error;
use crate::vector::{Vector, sub};

/// Most points of one tree: indices are of 32 bits, and graphs have two directions per edge.
pub const MOST_POINTS: usize = 1 << 26;

/// Grains in a metre. Positions are rounded to them, a micrometre: what a shift of the world by
/// whole metres does to the last bits of a coordinate is far below it, so it changes nothing.
const GRAINS_PER_M: f64 = 1_048_576.0;

/// Points of one tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Cloud {
    /// Different positions relative to `origin_m`, m, along a space-filling curve.
    pub points: Vec<[f64; 3]>,
    /// Likelihood of wood at each position, 0 to 1; the largest where points coincide.
    pub wood: Vec<f32>,
    /// Points at each position.
    pub count: Vec<u32>,
    /// Whole metres that were taken off the positions.
    pub origin_m: [f64; 3],
    /// Points left out because a coordinate was no finite number.
    pub not_finite: usize,
}

impl Cloud {
    /// Prepares points, which may be in any order. A likelihood that is no number counts as 1.
    ///
    /// # Errors
    /// [`Error::NoPoints`], [`Error::OnePosition`], [`Error::WoodCount`] and [`Error::TooMany`].
    pub fn new(points: &[[f64; 3]], wood: Option<&[f32]>) -> Result<Self, Error> {
        let given = points.len();
        if let Some(wood) = wood.filter(|wood| wood.len() != given) {
            return Err(Error::WoodCount { points: given, wood: wood.len() });
        }
        if given > MOST_POINTS {
            return Err(Error::TooMany(given));
        }
        let finite = |p: &[f64; 3]| p.iter().all(|value| value.is_finite());
        let mut low = [f64::INFINITY; 3];
        for p in points.iter().filter(|p| finite(p)) {
            low = std::array::from_fn(|axis| low[axis].min(p[axis]));
        }
        let origin_m = low.map(f64::floor);
        let likely = |i: usize| match wood {
            Some(wood) if !wood[i].is_nan() => wood[i].clamp(0.0, 1.0),
            _ => 1.0,
        };
        let mut keyed: Vec<(u64, Vector, f32)> = (0..given)
            .filter(|&i| finite(&points[i]))
            .map(|i| {
                let p = sub(points[i], origin_m).map(to_grain);
                (curve(p), p, likely(i))
            })
            .collect();
        let not_finite = given - keyed.len();
        keyed.sort_unstable_by(|a, b| {
            a.0.cmp(&b.0).then_with(|| compare(&a.1, &b.1)).then(b.2.total_cmp(&a.2))
        });
        let cloud = Self::without_duplicates(&keyed, origin_m, not_finite);
        match cloud.points.len() {
            0 => Err(Error::NoPoints { given, not_finite }),
            1 => Err(Error::OnePosition { given, at: cloud.to_given(cloud.points[0]) }),
            _ => Ok(cloud),
        }
    }

    fn without_duplicates(keyed: &[(u64, Vector, f32)], origin_m: Vector, lost: usize) -> Self {
        let (points, wood, count) = (Vec::new(), Vec::new(), Vec::new());
        let mut cloud = Self { points, wood, count, origin_m, not_finite: lost };
        for (_, p, likely) in keyed {
            if cloud.points.last() == Some(p) {
                if let Some(count) = cloud.count.last_mut() {
                    *count += 1;
                }
            } else {
                cloud.points.push(*p);
                cloud.wood.push(*likely);
                cloud.count.push(1);
            }
        }
        cloud
    }

    /// A position in the frame of the points that were given, m.
    #[must_use]
    pub fn to_given(&self, position: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| to_grain(position[axis]) + self.origin_m[axis])
    }

    /// A position from the frame of the points that were given, m.
    #[must_use]
    pub fn from_given(&self, position: [f64; 3]) -> [f64; 3] {
        sub(position, self.origin_m).map(to_grain)
    }

    /// Lowest and highest point, m.
    #[must_use]
    pub fn heights_m(&self) -> (f64, f64) {
        let z = self.points.iter().map(|p| p[2]);
        z.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)))
    }
}

/// Total order of positions: lowest first.
pub(crate) fn compare(a: &Vector, b: &Vector) -> std::cmp::Ordering {
    a[2].total_cmp(&b[2]).then(a[0].total_cmp(&b[0])).then(a[1].total_cmp(&b[1]))
}

fn to_grain(value: f64) -> f64 {
    (value * GRAINS_PER_M + 0.5).floor() / GRAINS_PER_M
}

/// Place on a Morton curve with cells of 1 mm (up to 2 km), for positions of 0 or more.
fn curve(p: Vector) -> u64 {
    let [x, y, z] = p.map(|value| spread(((value * 1000.0) as u64).min(0x1F_FFFF)));
    x | (y << 1) | (z << 2)
}

/// Spreads 21 bits over every third of 63 (Morton 1966; the usual magic masks).
fn spread(value: u64) -> u64 {
    let mut v = value;
    v = (v | (v << 32)) & 0x001F_0000_0000_FFFF;
    v = (v | (v << 16)) & 0x001F_0000_FF00_00FF;
    v = (v | (v << 8)) & 0x100F_00F0_0F00_F00F;
    v = (v | (v << 4)) & 0x10C3_0C30_C30C_30C3;
    (v | (v << 2)) & 0x1249_2492_4924_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_duplicates_and_shift_do_not_matter() {
        let points = [[0.5, 1.25, 3.0001], [0.1, 0.2, 0.3], [0.5, 1.25, 3.0001], [-2.7, 9.1, 1.0]];
        let wood = [0.2, 1.0, 0.7, f32::NAN];
        let cloud = Cloud::new(&points, Some(&wood)).unwrap();
        assert_eq!(cloud.points.len(), 3);
        assert_eq!(cloud.count.iter().sum::<u32>(), 4);
        let double = cloud.count.iter().position(|&n| n == 2).unwrap();
        assert_eq!(cloud.wood[double], 0.7);
        let mut turned = points;
        turned.reverse();
        let mut turned_wood = wood;
        turned_wood.reverse();
        assert_eq!(Cloud::new(&turned, Some(&turned_wood)).unwrap(), cloud);
        let shift = |p: &[f64; 3]| [p[0] + 500_000.0, p[1] + 5_000_000.0, p[2] + 1000.0];
        let shifted = Cloud::new(&points.each_ref().map(shift), Some(&wood)).unwrap();
        assert_eq!((&shifted.points, &shifted.wood), (&cloud.points, &cloud.wood));
    }

    #[test]
    fn what_is_no_cloud_is_said() {
        let nan = [[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0]];
        assert_eq!(Cloud::new(&nan, None), Err(Error::NoPoints { given: 2, not_finite: 2 }));
        assert_eq!(Cloud::new(&[], None), Err(Error::NoPoints { given: 0, not_finite: 0 }));
        let one = [[1.5, 2.5, -3.5]; 7];
        assert_eq!(
            Cloud::new(&one, None),
            Err(Error::OnePosition { given: 7, at: [1.5, 2.5, -3.5] })
        );
        let one = Cloud::new(&[[0.0; 3], [f64::NAN; 3], [1.0; 3]], None).unwrap();
        assert_eq!(one.not_finite, 1);
        assert_eq!(
            Cloud::new(&[[0.0; 3], [1.0; 3]], Some(&[1.0])),
            Err(Error::WoodCount { points: 2, wood: 1 })
        );
    }
}

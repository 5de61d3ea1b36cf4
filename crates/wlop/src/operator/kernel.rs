//! The sums over neighbours: kernels in single precision on offsets from the middle of a cell, eight
//! neighbours at a time.
//!
//! Offsets are shorter than a few support radii, so single precision resolves them to 1e-7 of it;
//! positions themselves stay in double precision. Every lane is summed in the sequence of the
//! neighbours and the lanes are added in a fixed sequence, so that the sums are the same on every
//! machine.

/// Neighbours worked on at a time.
pub(super) const LANES: usize = 8;

/// Softening of 1/r: r is read as sqrt(r² + `SOFTENING` (h/4)²), so that a sample on top of a point
/// has a finite pull (the limit r -> 0 is not defined in the papers). A twentieth of h/4.
pub(super) const SOFTENING: f32 = 0.0025;

/// Smallest sum of weights of neighbours; below it there are none.
const NO_NEIGHBOURS: f32 = 1e-12;

/// Eight neighbours: offsets from the middle of the cell in metres, (4/h)² in 1/m² and weight.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub(super) x: [f32; LANES],
    pub(super) y: [f32; LANES],
    pub(super) z: [f32; LANES],
    pub(super) narrowness: [f32; LANES],
    pub(super) weight: [f32; LANES],
}

impl Block {
    /// No neighbours.
    pub(super) const EMPTY: Self = Self {
        x: [0.0; LANES],
        y: [0.0; LANES],
        z: [0.0; LANES],
        narrowness: [0.0; LANES],
        weight: [0.0; LANES],
    };

    /// The same neighbours seen from elsewhere, m.
    #[inline(always)]
    pub(super) fn moved(&self, shift: [f32; 3]) -> Self {
        let mut moved = *self;
        for lane in 0..LANES {
            moved.x[lane] += shift[0];
            moved.y[lane] += shift[1];
            moved.z[lane] += shift[2];
        }
        moved
    }
}

/// The point in whose surroundings is summed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Target {
    /// Offset from the middle of the cell, m.
    pub(super) at: [f32; 3],
    /// (4/h)², 1/m².
    pub(super) narrowness: f32,
    /// Largest r² (4/h)² that counts.
    pub(super) cut: f32,
}

/// exp(-t) for t in 0 to 16, to 6e-6 of its value: a polynomial for exp(-t/32), squared five times.
///
/// The coefficients are those of least largest relative error (1.1e-8) on 0 to 1/2, found by Lawson's
/// iteration on 4001 Chebyshev points.
#[inline(always)]
pub(super) fn exp_minus(t: f32) -> f32 {
    const C: [f32; 6] =
        [0.999_999_99, -0.999_998_57, 0.499_968_05, -0.166_400_38, 0.040_645_54, -0.006_475_53];
    let u = t * (1.0 / 32.0);
    let p = C[0] + u * (C[1] + u * (C[2] + u * (C[3] + u * (C[4] + u * C[5]))));
    let p2 = p * p;
    let p4 = p2 * p2;
    let p8 = p4 * p4;
    let p16 = p8 * p8;
    p16 * p16
}

/// theta of one neighbour, 0 beyond the cut; and the offset to it with its square.
#[inline(always)]
fn theta(block: &Block, lane: usize, target: &Target) -> (f32, [f32; 3], f32) {
    let dx = block.x[lane] - target.at[0];
    let dy = block.y[lane] - target.at[1];
    let dz = block.z[lane] - target.at[2];
    let squared = dx * dx + dy * dy + dz * dz;
    // The narrower of two kernels: the rule by which h_ij = min(h_i, h_j).
    let own = block.narrowness[lane];
    let narrowness = if own > target.narrowness { own } else { target.narrowness };
    let t = squared * narrowness;
    let inside = if t <= target.cut { 1.0 } else { 0.0 };
    let t = if t <= target.cut { t } else { target.cut };
    (exp_minus(t) * inside * block.weight[lane], [dx, dy, dz], squared)
}

#[inline(always)]
fn add_up(lanes: [f32; LANES]) -> f32 {
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// A sum over the neighbours of a target.
///
/// Everything below a sum is inlined by force and written in plain loops: what the compiler left as a
/// function of its own would not be compiled for the processor that [`pulp`] finds.
pub(super) trait Kernel {
    /// What comes of it.
    type Sum: Send + Copy + Default;
    /// Sums up.
    fn sum(blocks: &[Block], target: &Target) -> Self::Sum;
}

/// The sum of theta over the neighbours.
pub(super) struct Density;

impl Kernel for Density {
    type Sum = f32;

    #[inline(always)]
    fn sum(blocks: &[Block], target: &Target) -> f32 {
        let mut sum = [0.0; LANES];
        for block in blocks {
            for lane in 0..LANES {
                sum[lane] += theta(block, lane, target).0;
            }
        }
        add_up(sum)
    }
}

/// The weighted mean of the offsets to the neighbours, m; nothing without neighbours. Weights are
/// theta / r to the power of `POWER`: 0, 1 or 2. Of `OTHERS` what lies at the very place of the target,
/// like itself, has no weight.
pub(super) struct MeanOffset<const POWER: u32, const OTHERS: bool>;

impl<const POWER: u32, const OTHERS: bool> Kernel for MeanOffset<POWER, OTHERS> {
    type Sum = [f32; 3];

    #[inline(always)]
    fn sum(blocks: &[Block], target: &Target) -> [f32; 3] {
        let (mut x, mut y, mut z) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut sum = [0.0; LANES];
        let softening = SOFTENING / target.narrowness;
        for block in blocks {
            for lane in 0..LANES {
                let (theta, offset, squared) = theta(block, lane, target);
                let weight = match POWER {
                    0 => theta,
                    1 => theta / (squared + softening).sqrt(),
                    _ => theta / (squared + softening),
                };
                let weight = if OTHERS && squared == 0.0 { 0.0 } else { weight };
                sum[lane] += weight;
                x[lane] += weight * offset[0];
                y[lane] += weight * offset[1];
                z[lane] += weight * offset[2];
            }
        }
        let sum = add_up(sum);
        if sum > NO_NEIGHBOURS {
            [add_up(x) / sum, add_up(y) / sum, add_up(z) / sum]
        } else {
            [0.0; 3]
        }
    }
}

/// Weighted scatter of the neighbours about their mean: xx, xy, xz, yy, yz, zz in m², with theta as
/// weights; nothing without neighbours.
pub(super) struct Scatter;

impl Kernel for Scatter {
    type Sum = [f32; 6];

    #[inline(always)]
    fn sum(blocks: &[Block], target: &Target) -> [f32; 6] {
        let (mut sum, mut first, mut second) = ([0.0; LANES], [[0.0; LANES]; 3], [[0.0; LANES]; 6]);
        for block in blocks {
            for lane in 0..LANES {
                let (weight, [x, y, z], _) = theta(block, lane, target);
                let (wx, wy, wz) = (weight * x, weight * y, weight * z);
                sum[lane] += weight;
                first[0][lane] += wx;
                first[1][lane] += wy;
                first[2][lane] += wz;
                second[0][lane] += wx * x;
                second[1][lane] += wx * y;
                second[2][lane] += wx * z;
                second[3][lane] += wy * y;
                second[4][lane] += wy * z;
                second[5][lane] += wz * z;
            }
        }
        let sum = add_up(sum);
        if sum <= NO_NEIGHBOURS {
            return [0.0; 6];
        }
        let [x, y, z] = [add_up(first[0]) / sum, add_up(first[1]) / sum, add_up(first[2]) / sum];
        [
            add_up(second[0]) / sum - x * x,
            add_up(second[1]) / sum - x * y,
            add_up(second[2]) / sum - x * z,
            add_up(second[3]) / sum - y * y,
            add_up(second[4]) / sum - y * z,
            add_up(second[5]) / sum - z * z,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::marker::PhantomData;

    #[test]
    fn the_polynomial_follows_the_exponential() {
        let worst = (0..=1_600_000u32)
            .map(|i| {
                let t = i as f32 * 1e-5;
                let exact = libm::exp(-f64::from(t));
                (f64::from(exp_minus(t)) - exact).abs() / exact
            })
            .fold(0.0, f64::max);
        assert!(worst < 6e-6, "{worst}");
    }

    /// Neighbours within and beyond the reach, one at the very place of the target, and a lane without.
    fn some_blocks() -> Vec<Block> {
        let value = |seed: u32| (seed.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        let mut blocks = vec![Block::EMPTY; 40];
        for (block, seed) in blocks.iter_mut().zip((0..).step_by(64)) {
            for (lane, seed) in (0..LANES).zip((seed..).step_by(5)) {
                block.x[lane] = 0.1 * value(seed) - 0.05;
                block.y[lane] = 0.1 * value(seed + 1) - 0.05;
                block.z[lane] = 0.1 * value(seed + 2) - 0.05;
                block.narrowness[lane] = 4e3 + 8e3 * value(seed + 3);
                block.weight[lane] = value(seed + 4);
            }
        }
        (blocks[3].x[2], blocks[3].y[2], blocks[3].z[2]) = (0.01, -0.02, 0.03);
        blocks[39].weight[7] = 0.0;
        blocks
    }

    struct Wide<'a, K> {
        blocks: &'a [Block],
        target: &'a Target,
        kernel: PhantomData<K>,
    }

    impl<K: Kernel> pulp::WithSimd for Wide<'_, K> {
        type Output = K::Sum;

        #[inline(always)]
        fn with_simd<S: pulp::Simd>(self, _simd: S) -> K::Sum {
            K::sum(self.blocks, self.target)
        }
    }

    fn bits<K: Kernel>(blocks: &[Block], target: &Target, print: impl Fn(K::Sum) -> Vec<u32>) {
        let plain = print(K::sum(blocks, target));
        let kernel = PhantomData::<K>;
        let wide = print(pulp::Arch::new().dispatch(Wide { blocks, target, kernel }));
        assert_eq!(plain, wide);
        assert!(plain.iter().all(|bits| *bits != 0));
    }

    #[test]
    fn wide_registers_change_no_bit() {
        let blocks = some_blocks();
        let target = Target { at: [0.01, -0.02, 0.03], narrowness: 6e3, cut: 4.0 };
        let all = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<u32>>();
        bits::<Density>(&blocks, &target, |sum| all(&[sum]));
        bits::<MeanOffset<0, false>>(&blocks, &target, |sum| all(&sum));
        bits::<MeanOffset<1, true>>(&blocks, &target, |sum| all(&sum));
        bits::<MeanOffset<2, true>>(&blocks, &target, |sum| all(&sum));
        bits::<Scatter>(&blocks, &target, |sum| all(&sum));
    }
}

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
#[inline]
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
#[inline]
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

fn add_up(lanes: [f32; LANES]) -> f32 {
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// The sum of theta over the neighbours.
pub(super) fn density(blocks: &[Block], target: &Target) -> f32 {
    let mut sum = [0.0; LANES];
    for block in blocks {
        for lane in 0..LANES {
            sum[lane] += theta(block, lane, target).0;
        }
    }
    add_up(sum)
}

/// The weighted mean of the offsets to the neighbours, m; nothing without neighbours. Weights are
/// theta / r to the power of `POWER`: 0, 1 or 2. Of `OTHERS` what lies at the very place of the target,
/// like itself, has no weight.
pub(super) fn mean_offset<const POWER: u32, const OTHERS: bool>(
    blocks: &[Block],
    target: &Target,
) -> [f32; 3] {
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
    if sum > NO_NEIGHBOURS { [x, y, z].map(|axis| add_up(axis) / sum) } else { [0.0; 3] }
}

/// Weighted scatter of the neighbours about their mean: xx, xy, xz, yy, yz, zz in m², with theta as
/// weights; nothing without neighbours.
pub(super) fn scatter(blocks: &[Block], target: &Target) -> [f32; 6] {
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
    let mean = first.map(|lanes| add_up(lanes) / sum);
    let [xx, xy, xz, yy, yz, zz] = second.map(|lanes| add_up(lanes) / sum);
    let [x, y, z] = mean;
    [xx - x * x, xy - x * y, xz - x * z, yy - y * y, yz - y * z, zz - z * z]
}

#[cfg(test)]
mod tests {
    use super::*;

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
}

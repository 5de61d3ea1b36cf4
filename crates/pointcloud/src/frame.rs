//! World lattice and local frames.

use serde::{Deserialize, Serialize};

/// Edge of the world lattice on which all positions lie: 0.1 mm.
///
/// Every LAS scale in use (1, 2, 5, 10 mm, 0.1 mm) is a multiple of it, so positions of such files
/// are kept exactly; coarser errors than half of this never arise from representation.
pub const TICK_M: f64 = 1e-4;

/// Ticks in a metre.
pub const TICKS_PER_M: f64 = 10_000.0;

/// Largest magnitude of a world coordinate, in metres.
///
/// Below it consecutive `f64` values are at most 2^-27 m (7.5 nm) apart, far finer than a tick.
pub const MAX_COORDINATE_M: f64 = 67_108_864.0;

/// The lattice position nearest to a world coordinate, in ticks.
#[must_use]
pub fn ticks_from_world(world_m: f64) -> i64 {
    // Half away from zero, as `f64::round`, which without SSE 4.1 is a call into the platform's
    // library: the largest number below one half is added, then cut (LLVM lowers `round` so).
    const BELOW_HALF: f64 = 0.499_999_999_999_999_94;
    let scaled = world_m * TICKS_PER_M;
    (scaled + BELOW_HALF.copysign(scaled)) as i64
}

/// The world coordinate of a lattice position: the `f64` nearest to `ticks / 10000`.
#[must_use]
pub fn world_from_ticks(ticks: i64) -> f64 {
    ticks as f64 / TICKS_PER_M
}

/// Moves a world coordinate to the nearest lattice position. Idempotent.
#[must_use]
pub fn quantise(world_m: f64) -> f64 {
    world_from_ticks(ticks_from_world(world_m))
}

/// A local frame: axes parallel to the world's, origin at whole metres.
///
/// A world `f64` and a whole number below it are both multiples of the world value's last bit, so
/// `world - origin` is exact; differences of local positions are therefore the same in any frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub struct Frame {
    /// World position of the local origin, whole metres.
    pub origin_m: [i64; 3],
}

impl Frame {
    /// A frame with its origin at the given whole metres.
    #[must_use]
    pub const fn new(origin_m: [i64; 3]) -> Self {
        Self { origin_m }
    }

    /// A frame near a world position: the position rounded down to whole metres.
    #[must_use]
    pub fn near(world_m: [f64; 3]) -> Self {
        Self { origin_m: world_m.map(|value| value.floor() as i64) }
    }

    /// World position to local position (exact for lattice positions within 8000 km).
    #[must_use]
    pub fn local_from_world(&self, world_m: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| world_m[axis] - self.origin_m[axis] as f64)
    }

    /// Local position to world position (exact for positions that came from the world).
    #[must_use]
    pub fn world_from_local(&self, local_m: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| local_m[axis] + self.origin_m[axis] as f64)
    }

    /// What to add to a position of `other` to get it in this frame: whole metres, hence exact.
    #[must_use]
    pub fn shift_from(&self, other: &Self) -> [f64; 3] {
        std::array::from_fn(|axis| (other.origin_m[axis] - self.origin_m[axis]) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn lattice_positions_survive_any_frame(ticks in -80_000_000_000i64..80_000_000_000, origin in -8_000_000i64..8_000_000) {
            let world = world_from_ticks(ticks);
            let frame = Frame::new([origin, 0, 0]);
            let back = frame.world_from_local(frame.local_from_world([world, 0.0, 0.0]))[0];
            prop_assert_eq!(ticks_from_world(back), ticks);
        }

        #[test]
        fn differences_do_not_depend_on_the_frame(a in 10_000_000_000i64..80_000_000_000, d in -1_000_000i64..1_000_000, shift in -500i64..500) {
            let (p, q) = (world_from_ticks(a), world_from_ticks(a + d));
            let base = p.floor() as i64;
            let difference = |origin: i64| {
                let frame = Frame::new([origin, 0, 0]);
                frame.local_from_world([p, 0., 0.])[0] - frame.local_from_world([q, 0., 0.])[0]
            };
            prop_assert_eq!(difference(base).to_bits(), difference(base + shift).to_bits());
        }

        #[test]
        fn ticks_are_rounded_half_away_from_zero(ticks in -6e11f64..6e11, half in -600_000_000i64..600_000_000) {
            for world in [ticks / TICKS_PER_M, (half as f64 + 0.5) / TICKS_PER_M, half as f64 / 65_536.0] {
                prop_assert_eq!(ticks_from_world(world), (world * TICKS_PER_M).round() as i64);
            }
        }

        #[test]
        fn quantising_twice_is_quantising_once(x in -1e7f64..1e7) {
            prop_assert_eq!(quantise(quantise(x)).to_bits(), quantise(x).to_bits());
        }
    }
}

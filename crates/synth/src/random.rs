//! Random streams that do not depend on who draws first.
//!
//! Every tree, pulse and plot has its own ChaCha stream, named by the scene's seed, what it is for
//! and an index. Work can be shared among any number of threads without changing a bit of it.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What a stream is for; part of its key, so that no two uses share numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// Attributes and place of a tree.
    Tree = 1,
    /// Lean and asymmetry of a grown tree.
    Lean = 2,
    /// A laser pulse.
    Pulse = 3,
    /// A flight line.
    Line = 4,
    /// A field plot.
    Plot = 5,
    /// Lattice noise of terrain and undergrowth.
    Noise = 6,
    /// What experiments do to trees and points of a scene.
    Experiment = 7,
    /// The axes and leaves of a tree that is grown piece by piece.
    Growth = 8,
    /// A column of pulses of a terrestrial scanner.
    Beam = 9,
    /// Places and sizes of what grows on a terrestrial plot.
    TerrestrialPlot = 10,
}

/// One stream of numbers.
#[derive(Debug, Clone)]
pub struct Stream {
    rng: ChaCha8Rng,
}

impl Stream {
    /// The stream of a seed, a use and an index.
    #[must_use]
    pub fn new(seed: u64, domain: Domain, index: u64) -> Self {
        let mut key = [0_u8; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..16].copy_from_slice(&(domain as u64).to_le_bytes());
        let mut rng = ChaCha8Rng::from_seed(key);
        rng.set_stream(index);
        Self { rng }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.rng.next_u64()
    }

    /// Uniform in [0, 1), in steps of 2^-32: enough for positions within a footprint or a crown.
    pub fn unit(&mut self) -> f64 {
        f64::from(self.rng.next_u32()) * (1.0 / 4_294_967_296.0)
    }

    /// Uniform in [low, high).
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// True with a probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Exponential with mean 1.
    pub fn exponential(&mut self) -> f64 {
        // The half step keeps the logarithm finite.
        -libm::log((f64::from(self.rng.next_u32()) + 0.5) * (1.0 / 4_294_967_296.0))
    }

    /// Exponential with mean 1 for free flights: the logarithm by a series, to 2e-5.
    pub(crate) fn flight(&mut self) -> f64 {
        let number = u64::from(self.rng.next_u32()) * 2 + 1;
        let halvings = number.leading_zeros() - 31;
        // Number over 2^33 is `scaled / 2^(halvings)` with `scaled` in [1/2, 1).
        let scaled = (number << halvings) as f64 * (1.0 / 8_589_934_592.0);
        // ln m = 2 atanh((m - 1)/(m + 1)) about the geometric mean of the interval.
        let s = (scaled - SQRT_HALF) / (scaled + SQRT_HALF);
        let q = s * s;
        let log = 2.0 * s * (1.0 + q * (1.0 / 3.0 + q * (0.2 + q / 7.0)));
        (f64::from(halvings) + 0.5) * std::f64::consts::LN_2 - log
    }

    /// Standard normal (Box and Muller 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (2.0 * self.exponential()).sqrt();
        radius * libm::cos(std::f64::consts::TAU * self.unit())
    }

    /// Nearly normal with mean 0 and variance 1, bounded by 4.9: the sum of eight 16-bit uniform
    /// numbers. Several times faster than [`Self::normal`]; meant for a sensor's noise.
    pub(crate) fn bell(&mut self) -> f64 {
        let lanes = |bits: u64| (0..4).map(|i| (bits >> (16 * i)) & 0xFFFF).sum::<u64>();
        let sum = lanes(self.bits()) + lanes(self.bits());
        // Eight uniforms on [0, 1]: mean 4, variance 8/12, so sqrt(1.5) makes the variance 1.
        ((sum as f64 + 4.0) * (1.0 / 65_536.0) - 4.0) * 1.224_744_871_391_589
    }

    /// Weibull by inversion.
    pub fn weibull(&mut self, shape: f64, scale: f64) -> f64 {
        scale * libm::pow(self.exponential(), 1.0 / shape)
    }

    /// A factor around 1: the exponential of a normal number with the given deviation, which is
    /// cut at two deviations.
    pub fn factor(&mut self, deviation: f64) -> f64 {
        libm::exp(deviation * self.normal().clamp(-2.0, 2.0))
    }

    /// A direction in the plane.
    pub fn direction(&mut self) -> [f64; 2] {
        let (sin, cos) = libm::sincos(std::f64::consts::TAU * self.unit());
        [cos, sin]
    }
}

const SQRT_HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The whole number not above a value of moderate size. Without SSE 4.1 the standard function is a call.
pub(crate) fn whole(value: f64) -> i32 {
    let cut = value as i32;
    cut - i32::from(f64::from(cut) > value)
}

/// Mixes 64 bits (the finaliser of SplitMix64, Steele, Lea and Flood 2014).
pub(crate) fn mix(mut value: u64) -> u64 {
    value = (value ^ (value >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    value = (value ^ (value >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    value ^ (value >> 31)
}

/// A hash of a lattice cell.
pub(crate) fn hash_cell(cell: [i32; 3], salt: u64) -> u64 {
    let [x, y, z] = cell.map(|index| index as u32 as u64);
    let packed = x.wrapping_mul(0x9E37_79B9_7F4A_7C15)
        ^ y.wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
        ^ z.wrapping_mul(0x1656_67B1_9E37_79F9);
    mix(packed ^ salt)
}

/// The upper 32 bits of a hash as a number in [0, 1).
pub(crate) fn unit_of(hash: u64) -> f64 {
    (hash >> 32) as f64 * (1.0 / 4_294_967_296.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(mut draw: impl FnMut(&mut Stream) -> f64) -> (f64, f64) {
        let mut stream = Stream::new(7, Domain::Tree, 0);
        let values: Vec<f64> = (0..40_000).map(|_| draw(&mut stream)).collect();
        let mean = values.iter().sum::<f64>() / 40_000.0;
        (mean, values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / 40_000.0)
    }

    #[test]
    fn moments_of_the_distributions() {
        let near = |(mean, variance): (f64, f64), m: f64, v: f64| {
            assert!(
                (mean - m).abs() < 0.02 && (variance / v - 1.0).abs() < 0.04,
                "{mean} {variance}"
            );
        };
        near(moments(Stream::unit), 0.5, 1.0 / 12.0);
        near(moments(Stream::normal), 0.0, 1.0);
        near(moments(Stream::bell), 0.0, 1.0);
        near(moments(Stream::exponential), 1.0, 1.0);
        near(moments(Stream::flight), 1.0, 1.0);
        // Weibull of shape 2: mean gamma(1.5), variance 1 - pi/4.
        near(moments(|s| s.weibull(2.0, 1.0)), 0.886_227, 0.214_602);
    }

    #[test]
    fn flights_are_logarithms() {
        let stream = |i| Stream::new(3, Domain::Pulse, i);
        for i in 0..2000 {
            let (flight, exact) = (stream(i).flight(), stream(i).exponential());
            assert!((flight - exact).abs() < 2e-5, "{flight} {exact}");
        }
        assert_eq!([whole(-0.5), whole(-2.0), whole(2.9), whole(0.0)], [-1, -2, 2, 0]);
    }

    #[test]
    fn streams_are_told_apart_by_every_part_of_their_name() {
        let first = |seed, domain, index| Stream::new(seed, domain, index).bits();
        let base = first(1, Domain::Tree, 0);
        assert_eq!(base, first(1, Domain::Tree, 0));
        for other in
            [first(2, Domain::Tree, 0), first(1, Domain::Pulse, 0), first(1, Domain::Tree, 1)]
        {
            assert_ne!(base, other);
        }
    }
}

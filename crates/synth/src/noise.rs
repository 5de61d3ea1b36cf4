//! Smooth noise on a lattice, with exact derivatives.
//!
//! Polynomials only, no tables and no trigonometry: the same bits on every machine.

use crate::random::{hash_cell, unit_of, whole};

/// Quintic fade and its derivative (Perlin 2002, Improving noise).
fn fade(t: f64) -> (f64, f64) {
    (t * t * t * (t * (t * 6.0 - 15.0) + 10.0), 30.0 * t * t * (t - 1.0) * (t - 1.0))
}

/// A slope of the lattice, uniform in the square of half-width 1.
fn slope(column: i32, row: i32, salt: u64) -> [f64; 2] {
    let hash = hash_cell([column, row, 0], salt);
    [2.0 * unit_of(hash) - 1.0, 2.0 * unit_of(hash << 32) - 1.0]
}

/// Gradient noise in the plane: value (about -0.8 to 0.8) and gradient, at unit wavelength.
pub(crate) fn gradient_noise(x: f64, y: f64, salt: u64) -> (f64, [f64; 2]) {
    let (i, j) = (whole(x), whole(y));
    let (fx, fy) = (x - f64::from(i), y - f64::from(j));
    let ((u, du), (v, dv)) = (fade(fx), fade(fy));
    let g00 = slope(i, j, salt);
    let g10 = slope(i + 1, j, salt);
    let g01 = slope(i, j + 1, salt);
    let g11 = slope(i + 1, j + 1, salt);
    let n00 = g00[0] * fx + g00[1] * fy;
    let n10 = g10[0] * (fx - 1.0) + g10[1] * fy;
    let n01 = g01[0] * fx + g01[1] * (fy - 1.0);
    let n11 = g11[0] * (fx - 1.0) + g11[1] * (fy - 1.0);
    let (kx, ky, kxy) = (n10 - n00, n01 - n00, n00 - n10 - n01 + n11);
    let blend = |axis: usize| {
        g00[axis]
            + u * (g10[axis] - g00[axis])
            + v * (g01[axis] - g00[axis])
            + u * v * (g00[axis] - g10[axis] - g01[axis] + g11[axis])
    };
    let value = n00 + u * kx + v * ky + u * v * kxy;
    (value, [blend(0) + du * (kx + v * kxy), blend(1) + dv * (ky + u * kxy)])
}

/// Value noise on a line: value in [-1, 1] and derivative, at unit wavelength.
pub(crate) fn line_noise(t: f64, salt: u64) -> (f64, f64) {
    let cell = whole(t);
    let knot = |index: i32| 2.0 * unit_of(hash_cell([index, 0, 1], salt)) - 1.0;
    let (low, high) = (knot(cell), knot(cell + 1));
    let (u, du) = fade(t - f64::from(cell));
    (low + u * (high - low), du * (high - low))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gradients_are_those_of_the_values(x in -50f64..50., y in -50f64..50.) {
            let step = 1e-6;
            let at = |x: f64, y: f64| gradient_noise(x, y, 3).0;
            let (value, [gx, gy]) = gradient_noise(x, y, 3);
            prop_assert!(value.abs() <= 1.0);
            prop_assert!(((at(x + step, y) - at(x - step, y)) / (2.0 * step) - gx).abs() < 1e-5);
            prop_assert!(((at(x, y + step) - at(x, y - step)) / (2.0 * step) - gy).abs() < 1e-5);
            let slope = (line_noise(x + step, 3).0 - line_noise(x - step, 3).0) / (2.0 * step);
            prop_assert!((slope - line_noise(x, 3).1).abs() < 1e-5);
        }
    }
}

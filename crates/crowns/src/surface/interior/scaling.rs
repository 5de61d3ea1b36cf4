//! Second-order cones of up to four dimensions: the Nesterov-Todd scaling, products and steps.
//!
//! Notation of Vandenberghe, The CVXOPT linear and quadratic cone program solvers (2010), section 4:
//! W scales so that the slack and the multiplier become one vector, lambda = W^-1 kappa = W s. In one
//! dimension everything reduces to the positive half line.

/// Vectors of a cone; entries from its dimension on are 0.
pub(super) type Vec4 = [f64; 4];

pub(super) fn product(a: &Vec4, b: &Vec4) -> f64 {
    a[0] * b[0] + tails(a, b)
}

fn tails(a: &Vec4, b: &Vec4) -> f64 {
    a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

/// Square of the head less that of the tail, without cancellation.
pub(super) fn determinant(a: &Vec4) -> f64 {
    let tail = tails(a, a).sqrt();
    (a[0] - tail) * (a[0] + tail)
}

/// The vector whose Jordan product with `a` is that of the unit element with `size`.
pub(super) fn inverse(a: &Vec4, size: f64) -> Vec4 {
    let factor = size / determinant(a);
    [factor * a[0], -factor * a[1], -factor * a[2], -factor * a[3]]
}

/// Jordan product.
pub(super) fn jordan(a: &Vec4, b: &Vec4) -> Vec4 {
    let tail = |i: usize| a[0] * b[i] + b[0] * a[i];
    [product(a, b), tail(1), tail(2), tail(3)]
}

/// What has the Jordan product `d` with `a`.
pub(super) fn divide(d: &Vec4, a: &Vec4) -> Vec4 {
    let head = (a[0] * d[0] - tails(a, d)) / determinant(a);
    let tail = |i: usize| (d[i] - head * a[i]) / a[0];
    [head, tail(1), tail(2), tail(3)]
}

/// The largest step from inside the cone that stays in it.
pub(super) fn longest_step(from: &Vec4, step: &Vec4) -> f64 {
    let (a, c) = (step[0] * step[0] - tails(step, step), determinant(from));
    if tails(from, from) == 0.0 && tails(step, step) == 0.0 {
        return if step[0] < 0.0 { -from[0] / step[0] } else { f64::INFINITY };
    }
    let b = from[0] * step[0] - tails(from, step);
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return f64::INFINITY;
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    let positive = |root: f64| if root > 0.0 { root } else { f64::INFINITY };
    positive(q / a).min(positive(c / q))
}

/// A Nesterov-Todd scaling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scaling {
    /// The scaled vector lambda.
    pub(super) lambda: Vec4,
    /// Unit vector of the scaling point.
    point: Vec4,
    eta: f64,
}

impl Scaling {
    /// The scaling of a slack and a multiplier, both inside the cone.
    pub(super) fn new(kappa: &Vec4, s: &Vec4) -> Self {
        let (root_k, root_s) = (determinant(kappa).sqrt(), determinant(s).sqrt());
        let (k, s_unit) = (kappa.map(|v| v / root_k), s.map(|v| v / root_s));
        let gamma = (0.5 * (1.0 + product(&k, &s_unit))).sqrt();
        let point: Vec4 = std::array::from_fn(|i| {
            let mirrored = if i == 0 { s_unit[i] } else { -s_unit[i] };
            (k[i] + mirrored) / (2.0 * gamma)
        });
        let mut scaling = Self { lambda: [0.0; 4], point, eta: (root_k / root_s).sqrt() };
        scaling.lambda = scaling.apply(s);
        scaling
    }

    /// W times a vector.
    pub(super) fn apply(&self, v: &Vec4) -> Vec4 {
        self.turn(v, 1.0).map(|value| self.eta * value)
    }

    /// W^-1 times a vector.
    pub(super) fn undo(&self, v: &Vec4) -> Vec4 {
        self.turn(v, -1.0).map(|value| value / self.eta)
    }

    fn turn(&self, v: &Vec4, sign: f64) -> Vec4 {
        let along = sign * tails(&self.point, v);
        let factor = sign * (v[0] + along / (1.0 + self.point[0]));
        let tail = |i: usize| v[i] + factor * self.point[i];
        [self.point[0] * v[0] + along, tail(1), tail(2), tail(3)]
    }

    /// The vector g and the factor f for which W^-2 = f (2 g g' - J).
    pub(super) fn inverse_square(&self) -> (Vec4, f64) {
        let [head, a, b, c] = self.point;
        ([head, -a, -b, -c], 1.0 / (self.eta * self.eta))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn inside(tail: [f64; 3], above: f64) -> Vec4 {
        let [a, b, c] = tail;
        [(a * a + b * b + c * c).sqrt() + above, a, b, c]
    }

    fn near(a: &Vec4, b: &Vec4) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + a.abs()))
    }

    proptest! {
        #[test]
        fn slack_and_multiplier_become_one(
            k in prop::array::uniform3(-3.0f64..3.0), s in prop::array::uniform3(-3.0f64..3.0),
            above in prop::array::uniform2(0.05f64..4.0),
        ) {
            let (kappa, s) = (inside(k, above[0]), inside(s, above[1]));
            let scaling = Scaling::new(&kappa, &s);
            prop_assert!(near(&scaling.lambda, &scaling.undo(&kappa)));
            prop_assert!(near(&scaling.undo(&scaling.apply(&s)), &s));
            let (g, f) = scaling.inverse_square();
            let twice = scaling.undo(&scaling.undo(&kappa));
            let along = 2.0 * product(&g, &kappa);
            let mirrored = [kappa[0], -kappa[1], -kappa[2], -kappa[3]];
            let direct: Vec4 = std::array::from_fn(|i| f * (along * g[i] - mirrored[i]));
            prop_assert!(near(&twice, &direct));
            let unit = jordan(&kappa, &inverse(&kappa, 2.0));
            prop_assert!(near(&unit, &[2.0, 0.0, 0.0, 0.0]));
            prop_assert!(near(&divide(&jordan(&kappa, &s), &kappa), &s));
        }

        #[test]
        fn the_longest_step_ends_on_the_boundary(
            k in prop::array::uniform3(-3.0f64..3.0), above in 0.05f64..4.0,
            step in prop::array::uniform4(-3.0f64..3.0),
        ) {
            let kappa = inside(k, above);
            let length = longest_step(&kappa, &step);
            let at = |t: f64| -> Vec4 { std::array::from_fn(|i| kappa[i] + t * step[i]) };
            if length.is_finite() {
                prop_assert!(determinant(&at(length)).abs() < 1e-7 * (1.0 + length * length * 100.0));
                prop_assert!(determinant(&at(0.99 * length)) > 0.0);
            } else {
                prop_assert!(determinant(&at(1e4)) > 0.0);
            }
        }
    }

    #[test]
    fn one_dimension_is_the_half_line() {
        let scaling = Scaling::new(&[4.0, 0.0, 0.0, 0.0], &[9.0, 0.0, 0.0, 0.0]);
        assert!((scaling.lambda[0] - 6.0).abs() < 1e-12);
        assert_eq!(longest_step(&[4.0, 0.0, 0.0, 0.0], &[-2.0, 0.0, 0.0, 0.0]), 2.0);
        assert_eq!(longest_step(&[4.0, 0.0, 0.0, 0.0], &[2.0, 0.0, 0.0, 0.0]), f64::INFINITY);
    }
}

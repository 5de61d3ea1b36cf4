//! Bounds on the shape of a paraboloid.

use crate::Error;

/// Bounds on the semiaxes (the radii one metre below the apex) of an L1 paraboloid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AxisBounds {
    /// The smallest and the largest semiaxis that are allowed, exactly. Both are convex constraints:
    /// with t = -(phi0 + phi1) and d the length of (phi0 - phi1, phi2), the largest semiaxis is at most
    /// A where d <= t - 2/A², the smallest at least a where t + d <= 2/a².
    Exact {
        /// Smallest semiaxis, m.
        smallest_m: f64,
        /// Largest semiaxis, m.
        largest_m: f64,
    },
    /// Constraint C4 of Polewski et al., |(phi0 - phi1, phi2, mu)| <= -(phi0 + phi1), with mu from
    /// their equation 15. It grows with omega, so that the sets of allowed surfaces are not nested.
    Paper {
        /// b_max of equation 15, m.
        largest_m: f64,
    },
}

impl Default for AxisBounds {
    /// 0.1 m (a needle) to 3 m, the largest axis of Polewski et al., section 6.
    fn default() -> Self {
        Self::Exact { smallest_m: 0.1, largest_m: 3.0 }
    }
}

/// Bounds as the cones need them, in any unit of curvature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Limits {
    /// Largest |(phi0 - phi1, phi2)| / -(phi0 + phi1).
    pub(super) omega: f64,
    /// Smallest difference of t and d.
    pub(super) least: f64,
    /// Largest sum of t and d.
    pub(super) most: f64,
    /// mu of C4; 0 without.
    pub(super) mu: f64,
}

impl Limits {
    /// The limits in 1/m.
    pub(super) fn new(bounds: AxisBounds, omega: f64) -> Result<Self, Error> {
        if !(0.0..=1.0).contains(&omega) {
            return Err(Error::Omega(omega));
        }
        match bounds {
            AxisBounds::Exact { smallest_m: smallest, largest_m: largest } => {
                if !(smallest > 0.0 && smallest < largest && largest.is_finite()) {
                    return Err(Error::AxisBounds { smallest, largest });
                }
                let [least, most] = [largest, smallest].map(|axis| 2.0 / (axis * axis));
                Ok(Self { omega, least, most, mu: 0.0 })
            }
            AxisBounds::Paper { largest_m } => {
                if !(largest_m > 0.0 && largest_m.is_finite() && omega < 1.0) {
                    return Err(Error::PaperBound { largest: largest_m, omega });
                }
                let mu = 2.0 / (largest_m * largest_m) * ((1.0 + omega) / (1.0 - omega)).sqrt();
                Ok(Self { omega, least: 0.0, most: f64::INFINITY, mu })
            }
        }
    }

    /// The same in other units: curvatures there are `factor` times those here.
    pub(super) fn scaled(self, factor: f64) -> Self {
        let Self { omega, least, most, mu } = self;
        Self { omega, least: least * factor, most: most * factor, mu: mu * factor }
    }

    /// The largest imbalance that all bounds together allow, below 1.
    pub(super) fn largest_imbalance(&self) -> f64 {
        if self.most.is_finite() {
            self.omega.min((self.most - self.least) / (self.most + self.least))
        } else {
            self.omega
        }
    }

    /// Range of t for surfaces with equal axes.
    pub(super) fn equal_axes(&self) -> [f64; 2] {
        [self.least.max(self.mu), self.most]
    }

    /// The nearest curvatures that satisfy all limits exactly: only for what rounding left over.
    pub(super) fn project(&self, [phi0, phi1, phi2]: [f64; 3]) -> [f64; 3] {
        let [low, high] = self.equal_axes();
        let trace = (-(phi0 + phi1)).clamp(low, high);
        let difference = phi0 - phi1;
        let size = (difference * difference + phi2 * phi2).sqrt();
        let most = self.largest_difference(trace);
        let shrink = if size > most { most / size } else { 1.0 };
        let half = 0.5 * difference * shrink;
        [half - 0.5 * trace, -half - 0.5 * trace, phi2 * shrink]
    }

    /// The largest |(phi0 - phi1, phi2)| for a given t.
    fn largest_difference(&self, trace: f64) -> f64 {
        let paper = (trace * trace - self.mu * self.mu).max(0.0).sqrt();
        let bounded = (trace - self.least).min(self.most - trace).min(self.omega * trace);
        bounded.min(paper).max(0.0)
    }

    /// Which limits hold with equality: on the axes, on the imbalance.
    pub(super) fn active(&self, [phi0, phi1, phi2]: [f64; 3]) -> [bool; 2] {
        /// Relative distance below which a limit is taken as reached: that of the solvers' results.
        const TIGHT: f64 = 1e-6;
        let (trace, difference) = (-(phi0 + phi1), phi0 - phi1);
        let size = (difference * difference + phi2 * phi2).sqrt();
        let near = |value: f64, limit: f64| (value - limit).abs() <= TIGHT * trace;
        let paper = (size * size + self.mu * self.mu).sqrt();
        let axes = near(trace - size, self.least)
            || near(trace + size, self.most)
            || (self.mu > 0.0 && near(paper, trace));
        let imbalance = self.omega > 0.0 && self.omega < 1.0 && near(size, self.omega * trace);
        [axes, imbalance]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exact_bounds_are_those_of_the_semiaxes() {
        let bounds = AxisBounds::Exact { smallest_m: 0.5, largest_m: 2.0 };
        let limits = Limits::new(bounds, 1.0).unwrap();
        // A surface with the semiaxes 2 and 0.5 along x and y: -x²/4 - 4y².
        assert_eq!(limits.active([-0.25, -4.0, 0.0]), [true, false]);
        assert_eq!(limits.project([-0.25, -4.0, 0.0]), [-0.25, -4.0, 0.0]);
        let [a, b, c] = limits.project([-0.2, -4.4, 0.0]);
        assert!(a <= -0.25 + 1e-12 && b >= -4.0 - 1e-12 && c == 0.0);
        assert!((limits.largest_imbalance() - 3.75 / 4.25).abs() < 1e-12);
    }

    #[test]
    fn equation_15() {
        let limits = Limits::new(AxisBounds::Paper { largest_m: 3.0 }, 0.2).unwrap();
        assert!((limits.mu - 2.0 / 9.0 * (1.2f64 / 0.8).sqrt()).abs() < 1e-15);
        let error = Limits::new(AxisBounds::Paper { largest_m: 3.0 }, 1.0).unwrap_err();
        assert!(matches!(error, Error::PaperBound { .. }));
    }
}

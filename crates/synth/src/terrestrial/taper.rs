//! How thick wood is along its axis.

/// Length over which the swelling of a stem's foot fades by a factor of e, m.
const FLARE_M: f64 = 0.35;
/// Where diameters are measured, m.
const BREAST_HEIGHT_M: f64 = 1.3;
/// Radius of the thinnest wood, m.
pub(crate) const TIP_RADIUS_M: f64 = 0.002;

/// Taper of a stem: `d(h) = DBH ((H - h) / (H - 1.3))^p` (Ormerod 1973, A simple bole model, The
/// Forestry Chronicle 49, 136-138), with a swelling that fades from the foot upwards and adds nothing
/// at breast height. Exact at breast height.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StemTaper {
    pub(crate) breast_radius_m: f64,
    pub(crate) length_m: f64,
    pub(crate) exponent: f64,
    pub(crate) flare: f64,
}

impl StemTaper {
    /// Radius at a distance from the foot along the axis, m.
    pub(crate) fn radius_m(&self, along_m: f64) -> f64 {
        let share = (self.length_m - along_m).max(0.0) / (self.length_m - BREAST_HEIGHT_M);
        let bole = self.breast_radius_m * libm::pow(share, self.exponent);
        let fading = |at: f64| libm::exp(-at / FLARE_M);
        let swelling = self.flare * (fading(along_m) - fading(BREAST_HEIGHT_M)).max(0.0);
        (bole * (1.0 + swelling)).max(TIP_RADIUS_M)
    }
}

/// Taper of a branch: from its first radius to that of a tip, a little slower than a cone at first.
pub(crate) fn branch_radius_m(first_m: f64, share: f64) -> f64 {
    let tip = TIP_RADIUS_M.min(first_m);
    tip + (first_m - tip) * libm::pow((1.0 - share).max(0.0), 0.9)
}

/// Radius of what leaves an axis between two places: the pipe model (Shinozaki et al. 1964, A
/// quantitative analysis of plant form: the pipe model theory, Japanese Journal of Ecology 14), after
/// which the sum of the cross-sections stays, as Leonardo da Vinci wrote (exponent 2; Minamino and
/// Tateno 2014, PLoS ONE 9, e93535).
pub(crate) fn leaving_radius_m(before_m: f64, after_m: f64) -> f64 {
    (before_m * before_m - after_m * after_m).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_at_breast_height_and_never_thicker_above() {
        let taper = StemTaper { breast_radius_m: 0.15, length_m: 24.0, exponent: 0.75, flare: 0.3 };
        assert!((taper.radius_m(1.3) - 0.15).abs() < 1e-12);
        let radii: Vec<f64> = (0..=240).map(|i| taper.radius_m(f64::from(i) * 0.1)).collect();
        assert!(radii.windows(2).all(|pair| pair[1] <= pair[0]));
        assert!(radii[0] > 0.18 && radii[240] == TIP_RADIUS_M);
    }

    #[test]
    fn cross_sections_are_shared() {
        assert!((leaving_radius_m(0.05, 0.04) - 0.03).abs() < 1e-12);
        assert_eq!(leaving_radius_m(0.01, 0.02), 0.0);
    }
}

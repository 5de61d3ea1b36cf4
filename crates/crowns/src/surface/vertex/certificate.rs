//! The proof that a vertex is optimal.

use super::super::dense::dot;
use super::descent::Descent;

/// An objective and a bound that no feasible point beats.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Certificate {
    pub(super) objective: f64,
    pub(super) lower_bound: f64,
    /// Sum of the weighted sizes of the heights.
    pub(super) magnitude: f64,
}

impl<const K: usize> Descent<'_, K> {
    /// The objective at `x`, and the bound that the multipliers of the vertex prove.
    ///
    /// The bound is that of [`super::super::dual::Dual::bound`], whose repair is not needed here: the
    /// equations hold to rounding, and what is left of them is charged in the same way.
    pub(super) fn certificate(&self, x: &[f64; K]) -> Certificate {
        let (mut objective, mut magnitude, mut value) = (0.0, 0.0, 0.0);
        let mut rho = [0.0; K];
        let mut add = |normal: &[f64; K], level: f64, y: f64| {
            value -= level * y;
            rho.iter_mut().zip(normal).for_each(|(sum, d)| *sum += d * y);
        };
        for (row, &y) in self.program.rows.iter().zip(&self.scratch.signed) {
            objective += row.w * (dot(&row.d, x) - row.z).abs();
            magnitude += row.w * row.z.abs();
            add(&row.d, row.z, y);
        }
        for (&item, multiplier) in self.basis.iter().zip(self.multipliers()) {
            if let Some(row) = self.program.rows.get(item) {
                add(&row.d, row.z, multiplier.clamp(-row.w, row.w));
            } else if self.is_bound(item) {
                add(&self.normal(item), self.level(item), multiplier.min(0.0));
            }
        }
        let lower_bound = (value - self.program.charge(&rho, objective, magnitude)).min(objective);
        Certificate { objective, lower_bound, magnitude }
    }
}

//! The tie-break: of all optimal surfaces that of the smallest weighted sum of squares.

use super::super::dense::{Cholesky, add_outer, dot};
use super::descent::{Descent, ROUNDING};
use super::nearest::{Half, nearest};

impl<const K: usize> Descent<'_, K> {
    /// Whether no other point is optimal: all multipliers are away from their limits.
    pub(super) fn is_unique(&self) -> bool {
        let multipliers = self.multipliers();
        (0..K).all(|place| !self.is_loose(place, multipliers[place]))
    }

    /// Whether a multiplier is at its limit: the member may leave without a rise of the objective.
    fn is_loose(&self, place: usize, multiplier: f64) -> bool {
        let (excess, noise) = self.excess(place, multiplier);
        excess >= -noise
    }

    /// The optimal point of the smallest weighted sum of squares.
    ///
    /// A point is optimal exactly if it agrees with the multipliers (complementary slackness): members
    /// of the basis stay as they are unless their multiplier is at its limit, those then may move to
    /// its side, and every other row stays on its side. What may move spans the face.
    pub(super) fn middle_of_face(&self) -> Option<[f64; K]> {
        let multipliers = self.multipliers();
        let mut edges = [[0.0; K]; K];
        let mut halves = Vec::new();
        let mut count = 0;
        for place in (0..K).filter(|&place| self.is_loose(place, multipliers[place])) {
            let direction = f64::copysign(1.0, multipliers[place]);
            let direction = if self.is_bound(self.basis[place]) { 1.0 } else { direction };
            edges[count] = std::array::from_fn(|i| direction * self.inverse[i][place]);
            if !self.is_artificial(self.basis[place]) {
                let normal = std::array::from_fn(|k| f64::from(u8::from(k == count)));
                halves.push(Half { normal, shift: 0.0, tiny: ROUNDING });
            }
            count += 1;
        }
        self.sides(&edges, &mut halves);
        let (metric, lowest) = self.squares(&edges, count)?;
        let t = nearest(&metric, lowest, &halves)?;
        let x = self.point();
        Some(std::array::from_fn(|i| x[i] + (0..count).map(|k| t[k] * edges[k][i]).sum::<f64>()))
    }

    /// Every row and bound outside the basis stays on its side.
    fn sides(&self, edges: &[[f64; K]; K], halves: &mut Vec<Half<K>>) {
        for at in 0..self.scratch.signed.len() {
            let side = self.scratch.signed[at];
            if side != 0.0 {
                let (normal, side) = (self.normal(at), f64::copysign(1.0, side));
                let shift = side * self.scratch.residual[at];
                let normal = edges.map(|edge| side * dot(&normal, &edge));
                halves.push(Half { normal, shift, tiny: self.tiny(at) });
            }
        }
    }

    /// The sum of squares over the face: its factorised second derivative and where it is lowest.
    /// Directions that are not used stay at nought.
    fn squares(&self, edges: &[[f64; K]; K], count: usize) -> Option<(Cholesky<K>, [f64; K])> {
        let (mut gram, mut rhs) = ([[0.0; K]; K], [0.0; K]);
        for (row, residual) in self.program.rows.iter().zip(&self.scratch.residual) {
            let along = edges.map(|edge| dot(&row.d, &edge));
            add_outer(&mut gram, &along, row.w);
            rhs.iter_mut().zip(along).for_each(|(sum, a)| *sum -= row.w * residual * a);
        }
        (count..K).for_each(|k| gram[k][k] = 1.0);
        let metric = Cholesky::new(&gram)?;
        Some((metric, metric.solve(&rhs)))
    }
}

//! The state of the vertex descent.

use super::super::dense::dot;
use super::super::program::Program;
use super::Scratch;
use super::step::invert;

/// Share of the terms of a sum below which it counts as nought.
pub(super) const ROUNDING: f64 = 1e-13;

/// A vertex of the program and what is known about it.
///
/// Rows, bounds and the artificial rows of the start (the unknowns themselves, of no weight) are
/// numbered through in this order.
pub(super) struct Descent<'a, const K: usize> {
    pub(super) program: &'a Program<K>,
    pub(super) scratch: &'a mut Scratch,
    /// Values of the artificial rows: the start.
    origin: [f64; K],
    pub(super) basis: [usize; K],
    /// The basis of the start.
    first: [usize; K],
    /// Column `k` is the edge along which member `k` of the basis grows at rate 1.
    pub(super) inverse: [[f64; K]; K],
    /// Of the rows outside the basis, each on its side.
    pub(super) gradient: [f64; K],
    /// Sum of the sizes of what `gradient` sums up.
    terms: [f64; K],
    /// Largest size of each column of the design.
    pub(super) widest: [f64; K],
}

impl<'a, const K: usize> Descent<'a, K> {
    pub(super) fn new(program: &'a Program<K>, origin: [f64; K], scratch: &'a mut Scratch) -> Self {
        let (mut terms, mut widest) = ([0.0; K], [0.0f64; K]);
        let mut highest = 0.0f64;
        for row in &program.rows {
            for k in 0..K {
                terms[k] += row.w * row.d[k].abs();
                widest[k] = widest[k].max(row.d[k].abs());
            }
            highest = highest.max(row.z.abs());
        }
        let size: f64 = (0..K).map(|k| widest[k] * origin[k].abs()).sum();
        scratch.tiny.clear();
        scratch.tiny.push(ROUNDING * (size + highest));
        for cone in &program.cones {
            let size: f64 = (0..K).map(|k| (cone.rows[0][k] * origin[k]).abs()).sum();
            scratch.tiny.push(ROUNDING * (size + cone.shift[0].abs()));
        }
        scratch.signed.clear();
        scratch.signed.extend(program.rows.iter().map(|row| row.w));
        scratch.signed.resize(program.rows.len() + program.cones.len(), f64::INFINITY);
        let first = program.rows.len() + program.cones.len();
        let basis = std::array::from_fn(|k| first + k);
        let inverse = std::array::from_fn(|i| std::array::from_fn(|k| f64::from(u8::from(i == k))));
        let (first, gradient) = (basis, [0.0; K]);
        Self { program, scratch, origin, basis, first, inverse, gradient, terms, widest }
    }

    /// Starts at another basis; `None` if that is singular or its vertex violates a bound.
    pub(super) fn start_at(&mut self, basis: &[usize; K]) -> Option<()> {
        self.inverse = invert(basis.map(|item| self.normal(item)))?;
        (self.basis, self.first) = (*basis, *basis);
        let x = self.point();
        let bounds = self.program.cones.iter().zip(&self.scratch.tiny[1..]);
        for (cone, tiny) in bounds {
            if cone.at(&x)[0] < -tiny {
                return None;
            }
        }
        for &item in basis {
            if let Some(signed) = self.scratch.signed.get_mut(item) {
                *signed = 0.0;
            }
        }
        Some(())
    }

    /// Rank of an item's infinitesimal, 0 being the largest: those of the first basis are smallest.
    pub(super) fn rank(&self, item: usize) -> usize {
        let place = self.first.iter().position(|&first| first == item);
        place.map_or(item, |place| usize::MAX - place)
    }

    pub(super) fn rows(&self) -> usize {
        self.program.rows.len()
    }

    pub(super) fn is_bound(&self, item: usize) -> bool {
        (self.rows()..self.rows() + self.program.cones.len()).contains(&item)
    }

    pub(super) fn is_artificial(&self, item: usize) -> bool {
        item >= self.rows() + self.program.cones.len()
    }

    /// The row, bound or unit vector with a number.
    pub(super) fn normal(&self, item: usize) -> [f64; K] {
        let n = self.rows();
        if let Some(row) = self.program.rows.get(item) {
            return row.d;
        }
        if let Some(cone) = self.program.cones.get(item - n) {
            return cone.rows[0];
        }
        let unit = item - n - self.program.cones.len();
        std::array::from_fn(|k| f64::from(u8::from(k == unit)))
    }

    /// The value that the normal times the unknowns has in the basis.
    pub(super) fn level(&self, item: usize) -> f64 {
        let n = self.rows();
        if let Some(row) = self.program.rows.get(item) {
            return row.z;
        }
        if let Some(cone) = self.program.cones.get(item - n) {
            return -cone.shift[0];
        }
        self.origin[item - n - self.program.cones.len()]
    }

    /// Size of a residual or slack that counts as nought.
    pub(super) fn tiny(&self, item: usize) -> f64 {
        self.scratch.tiny[(1 + item).saturating_sub(self.rows())]
    }

    /// The point where the basis holds with equality.
    pub(super) fn point(&self) -> [f64; K] {
        let levels: [f64; K] = std::array::from_fn(|k| self.level(self.basis[k]));
        let first: [f64; K] = std::array::from_fn(|i| dot(&self.inverse[i], &levels));
        let open: [f64; K] =
            std::array::from_fn(|k| levels[k] - dot(&self.normal(self.basis[k]), &first));
        std::array::from_fn(|i| first[i] + dot(&self.inverse[i], &open))
    }

    /// Residuals, sides and gradient anew from the basis.
    pub(super) fn refresh(&mut self) {
        let x = self.point();
        let Scratch { residual, signed, along, tiny, .. } = &mut *self.scratch;
        residual.clear();
        self.gradient = [0.0; K];
        for (row, signed) in self.program.rows.iter().zip(signed.iter_mut()) {
            let value = dot(&row.d, &x) - row.z;
            let wrong = value * *signed < 0.0 && value.abs() > tiny[0];
            *signed = if wrong { -*signed } else { *signed };
            residual.push(if value.abs() > tiny[0] { value } else { 0.0 });
            self.gradient.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum += *signed * d);
        }
        for (cone, &tiny) in self.program.cones.iter().zip(&tiny[1..]) {
            let value = dot(&cone.rows[0], &x) + cone.shift[0];
            residual.push(if value > tiny { value } else { 0.0 });
        }
        along.clear();
        along.resize(residual.len(), 0.0);
    }

    /// Multipliers of the basis: `basis' * multipliers = -gradient`.
    pub(super) fn multipliers(&self) -> [f64; K] {
        std::array::from_fn(|k| -(0..K).map(|i| self.gradient[i] * self.inverse[i][k]).sum::<f64>())
    }

    /// By how much the objective changes when the values of the rows do: the sum of these changes
    /// times the multipliers.
    pub(super) fn sensitivity(&self, change: impl Fn(usize) -> f64) -> f64 {
        let sides = &self.scratch.signed[..self.rows()];
        let outside: f64 = sides.iter().zip(0..).map(|(side, row)| side * change(row)).sum();
        let members = self.basis.iter().zip(self.multipliers());
        let rows = members.filter(|(item, _)| **item < self.rows());
        outside + rows.map(|(&row, multiplier)| multiplier * change(row)).sum::<f64>()
    }

    /// Rounding of the multiplier of a member.
    fn noise(&self, place: usize) -> f64 {
        8.0 * f64::EPSILON
            * (0..K).map(|i| self.terms[i] * self.inverse[i][place].abs()).sum::<f64>()
    }

    /// By how much a multiplier exceeds what an optimum allows, and by how much it may do so by
    /// rounding. Within that it is at its limit.
    pub(super) fn excess(&self, place: usize, multiplier: f64) -> (f64, f64) {
        let (item, noise) = (self.basis[place], self.noise(place));
        match self.program.rows.get(item) {
            Some(row) => (multiplier.abs() - row.w, noise + 1e-12 * row.w),
            None if self.is_bound(item) => (multiplier, noise),
            None => (multiplier.abs(), noise),
        }
    }
}

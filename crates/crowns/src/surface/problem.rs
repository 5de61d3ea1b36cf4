//! What is to be fitted, and the checks of its numbers.

use crate::Error;

/// Box for the centre: the position prior (Polewski et al., constraint C5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Middle of the box, m.
    pub centre: [f64; 2],
    /// Half its edge, m; 0 fixes the centre.
    pub half_width_m: f64,
}

impl Prior {
    /// Lower and upper corner of the box, m.
    #[must_use]
    pub fn corners(&self) -> [[f64; 2]; 2] {
        [-1.0, 1.0].map(|sign| self.centre.map(|middle| middle + sign * self.half_width_m))
    }

    /// The position of the box that is nearest to the given one.
    #[must_use]
    pub fn nearest(&self, position: [f64; 2]) -> [f64; 2] {
        let [low, high] = self.corners();
        [0, 1].map(|axis| position[axis].clamp(low[axis], high[axis]))
    }
}

/// The cells of a crown. Positions are in any one frame; near the crown is best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Problem<'a> {
    /// Cells of the thinned crown: centre x, y and highest z, m.
    pub cells: &'a [[f64; 3]],
    /// What each cell weighs; all the same without. Cells of weight 0 do not count at all.
    pub weights: Option<&'a [f64]>,
    /// Box for the centre, if there is a prior. Only L1 surfaces heed it.
    pub prior: Option<Prior>,
}

/// A cell that counts: x, y, z and its weight.
pub(super) type Cell = [f64; 4];

impl<'a> Problem<'a> {
    /// Cells of equal weight, without a prior.
    #[must_use]
    pub fn new(cells: &'a [[f64; 3]]) -> Self {
        Self { cells, weights: None, prior: None }
    }

    /// The same with weights, one for each cell.
    #[must_use]
    pub fn with_weights(self, weights: &'a [f64]) -> Self {
        Self { weights: Some(weights), ..self }
    }

    /// The same with a box for the centre.
    #[must_use]
    pub fn with_prior(self, prior: Prior) -> Self {
        Self { prior: Some(prior), ..self }
    }

    /// Checks the numbers and returns the cells that count.
    pub(super) fn check(&self) -> Result<Vec<Cell>, Error> {
        if let Some(prior) = &self.prior {
            let sound = prior.centre.iter().all(|value| value.is_finite());
            if !(sound && prior.half_width_m >= 0.0 && prior.half_width_m.is_finite()) {
                return Err(Error::Prior { centre: prior.centre, half_width: prior.half_width_m });
            }
        }
        let weights = self.checked_weights()?;
        let mut cells = Vec::with_capacity(self.cells.len());
        for (index, &[x, y, z]) in self.cells.iter().enumerate() {
            for (value, axis) in [(x, 'x'), (y, 'y'), (z, 'z')] {
                if !value.is_finite() {
                    return Err(Error::NotFinite { index, axis, value });
                }
            }
            let weight = weights.map_or(1.0, |weights| weights[index]);
            if weight > 0.0 {
                cells.push([x, y, z, weight]);
            }
        }
        if cells.is_empty() { Err(Error::NoCells) } else { Ok(cells) }
    }

    fn checked_weights(&self) -> Result<Option<&[f64]>, Error> {
        let Some(weights) = self.weights else { return Ok(None) };
        if weights.len() != self.cells.len() {
            let (cells, weights) = (self.cells.len(), weights.len());
            return Err(Error::WeightCount { cells, weights });
        }
        let unsound = |weight: &f64| !(weight.is_finite() && *weight >= 0.0);
        match weights.iter().position(unsound) {
            Some(index) => Err(Error::Weight { index, value: weights[index] }),
            None => Ok(Some(weights)),
        }
    }
}

/// Position of the highest cell, the first of equals.
pub(super) fn highest(cells: &[Cell]) -> [f64; 2] {
    let higher = |best: Cell, cell: &Cell| if cell[2] > best[2] { *cell } else { best };
    let [x, y, ..] = cells.iter().fold([0.0, 0.0, f64::NEG_INFINITY, 0.0], higher);
    [x, y]
}

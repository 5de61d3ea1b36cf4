//! The steps of the vertex descent.

use super::super::dense::dot;
use super::Scratch;
use super::descent::{Descent, ROUNDING};
use super::search::{Break, crossing};

/// Steps after which the descent gives up; crowns take 5 to 40.
const MAX_STEPS: u32 = 500;

/// A member of the basis, the direction in which it leaves and the slope of the objective there.
#[derive(Debug, Clone, Copy)]
struct Leaving {
    place: usize,
    direction: f64,
    slope: f64,
}

impl<const K: usize> Descent<'_, K> {
    /// Descends to an optimal vertex; the number of steps.
    pub(super) fn run(&mut self) -> Option<u32> {
        self.refresh();
        let mut fresh = true;
        for steps in 0..MAX_STEPS {
            if let Some(leaving) = self.leaving() {
                self.step(&leaving)?;
                fresh = false;
            } else if fresh {
                return Some(steps);
            } else {
                self.refresh();
                fresh = true;
            }
        }
        None
    }

    /// The member whose edge descends most steeply.
    fn leaving(&self) -> Option<Leaving> {
        let multipliers = self.multipliers();
        let (mut best, mut steepest) = (None, 0.0);
        for place in 0..K {
            let (excess, noise) = self.excess(place, multipliers[place]);
            let square: f64 = (0..K).map(|i| self.inverse[i][place] * self.inverse[i][place]).sum();
            if excess > noise && excess * excess > steepest * square {
                steepest = excess * excess / square;
                let direction = f64::copysign(1.0, multipliers[place]);
                best = Some(Leaving { place, direction, slope: -excess });
            }
        }
        best
    }

    /// Moves along an edge to its lowest point.
    fn step(&mut self, leaving: &Leaving) -> Option<()> {
        let edge = std::array::from_fn(|i| leaving.direction * self.inverse[i][leaving.place]);
        let count = self.look_along(&edge);
        let points = &mut self.scratch.points[..count];
        let t = crossing(points, leaving.slope, |a, b| a < b)?;
        let slope = leaving.slope + self.advance(t);
        let entering = self.entering(slope)?;
        self.exchange(leaving, entering)
    }

    /// Finds where residuals and slacks become nought along an edge; how many do.
    fn look_along(&mut self, edge: &[f64; K]) -> usize {
        let n = self.rows();
        let Scratch { residual, signed, along, points, .. } = &mut *self.scratch;
        points.resize(residual.len(), Break::default());
        let mut count = 0;
        // Without branches: whether a residual shrinks is as good as random.
        let mut note = |residual: f64, signed: f64, along: &mut f64, change: f64, noise: f64| {
            let change = if change.abs() > noise { change } else { 0.0 };
            *along = change;
            let (t, rise) = (-residual / change, -2.0 * signed * change);
            points[count] = Break { key: if t > 0.0 { t } else { 0.0 }, rise };
            count += usize::from(rise > 0.0);
        };
        let noise = ROUNDING * (0..K).map(|k| edge[k].abs() * self.widest[k]).sum::<f64>();
        let lanes = residual.iter().zip(signed.iter()).zip(along.iter_mut());
        for (row, ((residual, signed), along)) in self.program.rows.iter().zip(lanes) {
            note(*residual, *signed, along, dot(&row.d, edge), noise);
        }
        for (cone, at) in self.program.cones.iter().zip(n..) {
            let noise = ROUNDING * size(edge) * size(&cone.rows[0]);
            note(residual[at], signed[at], &mut along[at], dot(&cone.rows[0], edge), noise);
        }
        count
    }

    /// Moves all residuals, turns the rows that are passed and collects those that are reached.
    /// Returns by how much the slope has risen.
    fn advance(&mut self, t: f64) -> f64 {
        let n = self.rows();
        let Scratch { residual, signed, along, tiny, tied, met, .. } = &mut *self.scratch;
        let mut rise = 0.0;
        met.resize(residual.len(), 0);
        let mut count = 0;
        let lanes = residual.iter_mut().zip(signed.iter()).zip(along.iter());
        for (at, ((residual, signed), along)) in lanes.enumerate() {
            *residual += t * along;
            met[count] = at;
            let near = tiny[(1 + at).saturating_sub(n)];
            let beyond = *residual * f64::copysign(1.0, *signed) <= near;
            count += usize::from(beyond & (signed * along < 0.0));
        }
        tied.clear();
        for &at in &met[..count] {
            if at >= n || residual[at].abs() <= tiny[0] {
                residual[at] = 0.0;
                tied.push(at);
            } else {
                rise -= 2.0 * signed[at] * along[at];
                signed[at] = -signed[at];
                add(&mut self.gradient, &self.program.rows[at].d, 2.0 * signed[at]);
            }
        }
        rise
    }

    /// Turns a row to its other side.
    fn turn(&mut self, at: usize) {
        self.scratch.signed[at] = -self.scratch.signed[at];
        let (turn, d) = (2.0 * self.scratch.signed[at], self.program.rows[at].d);
        self.gradient.iter_mut().zip(&d).for_each(|(sum, d)| *sum += turn * d);
    }

    /// The row or bound that enters among those reached, turning those of them that come before it.
    fn entering(&mut self, slope: f64) -> Option<usize> {
        if let [only] = self.scratch.tied[..] {
            return Some(only);
        }
        let mut points: Vec<Break<usize>> = Vec::with_capacity(self.scratch.tied.len());
        for &at in &self.scratch.tied {
            let (signed, along) = (self.scratch.signed[at], self.scratch.along[at]);
            points.push(Break { key: at, rise: -2.0 * signed * along });
        }
        let order = self.order();
        let before = |a: &usize, b: &usize| a != b && self.sooner(&order, *a, *b);
        let entering = crossing(&mut points, slope, before)?;
        self.turn_before(&order, entering);
        Some(entering)
    }

    /// Turns those of the rows reached that come before an item.
    fn turn_before(&mut self, order: &[usize; K], item: usize) {
        for place in 0..self.scratch.tied.len() {
            let at = self.scratch.tied[place];
            if at != item && at < self.rows() && self.sooner(order, at, item) {
                self.turn(at);
            }
        }
    }

    /// The places of the basis in the order of their infinitesimals.
    fn order(&self) -> [usize; K] {
        let mut order = std::array::from_fn(|k| k);
        order.sort_unstable_by_key(|&place| self.rank(self.basis[place]));
        order
    }

    /// Whether of two items that the edge reaches at the same place the infinitesimals put `a` first.
    ///
    /// Residual `i` is raised by `e_i`, which moves the vertex, so that item `i` with the shares
    /// `s = normal_i * inverse` is reached at `t + (sum_k s_k e_k - e_i) / along_i`.
    fn sooner(&self, order: &[usize; K], a: usize, b: usize) -> bool {
        let shares = |item: usize| -> [f64; K] {
            let (normal, along) = (self.normal(item), self.scratch.along[item]);
            std::array::from_fn(|k| {
                (0..K).map(|i| normal[i] * self.inverse[i][k]).sum::<f64>() / along
            })
        };
        let (of_a, of_b) = (shares(a), shares(b));
        let rounding = 1e-9 * size(&of_a).max(size(&of_b));
        let next = if self.rank(a) < self.rank(b) { a } else { b };
        for &place in order {
            if self.rank(next) < self.rank(self.basis[place]) {
                break;
            }
            let (of_a, of_b) = (of_a[place], of_b[place]);
            if (of_a - of_b).abs() > rounding {
                return of_a < of_b;
            }
        }
        if next == a { self.scratch.along[a] > 0.0 } else { self.scratch.along[b] < 0.0 }
    }

    /// Puts an item into the place of the one that leaves.
    fn exchange(&mut self, leaving: &Leaving, entering: usize) -> Option<()> {
        let left = self.basis[leaving.place];
        if let Some(row) = self.program.rows.get(left) {
            let side = leaving.direction * row.w;
            self.scratch.signed[left] = side;
            self.gradient.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum += side * d);
        } else if self.is_bound(left) {
            self.scratch.signed[left] = f64::INFINITY;
        }
        if let Some(row) = self.program.rows.get(entering) {
            let side = self.scratch.signed[entering];
            self.gradient.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum -= side * d);
        }
        self.scratch.signed[entering] = 0.0;
        self.scratch.residual[entering] = 0.0;
        self.basis[leaving.place] = entering;
        self.inverse = invert(std::array::from_fn(|k| self.normal(self.basis[k])))?;
        Some(())
    }
}

fn add<const K: usize>(sum: &mut [f64; K], vector: &[f64; K], factor: f64) {
    sum.iter_mut().zip(vector).for_each(|(sum, value)| *sum += factor * value);
}

fn size<const K: usize>(vector: &[f64; K]) -> f64 {
    vector.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// The inverse by elimination with row exchanges; `None` for a singular matrix.
pub(super) fn invert<const K: usize>(mut a: [[f64; K]; K]) -> Option<[[f64; K]; K]> {
    let mut inverse: [[f64; K]; K] =
        std::array::from_fn(|i| std::array::from_fn(|k| f64::from(u8::from(i == k))));
    for k in 0..K {
        let larger =
            |best: usize, i: usize| if a[i][k].abs() > a[best][k].abs() { i } else { best };
        let pivot = (k + 1..K).fold(k, larger);
        a.swap(k, pivot);
        inverse.swap(k, pivot);
        let scale = 1.0 / a[k][k];
        if !scale.is_finite() {
            return None;
        }
        (0..K).for_each(|j| (a[k][j], inverse[k][j]) = (a[k][j] * scale, inverse[k][j] * scale));
        let (from, of) = (a[k], inverse[k]);
        for i in (0..K).filter(|&i| i != k) {
            let factor = a[i][k];
            (0..K).for_each(|j| a[i][j] -= factor * from[j]);
            (0..K).for_each(|j| inverse[i][j] -= factor * of[j]);
        }
    }
    Some(inverse)
}

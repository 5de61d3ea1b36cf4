//! One step: predictor, then corrector, with the same factorised matrix.

use super::State;
use super::scaling::{Scaling, Vec4, divide, jordan, longest_step, product};
use crate::surface::dense::{Cholesky, add_outer, dot};

/// Changes of what belongs to one cell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct LaneStep {
    pub(super) p: f64,
    pub(super) q: f64,
    pub(super) y: f64,
}

/// Changes of what belongs to one cone.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct LinkStep {
    pub(super) kappa: Vec4,
    pub(super) s: Vec4,
}

/// A direction.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step<const K: usize> {
    pub(super) x: [f64; K],
    pub(super) lanes: Vec<LaneStep>,
    pub(super) links: Vec<LinkStep>,
}

/// The matrix of a point and what the steps from it share.
struct System<'a, const K: usize> {
    state: &'a State<'a, K>,
    scalings: Vec<Scaling>,
    factor: Cholesky<K>,
}

impl<const K: usize> Step<K> {
    /// The step from a point; `None` where rounding leaves no direction.
    pub(super) fn of(state: &State<'_, K>) -> Option<Self> {
        let system = System::new(state)?;
        let mut step = Self {
            x: [0.0; K],
            lanes: vec![LaneStep::default(); state.lanes.len()],
            links: vec![LinkStep::default(); state.links.len()],
        };
        system.predict(&mut step);
        let [primal, dual] = step.longest(state).map(|length| length.min(1.0));
        let share = (step.gap_after(state, primal, dual) / state.gap).clamp(0.0, 1.0);
        system.correct(&mut step, share * share * share * state.gap / state.degree());
        step.x.iter().all(|value| value.is_finite()).then_some(step)
    }

    /// How far the primal and the dual part can go.
    pub(super) fn longest(&self, state: &State<'_, K>) -> [f64; 2] {
        // The reciprocals of the lengths: no division by nought, no branch.
        let (mut primal, mut dual) = (0.0f64, 0.0f64);
        for ((row, lane), d) in state.program.rows.iter().zip(&state.lanes).zip(&self.lanes) {
            primal = primal.max(-d.p / lane.p).max(-d.q / lane.q);
            dual = dual.max(d.y / (row.w - lane.y)).max(-d.y / (row.w + lane.y));
        }
        let mut lengths = [1.0 / primal, 1.0 / dual];
        for (link, d) in state.links.iter().zip(&self.links) {
            lengths[0] = lengths[0].min(longest_step(&link.kappa, &d.kappa));
            lengths[1] = lengths[1].min(longest_step(&link.s, &d.s));
        }
        lengths
    }

    fn gap_after(&self, state: &State<'_, K>, primal: f64, dual: f64) -> f64 {
        let mut gap = 0.0;
        for ((row, lane), d) in state.program.rows.iter().zip(&state.lanes).zip(&self.lanes) {
            let y = lane.y + dual * d.y;
            gap += (lane.p + primal * d.p) * (row.w - y) + (lane.q + primal * d.q) * (row.w + y);
        }
        for (link, d) in state.links.iter().zip(&self.links) {
            let along = |v: &Vec4, d: &Vec4, length: f64| -> Vec4 {
                std::array::from_fn(|i| v[i] + length * d[i])
            };
            gap += product(&along(&link.kappa, &d.kappa, primal), &along(&link.s, &d.s, dual));
        }
        gap
    }
}

impl<'a, const K: usize> System<'a, K> {
    /// D' theta D + G' W^-2 G.
    fn new(state: &'a State<'a, K>) -> Option<Self> {
        let mut matrix = [[0.0; K]; K];
        for (row, lane) in state.program.rows.iter().zip(&state.lanes) {
            add_outer(&mut matrix, &row.d, lane.theta);
        }
        let mut scalings = Vec::with_capacity(state.links.len());
        for (cone, link) in state.program.cones.iter().zip(&state.links) {
            let scaling = Scaling::new(&link.kappa, &link.s);
            let (g, factor) = scaling.inverse_square();
            add_outer(&mut matrix, &cone.transposed(&g), 2.0 * factor);
            for (i, row) in cone.rows.iter().enumerate().take(cone.dim) {
                add_outer(&mut matrix, row, if i == 0 { -factor } else { factor });
            }
            scalings.push(scaling);
        }
        Some(Self { state, scalings, factor: Cholesky::new(&matrix)? })
    }

    /// Towards complementary products of nought.
    fn predict(&self, step: &mut Step<K>) {
        for (lane, d) in self.state.lanes.iter().zip(&mut step.lanes) {
            *d = LaneStep { p: -lane.p, q: -lane.q, y: 0.0 };
        }
        let targets: Vec<Vec4> =
            self.scalings.iter().map(|scaling| scaling.lambda.map(|value| -value)).collect();
        self.solve(step, &targets);
    }

    /// Towards products of `mu`, with what the predictor left out.
    fn correct(&self, step: &mut Step<K>, mu: f64) {
        let rows = &self.state.program.rows;
        for ((row, lane), d) in rows.iter().zip(&self.state.lanes).zip(&mut step.lanes) {
            let p = (mu + d.p * d.y) / (row.w - lane.y) - lane.p;
            let q = (mu - d.q * d.y) / (row.w + lane.y) - lane.q;
            *d = LaneStep { p, q, y: 0.0 };
        }
        let target = |(scaling, d): (&Scaling, &LinkStep)| {
            let lambda = &scaling.lambda;
            let square = jordan(lambda, lambda);
            let second = jordan(&scaling.undo(&d.kappa), &scaling.apply(&d.s));
            let mut rest: Vec4 = std::array::from_fn(|i| -square[i] - second[i]);
            rest[0] += mu;
            divide(&rest, lambda)
        };
        let targets: Vec<Vec4> = self.scalings.iter().zip(&step.links).map(target).collect();
        self.solve(step, &targets);
    }

    /// Completes a step of which p and q hold their constant parts: what they would be if y stayed.
    fn solve(&self, step: &mut Step<K>, targets: &[Vec4]) {
        let State { program, lanes, links, dual_residue, .. } = self.state;
        let mut rhs = dual_residue.map(|rho| -rho);
        for ((row, lane), d) in program.rows.iter().zip(lanes).zip(&step.lanes) {
            let open = lane.theta * (lane.r - (lane.p + d.p) + (lane.q + d.q));
            rhs.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum -= d * open);
        }
        for (((cone, link), scaling), target) in
            program.cones.iter().zip(links).zip(&self.scalings).zip(targets)
        {
            let residue = scaling.undo(&link.residue);
            let open = scaling.undo(&std::array::from_fn(|i| target[i] - residue[i]));
            rhs.iter_mut().zip(cone.transposed(&open)).for_each(|(sum, part)| *sum += part);
        }
        step.x = self.factor.solve(&rhs);
        for ((row, lane), d) in program.rows.iter().zip(lanes).zip(&mut step.lanes) {
            let moved = dot(&row.d, &step.x);
            let open = lane.r - (lane.p + d.p) + (lane.q + d.q);
            d.y = lane.theta * (moved + open);
            d.p += lane.p / (row.w - lane.y) * d.y;
            d.q -= lane.q / (row.w + lane.y) * d.y;
        }
        for (i, d) in step.links.iter_mut().enumerate() {
            let (cone, link, scaling) = (&program.cones[i], &links[i], &self.scalings[i]);
            d.kappa = std::array::from_fn(|k| dot(&cone.rows[k], &step.x) + link.residue[k]);
            d.kappa[cone.dim..].fill(0.0);
            let scaled = scaling.undo(&d.kappa);
            d.s = scaling.undo(&std::array::from_fn(|k| targets[i][k] - scaled[k]));
        }
    }
}

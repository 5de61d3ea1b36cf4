//! The paraboloid of equal axes (omega = 0): a linear program, solved by clarabel.

use super::scale::Scale;
use super::{Paraboloid, Prior, Problem, Shape, Solution, Solver};
use crate::Error;
use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{NonnegativeConeT, ZeroConeT};
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolver, IPSolver, SolverStatus, SupportedConeT,
};

/// Unknowns phi0 (= phi1), phi3, phi4, phi5.
const UNKNOWNS: usize = 4;

/// Relative duality gap. At 1e-3 the centre is off by a median of 4 to 14 cm.
const GAP: f64 = 1e-8;

/// A residual or bound smaller than this, in scaled units, is tight at the optimum.
const TIGHT: f64 = 1e-6;

/// By how much the tie-break may exceed the optimum, relative: room for its interior.
const FACE: f64 = 1e-7;

/// Half width of the prior box, in units of the crown's size, below which the centre is fixed.
const POINT_PRIOR: f64 = 1e-7;

/// Minimises the sum of |phi0 (x² + y²) + phi3 x + phi4 y + phi5 - z| over the cells by clarabel's
/// interior point method in the residual-split form: with residual r, minimise the sum of 2p - r
/// over p >= r, p >= 0.
///
/// On gridded positions the optimum can be a whole face. It is recognised by fewer than four
/// residuals or bounds being tight, and resolved by the smallest sum of squares on that face.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EqualAxis;

/// A problem in scaled units.
struct Scaled {
    cells: Vec<[f64; 3]>,
    /// Bounds of phi0: at least, at most.
    curvature: [f64; 2],
    /// Lower and upper corner of the prior box.
    prior: Option<[[f64; 2]; 2]>,
}

/// What clarabel returns, in scaled units.
struct Raw {
    phi: [f64; UNKNOWNS],
    gap: f64,
    iterations: u32,
}

impl Solver for EqualAxis {
    fn unknowns(&self) -> usize {
        UNKNOWNS
    }

    fn row(&self, x: f64, y: f64) -> [f64; 6] {
        [x * x + y * y, x, y, 1.0, 0.0, 0.0]
    }

    fn solve(&self, problem: &Problem<'_>) -> Result<Solution, Error> {
        let scale = Scale::of(problem.cells);
        let scaled = Scaled::new(problem, &scale);
        let mut raw = linear_program(&scaled)?;
        if scaled.tight(&raw.phi) < UNKNOWNS
            && let Ok(chosen) = least_squares_on_face(&scaled, scaled.objective(&raw.phi))
        {
            raw.iterations += chosen.iterations;
            raw.phi = chosen.phi;
        }
        Ok(scaled.solution(&raw, &scale))
    }
}

impl Scaled {
    fn new(problem: &Problem<'_>, scale: &Scale) -> Self {
        let (l, h) = (scale.length_m, scale.height_m);
        let curvature = |axis: f64| -(l * l) / (h * axis * axis);
        let corner = |prior: &Prior, sign: f64| {
            let edge = |k: usize| prior.centre[k] + sign * prior.half_width_m - scale.centre[k];
            [edge(0) / l, edge(1) / l]
        };
        Self {
            cells: scale.apply(problem.cells),
            curvature: [curvature(problem.axes.smallest_m), curvature(problem.axes.largest_m)],
            prior: problem.prior.map(|prior| [corner(&prior, -1.0), corner(&prior, 1.0)]),
        }
    }

    fn residual(&self, phi: &[f64; UNKNOWNS], cell: &[f64; 3]) -> f64 {
        let [x, y, z] = *cell;
        phi[0] * (x * x + y * y) + phi[1] * x + phi[2] * y + phi[3] - z
    }

    fn objective(&self, phi: &[f64; UNKNOWNS]) -> f64 {
        self.cells.iter().map(|cell| self.residual(phi, cell).abs()).sum()
    }

    fn at_bound(&self, phi0: f64) -> bool {
        self.curvature.iter().any(|bound| (phi0 - bound).abs() <= TIGHT * (1.0 + bound.abs()))
    }

    /// Number of residuals and bounds that are zero.
    fn tight(&self, phi: &[f64; UNKNOWNS]) -> usize {
        let cells = self.cells.iter().filter(|cell| self.residual(phi, cell).abs() < TIGHT).count();
        let edges = self.prior.map_or(0, |[low, high]| {
            let on = |k: usize, edge: f64| (phi[1 + k] + 2.0 * phi[0] * edge).abs() < TIGHT;
            (0..2).filter(|&k| on(k, low[k]) || on(k, high[k])).count()
        });
        cells + edges + usize::from(self.at_bound(phi[0]))
    }

    /// Back to metres in the problem's frame.
    fn solution(&self, raw: &Raw, scale: &Scale) -> Solution {
        let [p0, p3, p4, p5] = raw.phi;
        let centre = [-p3 / (2.0 * p0), -p4 / (2.0 * p0)];
        let top = p5 - p0 * (centre[0] * centre[0] + centre[1] * centre[1]);
        let axis = scale.length_m / (-p0 * scale.height_m).sqrt();
        let paraboloid = Paraboloid::from_shape(&Shape {
            centre: [0, 1].map(|k| centre[k] * scale.length_m + scale.centre[k]),
            apex_z_m: top * scale.height_m + scale.centre[2],
            semiaxes_m: [axis; 2],
            azimuth: 0.0,
        });
        Solution {
            paraboloid,
            objective_m: self.objective(&raw.phi) * scale.height_m,
            gap_m: raw.gap * scale.height_m,
            iterations: raw.iterations,
            shape_bound_active: self.at_bound(p0),
        }
    }
}

/// Rows of `A x + s = b` gathered by column, for unknowns phi and then one p per cell.
struct Rows {
    columns: Vec<Vec<(usize, f64)>>,
    b: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl Rows {
    /// p >= r, p >= 0 and the bounds on the shape; the prior follows by [`Self::prior`].
    fn new(scaled: &Scaled) -> Self {
        let n = scaled.cells.len();
        let mut columns: Vec<Vec<(usize, f64)>> = vec![Vec::new(); UNKNOWNS];
        let mut b: Vec<f64> = scaled.cells.iter().map(|cell| cell[2]).collect();
        for (i, &[x, y, _]) in scaled.cells.iter().enumerate() {
            for (column, value) in columns.iter_mut().zip([x * x + y * y, x, y, 1.0]) {
                column.push((i, value));
            }
        }
        columns.extend((0..n).map(|i| vec![(i, -1.0), (n + i, -1.0)]));
        b.resize(2 * n, 0.0);
        let mut rows = Self { columns, b, cones: Vec::new() };
        rows.push([1.0, 0.0, 0.0, 0.0], scaled.curvature[1]);
        rows.push([-1.0, 0.0, 0.0, 0.0], -scaled.curvature[0]);
        rows
    }

    /// Adds `row * phi <= bound` (or `=` in a zero cone).
    fn push(&mut self, row: [f64; UNKNOWNS], bound: f64) {
        let place = self.b.len();
        for (column, value) in self.columns.iter_mut().zip(row) {
            if value != 0.0 {
                column.push((place, value));
            }
        }
        self.b.push(bound);
    }

    /// The box for the centre: -2 phi0 low <= phi3 <= -2 phi0 high and so for phi4. Closes the
    /// inequalities.
    fn prior(&mut self, prior: Option<[[f64; 2]; 2]>) {
        let Some([low, high]) = prior else {
            self.cones.push(NonnegativeConeT(self.b.len()));
            return;
        };
        let upper = |k: usize, at: f64| {
            if k == 0 { [2.0 * at, 1.0, 0.0, 0.0] } else { [2.0 * at, 0.0, 1.0, 0.0] }
        };
        if (0..2).all(|k| high[k] - low[k] < POINT_PRIOR) {
            self.cones.push(NonnegativeConeT(self.b.len()));
            (0..2).for_each(|k| self.push(upper(k, 0.5 * (low[k] + high[k])), 0.0));
            self.cones.push(ZeroConeT(2));
        } else {
            for k in 0..2 {
                self.push(upper(k, high[k]), 0.0);
                self.push(upper(k, low[k]).map(|value| -value), 0.0);
            }
            self.cones.push(NonnegativeConeT(self.b.len()));
        }
    }

    fn matrix(&self) -> CscMatrix<f64> {
        let mut starts = vec![0];
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        for column in &self.columns {
            rows.extend(column.iter().map(|entry| entry.0));
            values.extend(column.iter().map(|entry| entry.1));
            starts.push(rows.len());
        }
        CscMatrix::new(self.b.len(), self.columns.len(), starts, rows, values)
    }
}

fn linear_program(scaled: &Scaled) -> Result<Raw, Error> {
    let n = scaled.cells.len();
    let mut rows = Rows::new(scaled);
    rows.prior(scaled.prior);
    let mut cost = vec![0.0; UNKNOWNS];
    for &[x, y, _] in &scaled.cells {
        for (sum, value) in cost.iter_mut().zip([x * x + y * y, x, y, 1.0]) {
            *sum -= value;
        }
    }
    cost.resize(UNKNOWNS + n, 2.0);
    let quadratic = CscMatrix::zeros((UNKNOWNS + n, UNKNOWNS + n));
    solve(&quadratic, &cost, &rows)
}

/// Among surfaces within [`FACE`] of the optimum, that of the smallest sum of squared residuals.
fn least_squares_on_face(scaled: &Scaled, optimum: f64) -> Result<Raw, Error> {
    let n = scaled.cells.len();
    let mut rows = Rows::new(scaled);
    let (mut gram, mut cost) = ([[0.0; UNKNOWNS]; UNKNOWNS], vec![0.0; UNKNOWNS + n]);
    let (mut sums, mut constant) = ([0.0; UNKNOWNS], 0.0);
    for &[x, y, z] in &scaled.cells {
        let row = [x * x + y * y, x, y, 1.0];
        constant += z;
        for j in 0..UNKNOWNS {
            sums[j] -= row[j];
            cost[j] -= 2.0 * row[j] * z;
            (0..=j).for_each(|i| gram[i][j] += 2.0 * row[i] * row[j]);
        }
    }
    let place = rows.b.len();
    rows.push(sums, optimum + FACE * (1.0 + optimum) - constant);
    rows.columns[UNKNOWNS..].iter_mut().for_each(|column| column.push((place, 2.0)));
    rows.prior(scaled.prior);
    let starts = [0, 1, 3, 6, 10].into_iter().chain(std::iter::repeat_n(10, n)).collect();
    let upper = || (0..UNKNOWNS).flat_map(|j| (0..=j).map(move |i| (i, j)));
    let values = upper().map(|(i, j)| gram[i][j]).collect();
    let indices = upper().map(|(i, _)| i).collect();
    let quadratic = CscMatrix::new(UNKNOWNS + n, UNKNOWNS + n, starts, indices, values);
    solve(&quadratic, &cost, &rows)
}

fn settings() -> Result<DefaultSettings<f64>, Error> {
    let broken = |error| Error::Solver { status: format!("settings: {error}"), iterations: 0 };
    DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_rel(GAP)
        .tol_gap_abs(GAP)
        .direct_solve_method("qdldl".to_owned())
        .max_threads(1)
        .presolve_enable(false)
        .build()
        .map_err(broken)
}

fn solve(quadratic: &CscMatrix<f64>, cost: &[f64], rows: &Rows) -> Result<Raw, Error> {
    let refused = |error| Error::Solver { status: format!("refusal: {error:?}"), iterations: 0 };
    let mut solver =
        DefaultSolver::new(quadratic, cost, &rows.matrix(), &rows.b, &rows.cones, settings()?)
            .map_err(refused)?;
    solver.solve();
    let solution = &solver.solution;
    match (solution.status, solution.x.get(..UNKNOWNS)) {
        (SolverStatus::Solved | SolverStatus::AlmostSolved, Some(&[p0, p3, p4, p5])) => Ok(Raw {
            phi: [p0, p3, p4, p5],
            gap: (solution.obj_val - solution.obj_val_dual).abs(),
            iterations: solution.iterations,
        }),
        (status, _) => {
            let iterations = solution.iterations;
            Err(Error::Solver { status: format!("{status:?}"), iterations })
        }
    }
}

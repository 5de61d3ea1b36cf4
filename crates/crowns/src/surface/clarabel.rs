//! The reference engine: Clarabel, in the form with the fewest unknowns.

use super::dual::Dual;
use super::program::{Cone, Optimum, Program};
use crate::Error;
use clarabel::algebra::CscMatrix;
use clarabel::solver::SupportedConeT::{NonnegativeConeT, SecondOrderConeT};
use clarabel::solver::{
    DefaultSettings, DefaultSettingsBuilder, DefaultSolution, DefaultSolver, IPSolver,
    SolverStatus, SupportedConeT,
};

/// Relative duality gap. At 1e-3 the centre is off by a median of 4 to 14 cm.
const GAP: f64 = 1e-9;

/// With r = D x - z the sum of w |r| is that of w (2p - r) for the smallest p with p >= r, p >= 0.
pub(super) fn solve<const K: usize>(program: &Program<K>) -> Result<Optimum<K>, Error> {
    let refused = |error| Error::Solver { status: format!("refusal: {error:?}"), iterations: 0 };
    let n = program.rows.len();
    let system = System::new(program);
    let mut cost = vec![0.0; K];
    for row in &program.rows {
        cost.iter_mut().zip(&row.d).for_each(|(sum, d)| *sum -= row.w * d);
    }
    cost.extend(program.rows.iter().map(|row| 2.0 * row.w));
    let quadratic = CscMatrix::zeros((K + n, K + n));
    let matrix = system.matrix();
    let mut solver =
        DefaultSolver::new(&quadratic, &cost, &matrix, &system.b, &system.cones, settings()?)
            .map_err(refused)?;
    solver.solve();
    optimum(program, &solver.solution)
}

fn optimum<const K: usize>(
    program: &Program<K>,
    solution: &DefaultSolution<f64>,
) -> Result<Optimum<K>, Error> {
    let iterations = solution.iterations;
    let whole: Option<[f64; K]> = solution.x.get(..K).and_then(|x| x.try_into().ok());
    match (solution.status, whole) {
        (SolverStatus::Solved | SolverStatus::AlmostSolved, Some(x)) => {
            let objective = program.objective(&x);
            let lower_bound = dual(program, &solution.z).bound(program, objective);
            Ok(Optimum { x, objective, lower_bound, iterations })
        }
        (status, _) => Err(Error::Solver { status: format!("{status:?}"), iterations }),
    }
}

/// Multipliers of the residuals and cones out of those of the system.
fn dual<const K: usize>(program: &Program<K>, z: &[f64]) -> Dual {
    let n = program.rows.len();
    let y = program.rows.iter().zip(z).map(|(row, z)| z - row.w).collect();
    let mut place = 2 * n;
    let linear = |cone: &&Cone<K>| cone.dim == 1;
    let mut s = vec![[0.0; 4]; program.cones.len()];
    for wanted in [true, false] {
        for (cone, s) in program.cones.iter().zip(&mut s) {
            if linear(&cone) == wanted {
                s[..cone.dim].copy_from_slice(&z[place..place + cone.dim]);
                place += cone.dim;
            }
        }
    }
    Dual { y, s }
}

/// Rows of `A x + s = b` gathered by column, for the unknowns and then one p per cell: p >= r,
/// p >= 0, the linear cones, the others.
struct System {
    columns: Vec<Vec<(usize, f64)>>,
    b: Vec<f64>,
    cones: Vec<SupportedConeT<f64>>,
}

impl System {
    fn new<const K: usize>(program: &Program<K>) -> Self {
        let n = program.rows.len();
        let mut columns: Vec<Vec<(usize, f64)>> = vec![Vec::new(); K];
        let mut b: Vec<f64> = program.rows.iter().map(|row| row.z).collect();
        for (i, row) in program.rows.iter().enumerate() {
            columns.iter_mut().zip(row.d).for_each(|(column, d)| column.push((i, d)));
        }
        columns.extend((0..n).map(|i| vec![(i, -1.0), (n + i, -1.0)]));
        b.resize(2 * n, 0.0);
        let mut system = Self { columns, b, cones: Vec::new() };
        program.cones.iter().filter(|cone| cone.dim == 1).for_each(|cone| system.push(cone));
        system.cones.push(NonnegativeConeT(system.b.len()));
        for cone in program.cones.iter().filter(|cone| cone.dim > 1) {
            system.push(cone);
            system.cones.push(SecondOrderConeT(cone.dim));
        }
        system
    }

    fn push<const K: usize>(&mut self, cone: &Cone<K>) {
        for (row, shift) in cone.rows.iter().zip(cone.shift).take(cone.dim) {
            let place = self.b.len();
            for (column, value) in self.columns.iter_mut().zip(row) {
                if *value != 0.0 {
                    column.push((place, -value));
                }
            }
            self.b.push(shift);
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

fn settings() -> Result<DefaultSettings<f64>, Error> {
    let broken = |error| Error::Solver { status: format!("settings: {error}"), iterations: 0 };
    DefaultSettingsBuilder::default()
        .verbose(false)
        .tol_gap_rel(GAP)
        .tol_gap_abs(GAP)
        .tol_feas(GAP)
        .direct_solve_method("qdldl".to_owned())
        .max_threads(1)
        .presolve_enable(false)
        .build()
        .map_err(broken)
}

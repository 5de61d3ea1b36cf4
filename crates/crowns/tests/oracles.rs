//! The fits against other people's solvers: SCIP, GLPK, HiGHS and LAPACK's least squares.
//!
//! They are asked when the environment variable `TIMBERLINE_ORACLE` names a Python interpreter with
//! the packages of `.ci/requirements.txt`:
//!
//! `TIMBERLINE_ORACLE=python3 cargo test --release -p timberline-crowns --test oracles -- --ignored --nocapture`
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test may stop at what it did not expect, and tells what it measured"
)]

mod common;

use common::feasible::least_objective;
use common::oracle::{Answer, Asking, ask};
use common::problems::{Case, Wishes};
use timberline_crowns::surface::{Axes, Engine, L2, Method};

/// Difference to SCIP's objective, relative: its constraints hold to 1e-6 only.
const SCIP: f64 = 1e-4;
/// The same for linear programs.
const SIMPLEX: f64 = 1e-6;
/// The same for least squares.
const SQUARES: f64 = 1e-9;

const ASKING: Asking = Asking { limit_s: 20.0, repeat: 1, jobs: 2 };

fn cases(seeds: std::ops::Range<u64>, wishes: &Wishes) -> Vec<Case> {
    seeds.map(|seed| Case::random(seed, wishes)).collect()
}

fn objective(case: &Case, method: &dyn Method) -> f64 {
    method.fit(&case.problem()).unwrap().certificate.unwrap().objective_m
}

/// Differences relative to the oracle's objective, of the answers that it calls optimal. Of the
/// others, its bound and its best surface must lie on either side.
fn differences(cases: &[Case], answers: &[Answer], tolerance: f64) -> Vec<f64> {
    let mut differences = Vec::new();
    for (case, answer) in cases.iter().zip(answers) {
        assert_eq!(case.seed, answer.seed);
        let ours = objective(case, &case.method(Engine::Dedicated));
        let unit = ours.max(least_objective(case));
        let told = format!("seed {} ({}): ours {ours}, {answer:?}", case.seed, case.group());
        match (answer.status.as_str(), answer.objective) {
            ("optimal", Some(theirs)) => {
                let difference = (ours - theirs).abs() / unit;
                assert!(difference <= tolerance, "{difference:e}: {told}");
                differences.push(difference);
            }
            ("limit", theirs) => {
                let [low, high] = [answer.bound.unwrap_or(0.0), theirs.unwrap_or(f64::INFINITY)];
                let room = tolerance * unit;
                assert!((low - room..=high + room).contains(&ours), "{told}");
            }
            _ => panic!("the oracle failed: {told}"),
        }
    }
    differences
}

fn report(name: &str, cases: usize, mut differences: Vec<f64>, answers: &[Answer]) {
    let mut seconds: Vec<f64> = answers.iter().map(|answer| answer.seconds).collect();
    let nodes = answers.iter().map(|answer| answer.nodes).fold(0.0, f64::max);
    differences.sort_by(f64::total_cmp);
    seconds.sort_by(f64::total_cmp);
    println!(
        "{name}: {} of {cases} solved; differences {:.1e} (median) to {:.1e}; {:.4} s (median) to \
         {:.2} s, up to {nodes} nodes",
        differences.len(),
        differences[differences.len() / 2],
        differences[differences.len() - 1],
        seconds[seconds.len() / 2],
        seconds[seconds.len() - 1],
    );
}

#[test]
#[ignore = "needs TIMBERLINE_ORACLE"]
fn scip_finds_the_same_optimum_with_two_axes() {
    let omegas = vec![0.05, 0.2, 0.2, 0.5, 0.5, 0.8, 1.0];
    for (name, seeds, priors) in [("free", 0..50, 0.0), ("with prior", 50..100, 1.0)] {
        let wishes = Wishes { cells: [20, 100], omegas: omegas.clone(), priors, weights: 0.15 };
        let cases = cases(seeds, &wishes);
        let answers = ask("scip", &cases, ASKING);
        let differences = differences(&cases, &answers, SCIP);
        assert!(10 * differences.len() >= 9 * cases.len(), "SCIP solved {}", differences.len());
        report(&format!("SCIP, {name}"), cases.len(), differences, &answers);
    }
}

#[test]
#[ignore = "needs TIMBERLINE_ORACLE"]
fn simplex_solvers_find_the_same_optimum_with_equal_axes() {
    let wishes = Wishes { cells: [20, 300], omegas: vec![0.0], ..Wishes::default() };
    let cases = cases(200..400, &wishes);
    for solver in ["glpk", "highs"] {
        let answers = ask(solver, &cases, ASKING);
        let differences = differences(&cases, &answers, SIMPLEX);
        assert_eq!(differences.len(), cases.len());
        report(solver, cases.len(), differences, &answers);
    }
}

#[test]
#[ignore = "needs TIMBERLINE_ORACLE"]
fn least_squares_are_those_of_lapack() {
    let cases = cases(400..500, &Wishes { priors: 0.0, ..Wishes::default() });
    for (solver, axes) in [("equal-squares", Axes::Equal), ("free-squares", Axes::Free)] {
        let answers = ask(solver, &cases, ASKING);
        for (case, answer) in cases.iter().zip(&answers) {
            let (ours, theirs) = (objective(case, &L2 { axes }), answer.objective.unwrap());
            let unit = theirs.max(least_objective(case));
            assert!((ours - theirs).abs() <= SQUARES * unit, "{solver}: {ours} {answer:?}");
        }
    }
}

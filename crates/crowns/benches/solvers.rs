//! Medians of all solvers beside each other in one run, and crowns per minute on all cores:
//! `TIMBERLINE_ORACLE=python3 cargo bench -p timberline-crowns --bench solvers`.
//!
//! Without `TIMBERLINE_ORACLE` (a Python interpreter with the packages of `.ci/requirements.txt`)
//! the foreign solvers are left out. Their times are those of the solver's call alone.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a measurement prints, and stops at what it did not expect"
)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::oracle::{Asking, ask, python};
use common::problems::{Case, Crown, Wishes, between};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;
use timberline_crowns::surface::{Engine, Flag, L1, Method, Prior, Problem, thin};

const COUNTS: [usize; 4] = [30, 100, 300, 1000];
/// Problems of a kind and size.
const CASES: usize = 40;

#[derive(Debug, Clone, Copy)]
struct Kind {
    name: &'static str,
    omega: f64,
    half_width_m: Option<f64>,
    /// Only problems where the imbalance or an axis is at its limit: otherwise the cones do not
    /// matter, and a solver that begins with a linear program is done with that.
    curved: bool,
    foreign: &'static [&'static str],
}

const KINDS: [Kind; 6] = [
    Kind {
        name: "LP",
        omega: 0.0,
        half_width_m: None,
        curved: false,
        foreign: &["glpk", "highs", "scip-default"],
    },
    Kind {
        name: "LP, prior",
        omega: 0.0,
        half_width_m: Some(0.1),
        curved: false,
        foreign: &["glpk", "highs"],
    },
    Kind {
        name: "SOCP 0.2",
        omega: 0.2,
        half_width_m: None,
        curved: false,
        foreign: &["scip-default"],
    },
    Kind {
        name: "SOCP 0.2, cone active",
        omega: 0.2,
        half_width_m: None,
        curved: true,
        foreign: &["scip-default"],
    },
    Kind {
        name: "0.2, prior",
        omega: 0.2,
        half_width_m: Some(0.1),
        curved: false,
        foreign: &["scip-default"],
    },
    Kind {
        name: "0.2, fixed",
        omega: 0.2,
        half_width_m: Some(0.0),
        curved: false,
        foreign: &["scip-default"],
    },
];

/// Whether a cone is active in the optimum.
fn curved(case: &Case) -> bool {
    let flags = case.method(Engine::Dedicated).fit(&case.problem()).unwrap().flags;
    flags.contains(&Flag::ImbalanceActive) || flags.contains(&Flag::ShapeBoundActive)
}

fn cases(kind: &Kind, count: usize) -> Vec<Case> {
    let priors = if kind.half_width_m.is_some() { 1.0 } else { 0.0 };
    let wishes = Wishes { cells: [count; 2], omegas: vec![kind.omega], priors, weights: 0.0 };
    let fits = |case: &Case| !kind.curved || curved(case);
    let all = (0..).map(|seed| Case::random(seed, &wishes)).filter(fits);
    let mut cases: Vec<Case> = all.take(CASES).collect();
    for prior in cases.iter_mut().filter_map(|case| case.prior.as_mut()) {
        prior.half_width_m = kind.half_width_m.unwrap_or(0.0);
    }
    cases
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// The fastest of some runs, s.
fn seconds(case: &Case, engine: Engine, repeat: usize) -> f64 {
    let (method, problem) = (case.method(engine), case.problem());
    let once = |_| {
        let start = Instant::now();
        black_box(method.fit(black_box(&problem)).unwrap());
        start.elapsed().as_secs_f64()
    };
    (0..repeat).map(once).fold(f64::INFINITY, f64::min)
}

/// How many of the problems a solver gets: SCIP takes seconds for the largest.
fn foreign_cases(solver: &str, count: usize) -> usize {
    match (solver, count) {
        ("scip-default", 1000..) => 5,
        ("scip-default", _) => 15,
        _ => CASES,
    }
}

fn table(kind: &Kind, count: usize) {
    let cases = cases(kind, count);
    let of = |engine, repeat| -> Vec<f64> {
        cases.iter().map(|case| seconds(case, engine, repeat)).collect()
    };
    let ours = of(Engine::Dedicated, 5);
    let mut columns = vec![format!("{:.1}", 1e6 * median(ours.clone()))];
    // A solver that answers a part of the problems only is compared on these.
    let mut column = |name: &str, seconds: Vec<f64>| {
        let dedicated = median(ours[..seconds.len()].to_vec());
        let theirs = median(seconds);
        columns.push(format!("{name} {:.1} ({:.0} x)", 1e6 * theirs, theirs / dedicated));
    };
    column("clarabel", of(Engine::Clarabel, 2));
    if python().is_some() {
        for solver in kind.foreign {
            let few = foreign_cases(solver, count);
            let asking = Asking { limit_s: 30.0, repeat: 1, jobs: 1 };
            let answers = ask(solver, &cases[..few], asking);
            column(solver, answers.iter().map(|answer| answer.seconds).collect());
        }
    }
    println!("| {} | {count} | {} |", kind.name, columns.join(" | "));
}

/// Points of a crown, about three in a cell of half a metre, that thin to about 100 cells.
fn points(seed: u64) -> Vec<[f64; 3]> {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let radius = 2.72;
    let crown = Crown::random(random, [0.0; 2], radius);
    (0..360)
        .map(|_| {
            let (sin, cos) = libm::sincos(between(random, 0.0, std::f64::consts::TAU));
            let r = radius * between(random, 0.0, 1.0).sqrt();
            let deep = between(random, 0.0, 1.0) * between(random, 0.0, 1.0);
            [r * cos, r * sin, crown.z(r * cos, r * sin) - deep]
        })
        .collect()
}

/// Thins and fits `repeat` times a set of crowns on all threads; prints seconds for a million.
fn throughput(name: &str, crowns: &[Vec<[f64; 3]>], repeat: usize, method: &L1, uncertain: bool) {
    let start = Instant::now();
    let cells: usize = (0..crowns.len() * repeat)
        .into_par_iter()
        .map(|i| {
            let points = &crowns[i % crowns.len()];
            let higher = |a: [f64; 3], p: &[f64; 3]| if p[2] > a[2] { *p } else { a };
            let apex = points.iter().fold(points[0], higher);
            let cells = thin(points.iter().copied(), apex, 0.5).unwrap();
            let prior = Prior { centre: [0.0; 2], half_width_m: 0.5 };
            let problem = Problem::new(&cells).with_prior(prior);
            let fit = method.fit(&problem).unwrap();
            if uncertain {
                black_box(method.uncertainty(&problem, &fit).unwrap());
            }
            black_box(fit);
            cells.len()
        })
        .sum();
    let count = (crowns.len() * repeat) as f64;
    let (took, threads) = (start.elapsed().as_secs_f64(), rayon::current_num_threads());
    println!(
        "| {name} | {count} crowns of {:.0} cells, {threads} threads | {took:.1} s | {:.1} s a million |",
        cells as f64 / count,
        took * 1e6 / count
    );
}

fn main() {
    println!(
        "medians of {CASES} crowns, us; SCIP: of the first 15, or 5; in brackets, times the dedicated\n"
    );
    println!("| problem | cells | dedicated us | others |\n|---|---|---|---|");
    for kind in &KINDS {
        for count in COUNTS {
            table(kind, count);
        }
    }
    let crowns: Vec<Vec<[f64; 3]>> = (0..2000).map(points).collect();
    println!("\nthinning and fit with a prior of 0.5 m at the highest point\n");
    throughput("equal axes", &crowns, 500, &L1::default(), false);
    throughput("equal axes, uncertainty", &crowns, 20, &L1::default(), true);
    let two = L1 { omega: 0.2, ..L1::default() };
    throughput("omega 0.2", &crowns, 20, &two, false);
    throughput("omega 0.2, uncertainty", &crowns, 5, &two, true);
}

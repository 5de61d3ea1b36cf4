//! The dedicated solvers against Clarabel, and their certificates against everything at hand.
//!
//! `cargo test --release -p timberline-crowns --test engines -- --ignored --nocapture` compares them
//! on 10,000 crowns and prints how nodes, gaps and times are distributed.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "a test may stop at what it did not expect, and tells what it measured"
)]

mod common;

use common::feasible::{least_objective, objective, perturbed, projected, violation};
use common::problems::{Case, Wishes};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::time::Instant;
use timberline_crowns::surface::{
    Axes, Certificate, Engine, Fit, L1, L2, Method, Paraboloid, Problem, Surface,
};

/// Largest relative difference between the objectives of two engines.
const AGREEMENT: f64 = 1e-7;
/// Largest certified relative gap.
const GAP: f64 = 1e-6;
/// What rounding may break of a constraint: of the shape relative, of the prior box in metres.
const ROUNDING: f64 = 1e-9;
/// Random surfaces tried around every known one.
const TRIES: usize = 8;

/// One engine's answer to one case.
struct Answer {
    surface: Paraboloid,
    certificate: Certificate,
    micros: f64,
}

/// What is reported of one case.
struct Outcome {
    group: String,
    difference: f64,
    gap: f64,
    nodes: f64,
    micros: [f64; 2],
}

fn paraboloid(fit: &Fit) -> Option<Paraboloid> {
    match fit.surface {
        Some(Surface::Paraboloid(surface)) => Some(surface),
        _ => None,
    }
}

fn answer(case: &Case, engine: Engine) -> Result<Answer, String> {
    let (method, problem) = (case.method(engine), case.problem());
    let start = Instant::now();
    let fit = method.fit(&problem).map_err(|error| format!("{engine:?}: {error}"))?;
    let micros = 1e6 * start.elapsed().as_secs_f64();
    let none = || format!("{engine:?}: no surface, {:?}", fit.flags);
    let surface = paraboloid(&fit).ok_or_else(none)?;
    let certificate = fit.certificate.ok_or_else(none)?;
    let answer = Answer { surface, certificate, micros };
    sound(case, &answer).map_err(|why| format!("{engine:?}: {why}"))?;
    Ok(answer)
}

/// The certificate says what the surface costs, and the surface is allowed.
fn sound(case: &Case, answer: &Answer) -> Result<(), String> {
    let told = answer.certificate.objective_m;
    let costs = objective(case, &answer.surface);
    let unit = costs.max(least_objective(case));
    let holds = |holds: bool, why: String| if holds { Ok(()) } else { Err(why) };
    holds((told - costs).abs() <= 1e-9 * unit, format!("claims {told}, costs {costs}"))?;
    let broken = violation(case, &answer.surface);
    holds(broken <= ROUNDING, format!("breaks a constraint by {broken:e}"))?;
    let bound = answer.certificate.lower_bound_m;
    let gap = (told - bound) / unit;
    holds(gap <= GAP, format!("gap {gap:e}: objective {told}, bound {bound}"))
}

/// The cheapest of many surfaces that the case allows.
fn cheapest(case: &Case, known: &[Paraboloid]) -> f64 {
    let free = Problem { prior: None, ..case.problem() };
    let l1 = |omega: f64, problem: Problem<'_>| {
        L1 { omega, ..case.method(Engine::Dedicated) }.fit(&problem).ok()
    };
    let others = [
        L2 { axes: Axes::Equal }.fit(&free).ok(),
        L2 { axes: Axes::Free }.fit(&free).ok(),
        l1(case.omega, free),
        l1(0.0, case.problem()),
        l1(0.0, free),
    ];
    let others = others.iter().flatten().filter_map(paraboloid);
    let random = &mut ChaCha8Rng::seed_from_u64(case.seed ^ 0x5eed);
    let mut cheapest = f64::INFINITY;
    for shape in known.iter().copied().chain(others).filter_map(|surface| surface.shape()) {
        let around = (0..TRIES).map(|_| perturbed(&shape, random));
        for shape in std::iter::once(shape).chain(around.collect::<Vec<_>>()) {
            let surface = projected(case, &shape);
            assert!(violation(case, &surface) <= ROUNDING, "{shape:?} was not projected");
            cheapest = cheapest.min(objective(case, &surface));
        }
    }
    cheapest
}

fn compare(case: &Case) -> Result<Outcome, String> {
    let dedicated = answer(case, Engine::Dedicated)?;
    let reference = answer(case, Engine::Clarabel)?;
    let [ours, theirs] = [&dedicated, &reference].map(|answer| answer.certificate.objective_m);
    let unit = theirs.max(least_objective(case));
    let difference = (ours - theirs).abs() / unit;
    if difference > AGREEMENT {
        return Err(format!("objectives {ours} and {theirs} differ by {difference:e}"));
    }
    let cheapest = cheapest(case, &[dedicated.surface, reference.surface]);
    for (answer, engine) in [(&dedicated, "dedicated"), (&reference, "Clarabel")] {
        let bound = answer.certificate.lower_bound_m;
        if bound > cheapest + 1e-12 * unit {
            return Err(format!("{engine}: bound {bound} above a surface that costs {cheapest}"));
        }
    }
    Ok(Outcome {
        group: case.group(),
        difference,
        gap: (ours - dedicated.certificate.lower_bound_m) / unit,
        nodes: f64::from(dedicated.certificate.nodes),
        micros: [dedicated.micros, reference.micros],
    })
}

/// Compares all seeds; writes what fails where it can be read again, and stops in the end.
fn run(seeds: std::ops::Range<u64>, wishes: &Wishes) {
    let count = seeds.end - seeds.start;
    let results: Vec<_> = seeds
        .into_par_iter()
        .map(|seed| {
            let case = Case::random(seed, wishes);
            compare(&case).map_err(|why| Box::new((case, why)))
        })
        .collect();
    let (good, bad): (Vec<_>, Vec<_>) = results.into_iter().partition(Result::is_ok);
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (case, why) in bad.iter().filter_map(|result| result.as_ref().err().map(Box::as_ref)) {
        let path = folder.join(format!("case-{}.json", case.seed));
        std::fs::write(&path, case.json()).unwrap();
        let (group, n) = (case.group(), case.cells.len());
        println!("seed {} ({group}, {n} cells, {:?}): {why}", case.seed, case.bounds);
    }
    print(&good.into_iter().flatten().collect::<Vec<_>>());
    assert!(bad.is_empty(), "{} of {count} failed, written to {}", bad.len(), folder.display());
}

fn quantiles(mut values: Vec<f64>) -> String {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[(share * (values.len() - 1) as f64).round() as usize];
    let shown = |value: f64| {
        if value != 0.0 && value < 0.1 { format!("{value:.1e}") } else { format!("{value:.0}") }
    };
    [0.5, 0.95, 0.99, 1.0].map(|share| shown(at(share))).join(" / ")
}

/// A table of medians, 95th and 99th percentiles and maxima.
fn print(outcomes: &[Outcome]) {
    let mut groups: BTreeMap<String, Vec<&Outcome>> = BTreeMap::new();
    for outcome in outcomes {
        groups.entry(outcome.group.clone()).or_default().push(outcome);
    }
    groups.insert("all".to_owned(), outcomes.iter().collect());
    println!("quantiles: 50 / 95 / 99 / 100 %");
    println!("| problems | number | nodes | gap | difference | dedicated us | Clarabel us |");
    println!("|---|---|---|---|---|---|---|");
    for (name, group) in groups {
        let of = |value: fn(&Outcome) -> f64| quantiles(group.iter().map(|o| value(o)).collect());
        let columns = [
            of(|o| o.nodes),
            of(|o| o.gap),
            of(|o| o.difference),
            of(|o| o.micros[0]),
            of(|o| o.micros[1]),
        ];
        println!("| {name} | {} | {} |", group.len(), columns.join(" | "));
    }
}

#[test]
fn the_engines_agree() {
    let wishes = Wishes { cells: [20, 200], ..Wishes::default() };
    run(1_000_000..1_000_300, &wishes);
}

#[test]
#[ignore = "minutes: run with --release"]
fn the_engines_agree_on_ten_thousand_crowns() {
    run(0..10_000, &Wishes::default());
}

use super::super::program::{Cone, Program, Row};
use super::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

pub(super) fn uniform(random: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// What a crown is made of.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// Heights are rounded to this.
    pub(super) step: f64,
    pub(super) noise: f64,
    pub(super) weighted: bool,
    /// Smallest curvature.
    pub(super) least: f64,
    /// Half width of a box for the centre.
    pub(super) side: Option<f64>,
}

impl Default for Shape {
    fn default() -> Self {
        Self { step: 0.01, noise: 0.4, weighted: false, least: 0.05, side: None }
    }
}

/// Cells of a crown on a grid of 0.5 m with strays, in units of about its size.
pub(super) fn crown(seed: u64, n: usize, shape: &Shape) -> Program<4> {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let radius = 0.5 * (n as f64 / 3.0).sqrt() + 0.5;
    let (depth, stray) = (uniform(random, -0.5, 5.0), uniform(random, 0.0, 0.3));
    let centre = [0.0; 2].map(|_: f64| uniform(random, -0.3, 0.3));
    let rows = (0..n).map(|_| {
        let [x, y] = [0, 1].map(|_| {
            let cell = (uniform(random, -radius, radius) * 2.0).floor() / 2.0 + 0.25;
            cell / radius
        });
        let (dx, dy) = (x - centre[0], y - centre[1]);
        let low = if uniform(random, 0.0, 1.0) < stray { uniform(random, 0.0, 4.0) } else { 0.0 };
        let z = uniform(random, -shape.noise, shape.noise) - depth * (dx * dx + dy * dy) - low;
        let z = if shape.step > 0.0 { (z / shape.step).round() * shape.step } else { z };
        let w = if shape.weighted { uniform(random, 0.5, 2.0) } else { 1.0 };
        Row { d: [x * x + y * y, x, y, 1.0], z, w }
    });
    Program::new(rows.collect(), bounds(shape))
}

fn bounds(shape: &Shape) -> Vec<Cone<4>> {
    let mut cones = vec![
        Cone::linear([-1.0, 0.0, 0.0, 0.0], -shape.least),
        Cone::linear([1.0, 0.0, 0.0, 0.0], 20.0),
    ];
    if let Some(side) = shape.side {
        for (k, sign) in [(1, 1.0), (1, -1.0), (2, 1.0), (2, -1.0)] {
            let mut row = [-2.0 * side, 0.0, 0.0, 0.0];
            row[k] = sign;
            cones.push(Cone::linear(row, 0.0));
        }
    }
    cones
}

fn shape_of(seed: u64) -> Shape {
    Shape {
        step: [0.0, 0.01, 0.1, 1.0][seed as usize % 4],
        noise: [0.4, 0.0, 1.0][seed as usize % 3],
        weighted: seed.is_multiple_of(5),
        least: [0.05, 0.8, 4.0][seed as usize / 7 % 3],
        side: [None, Some(0.1), Some(0.01), Some(1.0)][seed as usize / 3 % 4],
    }
}

/// Steps through all combinations of `K` of `count`, calling with each.
fn combinations<const K: usize>(count: usize, visit: &mut impl FnMut([usize; K])) {
    let mut chosen: [usize; K] = std::array::from_fn(|k| k);
    loop {
        visit(chosen);
        let Some(k) = (0..K).rev().find(|&k| chosen[k] < count - K + k) else { return };
        chosen[k] += 1;
        (k + 1..K).for_each(|j| chosen[j] = chosen[j - 1] + 1);
    }
}

/// The smallest objective of all vertices.
fn by_enumeration<const K: usize>(program: &Program<K>) -> f64 {
    let rows = program.rows.iter().map(|row| (row.d, row.z));
    let all: Vec<_> = rows.chain(program.cones.iter().map(|c| (c.rows[0], -c.shift[0]))).collect();
    let mut best = f64::INFINITY;
    combinations(all.len(), &mut |chosen: [usize; K]| {
        let Some(inverse) = step::invert(chosen.map(|item| all[item].0)) else { return };
        let x: [f64; K] =
            std::array::from_fn(|i| (0..K).map(|k| inverse[i][k] * all[chosen[k]].1).sum());
        if program.cones.iter().all(|cone| cone.at(&x)[0] >= -1e-11) {
            best = best.min(program.objective(&x));
        }
    });
    best
}

#[test]
fn no_vertex_is_better() {
    for seed in 0..400 {
        let program = crown(seed, 5 + seed as usize % 6, &shape_of(seed));
        if program.spread.iter().any(|spread| *spread > 1e3) {
            continue; // Too few different cells.
        }
        let optimum = solve(&program).unwrap_or_else(|| panic!("{seed}"));
        let best = by_enumeration(&program);
        assert!(
            (optimum.objective - best).abs() <= 1e-9 * (1.0 + best),
            "{seed}: {best} {optimum:?}"
        );
    }
}

#[test]
fn every_crown_is_solved_with_a_tight_certificate() {
    let mut scratch = Scratch::default();
    for seed in 0..10_000u64 {
        let n = 20 + (seed as usize * 7919) % if seed.is_multiple_of(50) { 980 } else { 150 };
        let program = crown(seed, n, &shape_of(seed));
        let optimum = solve_with(&program, &mut scratch).unwrap_or_else(|| panic!("{seed}"));
        let gap = optimum.objective - optimum.lower_bound;
        let allowed = 1e-12 * optimum.objective + 1e-14 * program.magnitude();
        assert!((0.0..=allowed).contains(&gap), "{seed}: {gap} of {}", optimum.objective);
        let feasible = |cone: &Cone<4>| cone.at(&optimum.x)[0] >= -1e-12;
        assert!(program.cones.iter().all(feasible), "{seed}");
    }
}

fn assert_near<const K: usize>(a: &[f64; K], b: &[f64; K], what: u64) {
    let distance = (0..K).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max);
    assert!(distance <= 1e-9, "{what}: {a:?} {b:?}");
}

#[test]
fn the_order_of_the_rows_does_not_matter() {
    for seed in 0..2_000 {
        let mut program = crown(seed, 20 + seed as usize % 60, &shape_of(seed));
        let first = solve(&program).unwrap();
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        for i in (1..program.rows.len()).rev() {
            program.rows.swap(i, (random.next_u64() % (i as u64 + 1)) as usize);
        }
        assert_near(&first.x, &solve(&program).unwrap().x, seed);
    }
}

#[test]
fn a_weight_counts_as_repetition() {
    for seed in 0..300 {
        let single = crown(seed, 30, &Shape { weighted: false, ..shape_of(seed) });
        let (mut weighted, mut repeated) = (single.rows.clone(), Vec::new());
        for (i, row) in weighted.iter_mut().enumerate() {
            repeated.extend(std::iter::repeat_n(*row, 1 + i % 3));
            row.w = (1 + i % 3) as f64;
        }
        let [a, b] = [weighted, repeated].map(|rows| Program::new(rows, single.cones.clone()));
        assert_near(&solve(&a).unwrap().x, &solve(&b).unwrap().x, seed);
    }
}

#[test]
fn an_exact_surface_is_found_exactly() {
    for seed in 0..50 {
        let shape = Shape { step: 0.0, noise: 0.0, ..Shape::default() };
        let mut program = crown(seed, 200, &shape);
        let truth = [-1.3, 0.4, -0.2, 0.7];
        program.rows.iter_mut().for_each(|row| row.z = super::super::dense::dot(&row.d, &truth));
        let optimum = solve(&program).unwrap();
        assert_near(&optimum.x, &truth, seed);
        assert!(optimum.objective < 1e-11 && optimum.lower_bound > -1e-9);
    }
}

#[test]
fn the_middle_of_equal_optima_is_taken() {
    // A top between two heights twice: any in between is optimal.
    let row = |r: f64, z: f64| Row { d: [r, 1.0], z, w: 1.0 };
    let rows = [0.0, 1.0].map(|r| [0.0, 1.0, 3.0, 4.5].map(|z| row(r, z - 2.0 * r))).concat();
    let optimum = solve(&Program::new(rows, vec![])).unwrap();
    assert_near(&optimum.x, &[-2.0, 2.125], 0);
    // Its mean lies beyond the interval.
    let rows = [0.0, 1.0].map(|r| [0.0, 1.0, 2.0, 40.0].map(|z| row(r, z - 2.0 * r))).concat();
    let optimum = solve(&Program::new(rows, vec![Cone::linear([-1.0, 0.0], -0.1)])).unwrap();
    assert_near(&optimum.x, &[-2.0, 2.0], 0);
}

#[test]
fn impossible_bounds_end_without_a_result() {
    let mut program = crown(1, 30, &Shape::default());
    program.cones.push(Cone::linear([1.0, 0.0, 0.0, 0.0], -1.0));
    assert_eq!(solve(&program), None);
}

#[test]
fn the_fixed_centre_is_solved_too() {
    for seed in 0..2_000 {
        let crown = crown(seed, 20 + seed as usize % 100, &shape_of(seed));
        let rows = crown.rows.iter().map(|row| Row { d: [row.d[0], 1.0], z: row.z, w: row.w });
        let program = Program::new(rows.collect(), vec![Cone::linear([-1.0, 0.0], -0.8)]);
        let optimum = solve(&program).unwrap();
        let gap = optimum.objective - optimum.lower_bound;
        assert!(gap <= 1e-12 * optimum.objective + 1e-14 * program.magnitude(), "{seed}");
    }
}

//! What must hold for every crown: moved, turned, scaled, repeated, or given more room.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

mod common;

use common::feasible::least_objective;
use common::problems::{Case, Wishes, between};
use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use timberline_crowns::surface::{
    Axes, AxisBounds, Engine, Fit, L2, Method, Paraboloid, Prior, Problem, Shape,
};

/// How far a centre may be from where the data moved it, m.
const CENTRE: f64 = 1e-9;
/// Relative difference of objectives that are one.
const SAME: f64 = 1e-9;
/// The same where a search ends with a gap.
const SEARCHED: f64 = 1e-7;

const EXACT: AxisBounds = AxisBounds::Exact { smallest_m: 0.1, largest_m: 3.0 };

/// A crown without ties: heights are not rounded, so that there is one optimum only.
fn crown(seed: u64, omega: f64, priors: f64) -> Case {
    let wishes = Wishes { cells: [20, 200], omegas: vec![omega], priors, weights: 0.0 };
    let mut case = Case { bounds: EXACT, ..Case::random(seed, &wishes) };
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    case.cells.iter_mut().for_each(|cell| {
        (0..3).for_each(|axis| cell[axis] += between(random, -0.06, 0.06));
    });
    case
}

fn fit(case: &Case) -> Fit {
    case.method(Engine::Dedicated).fit(&case.problem()).unwrap()
}

fn objective(case: &Case) -> f64 {
    fit(case).certificate.unwrap().objective_m
}

fn mapped(case: &Case, map: impl Fn([f64; 3]) -> [f64; 3]) -> Case {
    let cells = case.cells.iter().map(|cell| map(*cell)).collect();
    let at = |c: [f64; 2]| map([c[0], c[1], 0.0]);
    let prior = case.prior.map(|prior| {
        let [x, y, _] = at(prior.centre);
        Prior { centre: [x, y], ..prior }
    });
    Case { cells, prior, ..case.clone() }
}

/// The optimum moves with the data: objectives agree, and so do, if asked, centres.
fn same(
    one: &Case,
    moved: impl Fn([f64; 2]) -> [f64; 2],
    factor: f64,
    other: &Case,
    centres: bool,
) {
    let (a, b) = (fit(one), fit(other));
    let [a_costs, b_costs] = [&a, &b].map(|fit| fit.certificate.unwrap().objective_m);
    let unit = (factor * a_costs).max(least_objective(other));
    let tolerance = if a.certificate.unwrap().nodes > 1 { SEARCHED } else { SAME };
    assert!((factor * a_costs - b_costs).abs() <= tolerance * unit, "{a:?} {b:?}");
    if centres {
        let centre = moved(a.position);
        let off = [0, 1].map(|axis| (b.position[axis] - centre[axis]).abs());
        assert!(off[0].max(off[1]) <= CENTRE, "{off:?} {a:?} {b:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn a_moved_crown(seed in 0u64..100_000, dx in -50.0f64..50.0, dy in -50.0f64..50.0,
                     dz in -99.0f64..99.0, omega in prop::sample::select(vec![0.0, 0.2, 0.5])) {
        for priors in [0.0, 1.0] {
            let case = crown(seed, omega, priors);
            let moved = mapped(&case, |[x, y, z]| [x + dx, y + dy, z + dz]);
            same(&case, |[x, y]| [x + dx, y + dy], 1.0, &moved, omega == 0.0 || priors == 0.0);
        }
    }

    #[test]
    fn a_turned_crown(seed in 0u64..100_000, angle in 0.0f64..6.2,
                      omega in prop::sample::select(vec![0.0, 0.2, 0.5])) {
        check_turned(seed, angle, omega);
    }

    #[test]
    fn a_scaled_crown(seed in 0u64..100_000, factor in 0.2f64..5.0,
                      omega in prop::sample::select(vec![0.0, 0.2, 0.5])) {
        let case = crown(seed, omega, 0.0);
        let mut scaled = mapped(&case, |cell| cell.map(|value| factor * value));
        // Semiaxes are radii one metre below the apex: they grow by the root.
        let [smallest_m, largest_m] = [0.1, 3.0].map(|axis: f64| axis * factor.sqrt());
        scaled.bounds = AxisBounds::Exact { smallest_m, largest_m };
        same(&case, |centre| centre.map(|value| factor * value), factor, &scaled, true);
    }

    #[test]
    fn weights_are_repetitions(seed in 0u64..100_000, omega in prop::sample::select(vec![0.0, 0.2])) {
        for priors in [0.0, 1.0] {
            let mut case = crown(seed, omega, priors);
            case.weights = Some((0..case.cells.len()).map(|i| (i % 4) as f64).collect());
            let mut repeated = Case { weights: None, ..case.clone() };
            let again = |(i, cell): (usize, &[f64; 3])| std::iter::repeat_n(*cell, i % 4);
            repeated.cells = case.cells.iter().enumerate().flat_map(again).collect();
            // On curved cones the solver ends elsewhere within its gap.
            same(&case, |centre| centre, 1.0, &repeated, omega == 0.0);
        }
    }

    #[test]
    fn more_room_is_never_worse(seed in 0u64..100_000) {
        let at_most = |more: f64, less: f64, unit: f64| more <= less + SEARCHED * unit;
        let case = crown(seed, 0.2, 1.0);
        let unit = objective(&Case { prior: None, ..case.clone() }).max(least_objective(&case));
        let mut last = f64::INFINITY;
        for half_width_m in [0.0, 0.1, 0.3, 1.0, 5.0] {
            let prior = case.prior.map(|prior| Prior { half_width_m, ..prior });
            let now = objective(&Case { prior, ..case.clone() });
            prop_assert!(at_most(now, last, last.min(1e9).max(unit)), "delta {half_width_m}: {now} {last}");
            last = now;
        }
        for prior in [None, case.prior] {
            let mut last = f64::INFINITY;
            for omega in [0.0, 0.05, 0.2, 0.5, 0.9, 1.0] {
                let now = objective(&Case { omega, prior, ..case.clone() });
                prop_assert!(at_most(now, last, last.min(1e9).max(unit)), "omega {omega}: {now} {last}");
                last = now;
            }
            let mut last = f64::INFINITY;
            for (smallest_m, largest_m) in [(0.8, 1.0), (0.8, 1.5), (0.3, 1.5), (0.3, 4.0), (0.1, 9.0)] {
                let bounds = AxisBounds::Exact { smallest_m, largest_m };
                let now = objective(&Case { bounds, prior, ..case.clone() });
                prop_assert!(at_most(now, last, last.min(1e9).max(unit)), "{bounds:?}: {now} {last}");
                last = now;
            }
        }
    }

    #[test]
    fn coefficients_to_shape_and_back(x in -50.0f64..50.0, y in -50.0f64..50.0, z in -9.0f64..60.0,
            small in 0.1f64..3.0, ratio in 1.0f64..6.0, azimuth in 0.0f64..3.1) {
        let shape = Shape { centre: [x, y], apex_z_m: z, semiaxes_m: [small * ratio, small], azimuth };
        let there = Paraboloid::from_shape(&shape);
        let back = Paraboloid::from_shape(&there.shape().unwrap());
        let size = there.phi.iter().fold(1.0f64, |size, value| size.max(value.abs()));
        for (a, b) in there.phi.iter().zip(back.phi) {
            prop_assert!((a - b).abs() <= 1e-9 * size, "{there:?} {back:?}");
        }
    }

    #[test]
    fn least_squares_move_turn_and_scale(seed in 0u64..100_000, angle in 0.0f64..6.2,
            factor in 0.2f64..5.0, dx in -50.0f64..50.0) {
        let (sin, cos) = libm::sincos(angle);
        let map = |[x, y, z]: [f64; 3]| {
            [factor * (cos * x - sin * y) + dx, factor * (sin * x + cos * y) - dx, factor * z]
        };
        let case = crown(seed, 0.0, 0.0);
        let moved = mapped(&case, map);
        for axes in [Axes::Equal, Axes::Free] {
            let [a, b] = [&case, &moved].map(|c| L2 { axes }.fit(&Problem::new(&c.cells)).unwrap());
            let [x, y, _] = map([a.position[0], a.position[1], 0.0]);
            // The centre of a nearly flat surface is nowhere.
            if libm::hypot(a.position[0], a.position[1]) < 20.0 {
                let off = libm::hypot(b.position[0] - x, b.position[1] - y);
                prop_assert!(off <= 1e-7, "{off:e} {a:?} {b:?}");
            }
        }
    }
}

/// Turns a crown; it must turn with its data.
fn check_turned(seed: u64, angle: f64, omega: f64) {
    let (sin, cos) = libm::sincos(angle);
    for priors in [0.0, 1.0] {
        // The prior is a box: it turns with the crown only where it is a point.
        let mut case = crown(seed, omega, priors);
        case.prior = case.prior.map(|prior| Prior { half_width_m: 0.0, ..prior });
        let turn = |[x, y, z]: [f64; 3]| [cos * x - sin * y, sin * x + cos * y, z];
        let turned = mapped(&case, turn);
        let moved = |[x, y]: [f64; 2]| {
            let [x, y, _] = turn([x, y, 0.0]);
            [x, y]
        };
        same(&case, moved, 1.0, &turned, true);
    }
}

/// One residual is nought only just: at a gap of 1e-10 it could not be told, and the centre of so
/// flat a surface, 15 m off, was 6e-9 m from where it belongs.
#[test]
fn a_turned_crown_with_a_residual_that_is_hardly_active() {
    (0..40).for_each(|step| check_turned(43391, 0.155 * f64::from(step), 0.5));
}

//! The L1 paraboloid against known surfaces, brute force, shifted frames and every degenerate case.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

use proptest::prelude::*;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use timberline_crowns::Error;
use timberline_crowns::surface::{
    AxisBounds, Engine, Fit, Flag, L1, Method, Paraboloid, Prior, Problem, Shape, Surface, thin,
};

const ENGINES: [Engine; 2] = [Engine::Dedicated, Engine::Clarabel];

fn uniform(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

fn solve(cells: &[[f64; 3]], prior: Option<Prior>) -> Fit {
    solve_with(&L1::default(), cells, prior)
}

fn solve_with(method: &L1, cells: &[[f64; 3]], prior: Option<Prior>) -> Fit {
    method.fit(&Problem { cells, weights: None, prior }).unwrap()
}

/// Equal axes and unequal ones.
fn methods() -> Vec<L1> {
    let method = |omega: f64| ENGINES.map(|engine| L1 { omega, engine, ..L1::default() });
    [0.0, 0.3, 1.0].into_iter().flat_map(method).collect()
}

fn paraboloid(fit: &Fit) -> Paraboloid {
    *fit.surface.as_ref().and_then(Surface::paraboloid).unwrap()
}

fn shape(fit: &Fit) -> Shape {
    paraboloid(fit).shape().unwrap()
}

fn surface(centre: [f64; 2], apex_z_m: f64, axis: f64) -> Paraboloid {
    Paraboloid::from_shape(&Shape { centre, apex_z_m, semiaxes_m: [axis; 2], azimuth: 0.0 })
}

/// Cells of a half-metre grid within a radius, on a surface, moved by `noise`.
fn crown(on: &Paraboloid, radius: f64, mut noise: impl FnMut() -> f64) -> Vec<[f64; 3]> {
    let mut cells = Vec::new();
    for i in -20..20 {
        for j in -20..20 {
            let (x, y) = (f64::from(i) * 0.5 + 0.25, f64::from(j) * 0.5 + 0.25);
            if x * x + y * y < radius * radius {
                cells.push([x, y, on.z(x, y) + noise()]);
            }
        }
    }
    cells
}

fn objective(of: &Paraboloid, cells: &[[f64; 3]]) -> f64 {
    cells.iter().map(|c| (of.z(c[0], c[1]) - c[2]).abs()).sum()
}

#[test]
fn an_exact_surface_is_recovered() {
    let truth = surface([0.3, -0.4], 21.5, 0.9);
    let found = solve(&crown(&truth, 2.5, || 0.0), None);
    let shape = shape(&found);
    assert!((found.position[0] - 0.3).abs() < 1e-6 && (found.position[1] + 0.4).abs() < 1e-6);
    assert!((shape.apex_z_m - 21.5).abs() < 1e-6 && (shape.semiaxes_m[0] - 0.9).abs() < 1e-6);
    assert_eq!(found.flags, []);
}

#[test]
fn a_third_of_outliers_does_not_move_it() {
    let truth = surface([0.3, -0.4], 21.5, 0.9);
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let found = solve(
        &crown(&truth, 3.0, || {
            if uniform(&mut random) < 0.33 { 6.0 * uniform(&mut random) - 4.0 } else { 0.0 }
        }),
        None,
    );
    assert!((found.position[0] - 0.3).abs() < 1e-5 && (found.position[1] + 0.4).abs() < 1e-5);
}

#[test]
fn the_objective_is_that_of_the_best_vertex() {
    // Without active bounds a linear program has an optimum through four of the cells.
    let mut random = ChaCha8Rng::seed_from_u64(4);
    for _ in 0..30 {
        let truth = surface([0.2, 0.1], 10.0, 0.8);
        let cells: Vec<[f64; 3]> = (0..14)
            .map(|_| {
                let (x, y) = (4.0 * uniform(&mut random) - 2.0, 4.0 * uniform(&mut random) - 2.0);
                [x, y, truth.z(x, y) + uniform(&mut random) - 0.5]
            })
            .collect();
        let found = solve(&cells, None);
        let certificate = found.certificate.unwrap();
        let (told, best) = (certificate.objective_m, best_vertex(&cells));
        assert!((told - best).abs() < 1e-9 * best, "{certificate:?} {best}");
        assert!((objective(&paraboloid(&found), &cells) - told).abs() < 1e-9);
        assert!(certificate.relative_gap() <= 1e-9);
    }
}

/// Sum of residuals of the best surface through any four cells, by elimination.
fn best_vertex(cells: &[[f64; 3]]) -> f64 {
    let n = cells.len();
    let mut best = f64::INFINITY;
    for a in 0..n {
        for b in 0..a {
            for c in 0..b {
                for d in 0..c {
                    if let Some([p0, p3, p4, p5]) = through([a, b, c, d].map(|i| cells[i])) {
                        let on = Paraboloid { phi: [p0, p0, 0.0, p3, p4, p5] };
                        if (-100.0..=-1.0 / 9.0).contains(&p0) {
                            best = best.min(objective(&on, cells));
                        }
                    }
                }
            }
        }
    }
    best
}

fn through(points: [[f64; 3]; 4]) -> Option<[f64; 4]> {
    let mut m = points.map(|[x, y, z]| [x * x + y * y, x, y, 1.0, z]);
    for k in 0..4 {
        let pivot = (k..4).max_by(|&i, &j| m[i][k].abs().total_cmp(&m[j][k].abs()))?;
        m.swap(k, pivot);
        if m[k][k].abs() < 1e-9 {
            return None;
        }
        for i in 0..4 {
            if i != k {
                let factor = m[i][k] / m[k][k];
                (0..5).for_each(|j| m[i][j] -= factor * m[k][j]);
            }
        }
    }
    Some([0, 1, 2, 3].map(|k| m[k][4] / m[k][k]))
}

#[test]
fn a_prior_box_holds_the_centre() {
    let truth = surface([1.2, 0.0], 15.0, 0.8);
    let cells = crown(&truth, 2.0, || 0.0);
    for method in methods() {
        for half_width_m in [0.5, 0.1, 0.0] {
            let prior = Prior { centre: [0.0, 0.0], half_width_m };
            let found = solve_with(&method, &cells, Some(prior));
            assert!((found.position[0] - half_width_m).abs() < 1e-5, "{method:?}: {found:?}");
            assert!(found.position[1].abs() <= half_width_m + 1e-5);
            assert!(found.flags.contains(&Flag::PriorActive));
        }
        let prior = Prior { centre: [1.0, 0.0], half_width_m: 0.5 };
        let free = solve_with(&method, &cells, Some(prior));
        assert!((free.position[0] - 1.2).abs() < 1e-6 && !free.flags.contains(&Flag::PriorActive));
    }
}

#[test]
fn the_box_costs_nothing_but_what_it_must() {
    // Every sampled surface within the box is at least as bad.
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let truth = surface([0.9, 0.3], 15.0, 0.8);
    let cells = crown(&truth, 2.0, || 0.4 * uniform(&mut random));
    let prior = Prior { centre: [0.0, 0.0], half_width_m: 0.4 };
    let best = solve(&cells, Some(prior)).certificate.unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(80);
    for _ in 0..2000 {
        let [x, y, axis] = [(); 3].map(|()| uniform(&mut random));
        let z = 14.0 + 2.0 * uniform(&mut random);
        let any = surface([0.8 * x - 0.4, 0.8 * y - 0.4], z, 0.3 + axis);
        assert!(objective(&any, &cells) >= best.objective_m - 1e-6);
    }
}

#[test]
fn an_ambiguous_optimum_is_settled_by_least_squares() {
    // Two heights on each of four symmetric positions and one above the middle: every surface
    // between the pairs is optimal; the mean of each pair has the smallest squares.
    let mut cells = Vec::new();
    for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        cells.extend([[x, y, 9.0], [x, y, 8.0]]);
    }
    cells.extend([[0.0, 0.0, 10.0], [0.0, 0.0, 10.6]]);
    let shape = shape(&solve(&cells, None));
    assert!((shape.apex_z_m - 10.3).abs() < 1e-3, "{shape:?}");
    let at_one = shape.apex_z_m - 1.0 / (shape.semiaxes_m[0] * shape.semiaxes_m[0]);
    assert!((at_one - 8.5).abs() < 1e-3, "{shape:?}");
}

#[test]
fn a_shifted_frame_gives_the_same_bits() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let world: Vec<[f64; 3]> = (0..300)
        .map(|_| {
            let [x, y, z] = [(); 3].map(|()| uniform(&mut random));
            let (x, y) = (557_812.0 + 5.0 * x, 4_112_310.0 + 5.0 * y);
            [x, y, 820.0 + z].map(timberline_pointcloud::frame::quantise)
        })
        .collect();
    let apex = world[0];
    let fit_in = |points: Vec<[f64; 3]>| {
        let cells = thin(points, apex, 0.4).unwrap();
        let found = solve(&cells, Some(Prior { centre: [0.0; 2], half_width_m: 0.5 }));
        (found.position.map(f64::to_bits), found.certificate.unwrap().objective_m.to_bits())
    };
    let mut moved = Vec::new();
    for origin in [[557_000, 4_112_000, 0], [557_808, 4_112_256, 800], [-12, 99, 7]] {
        let frame = timberline_pointcloud::Frame::new(origin);
        let local: Vec<[f64; 3]> = world.iter().map(|p| frame.local_from_world(*p)).collect();
        moved.push(fit_in(local.iter().rev().map(|p| frame.world_from_local(*p)).collect()));
    }
    assert!(moved.iter().all(|result| *result == fit_in(world.clone())));
}

// The table of degenerate input: a row, a test.

#[test]
fn fewer_than_four_cells() {
    for method in methods() {
        let found = solve_with(&method, &[[0.0, 0.0, 5.0], [1.0, 0.0, 7.0], [0.0, 1.0, 6.0]], None);
        assert_eq!(found.flags, [Flag::Underdetermined]);
        assert_eq!((found.position, found.surface), ([1.0, 0.0], None));
        assert_eq!(found.certificate, None);
    }
}

#[test]
fn cells_on_a_line() {
    let cells: Vec<[f64; 3]> = (0..20)
        .map(|i| [0.5 * f64::from(i), 0.2 * f64::from(i) + 0.1, 9.0 - f64::from(i % 5)])
        .collect();
    for method in methods() {
        let found = solve_with(&method, &cells, None);
        assert_eq!((found.flags, found.position), (vec![Flag::Underdetermined], [0.0, 0.1]));
    }
}

#[test]
fn cells_on_a_circle() {
    let cells: Vec<[f64; 3]> = (0..12)
        .map(|i| {
            let (sin, cos) = libm::sincos(f64::from(i) * 0.5);
            [2.0 * cos + 300.0, 2.0 * sin - 7.0, f64::from(i)]
        })
        .collect();
    for method in methods() {
        assert_eq!(solve_with(&method, &cells, None).flags, [Flag::Underdetermined]);
    }
}

#[test]
fn cells_on_other_conics() {
    let around = |i: u32| libm::sincos(f64::from(i) * 0.5);
    let ellipse = (0..12).map(around).map(|(sin, cos)| [2.0 * cos + sin, sin, cos]).collect();
    let parabola = (0..12).map(|i| f64::from(i) * 0.3).map(|x| [x, 0.5 * x * x, -x]).collect();
    let hyperbola = (1..12).map(|i| f64::from(i) * 0.3).map(|x| [x, 1.0 / x, x]).collect();
    let lines = (0..12).map(|i| [f64::from(i / 2) * 0.5, f64::from(i % 2), 3.0]).collect();
    for cells in [ellipse, parabola, hyperbola, lines] {
        let cells: Vec<[f64; 3]> = cells;
        for method in methods() {
            let found = solve_with(&method, &cells, None);
            let underdetermined = found.flags == [Flag::Underdetermined];
            assert_eq!(underdetermined, method.omega > 0.0, "{method:?} {found:?}");
            assert_eq!(underdetermined, found.surface.is_none());
        }
    }
}

#[test]
fn cells_without_weight_do_not_count() {
    let mut cells = crown(&surface([0.3, -0.4], 21.5, 0.9), 2.0, || 0.0);
    let weights: Vec<f64> = (0..cells.len()).map(|i| if i < 3 { 1.0 } else { 0.0 }).collect();
    cells[5][2] = 99.0;
    for method in methods() {
        let found = method.fit(&Problem::new(&cells).with_weights(&weights)).unwrap();
        assert_eq!(found.flags, [Flag::Underdetermined]);
        assert!(cells[..3].iter().any(|cell| cell[..2] == found.position));
    }
}

#[test]
fn exactly_four_cells() {
    let truth = surface([0.5, 0.5], 10.0, 0.9);
    let cells =
        [[0.0, 0.0], [1.5, 0.2], [0.4, 1.6], [0.7, 0.6]].map(|[x, y]| [x, y, truth.z(x, y)]);
    for engine in ENGINES {
        let found = solve_with(&L1 { engine, ..L1::default() }, &cells, None);
        assert!(found.flags.contains(&Flag::NoRedundancy), "{found:?}");
        assert!((found.position[0] - 0.5).abs() < 1e-5);
        let elliptic = solve_with(&L1 { omega: 0.3, engine, ..L1::default() }, &cells, None);
        assert_eq!(elliptic.flags, [Flag::Underdetermined]);
    }
}

#[test]
fn exactly_six_cells() {
    let truth = Shape { centre: [0.5, 0.5], apex_z_m: 9.0, semiaxes_m: [1.0, 0.8], azimuth: 1.0 };
    let truth = Paraboloid::from_shape(&truth);
    let positions = [[0.0, 0.0], [1.5, 0.2], [0.4, 1.6], [0.7, 0.6], [1.2, 1.3], [0.1, 0.9]];
    let cells = positions.map(|[x, y]| [x, y, truth.z(x, y)]);
    for method in methods().into_iter().filter(|method| method.omega > 0.0) {
        let found = solve_with(&method, &cells, None);
        assert!(found.flags.contains(&Flag::NoRedundancy), "{found:?}");
        assert!((found.position[0] - 0.5).abs() < 1e-4, "{found:?}");
    }
}

#[test]
fn flat_bowl_and_needle() {
    for height in [|_: f64| 12.0, |r2: f64| 12.0 + 0.3 * r2, |r2: f64| 12.0 - 400.0 * r2] {
        let mut cells = crown(&surface([0.0; 2], 12.0, 1.0), 2.0, || 0.0);
        cells.iter_mut().for_each(|c| c[2] = height(c[0] * c[0] + c[1] * c[1]));
        for method in methods() {
            let found = solve_with(&method, &cells, None);
            assert!(found.flags.contains(&Flag::ShapeBoundActive), "{method:?} {found:?}");
            assert!(found.position.iter().all(|value| value.is_finite()));
        }
    }
}

#[test]
fn a_tilted_plane() {
    let mut cells = crown(&surface([0.0; 2], 12.0, 1.0), 2.0, || 0.0);
    cells.iter_mut().for_each(|c| c[2] = 12.0 + 0.8 * c[0]);
    for method in methods() {
        let found = solve_with(&method, &cells, None);
        assert!(found.flags.contains(&Flag::CentreOutsideData), "{method:?} {found:?}");
    }
}

#[test]
fn one_flank() {
    let truth = surface([0.0; 2], 12.0, 1.0);
    let mut cells = crown(&truth, 2.5, || 0.0);
    cells.retain(|c| c[0] > 0.0);
    for method in methods() {
        let found = solve_with(&method, &cells, None);
        assert!(found.flags.contains(&Flag::OneSided), "{method:?} {found:?}");
        assert!(found.position[0].abs() < 1e-5);
    }
}

#[test]
fn centre_on_the_box_and_imbalance_at_its_most() {
    let truth = Shape { centre: [1.0, 0.2], apex_z_m: 12.0, semiaxes_m: [1.4, 0.7], azimuth: 0.5 };
    let cells = crown(&Paraboloid::from_shape(&truth), 2.5, || 0.0);
    let prior = Some(Prior { centre: [0.0; 2], half_width_m: 0.5 });
    for engine in ENGINES {
        let method = L1 { omega: 0.2, engine, ..L1::default() };
        let found = solve_with(&method, &cells, prior);
        assert_eq!(found.flags, [Flag::ImbalanceActive, Flag::PriorActive]);
        let axes = shape(&found).semiaxes_m.map(|axis| 1.0 / (axis * axis));
        assert!(((axes[1] - axes[0]) / (axes[1] + axes[0]) - 0.2).abs() < 1e-6, "{axes:?}");
        let free = solve_with(&L1 { omega: 1.0, ..method }, &cells, None);
        assert_eq!(free.flags, []);
        assert!((shape(&free).azimuth - 0.5).abs() < 1e-5, "{free:?}");
    }
}

#[test]
fn what_means_nothing_is_an_error() {
    let cells = crown(&surface([0.0; 2], 12.0, 1.0), 2.0, || 0.0);
    let with = |method: &L1, problem: Problem<'_>| method.fit(&problem).unwrap_err();
    for method in methods() {
        for (value, axis, place) in [(f64::NAN, 'z', 2), (f64::INFINITY, 'x', 0)] {
            let mut broken = cells.clone();
            broken[7][place] = value;
            let error = with(&method, Problem::new(&broken));
            assert!(matches!(error, Error::NotFinite { index: 7, axis: a, .. } if a == axis));
        }
        assert_eq!(with(&method, Problem::new(&[])), Error::NoCells);
        for half_width_m in [-0.1, f64::NAN, f64::INFINITY] {
            let problem = Problem::new(&cells).with_prior(Prior { centre: [0.0; 2], half_width_m });
            assert!(matches!(with(&method, problem), Error::Prior { .. }));
        }
        let problem =
            Problem::new(&cells).with_prior(Prior { centre: [f64::NAN, 0.0], half_width_m: 1.0 });
        assert!(matches!(with(&method, problem), Error::Prior { .. }));
    }
}

#[test]
fn bounds_that_mean_nothing_are_an_error() {
    let cells = crown(&surface([0.0; 2], 12.0, 1.0), 2.0, || 0.0);
    let with = |method: &L1| method.fit(&Problem::new(&cells)).unwrap_err();
    for omega in [-0.1, 1.1, f64::NAN] {
        assert!(matches!(with(&L1 { omega, ..L1::default() }), Error::Omega(_)));
    }
    for largest_m in [0.0, -1.0, f64::NAN, f64::INFINITY, 0.05] {
        let bounds = AxisBounds::Exact { largest_m, smallest_m: 0.1 };
        assert!(matches!(with(&L1 { bounds, ..L1::default() }), Error::AxisBounds { .. }));
    }
    for (largest_m, omega) in [(0.0, 0.0), (-1.0, 0.2), (f64::NAN, 0.2), (3.0, 1.0)] {
        let method = L1 { omega, bounds: AxisBounds::Paper { largest_m }, ..L1::default() };
        assert!(matches!(with(&method), Error::PaperBound { .. }), "{method:?}");
    }
}

#[test]
fn weights_that_mean_nothing_are_an_error() {
    let cells = crown(&surface([0.0; 2], 12.0, 1.0), 2.0, || 0.0);
    let with = |weights: &[f64]| {
        L1::default().fit(&Problem::new(&cells).with_weights(weights)).unwrap_err()
    };
    let mut weights = vec![0.0; cells.len()];
    assert_eq!(with(&weights), Error::NoCells);
    assert!(matches!(with(&weights[1..]), Error::WeightCount { .. }));
    for wrong in [-1.0, f64::NAN, f64::INFINITY] {
        weights[3] = wrong;
        assert!(matches!(with(&weights), Error::Weight { index: 3, .. }));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn noise_is_averaged(x in -0.4f64..0.4, y in -0.4f64..0.4, axis in 0.5f64..1.5, seed in 0u64..999) {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let truth = surface([x, y], 20.0, axis);
        let found = solve(&crown(&truth, 2.5, || 0.3 * uniform(&mut random) - 0.15), None);
        let (dx, dy) = (found.position[0] - x, found.position[1] - y);
        prop_assert!((dx * dx + dy * dy).sqrt() < 0.15, "{dx} {dy}");
        let best = objective(&truth, &crown(&truth, 2.5, {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            move || 0.3 * uniform(&mut random) - 0.15
        }));
        prop_assert!(found.certificate.unwrap().objective_m <= best + 1e-6);
    }
}

#[test]
fn the_standard_error_is_the_scatter_of_repeated_fits() {
    let truth = surface([0.1, -0.2], 20.0, 0.9);
    let (mut squares, mut claimed) = (0.0, 0.0);
    const REPEATS: u32 = 300;
    for seed in 0..REPEATS {
        let mut random = ChaCha8Rng::seed_from_u64(u64::from(seed));
        // A sum of uniforms: nearly normal, standard deviation 0.3 m.
        let noise = || (0..12).map(|_| uniform(&mut random)).sum::<f64>() * 0.3 - 1.8;
        let cells = crown(&truth, 2.5, noise);
        let found = solve(&cells, None);
        let uncertainty = L1::default().uncertainty(&Problem::new(&cells), &found).unwrap();
        let (dx, dy) = (found.position[0] - 0.1, found.position[1] + 0.2);
        squares += dx * dx + dy * dy;
        claimed += uncertainty.unwrap().standard_error_m;
    }
    let scatter = (squares / f64::from(REPEATS)).sqrt();
    let ratio = claimed / f64::from(REPEATS) / scatter;
    assert!((0.8..1.25).contains(&ratio), "claimed / scatter = {ratio}, scatter {scatter} m");
}

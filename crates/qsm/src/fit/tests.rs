//! Bias and honesty of the fit on cylinders with known radius.

use super::*;
use crate::testing::Random;
use std::f64::consts::PI;
use timberline_solids::vector::{across, cross, unit};

/// A cylinder seen by a scanner.
struct Scene {
    radius_m: f64,
    arc_deg: f64,
    points: usize,
    noise_m: f64,
    outliers: f64,
    slope: [f64; 2],
}

const PLAIN: Scene = Scene {
    radius_m: 0.1,
    arc_deg: 360.0,
    points: 50,
    noise_m: 0.003,
    outliers: 0.0,
    slope: [0.0; 2],
};

impl Scene {
    fn samples(&self, random: &mut Random) -> Vec<Sample> {
        let from = random.between(0.0, 2.0 * PI);
        let axis = unit([self.slope[0], self.slope[1], 1.0]).unwrap();
        let first = across(axis);
        let second = cross(axis, first);
        let one = |_| {
            let along = random.between(-0.2, 0.2);
            let angle = from + random.between(0.0, self.arc_deg.to_radians());
            let outlier = random.between(0.0, 1.0) < self.outliers;
            let distance = if outlier {
                self.radius_m * random.between(1.0, 3.0)
            } else {
                self.radius_m + self.noise_m * random.normal()
            };
            let (sin, cos) = libm::sincos(angle);
            let at: [f64; 3] = std::array::from_fn(|k| {
                along * axis[k] + distance * (cos * first[k] + sin * second[k])
            });
            let across_m = [0.01 + at[0], -0.02 + at[1]];
            Sample { across_m, along_m: at[2], weight: 1.0 }
        };
        (0..self.points).map(one).collect()
    }

    fn expected(&self) -> Expected {
        Expected { radius_m: 1.3 * self.radius_m, noise_m: self.noise_m, noise_weight: 6.0 }
    }
}

/// Mean error over the truth, share of errors within one and two standard errors, and of fits made.
struct Honesty {
    bias: f64,
    within_one: f64,
    within_two: f64,
    made: f64,
}

fn honesty(scene: &Scene) -> Honesty {
    const SEEDS: u64 = 500;
    let (mut bias, mut one, mut two, mut made) = (0.0, 0.0, 0.0, 0.0);
    for seed in 0..SEEDS {
        let samples = scene.samples(&mut Random::new(seed));
        let Some(fit) = fit(&samples, &scene.expected()) else { continue };
        let error = fit.radius_m - scene.radius_m;
        made += 1.0;
        bias += error / scene.radius_m;
        one += f64::from(u8::from(error.abs() <= fit.radius_sd_m));
        two += f64::from(u8::from(error.abs() <= 2.0 * fit.radius_sd_m));
    }
    Honesty {
        bias: bias / made,
        within_one: one / made,
        within_two: two / made,
        made: made / SEEDS as f64,
    }
}

fn check(name: &str, scene: &Scene, most_bias: f64) {
    let found = honesty(scene);
    println!(
        "{name}: bias {:+.2} %, {:.0} % and {:.0} % within one and two standard errors, {:.0} % made",
        found.bias * 100.0,
        found.within_one * 100.0,
        found.within_two * 100.0,
        found.made * 100.0
    );
    assert!(found.made > 0.98, "{name}: {} made", found.made);
    assert!(found.bias.abs() <= most_bias, "{name}: bias {}", found.bias);
    assert!((0.58..=0.80).contains(&found.within_one), "{name}: {} within one", found.within_one);
    assert!(found.within_two >= 0.89, "{name}: {} within two", found.within_two);
}

#[test]
fn the_standard_error_is_honest_whatever_the_arc() {
    for (arc_deg, most_bias) in [(360.0, 0.004), (180.0, 0.01), (90.0, 0.02), (60.0, 0.06)] {
        check(&format!("arc {arc_deg}"), &Scene { arc_deg, ..PLAIN }, most_bias);
    }
}

#[test]
fn the_standard_error_is_honest_with_few_points() {
    for (points, arc_deg) in [(6, 360.0), (8, 360.0), (8, 180.0), (12, 180.0), (20, 120.0)] {
        let name = format!("{points} points on {arc_deg} degrees");
        check(&name, &Scene { points, arc_deg, ..PLAIN }, 0.03);
    }
}

#[test]
fn a_third_of_outliers_does_no_harm() {
    for (points, arc_deg) in [(50, 360.0), (30, 360.0), (60, 180.0), (100, 90.0)] {
        let scene = Scene { points, arc_deg, outliers: 0.3, ..PLAIN };
        check(&format!("outliers, {points} points on {arc_deg} degrees"), &scene, 0.03);
    }
}

#[test]
fn a_leaning_axis_is_found() {
    check("leaning", &Scene { slope: [0.15, -0.1], points: 80, ..PLAIN }, 0.005);
    let scene = Scene { slope: [0.2, 0.0], points: 400, ..PLAIN };
    let found = fit(&scene.samples(&mut Random::new(7)), &scene.expected()).unwrap();
    assert!((found.slope[0] - 0.2).abs() < 0.01 && found.slope[1].abs() < 0.01, "{found:?}");
    assert!((found.offset_m[0] - 0.01).abs() < 0.002 && (found.offset_m[1] + 0.02).abs() < 0.002);
}

#[test]
fn thin_branches_are_not_inflated_by_noise() {
    for radius_m in [0.02, 0.01] {
        let scene = Scene { radius_m, points: 40, ..PLAIN };
        let found = honesty(&scene);
        println!("radius {radius_m}: bias {:+.2} %", found.bias * 100.0);
        assert!(found.bias.abs() < 0.06, "radius {radius_m}: {}", found.bias);
    }
}

#[test]
fn leaves_fill_what_wood_does_not() {
    let scene = Scene { points: 60, ..PLAIN };
    let mut random = Random::new(3);
    let stem = fit(&scene.samples(&mut random), &scene.expected()).unwrap();
    let leaf = |_| {
        let across_m = [random.between(-0.1, 0.1), random.between(-0.1, 0.1)];
        Sample { across_m, along_m: random.between(-0.2, 0.2), weight: 1.0 }
    };
    let cluster: Vec<Sample> = (0..60).map(leaf).collect();
    let leaves = fit(&cluster, &scene.expected()).unwrap();
    assert!(stem.inside_share < 0.02 && stem.surface_share > 0.9, "{stem:?}");
    assert!(leaves.inside_share > 0.2 || leaves.surface_share < 0.5, "{leaves:?}");
}

#[test]
fn unlikely_wood_counts_little() {
    let scene = Scene { points: 40, ..PLAIN };
    let mut random = Random::new(11);
    let mut samples = scene.samples(&mut random);
    // A denser surface of leaves at half the radius again.
    let shell = Scene { radius_m: 0.15, points: 60, ..PLAIN };
    samples.extend(shell.samples(&mut random).into_iter().map(|s| Sample { weight: 0.1, ..s }));
    let found = fit(&samples, &scene.expected()).unwrap();
    assert!((found.radius_m - 0.1).abs() < 0.003, "{found:?}");
}

#[test]
fn too_little_is_no_fit_and_no_harm() {
    let line = |i: usize| Sample { across_m: [i as f64 * 0.01, 0.0], along_m: 0.0, weight: 1.0 };
    let line: Vec<Sample> = (0..20).map(line).collect();
    let same = vec![Sample { across_m: [0.1, 0.1], along_m: 0.0, weight: 1.0 }; 30];
    assert_eq!(fit(&same, &PLAIN.expected()), None);
    assert_eq!(fit(&line[..5], &PLAIN.expected()), None);
    if let Some(found) = fit(&line, &PLAIN.expected()) {
        assert!(found.radius_sd_m > 0.25 * found.radius_m, "{found:?}");
    }
}

use super::*;
use proptest::prelude::*;

const SETTINGS: Settings = Settings {
    weights: Weights::Paper,
    mu: 0.45,
    iterations: 20,
    reach_ratio: 1.0,
    still_ratio: 0.0,
};

const EVEN: Settings = Settings { weights: Weights::Even, reach_ratio: 0.5, ..SETTINGS };

/// A repeatable number in 0 to 1 (SplitMix64, Steele et al. 2014).
fn noise(seed: u64) -> f64 {
    let mut v = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    v = (v ^ (v >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((v ^ (v >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// A noisy plane of 1 m² with `count` points.
fn plane(count: u64, noise_m: f64) -> Vec<[f64; 3]> {
    let at = |i| [noise(5 * i), noise(5 * i + 1), noise_m * (2.0 * noise(5 * i + 2) - 1.0)];
    (0..count).map(at).collect()
}

/// The formulas of the module's head, term by term in double precision over all pairs.
fn by_the_formulas(
    points: &[[f64; 3]],
    samples: &[u32],
    h_m: &[f64],
    settings: &Settings,
) -> Vec<[f64; 3]> {
    let between = |p: [f64; 3], q: [f64; 3]| {
        let [x, y, z] = [q[0] - p[0], q[1] - p[1], q[2] - p[2]];
        (x * x + y * y + z * z).sqrt()
    };
    let theta = |r: f64, h: f64| {
        let inside = r <= h * settings.reach_ratio;
        if inside { libm::exp(-(r * r) / (h / 4.0 * (h / 4.0))) } else { 0.0 }
    };
    let density = |cloud: &[[f64; 3]], h: &[f64]| -> Vec<f64> {
        let of = |i: usize| {
            let others = (0..cloud.len()).filter(|j| *j != i);
            1.0 + others.map(|j| theta(between(cloud[i], cloud[j]), h[i].min(h[j]))).sum::<f64>()
        };
        (0..cloud.len()).map(of).collect()
    };
    // Weighted mean of the offsets from `x` to a cloud.
    let mean = |x: [f64; 3],
                h_x: f64,
                cloud: &[[f64; 3]],
                h: &[f64],
                w: &[f64],
                power: u32,
                others: bool| {
        let (mut sum, mut offset) = (0.0, [0.0; 3]);
        for j in 0..cloud.len() {
            let r = between(x, cloud[j]);
            if others && r == 0.0 {
                continue;
            }
            let soft = (r * r + f64::from(kernel::SOFTENING) * h_x * h_x / 16.0).sqrt();
            let weight = theta(r, h_x.min(h[j])) * w[j] / [1.0, soft, soft * soft][power as usize];
            sum += weight;
            (0..3).for_each(|k| offset[k] += weight * (cloud[j][k] - x[k]));
        }
        if sum > 0.0 { offset.map(|o| o / sum) } else { [0.0; 3] }
    };
    let weights: Vec<f64> = density(points, h_m).iter().map(|v| 1.0 / v).collect();
    let h_x: Vec<f64> = samples.iter().map(|&s| h_m[s as usize]).collect();
    let mut x: Vec<[f64; 3]> = samples.iter().map(|&s| points[s as usize]).collect();
    for iteration in 0..settings.iterations {
        let w = density(&x, &h_x);
        let (powers, mu) = match settings.weights {
            Weights::Even => ([0, 2], settings.mu),
            Weights::Paper if iteration == 0 => ([0, 1], 0.0),
            Weights::Paper => ([1, 1], settings.mu),
        };
        let next = |i: usize| {
            let pull = mean(x[i], h_x[i], points, h_m, &weights, powers[0], false);
            let push = mean(x[i], h_x[i], &x, &h_x, &w, powers[1], true);
            [0, 1, 2].map(|k| x[i][k] + pull[k] - mu * push[k])
        };
        x = (0..x.len()).map(next).collect();
    }
    x
}

fn largest_difference(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn as_the_formulas_say() {
    let points = plane(300, 0.02);
    let samples: Vec<u32> = (0..300).step_by(2).collect();
    let own: Vec<f64> = (0..300).map(|i| 0.05 + 0.4 * noise(i)).collect();
    for settings in [SETTINGS, EVEN].map(|s| Settings { iterations: 5, ..s }) {
        for (radius, h_m) in
            [(Radius::Everywhere(0.3), &[0.3; 300][..]), (Radius::OfPoints(&own), &own)]
        {
            let made = project(&points, &samples, radius, &settings).unwrap();
            let expected = by_the_formulas(&points, &samples, h_m, &settings);
            let difference = largest_difference(&made.positions_m, &expected);
            assert!(difference < 3e-6, "{settings:?}: {difference:e}");
        }
    }
}

/// Root mean square of z and mean and relative standard deviation of the distance to the nearest
/// other, of what lies well inside the square.
fn evenness(cloud: &[[f64; 3]]) -> [f64; 3] {
    let inner = |p: &&[f64; 3]| p[..2].iter().all(|v| (0.15..0.85).contains(v));
    let gap = |p: &[f64; 3]| {
        let gaps = cloud.iter().map(|q| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2));
        gaps.filter(|squared| *squared > 0.0).fold(1.0, f64::min).sqrt()
    };
    let inside: Vec<&[f64; 3]> = cloud.iter().filter(inner).collect();
    let mean = |value: &dyn Fn(&[f64; 3]) -> f64| {
        inside.iter().map(|p| value(p)).sum::<f64>() / inside.len() as f64
    };
    let (square, gap_mean) = (mean(&|p| p[2] * p[2]), mean(&gap));
    [square.sqrt(), gap_mean, (mean(&|p| gap(p).powi(2)) - gap_mean * gap_mean).sqrt() / gap_mean]
}

#[test]
fn noise_across_a_plane_goes_away_and_samples_spread_evenly() {
    let points = plane(4000, 0.01);
    let samples: Vec<u32> = (0..2000).collect();
    let [noise_m, gap_m, uneven] = evenness(&points[..2000]);
    assert!(noise_m > 0.0055 && gap_m < 0.012 && uneven > 0.5, "{noise_m} {gap_m} {uneven}");
    for (settings, most_m, least_gap_m, most_uneven) in
        [(SETTINGS, 0.0035, 0.0115, 0.45), (EVEN, 0.0012, 0.018, 0.2)]
    {
        let made = project(&points, &samples, Radius::Everywhere(0.16), &settings).unwrap();
        let [noise_m, gap_m, uneven] = evenness(&made.positions_m);
        let weights = settings.weights;
        println!("{weights:?}: noise {:.2} mm, gaps vary by {:.0} %", 1e3 * noise_m, 1e2 * uneven);
        let good = noise_m < most_m && gap_m > least_gap_m && uneven < most_uneven;
        assert!(good, "{weights:?}: {noise_m} {gap_m} {uneven}");
    }
}

#[test]
fn iterations_end_when_samples_are_still() {
    let points = plane(1000, 0.01);
    let samples: Vec<u32> = (0..1000).step_by(3).collect();
    let settings = Settings { iterations: 200, still_ratio: 0.002, ..EVEN };
    let early = project(&points, &samples, Radius::Everywhere(0.2), &settings).unwrap();
    assert!((3..200).contains(&early.iterations), "{}", early.iterations);
    assert!(early.last_move_ratio < 0.002);
    let settings = Settings { still_ratio: 0.0, ..settings };
    let all = project(&points, &samples, Radius::Everywhere(0.2), &settings).unwrap();
    assert_eq!(all.iterations, 200);
}

#[test]
fn duplicates_and_far_points_stay_finite() {
    let mut points = vec![[0.25, 0.5, 0.0]; 40];
    points.extend([[5e6, 0.0, 0.0], [-5e6, 3.0, 8.0], [0.2501, 0.5, 0.0]]);
    let samples: Vec<u32> = (0..points.len() as u32).collect();
    let made = project(&points, &samples, Radius::Everywhere(0.05), &SETTINGS).unwrap();
    assert!(made.positions_m.iter().flatten().all(|v| v.is_finite()));
    assert_eq!(made.positions_m[40..42], points[40..42]);
    assert!(made.positions_m[..40].iter().all(|p| *p == made.positions_m[0]));
}

#[test]
fn nothing_comes_of_nothing() {
    let none = project(&[], &[], Radius::Everywhere(0.1), &SETTINGS).unwrap();
    assert!(none.positions_m.is_empty());
    let none = project(&[[0.0; 3]], &[], Radius::OfPoints(&[1.0]), &SETTINGS).unwrap();
    assert!(none.positions_m.is_empty());
}

#[test]
fn what_does_not_fit_is_named() {
    let said = |points: &[[f64; 3]], samples: &[u32], radius: Radius<'_>, settings: Settings| {
        project(points, samples, radius, &settings).unwrap_err().to_string()
    };
    let (one, h) = ([[0.0, f64::NAN, 0.0]], Radius::Everywhere(0.1));
    assert!(said(&one, &[], h, SETTINGS).starts_with("point 0 has y = NaN m"));
    assert!(said(&[[1e9, 0.0, 0.0]], &[], h, SETTINGS).contains("x = 1000000000 m"));
    let ok = [[0.0; 3]];
    assert!(said(&ok, &[3], h, SETTINGS).contains("sample 3 of a cloud of 1 points"));
    assert!(said(&ok, &[0], Radius::Everywhere(0.0), SETTINGS).contains("support radius 0 m"));
    assert!(
        said(&ok, &[0], Radius::OfPoints(&[]), SETTINGS).contains("`radius` has 0 values for 1")
    );
    let bad = Settings { mu: 0.5, reach_ratio: 2.0, ..SETTINGS };
    let text = said(&ok, &[0], h, bad);
    assert!(text.contains("`mu` is 0.5") && text.contains("`reach_ratio` is 2"), "{text}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn order_and_threads_change_no_byte(
        seed in 0u64..1_000_000, count in 1usize..400, own in prop::bool::ANY, turn in 0usize..400,
    ) {
        let points: Vec<[f64; 3]> =
            (0..count as u64).map(|i| [0, 1, 2].map(|k| noise(seed + 3 * i + k))).collect();
        let h_m: Vec<f64> = (0..count as u64).map(|i| 0.02 + 0.3 * noise(seed ^ i)).collect();
        let samples: Vec<u32> = (0..count as u32).filter(|i| i % 3 > 0).collect();
        let few = Settings { iterations: 3, ..EVEN };
        let run = |points: &[[f64; 3]], samples: &[u32], h_m: &[f64], threads| {
            let radius = if own { Radius::OfPoints(h_m) } else { Radius::Everywhere(0.2) };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| project(points, samples, radius, &few)).unwrap()
        };
        let one = run(&points, &samples, &h_m, 1);
        prop_assert_eq!(&one, &run(&points, &samples, &h_m, 2));
        // Turned round by some places, and back to front.
        let place = |i: usize| count - 1 - (i + turn) % count;
        let (mut other, mut other_h) = (points.clone(), h_m.clone());
        (0..count).for_each(|i| (other[place(i)], other_h[place(i)]) = (points[i], h_m[i]));
        let others: Vec<u32> = samples.iter().rev().map(|&s| place(s as usize) as u32).collect();
        let mut two = run(&other, &others, &other_h, 2);
        two.positions_m.reverse();
        prop_assert_eq!(one, two);
    }
}

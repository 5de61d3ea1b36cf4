use super::super::points::Label;
use super::super::scan_params::Layout;
use super::super::shapes::{bent_tube, pole, y_fork};
use super::super::vector::{dot, sub, unit};
use super::super::{TreeSize, TreeSpecies, grow};
use super::*;

fn coarse() -> ScanParams {
    ScanParams::tls().with_step(0.3)
}

fn one_position(distance_m: f64) -> ScanParams {
    let layout = Layout::Ring { positions: 1, distance_m, instrument_m: 1.5, arc_deg: 0.0 };
    ScanParams { layout, ..coarse() }
}

fn beech() -> TreeModel {
    let size = TreeSize::of_dbh(TreeSpecies::EuropeanBeech, 0.2);
    grow(TreeSpecies::EuropeanBeech, &size, 4).unwrap().at([500_000.25, 5_000_000.5, 1000.0])
}

#[test]
fn without_noise_points_lie_on_the_surface() {
    for shape in
        [pole(6.0, 0.2, 0.1), bent_tube(4.0, 80.0, 0.1, 40), y_fork(2.0, 2.5, 30.0, 0.15, 0.1)]
    {
        let points = scan_tree(&shape, &coarse().exact(), 1).unwrap();
        assert!(points.len() > 500);
        for i in 0..points.len() {
            // Positions are rounded to 0.1 mm.
            let distance = shape.distance_m(points.cloud.world(i));
            assert!(distance < 1e-4, "{distance} at {:?}", points.cloud.world(i));
        }
    }
}

#[test]
fn noise_is_along_the_beam_and_of_its_size() {
    let tree = pole(8.0, 0.25, 0.25);
    let params = ScanParams { range_noise_m: 0.004, ..one_position(6.0).exact() };
    let points = scan_tree(&tree, &ScanParams { range_noise_m: 0.004, ..params }, 1).unwrap();
    let station = points.stations[0].position_m;
    let mut squares = Vec::new();
    for i in 0..points.len() {
        let at = points.cloud.world(i);
        // Only where the beam meets the stem squarely is the noise a distance.
        let ray = unit(sub(at, station));
        let axis = unit([-at[0], -at[1], 0.0]);
        if at[2] < 7.9 && dot(ray, axis) > 0.97 {
            let off = libm::hypot(at[0], at[1]) - 0.25;
            squares.push(off * off);
        }
    }
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!(squares.len() > 200 && (rms - 0.004).abs() < 0.0006, "{rms} of {}", squares.len());
}

#[test]
fn nothing_is_seen_behind_wood() {
    let tree = pole(6.0, 0.2, 0.15);
    let points = scan_tree(&tree, &one_position(5.0).exact(), 1).unwrap();
    let station = points.stations[0].position_m;
    for i in 0..points.len() {
        let at = points.cloud.world(i);
        if at[2] < 5.99 {
            assert!(dot([at[0], at[1], 0.0], sub(station, at)) > -1e-3, "{at:?}");
        }
    }
    // A stem in the shade of another one.
    let mut pair = pole(3.0, 0.15, 0.15);
    pair.cylinders.extend(pole(3.0, 0.05, 0.05).at([0.0, 1.0, 0.0]).cylinders);
    let points = scan_tree(&pair, &one_position(5.0).exact(), 1).unwrap();
    assert!((0..points.len()).all(|i| points.cloud.world(i)[1] < 0.2));
}

#[test]
fn density_falls_with_the_square_of_range() {
    let count =
        |distance| scan_tree(&pole(2.0, 0.2, 0.2), &one_position(distance), 1).unwrap().len();
    let ratio = count(5.0) as f64 / count(10.0) as f64;
    assert!((3.2..5.0).contains(&ratio), "{ratio}");
}

#[test]
fn one_sided_scans_show_less_than_half_of_a_stem() {
    let points =
        scan_tree(&pole(2.0, 0.2, 0.2), &ScanParams::one_sided().with_step(0.2), 1).unwrap();
    let mut sectors = [false; 36];
    for i in 0..points.len() {
        let [x, y, z] = points.cloud.world(i);
        if z > 0.3 && z < 1.7 {
            let azimuth = libm::atan2(y, x).to_degrees().rem_euclid(360.0);
            sectors[(azimuth / 10.0) as usize % 36] = true;
        }
    }
    let seen = sectors.iter().filter(|&&seen| seen).count();
    assert!((12..23).contains(&seen), "{seen}");
}

/// Two posts, the edge of one before the middle of the other.
#[test]
fn pulses_on_an_edge_give_points_between_the_surfaces() {
    let mut pair = pole(2.0, 0.15, 0.15);
    pair.cylinders.extend(pole(2.0, 0.15, 0.15).at([0.15, 0.15, 0.0]).cylinders);
    let broad = ScanParams { divergence_mrad: 5.0, ..one_position(8.0) };
    let points = scan_tree(&pair, &broad, 1).unwrap();
    let off = |i: usize| pair.distance_m(points.cloud.world(i));
    let mixed: Vec<f64> = (0..points.len()).filter(|&i| points.mixed[i]).map(off).collect();
    assert!(mixed.len() > 20, "{}", mixed.len());
    let between = mixed.iter().filter(|&&distance| distance > 0.01).count();
    assert!(between > 5, "{between} of {}", mixed.len());
    let sharp = scan_tree(&pair, &one_position(8.0).exact(), 1).unwrap();
    assert!(!sharp.mixed.contains(&true));
}

#[test]
fn a_leafy_crown_gives_leaves_wood_and_several_returns() {
    let points = scan_tree(&beech(), &coarse().with_ground(), 2).unwrap();
    let count = |label| points.label.iter().filter(|&&l| l == label).count();
    assert!(count(Label::Leaf) > 1000 && count(Label::Wood) > 500 && count(Label::Ground) > 500);
    assert_eq!(count(Label::Understorey), 0);
    let returns = &points.cloud.number_of_returns;
    assert!(returns.iter().filter(|&&n| n > 1).count() > returns.len() / 50);
    let numbers = &points.cloud.return_number;
    assert!(numbers.iter().zip(returns).all(|(n, of)| n <= of && *n > 0));
    let surface = beech().surface();
    let mut off: Vec<f64> = (0..points.len())
        .filter(|&i| points.label[i] == Label::Wood && !points.mixed[i])
        .map(|i| surface.signed_distance_m(points.cloud.world(i)).abs())
        .collect();
    off.sort_unstable_by(f64::total_cmp);
    assert!(
        off[off.len() / 2] < 0.004 && off[off.len() * 19 / 20] < 0.02,
        "{}",
        off[off.len() / 2]
    );
}

#[test]
fn drones_see_the_top() {
    let params = ScanParams { step_deg: 0.15, ..ScanParams::uav() };
    let layout = Layout::Flight { lines: 2, spacing_m: 12.0, height_m: 45.0, sweep_m: 0.3 };
    let points = scan_tree(&beech(), &ScanParams { layout, ..params }, 2).unwrap();
    let top = (0..points.len()).map(|i| points.cloud.world(i)[2]).fold(0.0, f64::max);
    assert!(points.len() > 500 && top - 1000.0 > 0.9 * beech().height_m(), "{top}");
}

#[test]
fn threads_do_not_matter() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| scan_tree(&beech(), &ScanParams::tls().with_step(0.8), 5).unwrap())
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn parameters_out_of_range_are_refused() {
    let told =
        |params: ScanParams| scan_tree(&pole(2.0, 0.1, 0.1), &params, 1).unwrap_err().to_string();
    assert!(told(coarse().with_step(0.0)).contains("step_deg` is 0"));
    assert!(told(ScanParams { sensitivity: f64::NAN, ..coarse() }).contains("sensitivity` is NaN"));
    assert!(told(ScanParams { max_returns: 0, ..coarse() }).contains("max_returns` is 0"));
}

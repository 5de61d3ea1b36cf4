//! Crown models on real scans: are radii, residuals and the share of rejected trees plausible?
//!
//! `TIMBERLINE_DATA` is a folder with the public scans of lidR, NEON and others; treetops come from
//! lidR's `locate_trees(lmf(5))` where they were computed, else from a plain local maximum filter.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may stop at what it did not expect"
)]

use std::path::PathBuf;
use timberline_crowns::CrownModelParams;
use timberline_crowns::Window;
use timberline_crowns::starsac::{self, Outcome};
use timberline_pointcloud::{Frame, Grid2, Point, PointCloud};

fn data(path: &str) -> PathBuf {
    PathBuf::from(std::env::var("TIMBERLINE_DATA").unwrap()).join(path)
}

/// First returns, normalised already, with world positions on the lattice.
fn read(path: &str) -> PointCloud {
    let mut reader = las::Reader::from_path(data(path)).unwrap();
    let mut cloud = PointCloud::new(Frame::default());
    let points = reader.read_all().unwrap();
    let returns: Vec<u8> = points.return_number().collect();
    let classes: Vec<u8> = points.classification().collect();
    for (i, ((x, y), z)) in points.x().zip(points.y()).zip(points.z()).enumerate() {
        if classes[i] != 7 && returns[i] <= 1 {
            let world = [x, y, z].map(timberline_pointcloud::frame::quantise);
            cloud.push_world(world, &Point::default());
        }
    }
    let origin = Frame::near([cloud.x[0], cloud.y[0], 0.0]);
    cloud.in_frame(origin).in_canonical_order()
}

/// Local maxima of at least 2 m in circles of the given diameter.
fn tops(cloud: &PointCloud, grid: &Grid2, diameter: f64) -> Vec<[f64; 3]> {
    let highest = |&i: &usize| {
        let mut is = cloud.z[i] >= 2.0;
        grid.candidates(cloud.x[i], cloud.y[i], 0.5 * diameter, |j| {
            let (dx, dy) = (cloud.x[j] - cloud.x[i], cloud.y[j] - cloud.y[i]);
            let near = dx * dx + dy * dy <= 0.25 * diameter * diameter;
            is &= !near || (cloud.z[j], i) <= (cloud.z[i], j);
        });
        is
    };
    (0..cloud.len()).filter(highest).map(|i| cloud.local(i)).collect()
}

fn fit_all(
    cloud: &PointCloud,
    grid: &Grid2,
    tops: &[[f64; 3]],
    params: &CrownModelParams,
) -> Vec<Outcome> {
    let columns = [&cloud.x[..], &cloud.y, &cloud.z];
    let fit = |(seed, top): (usize, &[f64; 3])| {
        let accept = |i: usize| Some(cloud.z[i] >= params.min_height_m);
        let half_width = params.half_width_m(top[2]);
        let window = Window::gather(columns, grid, *top, half_width, accept);
        starsac::fit_window(&window, params, seed as u64)
    };
    tops.iter().enumerate().map(fit).collect()
}

fn quantiles(mut values: Vec<f64>) -> [f64; 5] {
    values.sort_unstable_by(f64::total_cmp);
    [0.05, 0.25, 0.5, 0.75, 0.95].map(|q| values[(q * (values.len() - 1) as f64) as usize])
}

/// Share of the points above 2 m that lie within a crown's radius, and how many crowns hold each
/// of those on average.
fn cover(cloud: &PointCloud, grid: &Grid2, tops: &[[f64; 3]], outcomes: &[Outcome]) -> [f64; 2] {
    let mut crowns_at = vec![0u32; cloud.len()];
    for (top, outcome) in tops.iter().zip(outcomes) {
        let radius = outcome.accepted().map_or(0.0, |crown| crown.radius_m);
        grid.candidates(top[0], top[1], radius, |i| {
            let (dx, dy) = (cloud.x[i] - top[0], cloud.y[i] - top[1]);
            crowns_at[i] += u32::from(dx * dx + dy * dy <= radius * radius);
        });
    }
    let canopy = (0..cloud.len()).filter(|&i| cloud.z[i] > 2.0);
    let counts: Vec<u32> = canopy.map(|i| crowns_at[i]).collect();
    let covered = counts.iter().filter(|&&n| n > 0).count() as f64;
    let sum: u32 = counts.iter().sum();
    [covered / counts.len() as f64, f64::from(sum) / covered.max(1.0)]
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn plausible_on_public_scans() {
    println!("accepted | radius, m: 5, 25, 50, 75, 95 % | outlier ratio | covered, overlap");
    for (path, diameter, radius_m) in [
        ("als/lidR/MixedConifer.laz", 5.0, 2.5..4.0),
        ("als/lidR/Megaplot.laz", 5.0, 2.5..4.5),
        ("als/pycrown/POINTS.laz", 5.0, 2.5..4.0),
        ("als/neon_SJER_052/SJER_052.laz", 8.0, 2.5..5.0),
    ] {
        let cloud = read(path);
        let grid = Grid2::new(&cloud.x, &cloud.y, 2.0).unwrap();
        let tops = tops(&cloud, &grid, diameter);
        let outcomes = fit_all(&cloud, &grid, &tops, &CrownModelParams::default());
        let crowns: Vec<_> = outcomes.iter().filter_map(Outcome::accepted).collect();
        let radius = quantiles(crowns.iter().map(|c| c.radius_m).collect());
        let ratio = quantiles(crowns.iter().map(|c| c.outlier_ratio()).collect());
        let cover = cover(&cloud, &grid, &tops, &outcomes);
        let (accepted, all) = (crowns.len(), tops.len());
        println!("{path}: {accepted}/{all} | {radius:.2?} | {ratio:.2?} | {cover:.2?}");
        assert!(accepted as f64 > 0.97 * all as f64);
        assert!(radius_m.contains(&radius[2]));
        assert!(cover[0] > 0.5 && cover[1] < 1.6);
    }
}

/// Tops that another program found: positions with heights, metres.
fn peer_tops(cloud: &PointCloud, path: &str) -> Vec<[f64; 3]> {
    let folder = PathBuf::from(std::env::var("TIMBERLINE_DATA").unwrap()).join("../peers/lidr");
    let text = std::fs::read_to_string(folder.join(path)).unwrap();
    let parse = |line: &str| {
        let mut fields = line.split(',').skip(1).map(|field| field.parse::<f64>().unwrap());
        let world = [(); 3].map(|()| fields.next().unwrap());
        cloud.frame.local_from_world(world.map(timberline_pointcloud::frame::quantise))
    };
    text.lines().skip(1).map(parse).collect()
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn plausible_around_the_tops_of_lidr() {
    for (scan, tops) in [
        ("als/lidR/MixedConifer.laz", "MixedConifer_lmf5.csv"),
        ("als/lidR/Megaplot.laz", "Megaplot_lmf5.csv"),
    ] {
        let cloud = read(scan);
        let grid = Grid2::new(&cloud.x, &cloud.y, 2.0).unwrap();
        let tops = peer_tops(&cloud, tops);
        let outcomes = fit_all(&cloud, &grid, &tops, &CrownModelParams::default());
        let radius: Vec<f64> =
            outcomes.iter().filter_map(|o| Some(o.accepted()?.radius_m)).collect();
        println!("{scan}: {}/{} {:.2?}", radius.len(), tops.len(), quantiles(radius.clone()));
        assert!(radius.len() as f64 > 0.97 * tops.len() as f64);
    }
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn single_conifers_from_a_drone() {
    // Clips of 4.7 m: the crown fills them. Half the field crown diameter is 2.4 m on average.
    let folder = std::fs::read_dir(data("uas_treeclips")).unwrap();
    let mut names: Vec<String> = folder
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".laz"))
        .collect();
    names.sort();
    let (mut radius, mut b1, mut accepted) = (Vec::new(), Vec::new(), 0);
    for name in &names {
        let mut cloud = read(&format!("uas_treeclips/{name}"));
        let lowest = cloud.z.iter().copied().fold(f64::INFINITY, f64::min);
        cloud.z.iter_mut().for_each(|z| *z -= lowest);
        let grid = Grid2::new(&cloud.x, &cloud.y, 2.0).unwrap();
        let highest = (0..cloud.len()).max_by(|a, b| cloud.z[*a].total_cmp(&cloud.z[*b]));
        let top = [cloud.local(highest.unwrap())];
        let outcome = fit_all(&cloud, &grid, &top, &CrownModelParams::default()).remove(0);
        if let Some(crown) = outcome.accepted() {
            accepted += 1;
            radius.push(crown.radius_m);
            b1.push(crown.model.b1 + crown.model.b2 * crown.radius_m);
        }
    }
    println!("{accepted}/{} radius {:.2?}", names.len(), quantiles(radius.clone()));
    println!("mean slope of the crown {:.2?}", quantiles(b1));
    assert!(accepted * 100 > names.len() * 95);
    assert!((2.0..3.0).contains(&quantiles(radius)[2]));
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn crown_boxes_of_neon() {
    // Drawn by hand (NeonTreeEvaluation): middle and mean half edge, m.
    const BOXES: [[f64; 3]; 9] = [
        [257992.3, 4110499.2, 2.78],
        [257981.8, 4110504.8, 3.38],
        [257971.5, 4110500.2, 4.67],
        [257990.1, 4110505.3, 4.25],
        [257994.2, 4110491.0, 4.58],
        [257963.6, 4110506.1, 3.43],
        [257983.7, 4110495.4, 4.35],
        [257994.5, 4110474.5, 3.73],
        [257980.9, 4110482.1, 5.60],
    ];
    let cloud = read("als/neon_SJER_052/SJER_052.laz");
    let grid = Grid2::new(&cloud.x, &cloud.y, 2.0).unwrap();
    let [ox, oy, _] = cloud.frame.origin_m.map(|v| v as f64);
    let tops: Vec<[f64; 3]> = BOXES
        .iter()
        .map(|[x, y, half]| {
            let inside = |i: &usize| {
                (cloud.x[*i] + ox - x).abs() < *half && (cloud.y[*i] + oy - y).abs() < *half
            };
            let top = (0..cloud.len())
                .filter(inside)
                .max_by(|a, b| cloud.z[*a].total_cmp(&cloud.z[*b]))
                .unwrap();
            cloud.local(top)
        })
        .collect();
    let outcomes = fit_all(&cloud, &grid, &tops, &CrownModelParams::default());
    let ratio = outcomes.iter().zip(BOXES).filter_map(|(o, b)| Some(o.accepted()?.radius_m / b[2]));
    let ratio: Vec<f64> = ratio.collect();
    println!("radius / half edge: {ratio:.2?}");
    assert!((0.8..1.25).contains(&quantiles(ratio)[2]));
}

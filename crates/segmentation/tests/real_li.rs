//! Trees of Li et al. 2012 on public scans against what another implementation found there.
//!
//! `TIMBERLINE_DATA` is a folder with the public scans of lidR.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may stop at what it did not expect"
)]

use std::path::PathBuf;
use timberline_pointcloud::{Frame, Point, PointCloud};
use timberline_segmentation::{LiParams, methods::li};

/// All points of a scan with heights above ground for elevations.
fn read(path: &str) -> PointCloud {
    let folder = PathBuf::from(std::env::var("TIMBERLINE_DATA").unwrap());
    let mut reader = las::Reader::from_path(folder.join(path)).unwrap();
    let mut cloud = PointCloud::new(Frame::default());
    let points = reader.read_all().unwrap();
    for ((x, y), z) in points.x().zip(points.y()).zip(points.z()) {
        let world = [x, y, z].map(timberline_pointcloud::frame::quantise);
        cloud.push_world(world, &Point::default());
    }
    let origin = Frame::near([cloud.x[0], cloud.y[0], 0.0]);
    cloud.in_frame(origin).in_canonical_order()
}

/// lidR 4's `li2012()` with its defaults finds 269 and 2220.
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn as_many_trees_as_another_implementation() {
    for (path, peer) in [("als/lidR/MixedConifer.laz", 269.0), ("als/lidR/Megaplot.laz", 2220.0)] {
        let cloud = read(path);
        let height: Vec<f32> = cloud.z.iter().map(|z| *z as f32).collect();
        for window_m in [1.0, 2.0] {
        let params = LiParams { window_m, ..LiParams::default() };
        let begun = std::time::Instant::now();
        let found = li::trees(&cloud.x, &cloud.y, &height, &params).unwrap();
        let count = found.tops.len() as f64;
        println!("{path}: {window_m} {count} trees, another implementation {peer} {:?}", begun.elapsed());
        }
    }
}

//! Trees of Li et al. 2012 on public scans against the quadratic program.
//!
//! `TIMBERLINE_DATA` is a folder with the public scans of lidR.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may stop at what it did not expect"
)]

mod li_reference;

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

/// Every point has the tree that the quadratic program gives it. (lidR's `li2012()` finds 269 and
/// 2220 trees with its defaults.)
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn the_index_changes_nothing_on_scans() {
    for (path, window_m, trees) in [
        ("als/lidR/MixedConifer.laz", 2.0, 213),
        ("als/lidR/MixedConifer.laz", 1.0, 233),
        ("als/lidR/Megaplot.laz", 2.0, 1661),
    ] {
        let cloud = read(path);
        let height: Vec<f32> = cloud.z.iter().map(|z| *z as f32).collect();
        let params = LiParams { window_m, ..LiParams::default() };
        let found = li::trees(&cloud.x, &cloud.y, &height, &params).unwrap();
        println!("{path}, window {window_m} m: {} trees", found.tops.len());
        assert_eq!(found.tops.len(), trees);
        assert!(found == li_reference::trees(&cloud.x, &cloud.y, &height, &params));
    }
}

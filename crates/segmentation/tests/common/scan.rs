//! Real scans whose elevations are heights above ground, and plain treetops.

use std::path::PathBuf;
use timberline_pointcloud::{Frame, Grid2, Point, PointCloud, frame};
use timberline_segmentation::{Crown, Marker, Piece};

/// A scan below TIMBERLINE_DATA, without trees.
pub(crate) fn normalised(path: &str) -> Piece {
    let data =
        std::env::var_os("TIMBERLINE_DATA").expect("TIMBERLINE_DATA names the scans' folder");
    let mut reader = las::Reader::from_path(PathBuf::from(data).join(path)).unwrap();
    let min = reader.header().bounds().min;
    let mut cloud = PointCloud::new(Frame::near([min.x, min.y, 0.0]));
    let points = reader.read_all().unwrap();
    let positions = points.x().zip(points.y()).zip(points.z()).zip(points.return_number());
    for (((x, y), z), return_number) in positions {
        let attributes = Point { return_number, ..Point::default() };
        cloud.push_world([x, y, z].map(frame::quantise), &attributes);
    }
    let cloud = cloud.in_canonical_order();
    Piece {
        frame: cloud.frame,
        height_m: cloud.z.iter().map(|z| *z as f32).collect(),
        is_first: cloud.return_number.iter().map(|number| *number <= 1).collect(),
        x: cloud.x,
        y: cloud.y,
        z: cloud.z,
        markers: Vec::new(),
    }
}

/// Points of at least 2 m that are the highest within a circle, of equal ones the first; without
/// crown models.
pub(crate) fn treetops(piece: &Piece, radius_m: f64) -> Vec<Marker> {
    let grid = Grid2::new(&piece.x, &piece.y, radius_m).unwrap();
    let is_top = |i: &usize| {
        let mut top = piece.height_m[*i] >= 2.0;
        grid.candidates(piece.x[*i], piece.y[*i], radius_m, |j| {
            let (dx, dy) = (piece.x[j] - piece.x[*i], piece.y[j] - piece.y[*i]);
            let near = dx * dx + dy * dy <= radius_m * radius_m;
            let (mine, other) = (piece.height_m[*i], piece.height_m[j]);
            top &= !near || other < mine || (other == mine && j >= *i);
        });
        top
    };
    let tops = (0..piece.x.len()).filter(is_top).enumerate();
    tops.map(|(place, i)| {
        let crown = Crown {
            id: place as u64 + 1,
            apex: [piece.x[i], piece.y[i], piece.z[i]],
            coefficients: [0.0; 2],
            radius_m: 0.0,
            tolerance_m: 0.0,
            oblique: false,
        };
        Marker { crown, height_m: f64::from(piece.height_m[i]), score: 1.0 }
    })
    .collect()
}

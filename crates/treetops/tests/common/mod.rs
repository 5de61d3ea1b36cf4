//! Reading of scans and peers' results for the tests on real data.

use las::Reader;
use spade::{DelaunayTriangulation, FloatTriangulation, HasPosition, Point2, Triangulation};
use std::path::{Path, PathBuf};
use timberline_pointcloud::{Frame, Nearest2, Point, PointCloud, frame};
use timberline_treetops::{Input, Params, Treetop, find};

/// The folder of real scans.
pub(crate) fn data() -> PathBuf {
    PathBuf::from(
        std::env::var_os("TIMBERLINE_DATA").expect("TIMBERLINE_DATA names the folder of scans"),
    )
}

/// All points of a LAS or LAZ file, on the lattice.
pub(crate) fn read(path: &Path) -> PointCloud {
    let mut reader = Reader::from_path(path).unwrap();
    let min = reader.header().bounds().min;
    let mut cloud = PointCloud::new(Frame::near([min.x, min.y, 0.0]));
    let points = reader.read_all().unwrap();
    let attributes = points.return_number().zip(points.classification());
    let positions = points.x().zip(points.y()).zip(points.z());
    for (((x, y), z), (return_number, classification)) in positions.zip(attributes) {
        let attributes = Point { return_number, classification, ..Point::default() };
        cloud.push_world([x, y, z].map(frame::quantise), &attributes);
    }
    cloud
}

struct Ground {
    position: Point2<f64>,
    z: f64,
}

impl HasPosition for Ground {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// Height above the linear TIN of class 2; beyond its hull above the nearest ground point.
pub(crate) fn heights_over_tin(cloud: &PointCloud) -> Vec<f32> {
    let ground: Vec<usize> = (0..cloud.len()).filter(|&i| cloud.classification[i] == 2).collect();
    let vertex =
        |&i: &usize| Ground { position: Point2::new(cloud.x[i], cloud.y[i]), z: cloud.z[i] };
    let tin =
        DelaunayTriangulation::<Ground>::bulk_load(ground.iter().map(vertex).collect()).unwrap();
    let positions: Vec<[f64; 2]> = ground.iter().map(|&i| [cloud.x[i], cloud.y[i]]).collect();
    let nearest = Nearest2::new(&positions).unwrap();
    let surface = tin.barycentric();
    (0..cloud.len())
        .map(|i| {
            let at = Point2::new(cloud.x[i], cloud.y[i]);
            let level = surface.interpolate(|vertex| vertex.data().z, at);
            let level = level.unwrap_or_else(|| {
                let found = nearest.nearest(&[cloud.x[i], cloud.y[i]], 1);
                cloud.z[ground[found[0].index]]
            });
            (cloud.z[i] - level) as f32
        })
        .collect()
}

/// A cloud with its elevations taken as heights: for scans that are normalised already.
pub(crate) fn normalised(path: &str) -> (PointCloud, Vec<f32>) {
    let cloud = read(&data().join(path));
    let height_m = cloud.z.iter().map(|&z| z as f32).collect();
    (cloud, height_m)
}

/// A cloud with heights over the TIN of its ground class.
pub(crate) fn over_tin(path: &str) -> (PointCloud, Vec<f32>) {
    let cloud = read(&data().join(path));
    let height_m = heights_over_tin(&cloud);
    (cloud, height_m)
}

/// Treetops of a cloud with heights.
pub(crate) fn tops((cloud, height_m): &(PointCloud, Vec<f32>), params: &Params) -> Vec<Treetop> {
    find(&Input::new(cloud, height_m), params).unwrap()
}

//! The ground filter on real scans with their classes stripped, scored by the terrain it gives at
//! the supplier's ground points (supplied ground is thinned: agreement by class says little).

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "these are tests"
)]

mod common;

use common::{Scan, rms};
use std::collections::BTreeSet;
use timberline_ground::tin::Tin;
use timberline_ground::{DtmParams, GroundParams, Label, Nodes, Source, Surface, classify};
use timberline_pointcloud::{Frame, Point, PointCloud, Rect};

/// File, and the largest error of the terrain model (m) that is still as good as measured.
const SCANS: [(&str, f64); 10] = [
    ("lidR/Topography.laz", 0.08),
    ("lasR_bcts/bcts_1.laz", 0.05),
    ("lasR_bcts/bcts_2.laz", 0.06),
    ("lasR_bcts/bcts_4.laz", 0.08),
    ("lidRtutorial/MixedEucaNat.laz", 0.25),
    ("hj_andrews/RS04.laz", 0.06),
    ("hj_andrews/RS12.laz", 0.12),
    ("hj_andrews/RS17.laz", 0.10),
    ("hj_andrews/RS29.laz", 0.14),
    ("hj_andrews/RS31.laz", 0.14),
];

fn cloud_of(scan: &Scan) -> PointCloud {
    let mut cloud = PointCloud::new(Frame::near(scan.world[0]));
    for (i, world) in scan.world.iter().enumerate() {
        let point = Point {
            return_number: scan.return_number[i],
            number_of_returns: scan.number_of_returns[i],
            classification: scan.class[i],
            ..Point::default()
        };
        cloud.push_world(*world, &point);
    }
    cloud.in_canonical_order()
}

/// A linear triangulation in the plane of the first point.
struct Linear {
    tin: Tin,
    origin: [f64; 3],
}

impl Linear {
    fn new(points: &[[f64; 3]]) -> Self {
        let origin = points[0];
        let mut seen = BTreeSet::new();
        let local = points.iter().map(|p| [0, 1, 2].map(|a| p[a] - origin[a]));
        let key = |p: &[f64; 3]| [p[0].to_bits(), p[1].to_bits()];
        let distinct: Vec<[f64; 3]> = local.filter(|p| seen.insert(key(p))).collect();
        Self { tin: Tin::new(&distinct).unwrap(), origin }
    }

    /// How far points within the triangulation lie above it.
    fn heights(&self, points: &[[f64; 3]]) -> Vec<f64> {
        let mut cursor = self.tin.cursor();
        let local = points.iter().map(|p| [0, 1, 2].map(|a| p[a] - self.origin[a]));
        local.filter_map(|p| cursor.offset(p)).map(|offset| offset.vertical_m).collect()
    }
}

/// What is measured on one scan, metres.
struct Score {
    terrain: f64,
    bias: f64,
    linear: f64,
    above: f64,
    omitted: f64,
    seconds: f64,
}

fn score(name: &str) -> Score {
    let scan = Scan::read(name);
    let cloud = cloud_of(&scan);
    let origin = cloud.frame.origin_m.map(|v| v as f64);
    let bounds = cloud.bounds().rect().moved([origin[0], origin[1]]);
    let rect = Rect { min: bounds.min, max: bounds.max.map(|v| v + 1.0) };
    let params = GroundParams { source: Source::Classify, ..GroundParams::default() };
    let clock = std::time::Instant::now();
    let labels = classify(&cloud, rect, &params).unwrap();
    let seconds = clock.elapsed().as_secs_f64();
    let of = |keep: &dyn Fn(bool, bool) -> bool| -> Vec<[f64; 3]> {
        let kept = |i: &usize| keep(labels[*i] == Label::Classified, cloud.classification[*i] == 2);
        (0..cloud.len()).filter(kept).map(|i| cloud.world(i)).collect()
    };
    let (ground, supplier) = (of(&|ours, _| ours), of(&|_, theirs| theirs));
    let params = DtmParams::default();
    let nodes = Nodes::new(ground.iter().copied(), params.merge_m);
    let surface = Surface::build(&nodes, rect, &params).unwrap();
    let errors: Vec<f64> = surface.heights(&supplier).iter().map(|h| -h).collect();
    let added = of(&|ours, theirs| ours && !theirs);
    Score {
        terrain: rms(&errors).0,
        bias: errors.iter().sum::<f64>() / errors.len() as f64,
        linear: rms(&Linear::new(&ground).heights(&supplier)).0,
        above: rms(&Linear::new(&supplier).heights(&added)).0,
        omitted: of(&|ours, theirs| theirs && !ours).len() as f64 / supplier.len() as f64,
        seconds,
    }
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn terrain_at_supplied_ground() {
    for (name, most) in SCANS {
        let s = score(name);
        println!(
            "{name:30} DTM {:.3} (bias {:+.3}), TIN {:.3}, added points over supplier's TIN {:.3}, \
             omitted {:.3}, {:.1} s",
            s.terrain, s.bias, s.linear, s.above, s.omitted, s.seconds
        );
        assert!(s.terrain <= most, "{name}: {} m", s.terrain);
        if name.contains("Topography") {
            assert!(s.linear <= 0.10, "{name}: {} m", s.linear);
        }
    }
}

//! The ground filter on real scans with their classes stripped.

mod common;

use common::{Scan, rms};
use timberline_ground::tin::Tin;
use timberline_ground::{DtmParams, GroundParams, Label, Nodes, Source, Surface, classify};
use timberline_pointcloud::{Frame, Point, PointCloud, Rect};

const SCANS: [&str; 10] = [
    "lidR/Topography.laz",
    "lasR_bcts/bcts_1.laz",
    "lasR_bcts/bcts_2.laz",
    "lasR_bcts/bcts_4.laz",
    "lidRtutorial/MixedEucaNat.laz",
    "hj_andrews/RS04.laz",
    "hj_andrews/RS12.laz",
    "hj_andrews/RS17.laz",
    "hj_andrews/RS29.laz",
    "hj_andrews/RS31.laz",
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

fn tin_of(points: &[[f64; 3]], origin: [f64; 3]) -> Tin {
    let mut seen = std::collections::BTreeSet::new();
    let local = points.iter().map(|p| [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]);
    let distinct: Vec<[f64; 3]> =
        local.filter(|p| seen.insert([p[0].to_bits(), p[1].to_bits()])).collect();
    Tin::new(&distinct).unwrap()
}

fn offsets(tin: &Tin, at: &[[f64; 3]], origin: [f64; 3]) -> Vec<f64> {
    let mut cursor = tin.cursor();
    at.iter()
        .filter_map(|p| cursor.offset([p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]))
        .map(|o| o.vertical_m)
        .collect()
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn lab() {
    let env = |k: &str, d: f64| std::env::var(k).ok().map_or(d, |v| v.parse().unwrap());
    let which = std::env::var("SCANS").unwrap_or_default();
    let d = GroundParams::default();
    let params = GroundParams {
        source: Source::Classify,
        coarse_distance_m: env("CD", d.coarse_distance_m),
        fine_distance_m: env("FD", d.fine_distance_m),
        coarse_angle_deg: env("CA", d.coarse_angle_deg),
        fine_angle_deg: env("FA", d.fine_angle_deg),
        spike_deg: env("SP", d.spike_deg),
        trim_m: env("TM", d.trim_m),
        trim_slope: env("TS", d.trim_slope),
        tolerance_m: env("TOL", d.tolerance_m),
        seed_cell_m: env("SEED", d.seed_cell_m),
        block_m: env("BLOCK", d.block_m),
        buffer_m: env("BUF", d.buffer_m),
        ..d
    };
    for name in SCANS.iter().filter(|n| n.contains(&which)) {
        let scan = Scan::read(name);
        let cloud = cloud_of(&scan);
        let b = cloud
            .bounds()
            .rect()
            .moved([cloud.frame.origin_m[0] as f64, cloud.frame.origin_m[1] as f64]);
        let rect = Rect { min: b.min, max: b.max.map(|v| v + 1.0) };
        let t = std::time::Instant::now();
        let labels = classify(&cloud, rect, &params).unwrap();
        let time = t.elapsed().as_secs_f64();
        let ground: Vec<[f64; 3]> = (0..cloud.len())
            .filter(|i| labels[*i] != Label::Other)
            .map(|i| cloud.world(i))
            .collect();
        let supplier = scan.supplier_ground();
        if let Ok(path) = std::env::var("DUMP") {
            let text: String = (0..cloud.len())
                .filter(|i| labels[*i] != Label::Other || cloud.classification[*i] == 2)
                .map(|i| {
                    let w = cloud.world(i);
                    format!(
                        "{:.3} {:.3} {:.3} {} {}\n",
                        w[0],
                        w[1],
                        w[2],
                        u8::from(labels[i] != Label::Other),
                        cloud.classification[i]
                    )
                })
                .collect();
            std::fs::write(path, text).unwrap();
        }
        let ours: Vec<[f64; 3]> = (0..cloud.len())
            .filter(|i| labels[*i] != Label::Other && cloud.classification[*i] != 2)
            .map(|i| cloud.world(i))
            .collect();
        let origin = [rect.min[0].floor(), rect.min[1].floor(), supplier[0][2].floor()];
        let at_supplier = offsets(&tin_of(&ground, origin), &supplier, origin);
        let over = offsets(&tin_of(&supplier, origin), &ours, origin);
        let indep = offsets(&tin_of(&ours, origin), &supplier, origin);
        let hit = (0..cloud.len())
            .filter(|i| labels[*i] != Label::Other && cloud.classification[*i] == 2)
            .count();
        let t = std::time::Instant::now();
        let nodes = Nodes::new(ground.iter().copied(), 0.1);
        let surface = Surface::build(&nodes, rect, &DtmParams::default()).unwrap();
        let build = t.elapsed().as_secs_f64();
        let dtm: Vec<f64> = supplier.iter().map(|p| surface.at([p[0], p[1]]) - p[2]).collect();
        let t2 = t.elapsed().as_secs_f64() - build;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        let mut worst: Vec<usize> = (0..supplier.len()).collect();
        worst.sort_by(|a, b| dtm[*b].abs().total_cmp(&dtm[*a].abs()));
        for i in worst.iter().take(6) {
            println!(
                "   worst {:.2} at {:.1} {:.1} z {:.2}",
                dtm[*i],
                supplier[*i][0] - rect.min[0],
                supplier[*i][1] - rect.min[1],
                supplier[*i][2]
            );
        }
        println!(
            "{name:28} tin {:.3} dtm {:.3} (bias {:.3}, max {:.2}) indep {:.3} omis {:.3} comm {:.3} over rms {:.3} bias {:.3} >1m {:.3} | {} ground, {time:.1} s; build {build:.1} s, {:.2} us/eval",
            rms(&at_supplier).0,
            rms(&dtm).0,
            mean(&dtm),
            dtm.iter().fold(0f64, |a, b| a.max(b.abs())),
            rms(&indep).0,
            1.0 - hit as f64 / supplier.len() as f64,
            ours.len() as f64 / ground.len() as f64,
            rms(&over).0,
            mean(&over),
            over.iter().filter(|o| **o > 1.0).count() as f64 / over.len() as f64,
            ground.len(),
            t2 * 1e6 / supplier.len() as f64
        );
    }
}

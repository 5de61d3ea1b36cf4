//! Accuracy of the terrain model on real scans.

mod common;

use common::{Scan, hash01, rms};
use timberline_ground::{DtmParams, Nodes, Surface};
use timberline_pointcloud::Rect;

fn rect_of(points: &[[f64; 3]]) -> Rect {
    let mut rect = Rect::EMPTY;
    for p in points {
        rect = rect.union(&Rect { min: [p[0], p[1]], max: [p[0], p[1]] });
    }
    rect
}

fn errors_at(surface: &Surface, at: &[[f64; 3]]) -> Vec<f64> {
    at.iter().map(|p| surface.at([p[0], p[1]]) - p[2]).collect()
}

fn cross_validated(points: &[[f64; 3]], params: &DtmParams) -> f64 {
    let rect = rect_of(points);
    let mut errors = Vec::new();
    for fold in 0..5 {
        let held = |i: usize| (hash01(i) * 5.0) as usize == fold;
        let (mut train, mut test) = (Vec::new(), Vec::new());
        for (i, p) in points.iter().enumerate() {
            if held(i) { test.push(*p) } else { train.push(*p) }
        }
        let nodes = Nodes::new(train.into_iter(), 0.1);
        let surface = Surface::build(&nodes, rect, params).unwrap();
        errors.extend(errors_at(&surface, &test));
    }
    let (rmse, missing) = rms(&errors);
    assert_eq!(missing, 0);
    rmse
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn lab() {
    let files = ["lidR/Topography.laz", "lasR_bcts/bcts_4.laz", "lasR_bcts/bcts_1.laz"];
    let scans: Vec<Vec<[f64; 3]>> = files.iter().map(|f| Scan::read(f).supplier_ground()).collect();
    let env = |k: &str, d: f64| std::env::var(k).ok().map_or(d, |v| v.parse().unwrap());
    for root in [4, 5] {
        for nodes in [80usize, 120, 180] {
            for prior in [0.0, 10.0, 40.0, 1e9] {
                let params = DtmParams {
                    log2_root: root,
                    most_nodes: nodes,
                    prior_weight: prior,
                    ..DtmParams::default()
                };
                if env("ROOT", root as f64) != root as f64
                    || env("NODES", nodes as f64) != nodes as f64
                {
                    continue;
                }
                let t = std::time::Instant::now();
                let r: Vec<f64> = scans.iter().map(|s| cross_validated(s, &params)).collect();
                println!("root {root} nodes {nodes} prior {prior}: {r:.5?} {:.1?}", t.elapsed());
            }
        }
    }
}

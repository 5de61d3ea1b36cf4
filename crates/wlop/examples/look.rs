//! x y z text in, consolidated text out.
use std::io::Write;
use timberline_wlop::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let text = std::fs::read_to_string(&args[1]).unwrap();
    let all: Vec<[f64; 3]> = text.lines().filter_map(|l| {
        let v: Vec<f64> = l.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        (v.len() >= 3).then(|| [v[0], v[1], v[2]])
    }).collect();
    let low = all.iter().fold([f64::INFINITY; 3], |m, p| [0,1,2].map(|k| m[k].min(p[k]))).map(f64::floor);
    let pts: Vec<[f64; 3]> = all.iter().map(|p| [0,1,2].map(|k| p[k] - low[k])).collect();
    let zmin = pts.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    let mut xs: Vec<f64> = pts.iter().filter(|p| p[2] < zmin + 0.3).map(|p| p[0]).collect();
    let mut ys: Vec<f64> = pts.iter().filter(|p| p[2] < zmin + 0.3).map(|p| p[1]).collect();
    xs.sort_by(f64::total_cmp); ys.sort_by(f64::total_cmp);
    let base = [xs[xs.len()/2], ys[ys.len()/2], zmin];
    let params: ConsolidationParams = if args.len() > 3 { serde_json::from_str(&args[3]).unwrap() } else { Default::default() };
    let t = std::time::Instant::now();
    let done = consolidate(&Tree { points_m: &pts, base_m: base, dbh_m: None }, &params).unwrap();
    let e = done.effect;
    println!("{}: {} -> {} ({} alone, {} stem) thick {:.2} -> {:.2} mm, dist {:.2} -> {:.2} mm, {:.2} s wall {}", args[1].rsplit('/').next().unwrap(), e.points_before, e.points_after, e.points_left_alone,
      done.stem.iter().filter(|s| **s).count(), e.thickness_before_m*1e3, e.thickness_after_m*1e3, e.distance_before_m*1e3, e.distance_after_m*1e3, t.elapsed().as_secs_f64(), done.skipped.map_or(String::new(), |s| format!("SKIPPED {s}")));
    if args.len() > 2 && args[2] != "-" {
        let mut f = std::io::BufWriter::new(std::fs::File::create(&args[2]).unwrap());
        for i in 0..done.positions_m.len() {
            let p = done.positions_m[i]; let o = pts[done.origins[i] as usize];
            writeln!(f, "{} {} {} {} {} {} {} {}", p[0], p[1], p[2], done.moved[i] as u8, done.stem[i] as u8, o[0], o[1], o[2]).unwrap();
        }
    }
}

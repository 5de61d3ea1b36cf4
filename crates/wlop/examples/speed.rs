use std::time::Instant;
use timberline_wlop::operator::*;
fn noise(seed: u64) -> f64 {
    let mut v = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    v = (v ^ (v >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((v ^ (v >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}
fn main() {
    let n: usize = std::env::args().nth(1).unwrap().parse().unwrap();
    let share: f64 = std::env::args().nth(2).unwrap().parse().unwrap();
    // cylinder radius 0.15, spacing 5 mm
    let length = n as f64 * 25e-6 / (0.15 * std::f64::consts::TAU);
    let pts: Vec<[f64;3]> = (0..n as u64).map(|i| {
        let a = noise(4*i)*std::f64::consts::TAU; let r = 0.15 + 0.004*(noise(4*i+1)-0.5);
        [r*libm::cos(a), r*libm::sin(a), noise(4*i+2)*length]
    }).collect();
    let kept: Vec<u32> = (0..n as u32).filter(|i| noise(u64::from(*i)*7+3) < share).collect();
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(|| {
        let t = Instant::now();
        let o = project(&pts, &kept, Radius::Everywhere(0.08), &Settings { weights: Weights::Even, mu: 0.45, iterations: 35, reach_ratio: 0.5, still_ratio: 0.0 }).unwrap();
        println!("{} {} {:.2} s", n, o.last_move_ratio, t.elapsed().as_secs_f64());
    });
    if let Some(p) = std::env::args().nth(3) {
        let b: Vec<u8> = pts.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        std::fs::write(p, b).unwrap();
    }
}

//! Real scans for the ignored tests.
#![allow(dead_code)]

use std::path::PathBuf;
use timberline_pointcloud::frame::quantise;

/// What the tests need of a scan.
pub(crate) struct Scan {
    pub(crate) world: Vec<[f64; 3]>,
    pub(crate) class: Vec<u8>,
    pub(crate) return_number: Vec<u8>,
    pub(crate) number_of_returns: Vec<u8>,
}

impl Scan {
    /// Reads a file of the `als` folder under `TIMBERLINE_DATA`.
    pub(crate) fn read(name: &str) -> Self {
        let root =
            std::env::var("TIMBERLINE_DATA").expect("TIMBERLINE_DATA names the folder of scans");
        let path = PathBuf::from(root).join("als").join(name);
        let mut reader = las::Reader::from_path(&path).unwrap();
        let points = reader.read_all().unwrap();
        let xy = points.x().zip(points.y());
        Self {
            world: xy.zip(points.z()).map(|((x, y), z)| [x, y, z].map(quantise)).collect(),
            class: points.classification().collect(),
            return_number: points.return_number().collect(),
            number_of_returns: points.number_of_returns().collect(),
        }
    }

    /// The supplier's ground points.
    pub(crate) fn supplier_ground(&self) -> Vec<[f64; 3]> {
        self.world
            .iter()
            .zip(&self.class)
            .filter(|(_, class)| **class == 2)
            .map(|(p, _)| *p)
            .collect()
    }
}

/// A reproducible number in 0..1 for index `i` (`SplitMix64`).
pub(crate) fn hash01(i: usize) -> f64 {
    let mut z = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Root mean square of finite values, and how many are not finite.
pub(crate) fn rms(errors: &[f64]) -> (f64, usize) {
    let finite: Vec<f64> = errors.iter().copied().filter(|e| e.is_finite()).collect();
    let mean = finite.iter().map(|e| e * e).sum::<f64>() / finite.len().max(1) as f64;
    (mean.sqrt(), errors.len() - finite.len())
}

//! What a campaign's files are: of LAS from the header and a handful of points; other formats state
//! neither number nor bounds reliably, and are read once.

use crate::cover::Cover;
use crate::crs::UnitChoice;
use crate::file::{container, open_file, read_head};
use crate::header::Header;
use crate::laszip::{Laszip, Plan};
use crate::sniff::{self, Format};
use crate::source::Source;
use crate::vlr::Records;
use crate::{Error, Notes, Scan, scan};
use serde::Serialize;
use std::path::Path;
use timberline_artefact::Crs;
use timberline_pointcloud::Bounds3;

/// Points of one block: the unit of Tittmann et al. 2011, section 3.
pub const BLOCK_POINTS: u32 = 150_000;
/// Tile edges proposed: powers of two, so that tiles of one campaign nest in those of another.
/// The smallest are for terrestrial scans: 55,000 points/m² fill a tile of 4 m with 0.9 M points.
const EDGES_M: [u32; 9] = [4, 8, 16, 32, 64, 128, 256, 512, 1024];
/// Without any density: what a usual airborne survey has, points per m².
const USUAL_DENSITY: f64 = 10.0;
/// Records looked at to see how much of its bounds a file covers.
const SAMPLES: u64 = 2048;
/// Samples that a cell should hold on average where the file covers all of its bounds.
const SAMPLES_PER_CELL: f64 = 8.0;

/// Facts about one file.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FileFacts {
    /// LAS version and point data record format; `None` for other formats.
    pub las: Option<((u8, u8), u8)>,
    /// `LAS`, `LAZ`, `COPC`, `E57`, `PLY`, `PCD` or `text`.
    pub container: &'static str,
    /// Number of points the header promises (LAS) or the file holds.
    pub points: u64,
    /// The CRS; unknown where the file names none.
    pub crs: Crs,
    /// Bounds in metres: those of the header (LAS) or of the points; `None` when they are not in order.
    pub bounds: Option<Bounds3>,
    /// Points per square metre of covered ground; `None` for files without extent.
    pub density_per_m2: Option<f64>,
    /// What a reader should know.
    pub notes: Vec<String>,
}

/// Reads the facts of a file: of LAS, LAZ and COPC without reading its points.
///
/// # Errors
/// [`Error::File`] for a file that cannot be taken in.
pub fn survey(path: &Path, units: UnitChoice, crs: Option<&Crs>) -> Result<FileFacts, Error> {
    let open = || {
        let mut file = open_file(path)?;
        match sniff::format(&mut file)? {
            Format::Las => survey_source(&mut file, units, crs),
            _ => survey_scan(scan::from_source(Box::new(file), units, crs)?.as_mut()),
        }
    };
    open().map_err(|error| error.in_file(path))
}

/// As [`survey`] for LAS, LAZ and COPC as bytes from anywhere.
///
/// # Errors
/// What is wrong with them.
pub fn survey_source(
    source: &mut dyn Source,
    units: UnitChoice,
    crs: Option<&Crs>,
) -> Result<FileFacts, Error> {
    let mut notes = Notes::default();
    let (header, records, crs) = read_head(source, units, crs, &mut notes)?;
    let bounds = header.stated_bounds_m(&crs);
    let samples = sample(source, &header, &records, &mut notes)?;
    let density_per_m2 = bounds.and_then(|bounds| {
        let covered = covered_share(&header, &samples);
        density(&header, &bounds, covered)
    });
    Ok(FileFacts {
        las: Some((header.version, header.layout.format)),
        container: container(&header, &records),
        points: header.points,
        crs,
        bounds,
        density_per_m2,
        notes: notes.into_messages(),
    })
}

/// Reads all points of a file for its facts, in bounded memory.
///
/// # Errors
/// [`Error::Io`]. Damage is no error here: the stage `scatter` decides about it.
pub fn survey_scan(file: &mut dyn Scan) -> Result<FileFacts, Error> {
    let (mut points, mut bounds, mut cover) = (0, Bounds3::EMPTY, Cover::default());
    while let Some(batch) = file.next_batch()? {
        points += batch.len() as u64;
        bounds = bounds.union(&batch.bounds());
        cover.add(&batch.x, &batch.y);
    }
    let area_m2 = cover.area_m2(points);
    Ok(FileFacts {
        las: None,
        container: file.container(),
        points,
        crs: file.crs().clone(),
        bounds: (points > 0).then_some(bounds),
        density_per_m2: area_m2.map(|area_m2| points as f64 / area_m2),
        notes: file.notes().messages().to_vec(),
    })
}

/// The tile edge, a power of two from 4 to 1024 m, at which a tile of the median density holds
/// about `block_points`. It changes only when the median passes the middle between two steps.
#[must_use]
pub fn tile_edge_m(files: &[FileFacts], block_points: u32) -> u32 {
    let mut densities: Vec<f64> = files.iter().filter_map(|file| file.density_per_m2).collect();
    densities.sort_by(f64::total_cmp);
    let median = densities.get(densities.len().saturating_sub(1) / 2).copied();
    let area_m2 = f64::from(block_points) / median.unwrap_or(USUAL_DENSITY);
    // The geometric middle between an edge and its double is where the area is twice the edge's.
    let fits = |edge: &&u32| area_m2 < 2.0 * f64::from(**edge) * f64::from(**edge);
    EDGES_M.iter().find(fits).or(EDGES_M.last()).copied().unwrap_or(EDGES_M[0])
}

/// Positions of some points, evenly spread over the file; of a LAZ file the first of each chunk,
/// which is not compressed.
fn sample(
    source: &mut dyn Source,
    header: &Header,
    records: &Records,
    notes: &mut Notes,
) -> Result<Vec<[f64; 2]>, Error> {
    let mut places = Vec::new();
    if header.compressed {
        let laszip = Laszip::parse(records.laszip.as_ref(), header)?;
        if let Plan::Chunks(chunks) = laszip.plan(source, header, notes)? {
            let step = (chunks.len() as u64).div_ceil(SAMPLES).max(1) as usize;
            places.extend(chunks.iter().step_by(step).map(|chunk| chunk.at));
        }
    } else {
        let count = header.points.min(header.points_that_fit());
        let step = count.div_ceil(SAMPLES).max(1);
        let at = |index: u64| header.points_at + index * u64::from(header.record_len);
        places.extend((0..count).step_by(step as usize).map(at));
    }
    let mut samples = Vec::with_capacity(places.len());
    for at in places.into_iter().filter(|at| at + 8 <= header.file_len) {
        let mut bytes = [0; 8];
        source.read_at(at, &mut bytes, "a point")?;
        let raw =
            |i: usize| i32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]);
        let [x, y, _] = header.position([raw(0), raw(4), 0]);
        samples.push([x, y]);
    }
    Ok(samples)
}

/// Share of the bounds' area where the samples are: a flight line that runs diagonally covers
/// little of its bounds. 1 with too few samples to tell.
fn covered_share(header: &Header, samples: &[[f64; 2]]) -> f64 {
    let side = (samples.len() as f64 / SAMPLES_PER_CELL).sqrt().floor().min(16.0) as usize;
    let Some([min, max]) = header.stated_bounds().filter(|_| side >= 2) else { return 1.0 };
    let cell = |value: f64, axis: usize| {
        let share = (value - min[axis]) / (max[axis] - min[axis]);
        (share * side as f64).clamp(0.0, (side - 1) as f64) as usize
    };
    let mut occupied = vec![false; side * side];
    samples.iter().for_each(|[x, y]| occupied[cell(*y, 1) * side + cell(*x, 0)] = true);
    occupied.iter().filter(|cell| **cell).count() as f64 / occupied.len() as f64
}

fn density(header: &Header, bounds: &Bounds3, covered: f64) -> Option<f64> {
    let [width, height] = bounds.rect().size();
    let area = width * height * covered;
    let density = header.points as f64 / area;
    (area > 0.0 && density.is_finite() && density > 0.0).then_some(density)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::LasBytes;

    fn facts(density: Option<f64>) -> FileFacts {
        FileFacts {
            las: Some(((1, 2), 1)),
            container: "LAS",
            points: 1,
            crs: Crs::default(),
            bounds: None,
            density_per_m2: density,
            notes: Vec::new(),
        }
    }

    #[test]
    fn edges_are_powers_of_two_near_the_block() {
        let edge = |densities: &[f64]| {
            let files: Vec<FileFacts> = densities.iter().map(|d| facts(Some(*d))).collect();
            tile_edge_m(&files, BLOCK_POINTS)
        };
        assert_eq!(edge(&[14.0]), 128);
        assert_eq!(edge(&[1.6]), 256);
        assert_eq!(edge(&[508.0]), 16);
        assert_eq!((edge(&[1100.0]), edge(&[2000.0]), edge(&[55_000.0])), (16, 8, 4));
        assert_eq!(edge(&[1e-9]), 1024);
        assert_eq!(edge(&[13.0, 14.0, 15.0]), edge(&[13.0, 14.0, 15.0, 900.0]));
        assert_eq!(edge(&[]), 128);
        assert_eq!(tile_edge_m(&[facts(None)], BLOCK_POINTS), 128);
    }

    /// A scan of one tree: a few thousand points on 5 x 5 m around 0.
    #[test]
    fn a_single_tree_as_text_has_a_tile_edge() {
        let mut text = String::new();
        for i in 0..7000 {
            let (x, y) = (f64::from(i % 83) * 0.06 - 2.5, f64::from(i % 97) * 0.05 - 2.5);
            text.push_str(&format!("{x:.3} {y:.3} {:.3}\n", f64::from(i) * 0.003 - 1.0));
        }
        let source = Box::new(std::io::Cursor::new(text.into_bytes()));
        let mut file = scan::from_source(source, UnitChoice::default(), None).unwrap();
        let facts = survey_scan(file.as_mut()).unwrap();
        assert_eq!((facts.container, facts.points, facts.las), ("text", 7000, None));
        let density = facts.density_per_m2.unwrap();
        assert!((180.0..400.0).contains(&density), "{density}");
        assert_eq!(facts.bounds.unwrap().min[0], -2.5);
        assert_eq!(tile_edge_m(&[facts], BLOCK_POINTS), 32);
    }

    fn with_bounds(mut bytes: Vec<u8>, size: f64) -> Vec<u8> {
        bytes[179..187].copy_from_slice(&size.to_le_bytes());
        bytes[195..203].copy_from_slice(&size.to_le_bytes());
        bytes
    }

    #[test]
    fn a_diagonal_strip_does_not_pass_for_a_sparse_square() {
        let (mut strip, mut square) = (LasBytes::new((1, 2), 0), LasBytes::new((1, 2), 0));
        for i in 0..2000i32 {
            let record = strip.record([i * 50, i * 50, 0]);
            strip = strip.push(record);
            let record = square.record([(i % 45) * 2222, (i / 45) * 2222, 0]);
            square = square.push(record);
        }
        let density = |las: LasBytes| {
            let bytes = with_bounds(las.build(), 1000.0);
            let mut source = std::io::Cursor::new(bytes);
            let facts = survey_source(&mut source, UnitChoice::default(), None).unwrap();
            facts.density_per_m2.unwrap()
        };
        assert!(density(strip) > 10.0 * density(square));
    }
}

//! Reading of the real scans that the comparison of segmenters knows.

use anyhow::{Context, Result, ensure};
use std::path::Path;
use timberline_experiment::segmentation::{BoxedScan, Clip, Plot};
use timberline_ingest::{LasFile, UnitChoice};
use timberline_pointcloud::{PointCloud, Rect};

/// The scans of a folder: those with crowns drawn by hand, those of single trees. What is not there
/// is left out.
///
/// # Errors
/// When a file that is there cannot be read, or nothing is.
pub(super) fn read(folder: &Path) -> Result<(Vec<BoxedScan>, Vec<Clip>)> {
    let boxed = folder.join(BOXED);
    let clips = folder.join(CLIPS);
    ensure!(
        boxed.is_dir() || clips.is_dir(),
        "{}: neither {BOXED} nor {CLIPS} is there",
        folder.display()
    );
    let boxed = if boxed.is_dir() { vec![boxed_scan(&boxed)?] } else { Vec::new() };
    let clips = if clips.is_dir() { single_trees(&clips)? } else { Vec::new() };
    Ok((boxed, clips))
}

/// A plot of the NeonTreeEvaluation benchmark (Weinstein et al. 2021), heights above ground.
const BOXED: &str = "als/neon_SJER_052";
const BOXED_NAME: &str = "SJER_052";
/// North-west corner of its picture, and the edge of a pixel, m.
const BOXED_CORNER_M: [f64; 2] = [257_957.6, 4_110_508.8];
const PIXEL_M: f64 = 0.1;
/// Extra attribute that holds the number of a point's box.
const LABEL: &str = "label";
/// Clips of single trees with their measurements.
const CLIPS: &str = "uas_treeclips";

fn boxed_scan(folder: &Path) -> Result<BoxedScan> {
    let cloud = points(&folder.join(BOXED_NAME).with_extension("laz"))?;
    let column = cloud.extra.get(LABEL).with_context(|| format!("{BOXED_NAME}: no `{LABEL}`"))?;
    let label: Vec<u64> = (0..cloud.len()).map(|i| column.value(i).max(0.0) as u64).collect();
    let height_m: Vec<f32> = (0..cloud.len()).map(|i| cloud.world(i)[2] as f32).collect();
    let path = folder.join(BOXED_NAME).with_extension("xml");
    let xml = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let boxes = boxes(&xml).with_context(|| path.display().to_string())?;
    let plot = Plot::measured(&cloud, &height_m, &label)?;
    Ok(BoxedScan { name: BOXED_NAME.to_owned(), plot, boxes })
}

/// The boxes of an annotation in the form of Pascal VOC, in the world.
fn boxes(xml: &str) -> Result<Vec<Rect>> {
    let value = |part: &str, tag: &str| -> Result<f64> {
        let text = part.split(&format!("<{tag}>")).nth(1).and_then(|rest| rest.split('<').next());
        let text = text.with_context(|| format!("a box without <{tag}>"))?;
        text.trim().parse().with_context(|| format!("<{tag}> is `{text}`"))
    };
    let of = |part: &str| -> Result<Rect> {
        let east = |tag| Ok::<f64, anyhow::Error>(BOXED_CORNER_M[0] + PIXEL_M * value(part, tag)?);
        let north = |tag| Ok::<f64, anyhow::Error>(BOXED_CORNER_M[1] - PIXEL_M * value(part, tag)?);
        Ok(Rect { min: [east("xmin")?, north("ymax")?], max: [east("xmax")?, north("ymin")?] })
    };
    xml.split("<bndbox>").skip(1).map(of).collect()
}

/// Clips with the table of what was measured.
fn single_trees(folder: &Path) -> Result<Vec<Clip>> {
    let path = folder.join("tree_reference.csv");
    let place = || path.display().to_string();
    let mut table = csv::Reader::from_path(&path).with_context(place)?;
    let heading = table.headers().with_context(place)?.clone();
    let column = |name: &str| {
        let found = heading.iter().position(|own| own == name);
        found.with_context(|| format!("{}: no column {name}", place()))
    };
    let title = column("FileTitle")?;
    let numbers = ["aveTopX", "aveTopY", "aveHeight", "aveBaseElevation", "aveCrownDia"];
    let numbers: Vec<usize> = numbers.into_iter().map(column).collect::<Result<_>>()?;
    let mut clips = Vec::new();
    for row in table.records() {
        let row = row.with_context(place)?;
        let number = |at: &usize| -> Result<f64> {
            let text = row.get(*at).unwrap_or_default();
            text.trim().parse().with_context(|| format!("{}: `{text}` is no number", place()))
        };
        let measured: Vec<f64> = numbers.iter().map(number).collect::<Result<_>>()?;
        clips.push(clip(folder, row.get(title).unwrap_or_default(), &measured)?);
    }
    Ok(clips)
}

/// A clip; `measured` are x and y of the top, height, elevation of the ground, crown diameter.
fn clip(folder: &Path, name: &str, measured: &[f64]) -> Result<Clip> {
    let &[x, y, height_m, ground_m, crown_diameter_m] = measured else {
        anyhow::bail!("{name}: {} numbers", measured.len())
    };
    let cloud = points(&folder.join(format!("{name}.laz")))?;
    let heights: Vec<f32> =
        (0..cloud.len()).map(|i| (cloud.world(i)[2] - ground_m) as f32).collect();
    let plot = Plot::measured(&cloud, &heights, &vec![0; cloud.len()])?;
    Ok(Clip { name: name.to_owned(), plot, top_m: [x, y], height_m, crown_diameter_m })
}

/// All points of a file but noise.
fn points(path: &Path) -> Result<PointCloud> {
    const NOISE: [u8; 2] = [7, 18];
    let place = || path.display().to_string();
    let mut file = LasFile::open(path, UnitChoice::default(), None)?;
    let mut all: Option<PointCloud> = None;
    while let Some(batch) = file.next_batch().with_context(place)? {
        match &mut all {
            None => all = Some(batch),
            Some(all) => all.append(&batch).with_context(place)?,
        }
    }
    if let Some(damage) = file.damage() {
        return Err(damage).with_context(place);
    }
    let all = all.with_context(|| format!("{}: no points", place()))?;
    let kept = (0..all.len() as u32).filter(|&i| !NOISE.contains(&all.classification[i as usize]));
    let cloud = all.select(&kept.collect::<Vec<u32>>());
    let bounds = cloud.bounds();
    let frame = timberline_pointcloud::Frame::near([bounds.min[0], bounds.min[1], 0.0]);
    Ok(cloud.in_frame(frame))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_lie_in_the_world() {
        let xml = "<object><bndbox><xmin>10</xmin><ymin>20</ymin><xmax>30</xmax><ymax>50</ymax></bndbox></object>";
        let found = boxes(xml).unwrap();
        let expected = [257_958.6, 4_110_503.8, 257_960.6, 4_110_506.8];
        let corners = [found[0].min[0], found[0].min[1], found[0].max[0], found[0].max[1]];
        assert!(corners.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
        let message = boxes("<bndbox><xmin>x</xmin></bndbox>").unwrap_err().to_string();
        assert!(message.contains("<xmin> is `x`"), "{message}");
    }
}

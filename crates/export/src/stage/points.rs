//! `points.laz`.

use super::Params;
use super::survey::{Survey, put, read, rename};
use crate::Error;
use crate::las::{Dimension, DimensionType, LasOptions, LasWriter, offset_for};
use crate::sorted_trees::SortedTrees;
use std::collections::BTreeMap;
use std::fs::File;
use timberline_artefact::kinds::{GroundPoints, Heights, Labels, PointTile};
use timberline_artefact::stage::{Context, Inputs, StageError};
use timberline_artefact::{Kind, OutputFolder};
use timberline_pointcloud::{Column, PointCloud, TileId};

const HEIGHT: &str = "HeightAboveGround";
const TREE: &str = "treeID";

/// The extra dimensions that hold results.
///
/// The height's name is that of PDAL and lidR's convention for `treeID` is kept. Ids are doubles:
/// they are below 2^53, lidR writes its own unique ids so, and viewers exist that show nothing of a
/// file with 64-bit integers (potree issue 1436).
pub(super) const RESULTS: [(&str, DimensionType, &str); 2] = [
    (HEIGHT, DimensionType::F32, "height above ground [m]"),
    (TREE, DimensionType::F64, "tree of the point, 0 for none"),
];

/// ASPRS classes.
const UNCLASSIFIED: u8 = 1;
const GROUND: u8 = 2;
/// ASPRS class of water.
const WATER: u8 = 9;

/// Writes all points, tile by tile.
pub(super) fn write(
    survey: &Survey,
    tiles: &[TileId],
    params: &Params,
    inputs: &Inputs,
    context: &Context<'_>,
    folder: &mut OutputFolder,
) -> Result<(), StageError> {
    let crs = survey.crs.clone().unwrap_or_default();
    let results = RESULTS.map(|(name, kind, description)| Dimension {
        name: name.to_owned(),
        kind,
        description: description.to_owned(),
    });
    let source = survey.source_dimensions();
    let dimensions = results.into_iter().chain(source.iter().map(|(_, d)| d.clone())).collect();
    let low = survey.bounds().map_or([0.0; 3], |bounds| bounds.min);
    let options = LasOptions {
        scale: params.las_scale,
        offset: offset_for(&crs, low),
        gps_standard_time: survey.has_standard_time(),
        colour: survey.colour(),
        dimensions,
        ..LasOptions::default()
    };
    let path = folder.file("points.laz");
    let file = File::create(&path).map_err(Error::io(&path, "create"))?;
    let mut writer = LasWriter::new(file, &path, true, &crs, &options)?;
    for tile in tiles {
        context.check_cancelled()?;
        let mut cloud = labelled(*tile, inputs)?;
        for (name, dimension) in &source {
            rename(&mut cloud, name, &dimension.name);
        }
        put_results(&mut cloud, *tile, &survey.trees, inputs)?;
        writer.write(&cloud)?;
        context.advance(cloud.len() as u64);
    }
    writer.finish()?;
    Ok(())
}

/// The points of a tile, ground points in class 2 (water in the surface stays class 9). Points that the source had in class 2 and that
/// are not ground here become unclassified; all others keep the source's class.
fn labelled(tile: TileId, inputs: &Inputs) -> Result<PointCloud, StageError> {
    let (_, PointTile { mut cloud }) = read::<PointTile>(inputs, tile)?;
    let (_, GroundPoints { ground, .. }) = read::<GroundPoints>(inputs, tile)?;
    for class in &mut cloud.classification {
        if *class == GROUND {
            *class = UNCLASSIFIED;
        }
    }
    for index in ground {
        let points = cloud.len();
        let class = cloud.classification.get_mut(index as usize);
        let class = class
            .ok_or_else(|| misaligned(GroundPoints::NAME, tile, points, index as usize + 1))?;
        if *class != WATER {
            *class = GROUND;
        }
    }
    Ok(cloud)
}

fn put_results(
    cloud: &mut PointCloud,
    tile: TileId,
    trees: &SortedTrees,
    inputs: &Inputs,
) -> Result<(), StageError> {
    let (_, Heights { height_m }) = read::<Heights>(inputs, tile)?;
    let mut tree_id = match inputs.tile_path(Labels::NAME, tile) {
        Ok(_) => read::<Labels>(inputs, tile)?.1.tree_id,
        Err(_) => vec![0; cloud.len()],
    };
    for (kind, found) in [(Heights::NAME, height_m.len()), (Labels::NAME, tree_id.len())] {
        if found != cloud.len() {
            return Err(misaligned(kind, tile, cloud.len(), found).into());
        }
    }
    keep_told(&mut tree_id, trees)?;
    put(cloud, HEIGHT, Column::F32(height_m));
    put(cloud, TREE, Column::F64(tree_id.iter().map(|id| *id as f64).collect()));
    Ok(())
}

/// Takes ids away that are in no table: where a stage failed on a tile, its trees are lost, but
/// points of the tiles around it may still name them.
fn keep_told(tree_id: &mut [u64], trees: &SortedTrees) -> Result<(), Error> {
    let mut told = BTreeMap::from([(0, true)]);
    for id in tree_id {
        let is_told = match told.get(id) {
            Some(known) => *known,
            None => trees.contains(*id)?,
        };
        told.insert(*id, is_told);
        if !is_told {
            *id = 0;
        }
    }
    Ok(())
}

fn misaligned(
    kind: &'static str,
    tile: TileId,
    expected: usize,
    found: usize,
) -> timberline_artefact::Error {
    let unit = format!("tile:{tile}");
    timberline_artefact::Error::Misaligned { kind, unit, expected, found }
}

//! Pictures of single artefacts, for `inspect --png`.

mod of_trees;

use super::Usage;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use timberline_artefact::kinds::{
    Consolidated, CrownModel, CrownModels, Detections, GroundModel, GroundPoints, Heights, Labels,
    PictureFiles, PointTile, Qsm, Skeletons, TreeCloud, Trees, Treetops,
};
use timberline_artefact::{Header, Kind, read};
use timberline_report::Grid;
use timberline_report::canvas::Canvas;
use timberline_report::pictures::{self, Heading, PointColour};

const GROUND: u8 = 2;
const UNCLASSIFIED: u8 = 1;

/// Draws an artefact into a PNG file.
///
/// # Errors
/// When the kind has no picture, there is nothing to draw, or a file cannot be read or written.
pub fn write(path: &Path, header: &Header, target: &Path) -> Result<()> {
    if header.kind == PictureFiles::NAME {
        return of_trees::copy(path, target);
    }
    let canvas = draw(path, header)?;
    canvas.write_png(target).with_context(|| format!("cannot write {}", target.display()))
}

fn draw(path: &Path, header: &Header) -> Result<Canvas> {
    let crs = header.facts.crs.clone().unwrap_or_default();
    let title = format!("{} of {}", header.kind, header.unit);
    let subtitle =
        format!("by {} (version {}), key {}", header.stage, header.stage_version, header.key);
    let heading = Heading { title: &title, subtitle: &subtitle, crs: &crs };
    Ok(match header.kind.as_str() {
        GroundModel::NAME => terrain(&heading, &read::<GroundModel>(path)?.1)?,
        Treetops::NAME => pictures::treetops(&heading, &read::<Treetops>(path)?.1.tops)?,
        CrownModels::NAME => {
            pictures::crown_models(&heading, &read::<CrownModels>(path)?.1.models)?
        }
        Detections::NAME => {
            let (_, Detections { trees }) = read::<Detections>(path)?;
            let models: Vec<CrownModel> = trees.into_iter().map(|tree| tree.model).collect();
            pictures::crown_models(&heading, &models)?
        }
        Trees::NAME => crowns(&heading, &read::<Trees>(path)?.1)?,
        PointTile::NAME | GroundPoints::NAME | Heights::NAME | Labels::NAME => {
            points(&heading, path, header)?
        }
        TreeCloud::NAME => of_trees::tree_cloud(&heading, path)?,
        Consolidated::NAME => of_trees::consolidated(&heading, path)?,
        Skeletons::NAME => of_trees::skeletons(&heading, path)?,
        Qsm::NAME => of_trees::qsm(path, header)?,
        kind => {
            let message =
                format!("`{kind}` has no picture; draw the points, terrain or trees made from it");
            return Err(Usage(message).into());
        }
    })
}

fn terrain(heading: &Heading<'_>, model: &GroundModel) -> Result<Canvas> {
    Ok(pictures::raster(heading, &Grid::from(&model.raster), "Elevation [m]")?)
}

/// Trees are drawn as the crown models they came from.
fn crowns(heading: &Heading<'_>, trees: &Trees) -> Result<Canvas> {
    let models: Vec<CrownModel> = trees
        .trees
        .iter()
        .map(|tree| CrownModel {
            id: tree.id,
            apex_m: tree.apex_m,
            height_m: tree.height_m,
            radius_m: tree.crown_radius_m,
            status: tree.status,
            ..CrownModel::default()
        })
        .collect();
    Ok(pictures::crown_models(heading, &models)?)
}

/// A tile's points from above, coloured by what the artefact says about them.
fn points(heading: &Heading<'_>, path: &Path, header: &Header) -> Result<Canvas> {
    if header.kind == PointTile::NAME {
        let mut cloud = read::<PointTile>(path)?.1.cloud;
        let elevation: Vec<f32> = (0..cloud.len()).map(|i| cloud.world(i)[2] as f32).collect();
        cloud.extra.clear();
        return Ok(pictures::points(
            heading,
            &cloud,
            PointColour::Value(&elevation, "Elevation [m]"),
        )?);
    }
    let mut cloud = read::<PointTile>(&input_of::<PointTile>(path, header)?)?.1.cloud;
    Ok(match header.kind.as_str() {
        Heights::NAME => {
            let heights = read::<Heights>(path)?.1.height_m;
            same_length(cloud.len(), heights.len())?;
            pictures::points(
                heading,
                &cloud,
                PointColour::Value(&heights, "Height above ground [m]"),
            )?
        }
        Labels::NAME => {
            let labels = read::<Labels>(path)?.1.tree_id;
            same_length(cloud.len(), labels.len())?;
            pictures::points(heading, &cloud, PointColour::Tree(&labels))?
        }
        _ => {
            cloud.classification.fill(UNCLASSIFIED);
            for index in read::<GroundPoints>(path)?.1.ground {
                let class = cloud.classification.get_mut(index as usize);
                *class.context("a ground point is not in the tile")? = GROUND;
            }
            pictures::points(heading, &cloud, PointColour::Class)?
        }
    })
}

fn same_length(points: usize, values: usize) -> Result<()> {
    if points != values {
        bail!("{values} values for {points} points");
    }
    Ok(())
}

/// The file in the same store that holds the points an artefact speaks of, as one of its inputs.
fn input_of<K: Kind>(path: &Path, header: &Header) -> Result<PathBuf> {
    let input = header
        .inputs
        .iter()
        .find(|input| input.kind == K::NAME && input.unit == header.unit)
        .context("the artefact does not say from which points it was made")?;
    let name = format!("{}-{}.{}.{}", input.unit.file_stem(), input.key, K::NAME, K::EXTENSION);
    let store = path.parent().and_then(Path::parent).unwrap_or(Path::new(".."));
    let folders =
        std::fs::read_dir(store).with_context(|| format!("cannot read {}", store.display()))?;
    let found =
        folders.flatten().map(|folder| folder.path().join(&name)).find(|file| file.is_file());
    found.with_context(|| format!("{name} is not in {}; run the pipeline again", store.display()))
}

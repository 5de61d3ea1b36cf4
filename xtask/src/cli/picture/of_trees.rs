//! Pictures of artefacts about single trees.

use super::input_of;
use anyhow::{Context, Result};
use std::path::Path;
use timberline_artefact::kinds::{
    Consolidated, PictureFiles, Qsm, Skeleton, SkeletonNode, Skeletons, TreeCloud,
};
use timberline_artefact::publish::write_atomic;
use timberline_artefact::{Header, read};
use timberline_pointcloud::PointCloud;
use timberline_report::canvas::Canvas;
use timberline_report::pictures::Heading;
use timberline_report::stage::{ColourBy, tree_picture, wood_of_points};
use timberline_report::tree::{Rod, TreePicture, draw};

/// Colour of skeletons.
const AXIS: [u8; 3] = [0, 114, 178];

/// The points of a tree.
pub(super) fn tree_cloud(heading: &Heading<'_>, path: &Path) -> Result<Canvas> {
    let (_, TreeCloud { stem, cloud }) = read::<TreeCloud>(path)?;
    of_points(heading, &cloud, cloud.frame.local_from_world(stem.base_m))
}

/// The consolidated points of a tree; heights count from the lowest.
pub(super) fn consolidated(heading: &Heading<'_>, path: &Path) -> Result<Canvas> {
    let (_, Consolidated { consolidation, cloud }) = read::<Consolidated>(path)?;
    if let Some(reason) = consolidation.skipped {
        return Err(
            super::super::Usage(format!("there are no consolidated points: {reason}")).into()
        );
    }
    of_points(heading, &cloud, cloud.bounds().min)
}

fn of_points(heading: &Heading<'_>, cloud: &PointCloud, base_m: [f64; 3]) -> Result<Canvas> {
    let count = format!("{} points", cloud.len());
    Ok(draw(&TreePicture {
        title: heading.title,
        lines: &[heading.subtitle.to_owned(), count],
        points: &wood_of_points(cloud),
        rods: &[],
        base_m,
        legend: &[],
    })?)
}

/// The axes from the points as scanned, with their first radii.
pub(super) fn skeletons(heading: &Heading<'_>, path: &Path) -> Result<Canvas> {
    let (_, Skeletons { raw, consolidated }) = read::<Skeletons>(path)?;
    let nodes = |skeleton: &Skeleton| format!("{} nodes", skeleton.nodes.len());
    let other = consolidated.as_ref().map_or("none".to_owned(), nodes);
    let about =
        format!("from points as scanned: {}; from consolidated points: {other}", nodes(&raw));
    Ok(draw(&TreePicture {
        title: heading.title,
        lines: &[heading.subtitle.to_owned(), about],
        points: &[],
        rods: &rods(&raw),
        base_m: raw.nodes.first().map_or([0.0; 3], |root| root.position_m),
        legend: &[(AXIS, "skeleton".to_owned())],
    })?)
}

fn rods(skeleton: &Skeleton) -> Vec<Rod> {
    let rod = |node: &SkeletonNode| {
        let parent = skeleton.nodes.get(node.parent? as usize)?;
        Some(Rod {
            ends_m: [parent.position_m, node.position_m],
            radius_m: node.radius_m,
            flat_start: parent.parent.is_none(),
            colour: AXIS,
        })
    };
    skeleton.nodes.iter().filter_map(rod).collect()
}

/// A model beside the points it was made from.
pub(super) fn qsm(path: &Path, header: &Header) -> Result<Canvas> {
    let (_, qsm) = read::<Qsm>(path)?;
    let frame = header.facts.frame.context("a tree model without a frame")?;
    let (_, TreeCloud { cloud, .. }) = read::<TreeCloud>(&input_of::<TreeCloud>(path, header)?)?;
    Ok(tree_picture(&qsm, frame, cloud, ColourBy::Source)?)
}

/// Writes the picture that is in the artefact.
pub(super) fn copy(path: &Path, target: &Path) -> Result<()> {
    let (_, PictureFiles { files }) = read::<PictureFiles>(path)?;
    let picture = files.iter().find(|file| file.name.ends_with(".png"));
    let bytes = &picture.context("there is no PNG picture in it")?.bytes;
    write_atomic(target, bytes).with_context(|| format!("cannot write {}", target.display()))
}

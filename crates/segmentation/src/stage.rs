//! The stage `segmentation`: the only place here that reads and writes artefacts.

mod program;
mod tree_labels;

use crate::blocks::{room_m, segment_in_blocks, sort_markers};
use crate::{Claim, Crown, Marker, SegmentMethod, SegmentationParams, Segmenter, View, segmenter};
use timberline_artefact::kinds::{
    CrownShape, CrownStatus, Detection, Detections, GroundPoints, Heights, Labels, PointTile,
};
use timberline_artefact::stage::{
    Context, InputSpec, Inputs, NamedFile, Params, Stage, StageError, StageInfo,
};
use timberline_artefact::{Aligned, Error, Kind, Surroundings, UnitKind, gather, read_header};
use timberline_pointcloud::{Frame, Rect};

pub use tree_labels::TreeLabelsStage;

/// The tree of every point, by the method that the parameters name.
#[derive(Debug, Clone, Copy)]
pub struct SegmentationStage;

impl Params for SegmentationParams {
    fn check(&self) -> Vec<String> {
        self.check()
    }
}

/// ASPRS classes of noise, low and high.
const NOISE: [u8; 2] = [7, 18];

const INPUTS: &[InputSpec] = &[
    InputSpec::halo(PointTile::NAME),
    InputSpec::halo(GroundPoints::NAME),
    InputSpec::halo(Heights::NAME),
    InputSpec::halo(Detections::NAME),
];

impl Stage for SegmentationStage {
    type Params = SegmentationParams;

    fn info() -> StageInfo {
        StageInfo {
            name: "segmentation",
            version: 4,
            summary: "the tree of every point, given the trees: see `method` and `command`",
            unit: UnitKind::Tile,
            inputs: INPUTS,
            outputs: &[Labels::NAME],
        }
    }

    fn halo_m(params: &Self::Params) -> f64 {
        if !params.command.is_empty() {
            return params.command_halo_m;
        }
        let segmenter = segmenter(params);
        let room_m = if segmenter.is_local() { 0.0 } else { f64::from(params.block_m) };
        segmenter.reach_m() + room_m
    }

    fn files(params: &Self::Params) -> Vec<NamedFile> {
        files_of(&params.command)
    }

    fn memory_bytes(params: &Self::Params, points: u64) -> u64 {
        // The graph of its voxels. Measured on the sample stand: a peak of 230 MB for 0.56 M points in a
        // tile and its neighbours on one thread (`cargo xtask run` of the shipped pipeline with
        // `method = "ncut"` and `--only segmentation --jobs 1`), which is 410 a point; several threads
        // hold the graphs of several squares.
        const BYTES_PER_POINT_NCUT: u64 = 800;
        let program = memory_of_program(&params.command, params.command_memory_limit_mb);
        match params.method {
            SegmentMethod::Ncut if params.command.is_empty() => points * BYTES_PER_POINT_NCUT,
            _ => points * BYTES_PER_POINT + program,
        }
    }

    fn run(
        params: &Self::Params,
        inputs: &Inputs,
        context: &Context<'_>,
    ) -> Result<(), StageError> {
        let (all, claims) = match params.command.is_empty() {
            true => built_in(params, inputs, context)?,
            false => {
                let hooked = program::Hooked {
                    command: &params.command,
                    halo_m: params.command_halo_m,
                    reach_m: params.reach_m,
                    time_limit_s: params.command_time_limit_s,
                    memory_limit_mb: params.command_memory_limit_mb,
                };
                let markers = |rect: &Rect, frame: &Frame| markers(inputs, rect, frame);
                program::claims_by_program(&hooked, inputs, context, markers)?
            }
        };
        context.advance(all.own_len as u64);
        let claims = all.own_values(&claims);
        let labelled = claims.iter().filter(|claim| claim.id != 0).count();
        let facts = all.located.count("points", all.own_len).count("labelled", labelled);
        context.emit(&labels(&claims), facts)?;
        Ok(())
    }
}

/// The files that the words of a program name.
fn files_of(command: &[String]) -> Vec<NamedFile> {
    let files = crate::hook::named_files(command).into_iter();
    files.map(|(name, required)| NamedFile { name, param: "command", required }).collect()
}

/// Peak memory of a task that holds little more than its points, bytes a point.
const BYTES_PER_POINT: u64 = 300;

/// Memory that a program may take, bytes; none where there is no program.
fn memory_of_program(command: &[String], limit_mb: u32) -> u64 {
    if command.is_empty() { 0 } else { u64::from(limit_mb) * 1_000_000 }
}

/// The tree of every point of a tile and its surroundings, by the method that the parameters name.
fn built_in(
    params: &SegmentationParams,
    inputs: &Inputs,
    context: &Context<'_>,
) -> Result<(Surroundings, Vec<Claim>), StageError> {
    let segmenter = segmenter(params);
    let halo_m = needed_m(&*segmenter, params, &tile_rect(inputs)?);
    let points_m = if segmenter.is_local() { 0.0 } else { halo_m };
    let mut all = gather(inputs, points_m, &[Aligned::Height])?;
    hide_noise(&mut all);
    let markers = markers(inputs, &all.tile_rect.grown(halo_m), &all.cloud.frame)?;
    context.check_cancelled()?;
    let claims = claims(&*segmenter, params, &all, &markers)?;
    Ok((all, claims))
}

/// The tile's rectangle in the world.
fn tile_rect(inputs: &Inputs) -> Result<Rect, Error> {
    let path = inputs.own_path(PointTile::NAME)?;
    let grid = read_header(path)?.facts.grid;
    let grid = grid.ok_or_else(|| Error::corrupt(path, "header", "no tile grid"))?;
    Ok(grid.rect(inputs.tile()?))
}

/// How far beyond this tile the segmenter looks, m; at most the halo of the stage.
fn needed_m(segmenter: &dyn Segmenter, params: &SegmentationParams, tile: &Rect) -> f64 {
    let reach_m = segmenter.reach_m();
    if segmenter.is_local() { reach_m } else { room_m(tile, params.block_m, reach_m) }
}

/// The trees with an apex in a rectangle of the world, edges included.
fn markers(inputs: &Inputs, rect: &Rect, frame: &Frame) -> Result<Vec<Marker>, Error> {
    let mut markers = Vec::new();
    for detections in inputs.each::<Detections>() {
        let (_, _, Detections { trees }) = detections?;
        let near = |tree: &&Detection| {
            let [x, y, _] = tree.model.apex_m;
            rect.touches(&Rect { min: [x, y], max: [x, y] })
        };
        markers.extend(trees.iter().filter(near).map(|tree| marker(tree, frame)));
    }
    sort_markers(&mut markers);
    Ok(markers)
}

/// A tree; where its model does not stand, without a crown.
fn marker(Detection { model, score, .. }: &Detection, frame: &Frame) -> Marker {
    let stands = model.status == CrownStatus::Accepted;
    let crown = Crown {
        id: model.id,
        apex: frame.local_from_world(model.apex_m),
        coefficients: if stands { model.coefficients() } else { [0.0; 2] },
        radius_m: if stands { model.radius_m } else { 0.0 },
        tolerance_m: model.tolerance_m,
        oblique: model.shape == CrownShape::Mixed,
    };
    Marker { crown, height_m: model.height_m, score: *score }
}

fn claims(
    segmenter: &dyn Segmenter,
    params: &SegmentationParams,
    all: &Surroundings,
    markers: &[Marker],
) -> Result<Vec<Claim>, crate::Error> {
    let cloud = &all.cloud;
    // Files that do not count returns say 0.
    let is_first: Vec<bool> = cloud.return_number.iter().map(|number| *number <= 1).collect();
    let view = View {
        frame: cloud.frame,
        x: &cloud.x,
        y: &cloud.y,
        z: &cloud.z,
        height_m: &all.height_m,
        is_first: &is_first,
        markers,
    };
    let own: Vec<bool> = all.own.iter().map(Option::is_some).collect();
    segment_in_blocks(segmenter, &view, &own, params.block_m)
}

/// Forgets the heights of what the scan says is noise: it has no tree and is no part of the canopy's
/// surface. Noise is there only where the stage `tiles` was told to keep it.
fn hide_noise(all: &mut Surroundings) {
    let classes = all.height_m.iter_mut().zip(&all.cloud.classification);
    classes.filter(|(_, class)| NOISE.contains(class)).for_each(|(height, _)| *height = f32::NAN);
}

fn labels(claims: &[Claim]) -> Labels {
    Labels {
        tree_id: claims.iter().map(|claim| claim.id).collect(),
        score: claims.iter().map(|claim| claim.score).collect(),
    }
}

//! The stage `tree-pictures`: the picture of one tree.

use crate::colour::Rgb;
use crate::tree::{Rod, TreePicture, draw};
use crate::{Canvas, Error};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use timberline_artefact::kinds::{Distances, PictureFiles, Qsm, RadiusSource, TreeCloud, TreeFile};
use timberline_artefact::stage::{Context, InputSpec, Inputs, Stage, StageError, StageInfo};
use timberline_artefact::{Facts, Kind, UnitKind};
use timberline_pointcloud::{Frame, PointCloud};

/// By what cylinders are coloured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ColourBy {
    /// What their radius rests on.
    Source,
    /// The order of their branch.
    Order,
}

/// Parameters of the stage `tree-pictures`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// By what cylinders are coloured.
    pub colour_by: ColourBy,
}

impl Default for Params {
    fn default() -> Self {
        Self { colour_by: ColourBy::Source }
    }
}

impl timberline_artefact::stage::Params for Params {}

/// Pictures of trees as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct TreePicturesStage;

const INPUTS: &[InputSpec] = &[InputSpec::own(TreeCloud::NAME), InputSpec::own(Qsm::NAME)];

impl Stage for TreePicturesStage {
    type Params = Params;

    fn info() -> StageInfo {
        StageInfo {
            name: "tree-pictures",
            version: 1,
            summary: "picture of one tree: points beside the model, from the south and from the east",
            unit: UnitKind::Tree,
            inputs: INPUTS,
            outputs: &[PictureFiles::NAME],
        }
    }

    /// The points, and four panels of twice the picture's resolution.
    fn memory_bytes(_params: &Params, points: u64) -> u64 {
        const BYTES_PER_POINT: u64 = 150;
        const PICTURE: u64 = 200 << 20;
        PICTURE + points * BYTES_PER_POINT
    }

    fn run(params: &Params, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let (header, qsm) = inputs.own::<Qsm>()?;
        let cloud = inputs.own::<TreeCloud>()?.1.cloud;
        let frame = header.facts.frame.ok_or("a tree model without a frame")?;
        let canvas = tree_picture(&qsm, frame, cloud, params.colour_by)?;
        let file = TreeFile { name: "tree.png".to_owned(), bytes: canvas.png()? };
        let facts = Facts::located_like(&header.facts).count("files", 1);
        context.emit(&PictureFiles { files: vec![file] }, facts)?;
        Ok(())
    }
}

/// The picture of a tree from its model, whose positions are in `frame`, and its points in any frame.
///
/// # Errors
/// As [`draw`].
pub fn tree_picture(
    qsm: &Qsm,
    frame: Frame,
    cloud: PointCloud,
    colour_by: ColourBy,
) -> Result<Canvas, Error> {
    draw(&TreePicture {
        title: &format!("Tree {}", qsm.tree_id),
        lines: &lines(qsm),
        points: &wood_of_points(&cloud.in_frame(frame)),
        rods: &rods(qsm, colour_by),
        base_m: frame.local_from_world(qsm.base_m),
        legend: &legend(qsm, colour_by),
    })
}

/// The points of a tree in the frame of the cloud, with how likely each is on wood; NaN where the cloud
/// does not tell.
#[must_use]
pub fn wood_of_points(cloud: &PointCloud) -> Vec<([f64; 3], f32)> {
    let wood = cloud.extra.get(TreeCloud::WOOD);
    let likelihood = |i: usize| wood.map_or(f32::NAN, |column| column.value(i) as f32);
    (0..cloud.len()).map(|i| (cloud.local(i), likelihood(i))).collect()
}

/// Colours of radius sources, from the palette of Okabe and Ito (2008).
const SOURCES: [(RadiusSource, Rgb); 3] = [
    (RadiusSource::Measured, [0, 158, 115]),
    (RadiusSource::Interpolated, [230, 159, 0]),
    (RadiusSource::Inferred, [204, 121, 167]),
];
/// Colours of branch orders, from the same palette; higher orders have the last.
const ORDERS: [Rgb; 5] =
    [[120, 84, 50], [0, 114, 178], [0, 158, 115], [230, 159, 0], [204, 121, 167]];

fn order_of(qsm: &Qsm, branch: u32) -> usize {
    let order = qsm.branches.get(branch as usize).map_or(0, |branch| usize::from(branch.order));
    order.min(ORDERS.len() - 1)
}

fn rods(qsm: &Qsm, by: ColourBy) -> Vec<Rod> {
    let source = |source: RadiusSource| {
        SOURCES.iter().find(|(other, _)| *other == source).map_or([128; 3], |(_, colour)| *colour)
    };
    let rod = |c: &timberline_artefact::kinds::QsmCylinder| Rod {
        ends_m: [c.start_m, c.end_m],
        radius_m: c.radius_m,
        flat_start: c.parent.is_none(),
        colour: match by {
            ColourBy::Source => source(c.source),
            ColourBy::Order => ORDERS[order_of(qsm, c.branch)],
        },
    };
    qsm.cylinders.iter().map(rod).collect()
}

fn legend(qsm: &Qsm, by: ColourBy) -> Vec<(Rgb, String)> {
    match by {
        ColourBy::Source => SOURCES
            .into_iter()
            .map(|(source, colour)| {
                let count = qsm.cylinders.iter().filter(|c| c.source == source).count();
                (colour, format!("{} ({count})", source.name()))
            })
            .collect(),
        ColourBy::Order => (0..ORDERS.len())
            .map(|order| {
                let of = |b: &&_| order_of_branch(b) == order;
                let count = qsm.branches.iter().filter(of).count();
                let more = if order + 1 == ORDERS.len() { "+" } else { "" };
                (ORDERS[order], format!("order {order}{more} ({count})"))
            })
            .collect(),
    }
}

fn order_of_branch(branch: &timberline_artefact::kinds::QsmBranch) -> usize {
    usize::from(branch.order).min(ORDERS.len() - 1)
}

/// What stands below the title.
fn lines(qsm: &Qsm) -> Vec<String> {
    let metrics = &qsm.metrics;
    let dbh = metrics.dbh.map_or("no DBH".to_owned(), |dbh| {
        let sd = if dbh.sd_m.is_finite() {
            format!(" ± {:.1}", dbh.sd_m * 100.0)
        } else {
            String::new()
        };
        format!("DBH {:.1}{sd} cm ({})", dbh.diameter_m * 100.0, dbh.source.name())
    });
    let litres = |m3: f64| format!("{:.0} l", m3 * 1000.0);
    let first = [
        dbh,
        format!("height {:.1} m", metrics.height_m),
        format!("stem {}", litres(metrics.stem_volume_m3)),
        format!("branches ≥ 5 cm {}", litres(metrics.thick_volume_m3)),
        format!("below {}", litres(metrics.thin_volume_m3)),
    ];
    let millimetres = |distances: &Distances| {
        let Distances { mean_m, rms_m, p95_m, max_m, .. } = *distances;
        let [mean, rms, p95, max] = [mean_m, rms_m, p95_m, max_m].map(|m| m * 1000.0);
        format!("mean {mean:.1}, RMS {rms:.1}, P95 {p95:.0}, max {max:.0} mm")
    };
    let mut second = vec![
        format!("{} branches", qsm.branches.len()),
        format!("{} cylinders", qsm.cylinders.len()),
    ];
    if qsm.cloud_to_model.count > 0 {
        second.push(format!("points to model: {}", millimetres(&qsm.cloud_to_model)));
    }
    vec![first.join("  ·  "), second.join("  ·  ")]
}

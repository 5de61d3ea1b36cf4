//! The stage `tree-models`: the files about one tree.

use crate::Error;
use crate::csv_table::write_table;
use crate::table::Column;
use crate::tree::ply::Precision;
use crate::tree::scene::Watertight;
use crate::tree::{
    Model, cylinder_columns, glb, metrics, obj, order_columns, ply, recording, scene,
    taper_columns, treefile, treeqsm,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::path::Path;
use timberline_artefact::kinds::{ModelFiles, Qsm, Skeletons, TreeCloud, TreeFile};
use timberline_artefact::stage::{Context, InputSpec, Inputs, Stage, StageError, StageInfo};
use timberline_artefact::{Facts, Kind, UnitKind};
use timberline_solids::tubes::Fineness;

/// Parameters of the stage `tree-models`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Corners of a tube's cross-section; twigs thinner than 2 cm have half as many.
    #[schemars(range(min = 3, max = 64), extend("x-source" = "Du et al. 2019, 10"))]
    pub sides: u32,
    /// Longest step along a tube's axis.
    #[schemars(
        range(min = 0.005, max = 1.0),
        extend("x-unit" = "m", "x-source" = "Du et al. 2019, 5 cm")
    )]
    pub step_m: f64,
    /// About so many triangles has the closed mesh of the whole tree; its grid is made so coarse. 0 leaves
    /// that mesh out.
    #[schemars(range(min = 0, max = 20_000_000))]
    pub watertight_triangles: u32,
    /// Smallest edge of that grid. Pieces of branches with a radius below the edge are left out.
    #[schemars(range(min = 0.001, max = 0.5), extend("x-unit" = "m"))]
    pub watertight_cell_m: f64,
    /// Write `tree.mcap`.
    pub write_recording: bool,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            sides: 10,
            step_m: 0.05,
            watertight_triangles: 300_000,
            watertight_cell_m: 0.005,
            write_recording: true,
        }
    }
}

impl timberline_artefact::stage::Params for Params {}

/// Files about a tree as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct TreeModelsStage;

const INPUTS: &[InputSpec] =
    &[InputSpec::own(Qsm::NAME), InputSpec::own(TreeCloud::NAME), InputSpec::own(Skeletons::NAME)];

impl Stage for TreeModelsStage {
    type Params = Params;

    fn info() -> StageInfo {
        StageInfo {
            name: "tree-models",
            version: 2,
            summary: "tables and meshes of one tree: QSM, TreeQSM columns, tree file, PLY, OBJ, glTF, MCAP",
            unit: UnitKind::Tree,
            inputs: INPUTS,
            outputs: &[ModelFiles::NAME],
        }
    }

    /// The points, and the corners of the closed mesh's grid while they are sorted: an estimate. With
    /// 300,000 triangles and 31,000 points the whole process held 195 MB (`cargo xtask run
    /// pipelines/tls-trees.toml --until tree-models --jobs 1` over a part of the sample plot); this says 216 MB.
    fn memory_bytes(params: &Params, points: u64) -> u64 {
        const BYTES_PER_POINT: u64 = 200;
        const BYTES_PER_TRIANGLE: u64 = 700;
        points * BYTES_PER_POINT + u64::from(params.watertight_triangles) * BYTES_PER_TRIANGLE
    }

    fn run(params: &Params, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let (header, qsm) = inputs.own::<Qsm>()?;
        let frame = header.facts.frame.ok_or("a tree model without a frame")?;
        let crs = header.facts.crs.clone().unwrap_or_default();
        let model = Model { qsm: &qsm, frame, crs: &crs };
        let mut files = tables(&model)?;
        context.check_cancelled()?;
        let closed = (params.watertight_triangles > 0).then(|| {
            let triangles = u64::from(params.watertight_triangles);
            scene::watertight(&model, triangles, params.watertight_cell_m)
        });
        let closed = closed.filter(|closed| !closed.closed.mesh.triangles.is_empty());
        files.push(file("metrics.json", metrics::write(&model, closed.as_ref())?));
        files.extend(meshes(&model, params, closed.as_ref()));
        context.check_cancelled()?;
        if params.write_recording {
            let cloud = inputs.own::<TreeCloud>()?.1.cloud.in_frame(frame);
            let skeletons = inputs.own::<Skeletons>()?.1;
            let used = skeletons.consolidated.filter(|_| qsm.consolidation.used);
            let skeleton = used.unwrap_or(skeletons.raw);
            files.push(file("tree.mcap", recording::write(&model, &cloud, &skeleton)?));
        }
        files.sort_by(|a, b| a.name.cmp(&b.name));
        let facts = Facts::located_like(&header.facts)
            .count("files", files.len())
            .count("cylinders", qsm.cylinders.len());
        context.emit(&ModelFiles { files }, facts)?;
        Ok(())
    }
}

fn file(name: &str, bytes: Vec<u8>) -> TreeFile {
    TreeFile { name: name.to_owned(), bytes }
}

fn tables(model: &Model<'_>) -> Result<Vec<TreeFile>, Error> {
    Ok(vec![
        table(model, "qsm.csv", cylinder_columns::COLUMNS, cylinder_columns::rows(model))?,
        table(model, "taper.csv", taper_columns::COLUMNS, taper_columns::rows(model))?,
        table(model, "branches.csv", order_columns::COLUMNS, order_columns::rows(model))?,
        file("treeqsm.csv", treeqsm::write(model, Path::new("treeqsm.csv"))?),
        file("tree.txt", treefile::write(model).into_bytes()),
    ])
}

fn table<T>(
    model: &Model<'_>,
    name: &str,
    columns: &[Column<T>],
    rows: impl IntoIterator<Item = T>,
) -> Result<TreeFile, Error> {
    let mut bytes = Vec::new();
    let rows = rows.into_iter().map(Ok);
    write_table(&mut bytes, Path::new(name), columns, model.crs, rows)?;
    Ok(file(name, bytes))
}

fn meshes(model: &Model<'_>, params: &Params, closed: Option<&Watertight>) -> Vec<TreeFile> {
    let fineness = Fineness { sides: params.sides, step_m: params.step_m };
    let branches = scene::branches(model, fineness, 0.0);
    let notes = notes(model);
    let (mesh, colours) = ply::merged(&branches);
    let part = glb::Part::of(model.qsm.tree_id.to_string(), [0.0; 3], &branches, Value::Null);
    let mut files = vec![
        file("tree.ply", ply::write(&mesh, &colours, Precision::Single, &notes)),
        file("tree.obj", obj::write(&branches, &notes).into_bytes()),
        file("tree.glb", glb::write(&[part], &extras(model))),
    ];
    if let Some(Watertight { closed, left_out }) = closed {
        let mut notes = notes;
        notes.push(format!(
            "grid {} m: {left_out} pieces that are thinner are left out",
            closed.cell_m
        ));
        let bytes = ply::write(&closed.mesh, &[], Precision::Single, &notes);
        files.push(file("tree_watertight.ply", bytes));
    }
    files
}

/// What text in a mesh file says about its frame.
fn notes(model: &Model<'_>) -> Vec<String> {
    let [x, y, z] = model.frame.origin_m;
    vec![
        format!("Timberline {}, tree {}", env!("CARGO_PKG_VERSION"), model.qsm.tree_id),
        format!("offset_m {x} {y} {z}"),
        format!("add offset_m to positions (metres) to get to the world: {}", model.crs.name),
        "colours: green measured, orange interpolated, purple inferred".to_owned(),
    ]
}

fn extras(model: &Model<'_>) -> Value {
    json!({
        "tree_id": model.qsm.tree_id,
        "offset_m": model.frame.origin_m,
        "axes": "world (x, y, z) = (x, -z, y) + offset_m",
        "crs": model.crs.name,
        "wkt": model.crs.wkt,
    })
}

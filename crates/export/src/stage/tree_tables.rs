//! The stage `tree-tables`: the files of all trees in the outputs folder, and merged tables and meshes.

use crate::Error;
use crate::csv_table::{write_dictionary_of, write_table};
use crate::gpkg::GeoPackage;
use crate::table::Column;
use crate::tree::cylinder_columns::{self, CylinderRow};
use crate::tree::order_columns::{self, OrderRow};
use crate::tree::ply::Precision;
use crate::tree::taper_columns::{self, TaperRow};
use crate::tree::tree_columns::{self, STEMS, TreeRow};
use crate::tree::{Model, glb, ply, scene};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use timberline_artefact::kinds::{ModelFiles, Outputs, PictureFiles, Qsm, Stems, TreeFile};
use timberline_artefact::stage::{Context, InputSpec, Inputs, Stage, StageError, StageInfo};
use timberline_artefact::{Crs, Facts, Kind, OutputFolder, UnitId, UnitKind};
use timberline_pointcloud::{Bounds3, Frame};
use timberline_solids::Mesh;
use timberline_solids::tubes::Fineness;
use timberline_solids::vector::add;

/// Parameters of the stage `tree-tables`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Corners of a tube's cross-section in the mesh of the plot; twigs thinner than 2 cm have half as many.
    #[schemars(range(min = 3, max = 64))]
    pub plot_sides: u32,
    /// Longest step along a tube's axis there.
    #[schemars(range(min = 0.005, max = 5.0), extend("x-unit" = "m"))]
    pub plot_step_m: f64,
    /// Branches are cut off there where they get thinner than this.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "m"))]
    pub plot_least_radius_m: f64,
}

impl Default for Params {
    fn default() -> Self {
        Self { plot_sides: 6, plot_step_m: 0.2, plot_least_radius_m: 0.01 }
    }
}

impl timberline_artefact::stage::Params for Params {}

/// Tables of all trees as a stage of a pipeline.
#[derive(Debug, Clone, Copy)]
pub struct TreeTablesStage;

const NAME: &str = "tree-tables";
/// Folder of the folders of trees.
const TREES: &str = "trees/";

const INPUTS: &[InputSpec] = &[
    InputSpec::all(Stems::NAME),
    InputSpec::all(Qsm::NAME),
    InputSpec::all(ModelFiles::NAME),
    InputSpec::all(PictureFiles::NAME),
];

impl Stage for TreeTablesStage {
    type Params = Params;

    fn info() -> StageInfo {
        StageInfo {
            name: NAME,
            version: 1,
            summary: "files of all trees, merged tables with their dictionaries, GeoPackage, mesh of the plot",
            unit: UnitKind::Campaign,
            inputs: INPUTS,
            outputs: &[Outputs::NAME],
        }
    }

    /// The mesh of the plot, and the files of one tree at a time. How many trees there are is not known
    /// here: a terrestrial tree has 10,000 points or more.
    fn memory_bytes(_params: &Params, points: u64) -> u64 {
        const BYTES_PER_POINT: u64 = 100;
        const ONE_TREE: u64 = 300 << 20;
        ONE_TREE + points * BYTES_PER_POINT
    }

    fn run(params: &Params, inputs: &Inputs, context: &Context<'_>) -> Result<(), StageError> {
        let mut folder = OutputFolder::open(context.outputs_folder(), NAME)?;
        let plot = Plot::of(params, inputs, context)?;
        plot.write_tables(inputs, context, &mut folder)?;
        plot.write_meshes(&mut folder)?;
        let mut unpacked = 0;
        for file in inputs.files_of(ModelFiles::NAME) {
            context.check_cancelled()?;
            let files = timberline_artefact::read::<ModelFiles>(&file.path)?.1.files;
            unpacked += unpack(&file.unit, &files, &mut folder)?;
        }
        for file in inputs.files_of(PictureFiles::NAME) {
            let files = timberline_artefact::read::<PictureFiles>(&file.path)?.1.files;
            unpacked += unpack(&file.unit, &files, &mut folder)?;
        }
        let files = folder.publish(is_ours)?;
        let mut totals = plot.totals.clone();
        totals.insert("tree files".to_owned(), unpacked);
        context.emit(&Outputs { files, totals }, plot.facts())?;
        Ok(())
    }
}

/// Whether a file in the outputs folder is this stage's.
fn is_ours(name: &str) -> bool {
    const TABLES: [&str; 4] = ["trees", "qsm", "taper", "branches"];
    let table =
        |stem: &str| name == format!("{stem}.csv") || name == format!("{stem}.dictionary.csv");
    name.starts_with(TREES)
        || TABLES.into_iter().any(table)
        || ["trees.gpkg", "plot.glb", "plot.ply"].contains(&name)
}

/// Writes the files of a tree into its folder; returns how many there are.
fn unpack(unit: &UnitId, files: &[TreeFile], folder: &mut OutputFolder) -> Result<u64, StageError> {
    for file in files {
        // A name comes from an artefact, and must not lead out of the folder.
        if file.name.contains(['/', '\\']) || file.name.starts_with('.') || file.name.is_empty() {
            return Err(format!("{unit}: `{}` is no name for a file", file.name).into());
        }
        let path = folder.file(&format!("{TREES}{}/{}", unit.file_stem(), file.name));
        let parent = path.parent().unwrap_or(Path::new(""));
        std::fs::create_dir_all(parent).map_err(Error::io(parent, "create"))?;
        std::fs::write(&path, &file.bytes).map_err(Error::io(&path, "write"))?;
    }
    Ok(files.len() as u64)
}

/// What is kept of all trees.
#[derive(Default)]
struct Plot {
    crs: Crs,
    located: Facts,
    origin: Frame,
    trees: Vec<TreeRow>,
    cylinders: usize,
    taper: Vec<TaperRow>,
    orders: Vec<OrderRow>,
    parts: Vec<glb::Part>,
    totals: BTreeMap<String, u64>,
}

impl Plot {
    /// Reads the models, by ascending tree id.
    fn of(params: &Params, inputs: &Inputs, context: &Context<'_>) -> Result<Self, StageError> {
        let mut plot = Self::default();
        let mut found = Vec::new();
        for stems in inputs.each::<Stems>() {
            let (_, header, Stems { stems, .. }) = stems?;
            plot.located.crs = plot.located.crs.take().or(header.facts.crs);
            found.extend(stems.iter().map(|stem| (stem.tree_id, stem.base_m)));
        }
        let corner = found.iter().fold(Bounds3::EMPTY, |mut bounds, (_, base)| {
            bounds.include(*base);
            bounds
        });
        if !corner.is_empty() {
            plot.origin = Frame::near(corner.min);
        }
        let fineness = Fineness { sides: params.plot_sides, step_m: params.plot_step_m };
        for model in inputs.each::<Qsm>() {
            context.check_cancelled()?;
            let (_, header, qsm) = model?;
            plot.add(&header.facts, &qsm, fineness, params.plot_least_radius_m)?;
        }
        plot.count(&found, context);
        plot.crs = plot.located.crs.clone().unwrap_or_default();
        Ok(plot)
    }

    fn add(
        &mut self,
        facts: &Facts,
        qsm: &Qsm,
        fineness: Fineness,
        least_radius_m: f64,
    ) -> Result<(), StageError> {
        let frame = facts.frame.ok_or("a tree model without a frame")?;
        self.located.crs = self.located.crs.take().or_else(|| facts.crs.clone());
        let crs = self.located.crs.clone().unwrap_or_default();
        let model = Model { qsm, frame, crs: &crs };
        self.trees.push(TreeRow::of(&model));
        self.cylinders += qsm.cylinders.len();
        self.taper.extend(taper_columns::rows(&model));
        self.orders.extend(order_columns::rows(&model));
        let branches = scene::branches(&model, fineness, least_radius_m);
        let offset_m = self.origin.shift_from(&frame);
        let extras = json!({ "tree_id": qsm.tree_id });
        let name = qsm.tree_id.to_string();
        self.parts.push(glb::Part::of(name, offset_m, &branches, extras));
        Ok(())
    }

    /// Counts the trees, and names those that were found but have no model.
    fn count(&mut self, found: &[(u64, [f64; 3])], context: &Context<'_>) {
        let modelled: Vec<u64> = self.trees.iter().map(|row| row.tree_id).collect();
        let lost: Vec<u64> = found
            .iter()
            .map(|(tree_id, _)| *tree_id)
            .filter(|tree_id| modelled.binary_search(tree_id).is_err())
            .collect();
        for tree_id in &lost {
            context.warn(format!("tree {tree_id}"), "it has no model: a stage before failed on it");
        }
        let totals = [
            ("trees", self.trees.len()),
            ("trees found", found.len().max(self.trees.len())),
            ("trees without a model", lost.len()),
            ("cylinders", self.cylinders),
        ];
        self.totals = totals.map(|(name, value)| (name.to_owned(), value as u64)).into();
    }

    fn facts(&self) -> Facts {
        let mut facts = self.located.clone();
        let bounds = self.trees.iter().fold(Bounds3::EMPTY, |mut bounds, row| {
            bounds.include(row.base_m);
            bounds
        });
        facts.bounds = Some(bounds).filter(|bounds| !bounds.is_empty());
        facts.counts = self.totals.clone();
        facts
    }

    fn write_tables(
        &self,
        inputs: &Inputs,
        context: &Context<'_>,
        folder: &mut OutputFolder,
    ) -> Result<(), StageError> {
        let crs = &self.crs;
        table(folder, "trees", tree_columns::COLUMNS, crs, self.trees.iter().cloned().map(Ok))?;
        table(folder, "qsm", cylinder_columns::COLUMNS, crs, all_cylinders(inputs, crs))?;
        table(folder, "taper", taper_columns::COLUMNS, crs, self.taper.iter().copied().map(Ok))?;
        let orders = self.orders.iter().copied().map(Ok);
        table(folder, "branches", order_columns::COLUMNS, crs, orders)?;
        let mut package = GeoPackage::create(&folder.file("trees.gpkg"), crs)?;
        package.add_layer(&STEMS, &mut self.trees.iter().cloned().map(Ok))?;
        let mut rows = vec![
            ("program".to_owned(), concat!("Timberline ", env!("CARGO_PKG_VERSION")).to_owned()),
            ("campaign".to_owned(), context.campaign().name.clone()),
            ("crs".to_owned(), crs.name.clone()),
        ];
        rows.extend(self.totals.iter().map(|(name, value)| (name.clone(), value.to_string())));
        let about = "How this layer was made: program, campaign, number of trees";
        package.add_attributes("run", about, &rows)?;
        package.finish()?;
        Ok(())
    }

    /// `plot.glb` with a node for every tree, and `plot.ply` with doubles.
    fn write_meshes(&self, folder: &mut OutputFolder) -> Result<(), StageError> {
        let [x, y, z] = self.origin.origin_m;
        let extras = json!({
            "offset_m": self.origin.origin_m,
            "axes": "world (x, y, z) = (x, -z, y) + offset_m",
            "crs": self.crs.name,
            "wkt": self.crs.wkt,
        });
        let path = folder.file("plot.glb");
        std::fs::write(&path, glb::write(&self.parts, &extras))
            .map_err(Error::io(&path, "write"))?;
        let (mut mesh, mut colours) = (Mesh::default(), Vec::new());
        for part in &self.parts {
            let moved = part.mesh.vertices_m.iter().map(|vertex| add(*vertex, part.offset_m));
            let triangles = part.mesh.triangles.clone();
            mesh.append(&Mesh { vertices_m: moved.collect(), triangles });
            colours.extend(&part.colours);
        }
        let notes = [
            format!("Timberline {}, {} trees", env!("CARGO_PKG_VERSION"), self.parts.len()),
            format!("offset_m {x} {y} {z}"),
            format!("add offset_m to positions (metres) to get to the world: {}", self.crs.name),
        ];
        let path = folder.file("plot.ply");
        std::fs::write(&path, ply::write(&mesh, &colours, Precision::Double, &notes))
            .map_err(Error::io(&path, "write"))?;
        Ok(())
    }
}

/// The cylinders of all trees, read tree by tree: those of hundreds of trees are gigabytes.
fn all_cylinders(inputs: &Inputs, crs: &Crs) -> impl Iterator<Item = Result<CylinderRow, Error>> {
    inputs.each::<Qsm>().flat_map(|model| match model {
        Ok((_, header, qsm)) => {
            let frame = header.facts.frame.unwrap_or_default();
            let model = Model { qsm: &qsm, frame, crs };
            cylinder_columns::rows(&model).map(Ok).collect()
        }
        Err(error) => vec![Err(error.into())],
    })
}

/// Writes a table and its dictionary.
fn table<T>(
    folder: &mut OutputFolder,
    stem: &str,
    columns: &[Column<T>],
    crs: &Crs,
    rows: impl Iterator<Item = Result<T, Error>>,
) -> Result<(), Error> {
    let path = folder.file(&format!("{stem}.csv"));
    let out = BufWriter::new(File::create(&path).map_err(Error::io(&path, "create"))?);
    write_table(out, &path, columns, crs, rows)?;
    let path = folder.file(&format!("{stem}.dictionary.csv"));
    let out = BufWriter::new(File::create(&path).map_err(Error::io(&path, "create"))?);
    write_dictionary_of(out, &path, columns, crs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_files_are_known_by_name() {
        for name in ["trees/12/qsm.csv", "trees/", "trees.csv", "qsm.dictionary.csv", "plot.glb"] {
            assert!(is_ours(name), "{name}");
        }
        for name in ["trees", "mytrees/1/a", "plot.png", "notes.csv", "points.laz"] {
            assert!(!is_ours(name), "{name}");
        }
    }

    #[test]
    fn a_name_cannot_lead_out_of_the_folder() {
        let place = tempfile::tempdir().unwrap();
        let mut folder = OutputFolder::open(place.path(), NAME).unwrap();
        for name in ["../evil", "a/b", ".hidden", "", "a\\b"] {
            let file = TreeFile { name: name.to_owned(), bytes: Vec::new() };
            assert!(unpack(&UnitId::Tree(1), &[file], &mut folder).is_err(), "{name}");
        }
    }
}

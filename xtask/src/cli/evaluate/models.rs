//! Tree models of a run, and the true trees they are compared with.

use super::super::known::artefacts;
use super::super::open::Opened;
use super::Args;
use crate::engine::explain::DryRun;
use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::path::Path;
use timberline_artefact::kinds::{Qsm, Trees};
use timberline_artefact::{Kind, read};
use timberline_evaluate::branches::{Branch, Volumes};
use timberline_evaluate::{ModelParams, Piece, PlotAccuracy, Stem, TreeModel, assess_models};
use timberline_pointcloud::Frame;
use timberline_solids::Cylinder;

/// How far the lowest cylinder of a true tree may be from the base in the table of trees, m.
const BASE_REACH_M: f64 = 1.0;

/// Whether the pipeline ends in models of trees and not in crowns.
pub(super) fn made_by(opened: &Opened) -> bool {
    let writes = |kind: &str| {
        opened.pipeline.stages.iter().any(|stage| stage.stage.info().outputs.contains(&kind))
    };
    writes(Qsm::NAME) && !writes(Trees::NAME)
}

/// Compares the models of a run with the tables of true trees and cylinders.
pub(super) fn assess(
    args: &Args,
    opened: &Opened,
    dry: &DryRun<'_>,
    [trees, cylinders]: [&Path; 2],
) -> Result<PlotAccuracy> {
    let rows: Vec<TreeRow> = read_table(trees)?;
    let first = rows.first().with_context(|| format!("{}: no trees", trees.display()))?;
    let frame = Frame::near(first.base_m());
    let wood = Wood::new(&rows, read_table(cylinders)?, frame)
        .with_context(|| cylinders.display().to_string())?;
    let is_high = |height_m: f64| height_m.is_nan() || height_m >= args.min_height;
    let high = rows.iter().filter(|row| is_high(row.height_m));
    let truth = high.map(|row| wood.tree(row)).collect::<Result<Vec<_>>>()?;
    let mut models = Vec::new();
    for path in artefacts(opened, dry, Qsm::NAME)?.values() {
        let (header, qsm) = read::<Qsm>(path)?;
        let own = header.facts.frame.with_context(|| format!("{}: no frame", path.display()))?;
        models.push(model(&qsm, frame.shift_from(&own)));
    }
    models.retain(|tree| is_high(tree.stem.height_m));
    let usual = ModelParams::default().with_class_below_truth(&truth);
    let max_distance_m = args.distance.unwrap_or(usual.max_distance_m);
    Ok(assess_models(&truth, &models, &ModelParams { max_distance_m, ..usual })?)
}

/// A line of the table of trees.
#[derive(Debug, Deserialize)]
struct TreeRow {
    tree_id: u64,
    dbh_cm: Option<f64>,
    height_m: f64,
    base_x_m: f64,
    base_y_m: f64,
    base_z_m: f64,
    stem_m3: Option<f64>,
    branches_from_5cm_m3: Option<f64>,
    branches_below_5cm_m3: Option<f64>,
}

impl TreeRow {
    fn base_m(&self) -> [f64; 3] {
        [self.base_x_m, self.base_y_m, self.base_z_m]
    }

    fn stem(&self) -> Stem {
        Stem {
            id: self.tree_id,
            at_m: [self.base_x_m, self.base_y_m],
            dbh_m: self.dbh_cm.map_or(f64::NAN, |dbh_cm| dbh_cm / 100.0),
            height_m: self.height_m,
        }
    }

    /// The volumes, if the table has them.
    fn volumes(&self) -> Option<Volumes> {
        Some(Volumes {
            stem_m3: self.stem_m3?,
            thick_m3: self.branches_from_5cm_m3?,
            thin_m3: self.branches_below_5cm_m3?,
        })
    }
}

/// A line of the table of cylinders.
#[derive(Debug, Deserialize)]
struct WoodRow {
    tree_id: u64,
    cylinder: u32,
    parent: u32,
    branch: u32,
    order: u16,
    start_x_m: f64,
    start_y_m: f64,
    start_z_m: f64,
    end_x_m: f64,
    end_y_m: f64,
    end_z_m: f64,
    start_radius_mm: f64,
    end_radius_mm: f64,
}

impl WoodRow {
    fn start_m(&self) -> [f64; 3] {
        [self.start_x_m, self.start_y_m, self.start_z_m]
    }

    /// The cylinder of the mean radius, moved.
    fn cylinder(&self, by_m: [f64; 3]) -> Cylinder {
        let moved = |at_m: [f64; 3]| std::array::from_fn(|axis| at_m[axis] + by_m[axis]);
        Cylinder {
            start_m: moved(self.start_m()),
            end_m: moved([self.end_x_m, self.end_y_m, self.end_z_m]),
            radius_m: (self.start_radius_mm + self.end_radius_mm) / 2000.0,
        }
    }
}

fn read_table<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>> {
    let place = || path.display().to_string();
    let rows = csv::Reader::from_path(path).with_context(place)?.into_deserialize();
    rows.collect::<Result<Vec<T>, csv::Error>>().with_context(place)
}

/// The true wood by tree.
struct Wood {
    trees: BTreeMap<u64, Vec<WoodRow>>,
    /// From the positions of the table to those of the frame in which trees are compared, m.
    shift_m: [f64; 3],
}

impl Wood {
    /// Where the table's origin is follows from the first tree, whose lowest cylinder stands at its base.
    fn new(rows: &[TreeRow], wood: Vec<WoodRow>, frame: Frame) -> Result<Self> {
        let mut trees: BTreeMap<u64, Vec<WoodRow>> = BTreeMap::new();
        for row in wood {
            trees.entry(row.tree_id).or_default().push(row);
        }
        let mut own = rows.iter().filter_map(|row| Some((row, trees.get(&row.tree_id)?.first()?)));
        let (tree, lowest) = own.next().context("no cylinder of any tree")?;
        let (base_m, start_m) = (tree.base_m(), lowest.start_m());
        let origin =
            Frame::new(std::array::from_fn(|axis| (base_m[axis] - start_m[axis]).round() as i64));
        for (tree, lowest) in std::iter::once((tree, lowest)).chain(own) {
            let (base_m, at_m) = (tree.base_m(), origin.world_from_local(lowest.start_m()));
            let away = (0..3).map(|axis| (base_m[axis] - at_m[axis]).abs()).fold(0.0, f64::max);
            let id = tree.tree_id;
            ensure!(
                away <= BASE_REACH_M,
                "the first cylinder of tree {id} begins {away:.2} m from its base; all positions must have one origin"
            );
        }
        let shift_m = frame.shift_from(&origin);
        Ok(Self { trees, shift_m })
    }

    fn tree(&self, row: &TreeRow) -> Result<TreeModel> {
        let none = Vec::new();
        let wood = self.trees.get(&row.tree_id).unwrap_or(&none);
        let places: BTreeMap<u32, u32> =
            wood.iter().zip(0..).map(|(row, place)| (row.cylinder, place)).collect();
        let piece = |wood: &WoodRow| -> Result<Piece> {
            let parent = places.get(&wood.parent).copied().filter(|_| wood.parent != 0);
            ensure!(
                parent.is_some() || wood.parent == 0,
                "cylinder {} of tree {}: its parent {} is not in the table of cylinders",
                wood.cylinder,
                row.tree_id,
                wood.parent
            );
            let cylinder = wood.cylinder(self.shift_m);
            ensure!(
                cylinder.is_finite(),
                "cylinder {} of tree {} is {cylinder:?}; all values must be finite and the radius not negative",
                wood.cylinder,
                row.tree_id
            );
            Ok(Piece { cylinder, parent, branch: wood.branch, order: wood.order })
        };
        let pieces = wood.iter().map(piece).collect::<Result<Vec<_>>>()?;
        let volumes = row.volumes().unwrap_or_else(|| Volumes::of(&branches(&pieces)));
        Ok(TreeModel { stem: row.stem(), pieces, volumes })
    }
}

/// Every piece as a branch: volumes are counted by piece.
fn branches(pieces: &[Piece]) -> Vec<Branch> {
    let branch = |piece: &Piece| Branch { order: piece.order, cylinders: vec![piece.cylinder] };
    pieces.iter().map(branch).collect()
}

/// The model of a tree, moved.
fn model(qsm: &Qsm, by_m: [f64; 3]) -> TreeModel {
    let moved = |at_m: [f64; 3]| std::array::from_fn(|axis| at_m[axis] + by_m[axis]);
    let order = |branch: u32| qsm.branches.get(branch as usize).map_or(0, |branch| branch.order);
    let piece = |own: &timberline_artefact::kinds::QsmCylinder| Piece {
        cylinder: Cylinder {
            start_m: moved(own.start_m),
            end_m: moved(own.end_m),
            radius_m: own.radius_m,
        },
        parent: own.parent,
        branch: own.branch,
        order: order(own.branch),
    };
    let metrics = &qsm.metrics;
    TreeModel {
        stem: Stem {
            id: qsm.tree_id,
            at_m: [qsm.base_m[0], qsm.base_m[1]],
            dbh_m: metrics.dbh.map_or(f64::NAN, |dbh| dbh.diameter_m),
            height_m: metrics.height_m,
        },
        pieces: qsm.cylinders.iter().map(piece).collect(),
        volumes: Volumes {
            stem_m3: metrics.stem_volume_m3,
            thick_m3: metrics.thick_volume_m3,
            thin_m3: metrics.thin_volume_m3,
        },
    }
}

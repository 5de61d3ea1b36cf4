//! The columns of `taper.csv`.

use super::Model;
use crate::table::{Column, Kind, Unit, Value, column};
use timberline_artefact::kinds::TaperStep;

/// A row: the stem of a tree at a height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TaperRow {
    /// The tree.
    pub tree_id: u64,
    /// The step.
    pub step: TaperStep,
}

/// The rows of a model, in its order.
pub fn rows<'a>(model: &Model<'a>) -> impl Iterator<Item = TaperRow> + 'a {
    let qsm = model.qsm;
    qsm.metrics.taper.iter().map(move |step| TaperRow { tree_id: qsm.tree_id, step: *step })
}

/// The columns.
pub const COLUMNS: &[Column<TaperRow>] = &[
    column("tree_id", Kind::Integer, Unit::None, "1 to 2^53", "Id of the tree", |row, _| {
        Value::Integer(row.tree_id as i64)
    }),
    column("height_m", Kind::Real(3), Unit::Is("m"), "", "Height above the base", |row, _| {
        Value::Real(row.step.height_m)
    }),
    column(
        "diameter_m",
        Kind::Real(4),
        Unit::Is("m"),
        "0 or more",
        "Diameter of the stem at that height",
        |row, _| Value::Real(row.step.diameter_m),
    ),
    column(
        "source",
        Kind::Text,
        Unit::None,
        "measured, interpolated, inferred",
        "What the diameter rests on, as in qsm.csv",
        |row, _| Value::Text(row.step.source.name().to_owned()),
    ),
];

//! The columns of `qsm.csv`.

use super::Model;
use crate::table::{Column, Kind, Unit, Value, column};
use timberline_artefact::kinds::QsmCylinder;
use timberline_solids::vector::distance;

/// A row: one cylinder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CylinderRow {
    /// The tree.
    pub tree_id: u64,
    /// Number of the cylinder in the tree, from 1.
    pub number: u32,
    /// The cylinder.
    pub cylinder: QsmCylinder,
    /// Ends, world, m.
    pub ends_m: [[f64; 3]; 2],
    /// Order of its branch.
    pub order: u16,
    /// Number of the branch that its branch grows on, from 1.
    pub parent_branch: Option<u32>,
    /// Place in its branch, from 1.
    pub position: u32,
}

/// The rows of a model, in its order.
pub fn rows<'a>(model: &Model<'a>) -> impl Iterator<Item = CylinderRow> + 'a {
    let Model { qsm, frame, .. } = *model;
    (0u32..).zip(&qsm.cylinders).map(move |(place, cylinder)| {
        let branch = qsm.branches.get(cylinder.branch as usize);
        CylinderRow {
            tree_id: qsm.tree_id,
            number: place + 1,
            cylinder: *cylinder,
            ends_m: [cylinder.start_m, cylinder.end_m].map(|end| frame.world_from_local(end)),
            order: branch.map_or(0, |branch| branch.order),
            parent_branch: branch.and_then(|branch| branch.parent).map(|parent| parent + 1),
            position: branch.map_or(0, |branch| place.saturating_sub(branch.first) + 1),
        }
    })
}

/// Positions to a micrometre: finer than any scanner, coarser than the last bit of a world coordinate.
const MICROMETRES: Kind = Kind::Real(6);
const M: Unit = Unit::Is("m");
const POSITIVE: &str = "0 or more";

/// An integer, or missing.
fn or_missing(value: Option<u32>) -> Value {
    value.map_or(Value::Real(f64::NAN), |value| Value::Integer(i64::from(value)))
}

macro_rules! position {
    ($name:literal, $end:literal, $axis:literal, $unit:expr, $meaning:literal) => {
        column($name, MICROMETRES, $unit, "", $meaning, |row, crs| {
            Value::Real(crs.crs_from_world(row.ends_m[$end])[$axis])
        })
    };
}

/// The columns. Positions are in the units of the CRS, sizes in metres.
pub const COLUMNS: &[Column<CylinderRow>] = &[
    column("tree_id", Kind::Integer, Unit::None, "1 to 2^53", "Id of the tree", |row, _| {
        Value::Integer(row.tree_id as i64)
    }),
    column(
        "cylinder",
        Kind::Integer,
        Unit::None,
        "1 or more",
        "Number of the cylinder in its tree; a parent has a lower one",
        |row, _| Value::Integer(i64::from(row.number)),
    ),
    column(
        "parent",
        Kind::Integer,
        Unit::None,
        "1 or more",
        "Number of the cylinder it continues or grows on; missing for the lowest",
        |row, _| or_missing(row.cylinder.parent.map(|parent| parent + 1)),
    ),
    column(
        "branch",
        Kind::Integer,
        Unit::None,
        "1 or more",
        "Number of its branch in the tree; 1 is the stem",
        |row, _| Value::Integer(i64::from(row.cylinder.branch) + 1),
    ),
    column(
        "parent_branch",
        Kind::Integer,
        Unit::None,
        "1 or more",
        "Number of the branch that its branch grows on; missing for the stem",
        |row, _| or_missing(row.parent_branch),
    ),
    column(
        "branch_order",
        Kind::Integer,
        Unit::None,
        POSITIVE,
        "Order of the branch: 0 the stem, 1 branches on the stem, and so on",
        |row, _| Value::Integer(i64::from(row.order)),
    ),
    column(
        "position_in_branch",
        Kind::Integer,
        Unit::None,
        "1 or more",
        "Place of the cylinder in its branch",
        |row, _| Value::Integer(i64::from(row.position)),
    ),
    position!("start_x", 0, 0, Unit::CrsHorizontal, "Easting of the lower end's centre"),
    position!("start_y", 0, 1, Unit::CrsHorizontal, "Northing of the lower end's centre"),
    position!("start_z", 0, 2, Unit::CrsVertical, "Elevation of the lower end's centre"),
    position!("end_x", 1, 0, Unit::CrsHorizontal, "Easting of the upper end's centre"),
    position!("end_y", 1, 1, Unit::CrsHorizontal, "Northing of the upper end's centre"),
    position!("end_z", 1, 2, Unit::CrsVertical, "Elevation of the upper end's centre"),
    column("length_m", MICROMETRES, M, POSITIVE, "Distance between the ends", |row, _| {
        Value::Real(distance(row.ends_m[0], row.ends_m[1]))
    }),
    column("radius_m", MICROMETRES, M, POSITIVE, "Radius", |row, _| {
        Value::Real(row.cylinder.radius_m)
    }),
    column(
        "radius_sd_m",
        MICROMETRES,
        M,
        POSITIVE,
        "Standard error of the radius; missing where there is none",
        |row, _| Value::Real(row.cylinder.radius_sd_m),
    ),
    column(
        "source",
        Kind::Text,
        Unit::None,
        "measured, interpolated, inferred",
        "What the radius rests on: a fit to the cylinder's own points, measured cylinders of the same branch, or the pipe model",
        |row, _| Value::Text(row.cylinder.source.name().to_owned()),
    ),
    column(
        "arc_coverage",
        Kind::Real(3),
        Unit::None,
        "0 to 1",
        "Part of the circumference that has points",
        |row, _| Value::Real(f64::from(row.cylinder.arc_coverage)),
    ),
    column(
        "points",
        Kind::Integer,
        Unit::None,
        POSITIVE,
        "Number of points the fit rests on",
        |row, _| Value::Integer(i64::from(row.cylinder.points)),
    ),
];

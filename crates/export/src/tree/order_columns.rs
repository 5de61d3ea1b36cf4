//! The columns of `branches.csv`: branches counted by order.

use super::Model;
use crate::table::{Column, Kind, Unit, Value};
use timberline_artefact::Crs;
use timberline_artefact::kinds::RadiusSource;

/// A row: the branches of one order in a tree.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OrderRow {
    /// The tree.
    pub tree_id: u64,
    /// The order.
    pub order: u16,
    /// Branches of it.
    pub branches: u32,
    /// Their cylinders.
    pub cylinders: u32,
    /// Of these, measured ones.
    pub measured: u32,
    /// Length, m.
    pub length_m: f64,
    /// Volume, m3.
    pub volume_m3: f64,
    /// Lateral surface, m2.
    pub surface_m2: f64,
    /// Largest diameter, m.
    pub diameter_m: f64,
}

/// The rows of a model, by order; orders without branches are left out.
#[must_use]
pub fn rows(model: &Model<'_>) -> Vec<OrderRow> {
    let mut rows: Vec<OrderRow> = Vec::new();
    let all = model.cylinders();
    for branch in &model.qsm.branches {
        let order = usize::from(branch.order);
        while rows.len() <= order {
            let order = rows.len() as u16;
            rows.push(OrderRow { tree_id: model.qsm.tree_id, order, ..OrderRow::default() });
        }
        let row = &mut rows[order];
        row.branches += 1;
        for place in model.places(branch) {
            row.cylinders += 1;
            row.measured += u32::from(model.qsm.cylinders[place].source == RadiusSource::Measured);
            row.length_m += all[place].length_m();
            row.volume_m3 += all[place].volume_m3();
            row.surface_m2 += all[place].lateral_area_m2();
            row.diameter_m = row.diameter_m.max(2.0 * all[place].radius_m);
        }
    }
    rows.retain(|row| row.branches > 0);
    rows
}

const fn column(
    name: &'static str,
    kind: Kind,
    unit: &'static str,
    meaning: &'static str,
    value: fn(&OrderRow, &Crs) -> Value,
) -> Column<OrderRow> {
    let unit = if unit.is_empty() { Unit::None } else { Unit::Is(unit) };
    Column { name, kind, unit, meaning, range: "0 or more", value }
}

/// The columns.
pub const COLUMNS: &[Column<OrderRow>] = &[
    column("tree_id", Kind::Integer, "", "Id of the tree", |row, _| {
        Value::Integer(row.tree_id as i64)
    }),
    column(
        "branch_order",
        Kind::Integer,
        "",
        "Order: 0 the stem, 1 branches on the stem, and so on",
        |row, _| Value::Integer(i64::from(row.order)),
    ),
    column("branches", Kind::Integer, "", "Number of branches of that order", |row, _| {
        Value::Integer(i64::from(row.branches))
    }),
    column("cylinders", Kind::Integer, "", "Number of their cylinders", |row, _| {
        Value::Integer(i64::from(row.cylinders))
    }),
    column("measured", Kind::Integer, "", "Number of those with a measured radius", |row, _| {
        Value::Integer(i64::from(row.measured))
    }),
    column("length_m", Kind::Real(3), "m", "Length of the cylinders", |row, _| {
        Value::Real(row.length_m)
    }),
    column("volume_m3", Kind::Real(6), "m3", "Volume of the cylinders", |row, _| {
        Value::Real(row.volume_m3)
    }),
    column("surface_m2", Kind::Real(4), "m2", "Lateral surface of the cylinders", |row, _| {
        Value::Real(row.surface_m2)
    }),
    column("diameter_m", Kind::Real(4), "m", "Largest diameter", |row, _| {
        Value::Real(row.diameter_m)
    }),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree::testing::{FRAME, fork};

    #[test]
    fn orders_add_up() {
        let (qsm, crs) = (fork(7), Crs::default());
        let found = rows(&Model { qsm: &qsm, frame: FRAME, crs: &crs });
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].branches, found[0].cylinders, found[0].measured), (1, 3, 2));
        assert_eq!((found[1].order, found[1].branches, found[1].measured), (1, 1, 0));
        assert_eq!(found[0].diameter_m, 0.4);
        let total: f64 = found.iter().map(|row| row.length_m).sum();
        let model = Model { qsm: &qsm, frame: FRAME, crs: &crs };
        let expected: f64 =
            model.cylinders().iter().map(timberline_solids::Cylinder::length_m).sum();
        assert!((total - expected).abs() < 1e-12);
    }
}

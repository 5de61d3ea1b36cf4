//! What a column of a table is: one description for CSV, its dictionary and the GeoPackage.

use crate::crs::unit_name;
use timberline_artefact::Crs;
use timberline_artefact::kinds::Tree;

/// One value of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A whole number.
    Integer(i64),
    /// A measured number; NaN is written as missing.
    Real(f64),
    /// A word.
    Text(String),
}

/// The type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers.
    Integer,
    /// Numbers written with this many decimals.
    Real(usize),
    /// Words.
    Text,
}

/// Unit of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unit {
    /// No unit.
    None,
    /// Unit of x and y of the CRS.
    CrsHorizontal,
    /// Unit of z of the CRS.
    CrsVertical,
    /// Another, by name.
    Is(&'static str),
}

impl Unit {
    /// The unit's name in a given CRS.
    #[must_use]
    pub fn name(self, crs: &Crs) -> &'static str {
        match self {
            Self::None => "",
            Self::CrsHorizontal => unit_name(crs.horizontal_m_per_unit),
            Self::CrsVertical => unit_name(crs.vertical_m_per_unit),
            Self::Is(name) => name,
        }
    }
}

/// One column of a table about things of one type.
#[derive(Debug)]
pub struct Column<T = Tree> {
    /// Name, the same in every format.
    pub name: &'static str,
    /// Type.
    pub kind: Kind,
    /// Unit.
    pub unit: Unit,
    /// What the value says, and what a missing one means.
    pub meaning: &'static str,
    /// Values that occur.
    pub range: &'static str,
    /// The value of a row.
    pub value: fn(&T, &Crs) -> Value,
}

/// A column, as a line of a table of columns.
pub(crate) const fn column<T>(
    name: &'static str,
    kind: Kind,
    unit: Unit,
    range: &'static str,
    meaning: &'static str,
    value: fn(&T, &Crs) -> Value,
) -> Column<T> {
    Column { name, kind, unit, meaning, range, value }
}

impl<T> Clone for Column<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Column<T> {}

impl<T> Column<T> {
    /// The value of a row as text: fixed decimals, empty where missing.
    #[must_use]
    pub fn text(&self, row: &T, crs: &Crs) -> String {
        match (self.value_of(row, crs), self.kind) {
            (None, _) => String::new(),
            (Some(Value::Integer(value)), _) => value.to_string(),
            (Some(Value::Text(value)), _) => value,
            (Some(Value::Real(value)), Kind::Real(decimals)) => format!("{value:.decimals$}"),
            (Some(Value::Real(value)), _) => value.to_string(),
        }
    }

    /// The value of a row, rounded to the column's decimals; `None` where it is missing.
    ///
    /// Rounded values are the same in every format, and never -0.
    #[must_use]
    pub fn value_of(&self, row: &T, crs: &Crs) -> Option<Value> {
        match ((self.value)(row, crs), self.kind) {
            (Value::Real(value), _) if !value.is_finite() => None,
            (Value::Real(value), Kind::Real(decimals)) => {
                let step = [1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8][decimals.min(8)];
                Some(Value::Real((value * step).round() / step + 0.0))
            }
            (value, _) => Some(value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tree_columns::TREE_COLUMNS;

    #[test]
    fn numbers_have_fixed_decimals_and_no_negative_zero() {
        let height = TREE_COLUMNS.iter().find(|column| column.name == "height_m").unwrap();
        let text =
            |value| height.text(&Tree { height_m: value, ..Tree::default() }, &Crs::default());
        assert_eq!([text(12.345_678), text(-0.001), text(f64::NAN)], ["12.35", "0.00", ""]);
    }

    #[test]
    fn feet_go_out_as_feet_and_heights_as_metres() {
        let crs =
            Crs { horizontal_m_per_unit: 0.3048, vertical_m_per_unit: 0.3048, ..Crs::default() };
        let tree = Tree { apex_m: [304.8, 609.6, 30.48], height_m: 20.0, ..Tree::default() };
        let row: Vec<String> = TREE_COLUMNS[1..6].iter().map(|c| c.text(&tree, &crs)).collect();
        assert_eq!(row, ["1000.000", "2000.000", "100.000", "0.000", "20.00"]);
        assert_eq!(TREE_COLUMNS[1].unit.name(&crs), "foot");
    }
}

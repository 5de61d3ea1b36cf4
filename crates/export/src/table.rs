//! Columns of the tree table: one description for CSV, its dictionary and the GeoPackage.

use crate::crs::unit_name;
use timberline_artefact::Crs;
use timberline_artefact::kinds::{CrownShape, CrownStatus, PositionSource, Tree, TreeFlag};

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

/// One column.
#[derive(Debug, Clone, Copy)]
pub struct Column {
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
    /// The value of a tree.
    pub value: fn(&Tree, &Crs) -> Value,
}

impl Column {
    /// The value of a tree as text: fixed decimals, empty where missing.
    #[must_use]
    pub fn text(&self, tree: &Tree, crs: &Crs) -> String {
        match (self.value_of(tree, crs), self.kind) {
            (None, _) => String::new(),
            (Some(Value::Integer(value)), _) => value.to_string(),
            (Some(Value::Text(value)), _) => value,
            (Some(Value::Real(value)), Kind::Real(decimals)) => format!("{value:.decimals$}"),
            (Some(Value::Real(value)), _) => value.to_string(),
        }
    }

    /// The value of a tree, rounded to the column's decimals; `None` where it is missing.
    ///
    /// Rounded values are the same in every format, and never -0.
    #[must_use]
    pub fn value_of(&self, tree: &Tree, crs: &Crs) -> Option<Value> {
        match ((self.value)(tree, crs), self.kind) {
            (Value::Real(value), _) if !value.is_finite() => None,
            (Value::Real(value), Kind::Real(decimals)) => {
                let step = [1.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8][decimals.min(8)];
                Some(Value::Real((value * step).round() / step + 0.0))
            }
            (value, _) => Some(value),
        }
    }
}

const fn column(
    name: &'static str,
    kind: Kind,
    unit: Unit,
    range: &'static str,
    meaning: &'static str,
    value: fn(&Tree, &Crs) -> Value,
) -> Column {
    Column { name, kind, unit, meaning, range, value }
}

/// Metres with two decimals.
const METRES: Kind = Kind::Real(2);
const M: Unit = Unit::Is("m");
const POSITIVE: &str = "0 or more";

/// The columns of the tree table.
///
/// Positions are in the units of the CRS, so that they lie where the campaign's other layers do;
/// sizes and heights above ground are metres whatever the CRS.
pub const TREE_COLUMNS: &[Column] = &[
    column(
        "tree_id",
        Kind::Integer,
        Unit::None,
        "1 to 2^53",
        "Id of the tree, the same in points, layers and tables; made from the apex position",
        |tree, _| Value::Integer(tree.id as i64),
    ),
    column(
        "x",
        Kind::Real(3),
        Unit::CrsHorizontal,
        "",
        "Easting of the highest point",
        |tree, crs| Value::Real(crs.crs_from_world(tree.apex_m)[0]),
    ),
    column(
        "y",
        Kind::Real(3),
        Unit::CrsHorizontal,
        "",
        "Northing of the highest point",
        |tree, crs| Value::Real(crs.crs_from_world(tree.apex_m)[1]),
    ),
    column(
        "z",
        Kind::Real(3),
        Unit::CrsVertical,
        "",
        "Elevation of the highest point",
        |tree, crs| Value::Real(crs.crs_from_world(tree.apex_m)[2]),
    ),
    column(
        "ground_z",
        Kind::Real(3),
        Unit::CrsVertical,
        "",
        "Elevation of the ground below the highest point; missing without ground",
        |tree, crs| Value::Real(tree.ground_m / crs.vertical_m_per_unit),
    ),
    column(
        "height_m",
        METRES,
        M,
        POSITIVE,
        "Height of the highest point above the ground surface",
        |tree, _| Value::Real(tree.height_m),
    ),
    column(
        "stem_x",
        Kind::Real(3),
        Unit::CrsHorizontal,
        "",
        "Easting taken for the stem",
        |tree, crs| Value::Real(tree.position_m[0] / crs.horizontal_m_per_unit),
    ),
    column(
        "stem_y",
        Kind::Real(3),
        Unit::CrsHorizontal,
        "",
        "Northing taken for the stem",
        |tree, crs| Value::Real(tree.position_m[1] / crs.horizontal_m_per_unit),
    ),
    column(
        "stem_source",
        Kind::Text,
        Unit::None,
        "crown-fit, highest-point",
        "Where the stem position comes from: centre of the fitted crown surface, or highest point",
        |tree, _| Value::Text(position_source(tree.position_source).to_owned()),
    ),
    column(
        "stem_uncertainty_m",
        METRES,
        M,
        POSITIVE,
        "Extent of the positions whose fit is nearly as good; missing without a fit",
        |tree, _| Value::Real(tree.position_uncertainty_m),
    ),
    column(
        "crown_radius_m",
        METRES,
        M,
        POSITIVE,
        "Crown radius of the consensus crown model",
        |tree, _| Value::Real(tree.crown_radius_m),
    ),
    column(
        "crown_area_m2",
        METRES,
        Unit::Is("m2"),
        POSITIVE,
        "Area of the crown outline",
        |tree, _| Value::Real(tree.crown_area_m2),
    ),
    column(
        "crown_diameter_m",
        METRES,
        M,
        POSITIVE,
        "Diameter of the circle of the crown's area",
        |tree, _| Value::Real(tree.crown_diameter_mean_m),
    ),
    column(
        "crown_diameter_max_m",
        METRES,
        M,
        POSITIVE,
        "Largest width of the crown outline",
        |tree, _| Value::Real(tree.crown_diameter_max_m),
    ),
    column(
        "crown_base_m",
        METRES,
        M,
        POSITIVE,
        "Height of the crown's base above ground; missing where it cannot be told",
        |tree, _| Value::Real(tree.crown_base_m),
    ),
    column(
        "semi_axis_a_m",
        METRES,
        M,
        POSITIVE,
        "Larger semi-axis of the fitted surface one metre below its apex; missing without a fit",
        |tree, _| Value::Real(tree.semi_axes_m[0].max(tree.semi_axes_m[1])),
    ),
    column(
        "semi_axis_b_m",
        METRES,
        M,
        POSITIVE,
        "Smaller semi-axis of the fitted surface one metre below its apex; missing without a fit",
        |tree, _| Value::Real(tree.semi_axes_m[0].min(tree.semi_axes_m[1])),
    ),
    column(
        "fit_residual_m",
        Kind::Real(3),
        M,
        POSITIVE,
        "Mean absolute residual of the fitted surface; missing without a fit",
        |tree, _| Value::Real(tree.fit_residual_m),
    ),
    column(
        "model",
        Kind::Text,
        Unit::None,
        "paraboloid, cone, blend, mixed",
        "Form of the consensus crown model",
        |tree, _| Value::Text(shape(tree.shape).to_owned()),
    ),
    column(
        "model_b1",
        Kind::Real(5),
        Unit::None,
        "",
        "First parameter of the crown model",
        |tree, _| Value::Real(tree.parameters[0]),
    ),
    column(
        "model_b2",
        Kind::Real(5),
        Unit::None,
        "",
        "Second parameter; 0 for forms with one",
        |tree, _| Value::Real(tree.parameters[1]),
    ),
    column(
        "model_status",
        Kind::Text,
        Unit::None,
        "accepted, too-few-points, too-many-outliers, no-model",
        "Whether the crown model stands, and if not, why",
        |tree, _| Value::Text(status(tree.status).to_owned()),
    ),
    column(
        "inliers",
        Kind::Integer,
        Unit::None,
        POSITIVE,
        "Points that agree with the crown model",
        |tree, _| Value::Integer(i64::from(tree.inliers)),
    ),
    column(
        "outliers",
        Kind::Integer,
        Unit::None,
        POSITIVE,
        "Points in the window of the crown model that do not agree with it",
        |tree, _| Value::Integer(i64::from(tree.outliers)),
    ),
    column(
        "points",
        Kind::Integer,
        Unit::None,
        POSITIVE,
        "Points labelled with the tree",
        |tree, _| Value::Integer(i64::from(tree.points)),
    ),
    column(
        "flags",
        Kind::Text,
        Unit::None,
        "underdetermined, no-redundancy, shape-bound-active, centre-outside-data, one-sided, \
         prior-active, imbalance-active, model-rejected, at-survey-edge",
        "What to know about the tree, words separated by spaces",
        |tree, _| Value::Text(TreeFlag::names(tree.flags)),
    ),
];

fn position_source(source: PositionSource) -> &'static str {
    match source {
        PositionSource::CrownFit => "crown-fit",
        PositionSource::HighestPoint => "highest-point",
    }
}

fn shape(shape: CrownShape) -> &'static str {
    match shape {
        CrownShape::Paraboloid => "paraboloid",
        CrownShape::Cone => "cone",
        CrownShape::Blend => "blend",
        CrownShape::Mixed => "mixed",
    }
}

fn status(status: CrownStatus) -> &'static str {
    match status {
        CrownStatus::Accepted => "accepted",
        CrownStatus::TooFewPoints => "too-few-points",
        CrownStatus::TooManyOutliers => "too-many-outliers",
        CrownStatus::NoModel => "no-model",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique_and_plain() {
        let mut names: Vec<&str> = TREE_COLUMNS.iter().map(|column| column.name).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        assert!(names.iter().all(|name| name.chars().all(plain)));
    }

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

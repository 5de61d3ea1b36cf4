//! The columns of the tree table.

use crate::table::{Column, Kind, Unit, Value, column};
use timberline_artefact::kinds::{CrownShape, CrownStatus, Tree, TreeFlag};

/// Metres with two decimals.
const METRES: Kind = Kind::Real(2);
/// Metres with three decimals.
const MILLIMETRES: Kind = Kind::Real(3);
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
        "l1, l2, hull-centroid, starsac, highest-point",
        "Method that made the stem position: centre of the crown surface fitted by L1 or L2, centroid of the crown's hull, peak of the consensus model, or highest point (also where a fit is not usable)",
        |tree, _| Value::Text(tree.position_method.name().to_owned()),
    ),
    column(
        "stem_uncertainty_m",
        MILLIMETRES,
        M,
        POSITIVE,
        "Radius around the stem of the positions, within the prior, whose fit is within 0.1 % of the best; missing where not computed",
        |tree, _| Value::Real(tree.position_extent_m),
    ),
    column(
        "stem_standard_error_m",
        MILLIMETRES,
        M,
        POSITIVE,
        "Asymptotic standard error of the stem position without regard to the prior, both axes together; missing without one",
        |tree, _| Value::Real(tree.position_standard_error_m),
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
        "surface_x",
        Kind::Real(3),
        Unit::CrsHorizontal,
        "",
        "Easting of the fitted surface's centre; missing without a surface",
        |tree, crs| Value::Real(tree.surface_centre_m[0] / crs.horizontal_m_per_unit),
    ),
    column(
        "surface_y",
        Kind::Real(3),
        Unit::CrsHorizontal,
        "",
        "Northing of the fitted surface's centre; missing without a surface",
        |tree, crs| Value::Real(tree.surface_centre_m[1] / crs.horizontal_m_per_unit),
    ),
    column(
        "surface_z",
        Kind::Real(3),
        Unit::CrsVertical,
        "",
        "Elevation of the fitted surface at its centre; missing without a surface",
        |tree, crs| Value::Real(tree.surface_apex_m / crs.vertical_m_per_unit),
    ),
    column(
        "semi_axis_a_m",
        METRES,
        M,
        POSITIVE,
        "Larger semi-axis of the fitted surface one metre below its apex; missing without a surface",
        |tree, _| Value::Real(tree.semi_axes_m[0].max(tree.semi_axes_m[1])),
    ),
    column(
        "semi_axis_b_m",
        METRES,
        M,
        POSITIVE,
        "Smaller semi-axis of the fitted surface one metre below its apex; missing without a surface",
        |tree, _| Value::Real(tree.semi_axes_m[0].min(tree.semi_axes_m[1])),
    ),
    column(
        "rotation_deg",
        Kind::Real(1),
        Unit::Is("degree"),
        "0 to 179.9",
        "Azimuth of the larger semi-axis, clockwise from grid north; missing for equal axes and without a surface",
        |tree, _| Value::Real(rotation(tree)),
    ),
    column(
        "fit_cells",
        Kind::Integer,
        Unit::None,
        POSITIVE,
        "Cells of the thinned crown that the fit saw (of a consensus model: points); 0 without a surface",
        |tree, _| Value::Integer(i64::from(tree.fit_cells)),
    ),
    column(
        "fit_objective_m",
        MILLIMETRES,
        M,
        POSITIVE,
        "Sum of the cells' absolute vertical residuals; missing without a surface",
        |tree, _| Value::Real(tree.fit_objective_m),
    ),
    column(
        "fit_residual_m",
        MILLIMETRES,
        M,
        POSITIVE,
        "Mean of the cells' absolute vertical residuals; missing without a surface",
        |tree, _| Value::Real(tree.fit_residual_m),
    ),
    column(
        "fit_gap",
        Kind::Real(8),
        Unit::None,
        "0 to 1",
        "Certified: no surface has an objective smaller by more than this share; missing without a certificate",
        |tree, _| Value::Real(tree.fit_gap),
    ),
    column(
        "fit_nodes",
        Kind::Integer,
        Unit::None,
        POSITIVE,
        "Problems solved until the optimum was certified; 0 without a certificate",
        |tree, _| Value::Integer(i64::from(tree.fit_nodes)),
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
        "score",
        Kind::Real(3),
        Unit::None,
        "0 to 1",
        "How sure it is that this is a tree; the pipeline's threshold is min_score of its stage detection",
        |tree, _| Value::Real(f64::from(tree.score)),
    ),
    column(
        "origin",
        Kind::Text,
        Unit::None,
        "surface, below-canopy",
        "What the tree was found by: a top of the canopy, or one below other crowns",
        |tree, _| Value::Text(tree.origin.name().to_owned()),
    ),
    column(
        "flags",
        Kind::Text,
        Unit::None,
        "underdetermined, no-redundancy, shape-bound-active, centre-outside-data, one-sided, \
         prior-active, imbalance-active, model-rejected, at-survey-edge, not-elliptic, fit-failed",
        "What to know about the tree, words separated by spaces",
        |tree, _| Value::Text(TreeFlag::names(tree.flags)),
    ),
];

/// The azimuth as it is written: one that rounds to 180 degrees is that of 0.
fn rotation(tree: &Tree) -> f64 {
    if tree.rotation_deg >= 179.95 { 0.0 } else { tree.rotation_deg }
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
    use timberline_artefact::Crs;
    use timberline_artefact::kinds::PositionMethod;

    #[test]
    fn names_are_unique_and_plain() {
        let mut names: Vec<&str> = TREE_COLUMNS.iter().map(|column| column.name).collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
        assert!(names.iter().all(|name| name.chars().all(plain)));
    }

    /// What a tree has in a column.
    fn text(tree: &Tree, name: &str) -> String {
        let column = TREE_COLUMNS.iter().find(|column| column.name == name).unwrap();
        column.text(tree, &Crs::default())
    }

    #[test]
    fn the_surface_of_a_fit_is_told_in_full() {
        let tree = Tree {
            position_method: PositionMethod::L1,
            position_extent_m: 0.0414,
            position_standard_error_m: 0.21,
            surface_centre_m: [10.25, 20.5],
            surface_apex_m: 31.0625,
            semi_axes_m: [1.75, 1.25],
            rotation_deg: 22.54,
            fit_cells: 40,
            fit_objective_m: 8.0,
            fit_residual_m: 0.2,
            fit_gap: 1.25e-7,
            fit_nodes: 5,
            flags: TreeFlag::NotElliptic.bit() | TreeFlag::ImbalanceActive.bit(),
            ..Tree::default()
        };
        let written = [
            ("stem_source", "l1"),
            ("stem_uncertainty_m", "0.041"),
            ("stem_standard_error_m", "0.210"),
            ("surface_x", "10.250"),
            ("surface_y", "20.500"),
            ("surface_z", "31.063"),
            ("semi_axis_a_m", "1.75"),
            ("semi_axis_b_m", "1.25"),
            ("rotation_deg", "22.5"),
            ("fit_cells", "40"),
            ("fit_objective_m", "8.000"),
            ("fit_residual_m", "0.200"),
            ("fit_gap", "0.00000013"),
            ("fit_nodes", "5"),
            ("flags", "imbalance-active not-elliptic"),
        ];
        for (name, expected) in written {
            assert_eq!(text(&tree, name), expected, "{name}");
        }
    }

    #[test]
    fn without_a_surface_its_columns_are_empty() {
        let blank = Tree::without_fit();
        for name in ["surface_x", "surface_z", "semi_axis_a_m", "rotation_deg", "fit_gap"] {
            assert_eq!(text(&blank, name), "", "{name}");
        }
        assert_eq!([text(&blank, "fit_cells"), text(&blank, "fit_nodes")], ["0", "0"]);
    }

    #[test]
    fn a_rotation_never_rounds_to_half_a_turn() {
        let turned = |rotation_deg| text(&Tree { rotation_deg, ..Tree::default() }, "rotation_deg");
        assert_eq!([turned(179.96), turned(179.94), turned(0.0)], ["0.0", "179.9", "0.0"]);
    }

    #[test]
    fn every_flag_and_method_is_in_the_dictionary() {
        let range = |name: &str| TREE_COLUMNS.iter().find(|c| c.name == name).unwrap().range;
        let flags: Vec<&str> = TreeFlag::ALL.iter().map(|flag| flag.name()).collect();
        assert_eq!(range("flags"), flags.join(", "));
        for method in [PositionMethod::HighestPoint, PositionMethod::L2, PositionMethod::StarSac] {
            assert!(range("stem_source").split(", ").any(|word| word == method.name()));
        }
    }
}

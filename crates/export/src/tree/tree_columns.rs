//! The columns of the tree table of a terrestrial campaign.

use super::Model;
use crate::gpkg::{Geometry, Layer};
use crate::table::{Column, Kind, Unit, Value, column};
use timberline_artefact::Crs;
use timberline_artefact::kinds::{
    BaseSource, ConsolidationEffect, Dbh, Distances, RadiusSource, TreeMetrics,
};

/// A row: one tree.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeRow {
    /// The tree.
    pub tree_id: u64,
    /// Base of the stem, world, m.
    pub base_m: [f64; 3],
    /// What the elevation of the base was taken from.
    pub base_source: BaseSource,
    /// Sizes.
    pub metrics: TreeMetrics,
    /// From the points to the model.
    pub cloud_to_model: Distances,
    /// From the model to the points.
    pub model_to_cloud: Distances,
    /// What consolidation brought.
    pub consolidation: ConsolidationEffect,
    /// Number of branches, the stem included.
    pub branches: u32,
    /// Number of cylinders.
    pub cylinders: u32,
    /// Of these, measured ones.
    pub measured: u32,
    /// Largest branch order.
    pub highest_order: u16,
}

impl TreeRow {
    /// The row of a model.
    #[must_use]
    pub fn of(model: &Model<'_>) -> Self {
        let qsm = model.qsm;
        let measured = qsm.cylinders.iter().filter(|c| c.source == RadiusSource::Measured);
        Self {
            tree_id: qsm.tree_id,
            base_m: qsm.base_m,
            base_source: qsm.base_source,
            metrics: qsm.metrics.clone(),
            cloud_to_model: qsm.cloud_to_model,
            model_to_cloud: qsm.model_to_cloud,
            consolidation: qsm.consolidation.clone(),
            branches: qsm.branches.len() as u32,
            cylinders: qsm.cylinders.len() as u32,
            measured: measured.count() as u32,
            highest_order: qsm.branches.iter().map(|branch| branch.order).max().unwrap_or(0),
        }
    }

    fn dbh(&self, value: fn(&Dbh) -> Value) -> Value {
        self.metrics.dbh.as_ref().map_or(Value::Real(f64::NAN), value)
    }

    /// A distance, missing where no distance was taken.
    fn of_distances(distances: &Distances, value: f64) -> Value {
        Value::Real(if distances.count > 0 { value } else { f64::NAN })
    }
}

const fn size(
    name: &'static str,
    decimals: usize,
    unit: &'static str,
    meaning: &'static str,
    value: fn(&TreeRow, &Crs) -> Value,
) -> Column<TreeRow> {
    column(name, Kind::Real(decimals), Unit::Is(unit), "0 or more", meaning, value)
}

const fn count(
    name: &'static str,
    meaning: &'static str,
    value: fn(&TreeRow, &Crs) -> Value,
) -> Column<TreeRow> {
    column(name, Kind::Integer, Unit::None, "0 or more", meaning, value)
}

/// The columns. Positions are in the units of the CRS, sizes in metres.
pub const COLUMNS: &[Column<TreeRow>] = &[
    column(
        "tree_id",
        Kind::Integer,
        Unit::None,
        "1 to 2^53",
        "Id of the tree, the same in all tables and file names; made from the position of the base",
        |row, _| Value::Integer(row.tree_id as i64),
    ),
    column(
        "x",
        Kind::Real(3),
        Unit::CrsHorizontal,
        "",
        "Easting of the base of the stem",
        |row, crs| Value::Real(crs.crs_from_world(row.base_m)[0]),
    ),
    column(
        "y",
        Kind::Real(3),
        Unit::CrsHorizontal,
        "",
        "Northing of the base of the stem",
        |row, crs| Value::Real(crs.crs_from_world(row.base_m)[1]),
    ),
    column(
        "z",
        Kind::Real(3),
        Unit::CrsVertical,
        "",
        "Elevation of the base of the stem",
        |row, crs| Value::Real(crs.crs_from_world(row.base_m)[2]),
    ),
    column(
        "base_source",
        Kind::Text,
        Unit::None,
        "ground, lowest-points",
        "What the elevation of the base was taken from: the terrain, or the tree's lowest points where the scan has no ground",
        |row, _| Value::Text(row.base_source.name().to_owned()),
    ),
    size(
        "dbh_cm",
        2,
        "cm",
        "Diameter of the stem 1.3 m above the base; missing where there is no stem at that height",
        |row, _| row.dbh(|dbh| Value::Real(dbh.diameter_m * 100.0)),
    ),
    size("dbh_sd_cm", 2, "cm", "Standard error of the diameter", |row, _| {
        row.dbh(|dbh| Value::Real(dbh.sd_m * 100.0))
    }),
    column(
        "dbh_arc_coverage",
        Kind::Real(3),
        Unit::None,
        "0 to 1",
        "Part of the circumference at breast height that has points",
        |row, _| row.dbh(|dbh| Value::Real(f64::from(dbh.arc_coverage))),
    ),
    count("dbh_points", "Points the diameter rests on", |row, _| {
        row.dbh(|dbh| Value::Integer(i64::from(dbh.points)))
    }),
    column(
        "dbh_source",
        Kind::Text,
        Unit::None,
        "measured, interpolated, inferred",
        "Whether the diameter was measured at breast height, taken from measurements near it, or inferred",
        |row, _| row.dbh(|dbh| Value::Text(dbh.source.name().to_owned())),
    ),
    size("height_m", 2, "m", "Height of the highest point above the base", |row, _| {
        Value::Real(row.metrics.height_m)
    }),
    size(
        "crown_base_m",
        2,
        "m",
        "Height of the lowest branch of the crown above the base; missing without branches",
        |row, _| Value::Real(row.metrics.crown_base_m.unwrap_or(f64::NAN)),
    ),
    size("crown_area_m2", 2, "m2", "Area of the crown seen from above", |row, _| {
        Value::Real(row.metrics.crown_area_m2)
    }),
    size("crown_diameter_m", 2, "m", "Diameter of the circle with that area", |row, _| {
        Value::Real(row.metrics.crown_diameter_m)
    }),
    size("stem_volume_m3", 5, "m3", "Volume of the stem", |row, _| {
        Value::Real(row.metrics.stem_volume_m3)
    }),
    size(
        "thick_volume_m3",
        5,
        "m3",
        "Volume of branches with a diameter of 5 cm or more",
        |row, _| Value::Real(row.metrics.thick_volume_m3),
    ),
    size(
        "thin_volume_m3",
        5,
        "m3",
        "Volume of branches with a diameter below 5 cm; mostly inferred, see the sources in qsm.csv",
        |row, _| Value::Real(row.metrics.thin_volume_m3),
    ),
    size("surface_m2", 3, "m2", "Lateral surface of all cylinders", |row, _| {
        Value::Real(row.metrics.surface_m2)
    }),
    size("length_m", 2, "m", "Length of all cylinders", |row, _| Value::Real(row.metrics.length_m)),
    count("branches", "Number of branches, the stem included", |row, _| {
        Value::Integer(i64::from(row.branches))
    }),
    count("highest_order", "Largest branch order", |row, _| {
        Value::Integer(i64::from(row.highest_order))
    }),
    count("cylinders", "Number of cylinders", |row, _| Value::Integer(i64::from(row.cylinders))),
    count("cylinders_measured", "Number of cylinders with a measured radius", |row, _| {
        Value::Integer(i64::from(row.measured))
    }),
    count("cloud_points", "Points whose distance to the model was taken", |row, _| {
        Value::Integer(row.cloud_to_model.count as i64)
    }),
    size(
        "cloud_to_model_mean_m",
        5,
        "m",
        "Mean distance from the points to the model",
        |row, _| TreeRow::of_distances(&row.cloud_to_model, row.cloud_to_model.mean_m),
    ),
    size("cloud_to_model_rms_m", 5, "m", "Root mean square of these distances", |row, _| {
        TreeRow::of_distances(&row.cloud_to_model, row.cloud_to_model.rms_m)
    }),
    size("cloud_to_model_p95_m", 5, "m", "95th percentile of these distances", |row, _| {
        TreeRow::of_distances(&row.cloud_to_model, row.cloud_to_model.p95_m)
    }),
    size("cloud_to_model_max_m", 5, "m", "Largest of these distances", |row, _| {
        TreeRow::of_distances(&row.cloud_to_model, row.cloud_to_model.max_m)
    }),
    size(
        "model_to_cloud_mean_m",
        5,
        "m",
        "Mean distance from the model's surface to the points, over the surface that could be seen",
        |row, _| TreeRow::of_distances(&row.model_to_cloud, row.model_to_cloud.mean_m),
    ),
    size("model_to_cloud_rms_m", 5, "m", "Root mean square of these distances", |row, _| {
        TreeRow::of_distances(&row.model_to_cloud, row.model_to_cloud.rms_m)
    }),
    size("model_to_cloud_p95_m", 5, "m", "95th percentile of these distances", |row, _| {
        TreeRow::of_distances(&row.model_to_cloud, row.model_to_cloud.p95_m)
    }),
    size("model_to_cloud_max_m", 5, "m", "Largest of these distances", |row, _| {
        TreeRow::of_distances(&row.model_to_cloud, row.model_to_cloud.max_m)
    }),
    column(
        "consolidated",
        Kind::Text,
        Unit::None,
        "yes, no",
        "Whether the model was made from consolidated points",
        |row, _| Value::Text(if row.consolidation.used { "yes" } else { "no" }.to_owned()),
    ),
    column("consolidation_reason", Kind::Text, Unit::None, "", "Why not, if not", |row, _| {
        Value::Text(row.consolidation.reason.clone())
    }),
];

/// The layer of `trees.gpkg`: the bases of the stems.
pub const STEMS: Layer<'static, TreeRow> = Layer {
    name: "stems",
    description: "Base of the stem of every tree that has a model, with the whole tree table",
    geometry_type: "POINT",
    has_z: true,
    columns: COLUMNS,
    geometry: |row, crs| Some(Geometry::Point(crs.crs_from_world(row.base_m))),
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::csv_table::write_table;
    use crate::tree::testing::{FRAME, fork};
    use std::path::Path;

    fn text(row: TreeRow) -> String {
        let mut bytes = Vec::new();
        let rows = [Ok(row)].into_iter();
        write_table(&mut bytes, Path::new("t.csv"), COLUMNS, &Crs::default(), rows).unwrap();
        String::from_utf8(bytes).unwrap().lines().nth(1).unwrap().to_owned()
    }

    #[test]
    fn a_tree_is_a_row() {
        let (mut qsm, crs) = (fork(7), Crs::default());
        let row = TreeRow::of(&Model { qsm: &qsm, frame: FRAME, crs: &crs });
        let expected = "7,500000.500,5000000.500,1000.000,ground,40.00,0.40,0.750,100,measured,6.10,\
                        4.00,3.00,1.95,0.45000,0.01400,0.00000,6.200,7.80,2,1,4,2,9,0.01000,0.02000,\
                        0.03000,0.05000,,,,,no,";
        assert_eq!(text(row), expected);
        qsm.metrics.dbh = None;
        let without = TreeRow::of(&Model { qsm: &qsm, frame: FRAME, crs: &crs });
        assert!(text(without).contains(",ground,,,,,,6.10,"));
    }

    #[test]
    fn names_are_unique_and_meanings_told() {
        let mut names: Vec<&str> = COLUMNS.iter().map(|column| column.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), COLUMNS.len());
        assert!(COLUMNS.iter().all(|column| !column.meaning.is_empty()));
    }
}

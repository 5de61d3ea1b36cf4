//! Statements that make the tables of the standard.

use super::{Layer, sql_type};
use crate::table::Column;

/// Page size and identity; journals are pointless in a file that appears only when it is whole.
pub(super) const PRAGMAS: &str = "
PRAGMA page_size = 4096;
PRAGMA journal_mode = OFF;
PRAGMA synchronous = OFF;
PRAGMA application_id = 0x47504B47;
PRAGMA user_version = 10300;";

/// Annex C of the standard, with the rows it requires in `gpkg_spatial_ref_sys`.
pub(super) const CORE_TABLES: &str = r#"
BEGIN;
CREATE TABLE gpkg_spatial_ref_sys (
  srs_name TEXT NOT NULL,
  srs_id INTEGER PRIMARY KEY,
  organization TEXT NOT NULL,
  organization_coordsys_id INTEGER NOT NULL,
  definition TEXT NOT NULL,
  description TEXT
);
INSERT INTO gpkg_spatial_ref_sys VALUES
  ('Undefined cartesian SRS', -1, 'NONE', -1, 'undefined', 'undefined cartesian coordinate reference system'),
  ('Undefined geographic SRS', 0, 'NONE', 0, 'undefined', 'undefined geographic coordinate reference system'),
  ('WGS 84 geodetic', 4326, 'EPSG', 4326, 'GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","4326"]]', 'longitude/latitude coordinates in decimal degrees on the WGS 84 spheroid');
CREATE TABLE gpkg_contents (
  table_name TEXT NOT NULL PRIMARY KEY,
  data_type TEXT NOT NULL,
  identifier TEXT UNIQUE,
  description TEXT DEFAULT '',
  last_change DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
  min_x DOUBLE,
  min_y DOUBLE,
  max_x DOUBLE,
  max_y DOUBLE,
  srs_id INTEGER,
  CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id)
);
CREATE TABLE gpkg_geometry_columns (
  table_name TEXT NOT NULL,
  column_name TEXT NOT NULL,
  geometry_type_name TEXT NOT NULL,
  srs_id INTEGER NOT NULL,
  z TINYINT NOT NULL,
  m TINYINT NOT NULL,
  CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
  CONSTRAINT uk_gc_table_name UNIQUE (table_name),
  CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
  CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys (srs_id)
);
CREATE TABLE gpkg_extensions (
  table_name TEXT,
  column_name TEXT,
  extension_name TEXT NOT NULL,
  definition TEXT NOT NULL,
  scope TEXT NOT NULL,
  CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name)
);
CREATE TABLE gpkg_data_columns (
  table_name TEXT NOT NULL,
  column_name TEXT NOT NULL,
  name TEXT,
  title TEXT,
  description TEXT,
  mime_type TEXT,
  constraint_name TEXT,
  CONSTRAINT pk_gdc PRIMARY KEY (table_name, column_name),
  CONSTRAINT gdc_tn UNIQUE (table_name, name)
);
CREATE TABLE gpkg_data_column_constraints (
  constraint_name TEXT NOT NULL,
  constraint_type TEXT NOT NULL,
  value TEXT,
  min NUMERIC,
  min_is_inclusive BOOLEAN,
  max NUMERIC,
  max_is_inclusive BOOLEAN,
  description TEXT,
  CONSTRAINT gdcc_ntv UNIQUE (constraint_name, constraint_type, value)
);
INSERT INTO gpkg_extensions VALUES
  ('gpkg_data_columns', NULL, 'gpkg_schema', 'http://www.geopackage.org/spec121/#extension_schema', 'read-write'),
  ('gpkg_data_column_constraints', NULL, 'gpkg_schema', 'http://www.geopackage.org/spec121/#extension_schema', 'read-write');
COMMIT;"#;

/// The table of a layer and its index.
pub(super) fn feature_table<T>(layer: &Layer<'_, T>) -> String {
    let Layer { name, geometry_type, columns, .. } = layer;
    let columns: String =
        columns.iter().map(|c| format!(",\n  \"{}\" {}", c.name, sql_type(c.kind))).collect();
    format!(
        "CREATE TABLE \"{name}\" (\n  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,\n  \
         geom {geometry_type}{columns}\n);\n\
         CREATE VIRTUAL TABLE \"rtree_{name}_geom\" USING rtree(id, minx, maxx, miny, maxy);"
    )
}

/// The table of an attribute layer.
pub(super) fn attribute_table(name: &str) -> String {
    format!(
        "CREATE TABLE \"{name}\" (\n  fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,\n  \
         name TEXT NOT NULL,\n  value TEXT NOT NULL\n);"
    )
}

/// `INSERT` with a place for fid, geometry and every column.
pub(super) fn insert_statement<T>(name: &str, columns: &[Column<T>]) -> String {
    let names: String = columns.iter().map(|c| format!(", \"{}\"", c.name)).collect();
    let places: String = (3..columns.len() + 3).map(|place| format!(", ?{place}")).collect();
    format!("INSERT INTO \"{name}\" (fid, geom{names}) VALUES (?1, ?2{places})")
}

/// The triggers that keep the index right when somebody edits the layer (annex F.3).
pub(super) fn rtree_triggers(name: &str) -> String {
    let (t, r) = (format!("\"{name}\""), format!("\"rtree_{name}_geom\""));
    let bounds = "ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom)";
    let trigger = |suffix: &str, event: &str, when: &str, body: String| {
        format!(
            "CREATE TRIGGER \"rtree_{name}_geom_{suffix}\" AFTER {event} ON {t}\n\
             WHEN {when}\nBEGIN\n  {body};\nEND;\n"
        )
    };
    let filled = "(NEW.geom NOT NULL AND NOT ST_IsEmpty(NEW.geom))";
    let empty = "(NEW.geom ISNULL OR ST_IsEmpty(NEW.geom))";
    let replace = format!("INSERT OR REPLACE INTO {r} VALUES (NEW.fid, {bounds})");
    let delete = format!("DELETE FROM {r} WHERE id = OLD.fid");
    let both = format!("DELETE FROM {r} WHERE id IN (OLD.fid, NEW.fid)");
    [
        trigger("insert", "INSERT", filled, replace.clone()),
        trigger(
            "update1",
            "UPDATE OF geom",
            &format!("OLD.fid = NEW.fid AND {filled}"),
            replace.clone(),
        ),
        trigger(
            "update2",
            "UPDATE OF geom",
            &format!("OLD.fid = NEW.fid AND {empty}"),
            delete.clone(),
        ),
        trigger(
            "update3",
            "UPDATE",
            &format!("OLD.fid != NEW.fid AND {filled}"),
            format!("{delete};\n  {replace}"),
        ),
        trigger("update4", "UPDATE", &format!("OLD.fid != NEW.fid AND {empty}"), both),
        trigger("delete", "DELETE", "OLD.geom NOT NULL", delete),
    ]
    .concat()
}

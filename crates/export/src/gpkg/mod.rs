//! OGC GeoPackage 1.3 (OGC 12-128r17), written by hand over SQLite.
//!
//! Tables of the standard (annex C), the R-tree extension (annex F.3) and the schema extension
//! (annex F.9: a description for every column). The same rows give the same bytes: no time of
//! writing is recorded, rows go in by ascending id, and the index is filled in that order.

mod geometry;
mod schema;

pub use geometry::Geometry;

use crate::Error;
use crate::crs::Horizontal;
use crate::table::{Column, Kind, Value};
use rusqlite::{Connection, Statement, ToSql, params};
use std::path::{Path, PathBuf};
use timberline_artefact::Crs;
use timberline_artefact::kinds::Tree;

/// Recorded as the time of the last change: GeoPackage wants one, results must not depend on it.
const NO_TIME: &str = "1970-01-01T00:00:00.000Z";
/// Id of a reference system without an EPSG code (the standard leaves the choice).
const CUSTOM_SRS: i32 = 100_000;
/// The standard's id of an undefined cartesian system.
const UNDEFINED_CARTESIAN: i32 = -1;

/// A GeoPackage being written.
#[derive(Debug)]
pub struct GeoPackage {
    connection: Connection,
    path: PathBuf,
    srs_id: i32,
    crs: Crs,
}

/// A layer of features, one for each thing of a type.
#[derive(Debug)]
pub struct Layer<'a, T = Tree> {
    /// Table name.
    pub name: &'a str,
    /// What it holds, for people.
    pub description: &'a str,
    /// `POINT` or `POLYGON`.
    pub geometry_type: &'a str,
    /// Whether geometries have a z.
    pub has_z: bool,
    /// The attributes.
    pub columns: &'a [Column<T>],
    /// The geometry of a thing; `None` for those that are not in this layer.
    pub geometry: fn(&T, &Crs) -> Option<Geometry>,
}

impl GeoPackage {
    /// Begins an empty file; anything there before is an error of SQLite's.
    ///
    /// # Errors
    /// [`Error::Sqlite`].
    pub fn create(path: &Path, crs: &Crs) -> Result<Self, Error> {
        let fail = Error::sqlite(path);
        let connection = Connection::open(path).map_err(&fail)?;
        connection.execute_batch(schema::PRAGMAS).map_err(&fail)?;
        connection.execute_batch(schema::CORE_TABLES).map_err(&fail)?;
        let system = Horizontal::of(crs);
        let mut package = Self {
            connection,
            path: path.to_path_buf(),
            srs_id: UNDEFINED_CARTESIAN,
            crs: crs.clone(),
        };
        package.srs_id = package.add_reference_system(&system).map_err(&fail)?;
        Ok(package)
    }

    fn add_reference_system(&self, system: &Horizontal) -> rusqlite::Result<i32> {
        let (id, organisation, code) = match (system.epsg.map(i32::try_from), &system.wkt) {
            (Some(Ok(4326)), _) => return Ok(4326),
            (Some(Ok(code)), _) => (code, "EPSG", code),
            (_, Some(_)) => (CUSTOM_SRS, "NONE", CUSTOM_SRS),
            (_, None) => return Ok(UNDEFINED_CARTESIAN),
        };
        let definition = system.wkt.as_deref().unwrap_or("undefined");
        self.connection.execute(
            "INSERT INTO gpkg_spatial_ref_sys VALUES (?1, ?2, ?3, ?4, ?5, NULL)",
            params![system.name, id, organisation, code, definition],
        )?;
        Ok(id)
    }

    /// Writes a layer with its spatial index; rows with a geometry get `fid` 1, 2, ... in order.
    ///
    /// # Errors
    /// [`Error::Sqlite`], or what the iterator yields.
    pub fn add_layer<T>(
        &mut self,
        layer: &Layer<'_, T>,
        things: &mut dyn Iterator<Item = Result<T, Error>>,
    ) -> Result<u64, Error> {
        let fail = Error::sqlite(&self.path);
        let transaction = self.connection.unchecked_transaction().map_err(&fail)?;
        self.connection.execute_batch(&schema::feature_table(layer)).map_err(&fail)?;
        let mut extent = Extent::EMPTY;
        let mut rows = 0;
        {
            let insert = schema::insert_statement(layer.name, layer.columns);
            let mut insert = self.connection.prepare(&insert).map_err(&fail)?;
            let index =
                format!("INSERT INTO rtree_{}_geom VALUES (?1, ?2, ?3, ?4, ?5)", layer.name);
            let mut index = self.connection.prepare(&index).map_err(&fail)?;
            for thing in things {
                let thing = thing?;
                let Some(geometry) = (layer.geometry)(&thing, &self.crs) else { continue };
                rows += 1;
                let bounds = geometry.bounds();
                extent.include(bounds);
                self.insert(&mut insert, rows, &geometry, layer, &thing).map_err(&fail)?;
                let [min_x, max_x, min_y, max_y] = bounds;
                index.execute(params![rows, min_x, max_x, min_y, max_y]).map_err(&fail)?;
            }
        }
        self.register(layer, &extent).map_err(&fail)?;
        self.connection.execute_batch(&schema::rtree_triggers(layer.name)).map_err(&fail)?;
        transaction.commit().map_err(&fail)?;
        Ok(rows as u64)
    }

    fn insert<T>(
        &self,
        insert: &mut Statement<'_>,
        fid: i64,
        geometry: &Geometry,
        layer: &Layer<'_, T>,
        thing: &T,
    ) -> rusqlite::Result<usize> {
        let blob = geometry.blob(self.srs_id);
        let values: Vec<Box<dyn ToSql>> =
            layer.columns.iter().map(|c| sql_value(c.value_of(thing, &self.crs))).collect();
        let mut row: Vec<&dyn ToSql> = vec![&fid, &blob];
        row.extend(values.iter().map(AsRef::as_ref));
        insert.execute(row.as_slice())
    }

    fn register<T>(&self, layer: &Layer<'_, T>, extent: &Extent) -> rusqlite::Result<()> {
        let [min_x, max_x, min_y, max_y] = extent.values();
        self.connection.execute(
            "INSERT INTO gpkg_contents VALUES (?1, 'features', ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
            params![
                layer.name,
                layer.description,
                NO_TIME,
                min_x,
                min_y,
                max_x,
                max_y,
                self.srs_id
            ],
        )?;
        self.connection.execute(
            "INSERT INTO gpkg_geometry_columns VALUES (?1, 'geom', ?2, ?3, ?4, 0)",
            params![layer.name, layer.geometry_type, self.srs_id, u8::from(layer.has_z)],
        )?;
        self.connection.execute(
            "INSERT INTO gpkg_extensions VALUES (?1, 'geom', 'gpkg_rtree_index',
             'http://www.geopackage.org/spec120/#extension_rtree', 'write-only')",
            params![layer.name],
        )?;
        for column in layer.columns {
            let unit = column.unit.name(&self.crs);
            let title =
                if unit.is_empty() { None } else { Some(format!("{} [{unit}]", column.name)) };
            self.connection.execute(
                "INSERT INTO gpkg_data_columns VALUES (?1, ?2, NULL, ?3, ?4, NULL, NULL)",
                params![layer.name, column.name, title, column.meaning],
            )?;
        }
        Ok(())
    }

    /// Writes a table of names and values, sorted as given.
    ///
    /// # Errors
    /// [`Error::Sqlite`].
    pub fn add_attributes(
        &mut self,
        name: &str,
        description: &str,
        rows: &[(String, String)],
    ) -> Result<(), Error> {
        let fail = Error::sqlite(&self.path);
        let transaction = self.connection.unchecked_transaction().map_err(&fail)?;
        self.connection.execute_batch(&schema::attribute_table(name)).map_err(&fail)?;
        for (key, value) in rows {
            let insert = format!("INSERT INTO \"{name}\" (name, value) VALUES (?1, ?2)");
            self.connection.execute(&insert, params![key, value]).map_err(&fail)?;
        }
        self.connection
            .execute(
                "INSERT INTO gpkg_contents VALUES
                 (?1, 'attributes', ?1, ?2, ?3, NULL, NULL, NULL, NULL, NULL)",
                params![name, description, NO_TIME],
            )
            .map_err(&fail)?;
        transaction.commit().map_err(&fail)
    }

    /// Closes the file.
    ///
    /// # Errors
    /// [`Error::Sqlite`].
    pub fn finish(self) -> Result<(), Error> {
        let fail = Error::sqlite(&self.path);
        self.connection.close().map_err(|(_, error)| fail(error))
    }
}

/// The type of a column in SQL.
fn sql_type(kind: Kind) -> &'static str {
    match kind {
        Kind::Integer => "INTEGER",
        Kind::Real(_) => "REAL",
        Kind::Text => "TEXT",
    }
}

fn sql_value(value: Option<Value>) -> Box<dyn ToSql> {
    match value {
        None => Box::new(rusqlite::types::Null),
        Some(Value::Integer(value)) => Box::new(value),
        Some(Value::Real(value)) => Box::new(value),
        Some(Value::Text(value)) => Box::new(value),
    }
}

/// Bounds of a layer: minimum and maximum of x, then of y.
struct Extent([f64; 4]);

impl Extent {
    const EMPTY: Self = Self([f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY]);

    fn include(&mut self, [min_x, max_x, min_y, max_y]: [f64; 4]) {
        let own = self.0;
        self.0 = [own[0].min(min_x), own[1].max(max_x), own[2].min(min_y), own[3].max(max_y)];
    }

    fn values(&self) -> [Option<f64>; 4] {
        self.0.map(|value| value.is_finite().then_some(value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layers::{CROWNS, TREETOPS};

    fn trees() -> Vec<Tree> {
        let square = |x: f64| vec![[x, 0.0], [x + 2.0, 0.0], [x + 2.0, 2.0], [x, 2.0]];
        let tree = |id: u64, crown_m| Tree {
            id,
            apex_m: [id as f64, 1.0, 30.0],
            ground_m: f64::NAN,
            crown_m,
            ..Tree::default()
        };
        vec![tree(3, square(2.0)), tree(5, Vec::new()), tree(8, square(7.0))]
    }

    fn write(path: &Path) {
        let crs = Crs { epsg: Some(3005), ..Crs::default() };
        let mut package = GeoPackage::create(path, &crs).unwrap();
        assert_eq!(package.add_layer(&TREETOPS, &mut trees().into_iter().map(Ok)).unwrap(), 3);
        assert_eq!(package.add_layer(&CROWNS, &mut trees().into_iter().map(Ok)).unwrap(), 2);
        package.add_attributes("run", "about", &[("program".into(), "x".into())]).unwrap();
        package.finish().unwrap();
    }

    #[test]
    fn the_standards_tables_are_filled() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.gpkg");
        write(&path);
        let db = Connection::open(&path).unwrap();
        let text = |sql: &str| db.query_row(sql, [], |row| row.get::<_, String>(0)).unwrap();
        let number = |sql: &str| db.query_row(sql, [], |row| row.get::<_, i64>(0)).unwrap();
        assert_eq!(text("PRAGMA integrity_check"), "ok");
        assert_eq!(number("PRAGMA application_id"), i64::from(u32::from_be_bytes(*b"GPKG")));
        assert_eq!(number("SELECT count(*) FROM gpkg_contents"), 3);
        assert_eq!(number("SELECT count(*) FROM rtree_crowns_geom"), 2);
        assert_eq!(number("SELECT count(*) FROM treetops WHERE ground_z IS NULL"), 3);
        assert_eq!(number("SELECT tree_id FROM crowns WHERE fid = 2"), 8);
        assert_eq!(
            number("SELECT CAST(max_x AS INTEGER) FROM gpkg_contents WHERE table_name = 'crowns'"),
            9
        );
        assert_eq!(
            text("SELECT srs_name FROM gpkg_spatial_ref_sys WHERE srs_id = 3005"),
            "NAD83 / BC Albers"
        );
    }

    #[test]
    fn the_same_rows_give_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let paths = ["a.gpkg", "b.gpkg"].map(|name| folder.path().join(name));
        paths.iter().for_each(|path| write(path));
        assert_eq!(std::fs::read(&paths[0]).unwrap(), std::fs::read(&paths[1]).unwrap());
    }
}

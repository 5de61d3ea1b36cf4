//! Tables as CSV and their dictionaries.

use crate::Error;
use crate::table::{Column, Kind};
use crate::tree_columns::TREE_COLUMNS;
use std::io::Write;
use std::path::Path;
use timberline_artefact::Crs;
use timberline_artefact::kinds::Tree;

/// Writes trees row by row, in the order given, with a header line; `path` is for messages.
///
/// # Errors
/// [`Error::Csv`], or what the iterator yields.
pub fn write_trees(
    out: impl Write,
    path: &Path,
    crs: &Crs,
    trees: impl Iterator<Item = Result<Tree, Error>>,
) -> Result<(), Error> {
    write_table(out, path, TREE_COLUMNS, crs, trees)
}

/// Writes the dictionary of the tree table: one line a column with its type, unit, meaning and range.
///
/// # Errors
/// [`Error::Csv`].
pub fn write_dictionary(out: impl Write, path: &Path, crs: &Crs) -> Result<(), Error> {
    write_dictionary_of(out, path, TREE_COLUMNS, crs)
}

/// Writes a table row by row, in the order given, with a header line; `path` is for messages.
///
/// # Errors
/// [`Error::Csv`], or what the iterator yields.
pub fn write_table<T>(
    out: impl Write,
    path: &Path,
    columns: &[Column<T>],
    crs: &Crs,
    rows: impl Iterator<Item = Result<T, Error>>,
) -> Result<(), Error> {
    let fail = |source| Error::Csv { path: path.to_path_buf(), source };
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(columns.iter().map(|column| column.name)).map_err(fail)?;
    for row in rows {
        let row = row?;
        writer.write_record(columns.iter().map(|column| column.text(&row, crs))).map_err(fail)?;
    }
    writer.flush().map_err(Error::io(path, "write"))
}

/// Writes the dictionary of a table: one line a column with its type, unit, meaning and range.
///
/// # Errors
/// [`Error::Csv`].
pub fn write_dictionary_of<T>(
    out: impl Write,
    path: &Path,
    columns: &[Column<T>],
    crs: &Crs,
) -> Result<(), Error> {
    let fail = |source| Error::Csv { path: path.to_path_buf(), source };
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(["column", "type", "unit", "meaning", "range"]).map_err(fail)?;
    for column in columns {
        let kind = match column.kind {
            Kind::Integer => "integer".to_owned(),
            Kind::Real(decimals) => format!("number, {decimals} decimals"),
            Kind::Text => "text".to_owned(),
        };
        let unit = column.unit.name(crs);
        let row = [column.name, &kind, unit, column.meaning, column.range];
        writer.write_record(row).map_err(fail)?;
    }
    writer.flush().map_err(Error::io(path, "write"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_a_value_for_every_column() {
        let mut bytes = Vec::new();
        let tree = Tree {
            id: 7,
            ground_m: f64::NAN,
            height_m: 21.5,
            flags: 0b1_1000,
            ..Tree::without_fit()
        };
        let trees = [Ok(tree)].into_iter();
        write_trees(&mut bytes, Path::new("t.csv"), &Crs::default(), trees).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let expected = "7,0.000,0.000,0.000,,21.50,0.000,0.000,highest-point,,,0.00,0.00,0.00,\
                        0.00,0.00,,,,,,,0,,,,0,mixed,0.00000,0.00000,accepted,0,0,0,\
                        ,surface,centre-outside-data one-sided";
        assert_eq!(text.lines().nth(1), Some(expected));
        assert_eq!(text.lines().count(), 2);
    }

    #[test]
    fn the_dictionary_describes_every_column() {
        let mut bytes = Vec::new();
        write_dictionary(&mut bytes, Path::new("d.csv"), &Crs::default()).unwrap();
        let mut reader = csv::Reader::from_reader(bytes.as_slice());
        let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
        assert_eq!(rows.len(), TREE_COLUMNS.len());
        assert!(rows.iter().all(|row| !row[3].is_empty() && !row[1].is_empty()));
    }
}

//! TOML files whose values know where they stand.

use super::{Place, Problem, Problems};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml_edit::{Item, TableLike};

/// A parsed TOML file.
#[derive(Debug, Clone)]
pub struct Document {
    /// Where it was read from, as the user named it.
    pub path: PathBuf,
    /// The whole file as a table.
    pub root: Node,
}

/// One value of a TOML file.
#[derive(Debug, Clone)]
pub struct Node {
    /// Where its key stands (for list elements and the whole file: where it begins).
    pub key_at: Place,
    /// Where the value begins.
    pub at: Place,
    /// The value as it was written, for messages.
    pub written: String,
    /// The value.
    pub content: Content,
}

/// What a node holds.
#[derive(Debug, Clone)]
pub enum Content {
    /// A string, number or truth value; `Null` for what JSON cannot hold (dates, nan, inf).
    Scalar(Value),
    /// A list.
    List(Vec<Node>),
    /// A table.
    Table(BTreeMap<String, Node>),
}

impl Document {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Problems`] when it cannot be read or is no TOML.
    pub fn read(path: &Path) -> Result<Self, Problems> {
        let text = std::fs::read_to_string(path).map_err(|error| {
            let what = match error.kind() {
                std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
                _ => format!("cannot be read: {error}"),
            };
            Problems::one(Problem::new(path, None, what))
        })?;
        Self::parse(path, &text)
    }

    /// Parses the text of a file.
    ///
    /// # Errors
    /// [`Problems`] when it is no TOML.
    pub fn parse(path: &Path, text: &str) -> Result<Self, Problems> {
        let parsed = toml_edit::Document::parse(text).map_err(|error| {
            let place = error.span().map(|span| Lines(text).place(span.start));
            Problems::one(Problem::new(path, place, error.message().replace('\n', ", ")))
        })?;
        let start = Place { line: 1, column: 1 };
        let root = Lines(text).table(start, start, parsed.as_table());
        Ok(Self { path: path.to_owned(), root })
    }
}

impl Node {
    /// The value under a key, if this is a table that has it.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&Self> {
        match &self.content {
            Content::Table(entries) => entries.get(key),
            _ => None,
        }
    }

    /// The value as JSON.
    #[must_use]
    pub fn to_json(&self) -> Value {
        match &self.content {
            Content::Scalar(value) => value.clone(),
            Content::List(items) => items.iter().map(Self::to_json).collect(),
            Content::Table(entries) => {
                entries.iter().map(|(key, node)| (key.clone(), node.to_json())).collect()
            }
        }
    }
}

struct Lines<'a>(&'a str);

impl Lines<'_> {
    fn place(&self, offset: usize) -> Place {
        let before = &self.0[..offset.min(self.0.len())];
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        Place {
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }

    fn table(&self, key_at: Place, at: Place, table: &dyn TableLike) -> Node {
        let entry = |(name, item): (&str, &Item)| {
            let key = table.key(name).and_then(toml_edit::Key::span);
            let place = key.map_or(key_at, |span| self.place(span.start));
            (name.to_owned(), self.item(place, item))
        };
        let entries = table.iter().filter(|(_, item)| !item.is_none()).map(entry).collect();
        Node { key_at, at, written: "a table".into(), content: Content::Table(entries) }
    }

    fn item(&self, key_at: Place, item: &Item) -> Node {
        let span = item.span();
        let at = span.as_ref().map_or(key_at, |span| self.place(span.start));
        if let Some(table) = item.as_table_like() {
            return self.table(key_at, at, table);
        }
        let written = span.map_or_else(String::new, |span| self.0[span].trim().to_owned());
        let content = match item {
            Item::Value(value) => self.value(value),
            Item::ArrayOfTables(tables) => {
                Content::List(tables.iter().map(|table| self.table(key_at, at, table)).collect())
            }
            _ => Content::Scalar(Value::Null),
        };
        Node { key_at, at, written, content }
    }

    fn value(&self, value: &toml_edit::Value) -> Content {
        match value {
            toml_edit::Value::String(text) => Content::Scalar(text.value().as_str().into()),
            toml_edit::Value::Integer(number) => Content::Scalar((*number.value()).into()),
            toml_edit::Value::Float(number) => Content::Scalar((*number.value()).into()),
            toml_edit::Value::Boolean(truth) => Content::Scalar((*truth.value()).into()),
            toml_edit::Value::Array(array) => {
                Content::List(array.iter().map(|value| self.element(value)).collect())
            }
            _ => Content::Scalar(Value::Null),
        }
    }

    fn element(&self, value: &toml_edit::Value) -> Node {
        let at = value.span().map_or(Place { line: 1, column: 1 }, |span| self.place(span.start));
        self.item(at, &Item::Value(value.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_of_keys_and_values() {
        let text = "name = \"é\" # x\n[ground]\n  edge_m = 3\nlist = [1,\n 2.5]\n";
        let document = Document::parse(Path::new("a.toml"), text).unwrap();
        let edge = document.root.get("ground").unwrap().get("edge_m").unwrap();
        assert_eq!(
            (edge.key_at, edge.at),
            (Place { line: 3, column: 3 }, Place { line: 3, column: 12 })
        );
        let Content::List(items) =
            &document.root.get("ground").unwrap().get("list").unwrap().content
        else {
            panic!()
        };
        assert_eq!((items[1].at, items[1].written.as_str()), (Place { line: 5, column: 2 }, "2.5"));
    }

    #[test]
    fn broken_toml_is_placed() {
        let error = Document::parse(Path::new("a.toml"), "a = 1\nb = = 2\n").unwrap_err();
        assert!(error.to_string().contains("a.toml:2:5"), "{error}");
    }
}

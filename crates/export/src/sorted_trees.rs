//! Trees of a whole campaign in the order of their ids, without holding them all.

use crate::Error;
use rusqlite::{Connection, params};
use std::path::Path;
use timberline_artefact::codec;
use timberline_artefact::kinds::Tree;

/// A scratch table that takes trees tile by tile and gives them back sorted by id.
///
/// SQLite's tree on disk does the sorting; memory stays at its page cache.
#[derive(Debug)]
pub struct SortedTrees {
    connection: Connection,
    path: std::path::PathBuf,
    len: u64,
}

impl SortedTrees {
    /// An empty table in a scratch file, which the caller removes.
    ///
    /// # Errors
    /// [`Error::Sqlite`].
    pub fn new(path: &Path) -> Result<Self, Error> {
        let fail = Error::sqlite(path);
        let connection = Connection::open(path).map_err(&fail)?;
        connection
            .execute_batch(
                "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA locking_mode = EXCLUSIVE;
                 CREATE TABLE trees (id INTEGER PRIMARY KEY, row BLOB NOT NULL);",
            )
            .map_err(&fail)?;
        Ok(Self { connection, path: path.to_path_buf(), len: 0 })
    }

    /// Number of trees.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds the trees of a tile.
    ///
    /// # Errors
    /// [`Error::DuplicateTree`] when an id is there already.
    pub fn add(&mut self, trees: &[Tree]) -> Result<(), Error> {
        let fail = Error::sqlite(&self.path);
        let transaction = self.connection.transaction().map_err(&fail)?;
        let mut insert = transaction
            .prepare_cached("INSERT OR IGNORE INTO trees VALUES (?1, ?2)")
            .map_err(&fail)?;
        for tree in trees {
            let scratch = |detail| Error::Scratch { path: self.path.clone(), id: tree.id, detail };
            let row = codec::encode(tree).map_err(scratch)?;
            if insert.execute(params![tree.id as i64, row]).map_err(&fail)? == 0 {
                return Err(Error::DuplicateTree { id: tree.id });
            }
        }
        drop(insert);
        transaction.commit().map_err(&fail)?;
        self.len += trees.len() as u64;
        Ok(())
    }

    /// Whether a tree is there.
    ///
    /// # Errors
    /// [`Error::Sqlite`].
    pub fn contains(&self, id: u64) -> Result<bool, Error> {
        let fail = Error::sqlite(&self.path);
        let mut select =
            self.connection.prepare_cached("SELECT 1 FROM trees WHERE id = ?1").map_err(&fail)?;
        select.exists(params![id as i64]).map_err(&fail)
    }

    /// Calls `visit` with an iterator over all trees, by ascending id.
    ///
    /// # Errors
    /// What `visit` returns, or [`Error::Sqlite`] and [`Error::Scratch`] through the iterator.
    pub fn visit<T>(
        &self,
        visit: impl FnOnce(&mut dyn Iterator<Item = Result<Tree, Error>>) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let fail = Error::sqlite(&self.path);
        let mut select = self
            .connection
            .prepare_cached("SELECT id, row FROM trees ORDER BY id")
            .map_err(&fail)?;
        let rows = select
            .query_map([], |row| Ok((row.get::<_, i64>(0)? as u64, row.get::<_, Vec<u8>>(1)?)))
            .map_err(&fail)?;
        let mut trees = rows.map(|row| {
            let (id, bytes) = row.map_err(&fail)?;
            let scratch = |detail| Error::Scratch { path: self.path.clone(), id, detail };
            codec::decode(&bytes).map_err(scratch)
        });
        visit(&mut trees)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(id: u64) -> Tree {
        Tree { id, ground_m: f64::NAN, crown_m: vec![[id as f64, 0.1]], ..Tree::default() }
    }

    #[test]
    fn trees_come_back_sorted_and_whole() {
        let folder = tempfile::tempdir().unwrap();
        let mut trees = SortedTrees::new(&folder.path().join("s")).unwrap();
        trees.add(&[tree(9), tree(3)]).unwrap();
        trees.add(&[tree(5)]).unwrap();
        let found: Vec<Tree> = trees.visit(|rows| rows.collect()).unwrap();
        assert_eq!(found.iter().map(|tree| tree.id).collect::<Vec<_>>(), [3, 5, 9]);
        assert!(found[0].ground_m.is_nan());
        assert_eq!(found[2].crown_m, [[9.0, 0.1]]);
        assert_eq!([0, 3, 4, 9].map(|id| trees.contains(id).unwrap()), [false, true, false, true]);
    }

    #[test]
    fn a_doubled_tree_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let mut trees = SortedTrees::new(&folder.path().join("s")).unwrap();
        trees.add(&[tree(9)]).unwrap();
        assert!(matches!(trees.add(&[tree(9)]), Err(Error::DuplicateTree { id: 9 })));
    }
}

//! The folder of files that people take away.

use crate::Error;
use crate::kinds::OutputFile;
use crate::publish::TEMP_PREFIX;
use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Files of one stage on their way into the outputs folder.
///
/// They are made in a scratch folder inside it and appear when all of them are whole. The scratch
/// folder is named after the stage, so what a killed process left is removed by the next.
#[derive(Debug)]
pub struct OutputFolder {
    folder: PathBuf,
    scratch: PathBuf,
    names: BTreeSet<String>,
}

impl OutputFolder {
    /// Begins, removing what an interrupted run of the same stage left.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn open(folder: &Path, stage: &str) -> Result<Self, Error> {
        let scratch = folder.join(format!("{TEMP_PREFIX}{stage}"));
        remove_folder(&scratch)?;
        std::fs::create_dir_all(&scratch).map_err(Error::io(&scratch, "create"))?;
        Ok(Self { folder: folder.to_path_buf(), scratch, names: BTreeSet::new() })
    }

    /// A folder for intermediate files, which vanishes with this value.
    #[must_use]
    pub fn scratch(&self) -> &Path {
        &self.scratch
    }

    /// Announces a file and says where to write it for now. The name may hold folders, with `/`; the
    /// caller makes them (`std::fs::create_dir_all` of the parent).
    pub fn file(&mut self, name: &str) -> PathBuf {
        self.names.insert(name.to_owned());
        self.scratch.join(name)
    }

    /// Lets all announced files appear, after removing earlier files of the stage that are not among
    /// them (`is_ours` knows them by name; a folder it knows by its name and `/` goes when it is empty). Returns the files, sorted by name.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn publish(self, is_ours: impl Fn(&str) -> bool) -> Result<Vec<OutputFile>, Error> {
        let mut files = Vec::new();
        for name in &self.names {
            let path = self.scratch.join(name);
            let file = File::open(&path).map_err(Error::io(&path, "open"))?;
            file.sync_all().map_err(Error::io(&path, "sync"))?;
            files.push(OutputFile::describe(&self.scratch, name)?);
        }
        self.remove_stale(is_ours)?;
        for name in &self.names {
            let target = self.folder.join(name);
            let parent = target.parent().unwrap_or(&self.folder);
            std::fs::create_dir_all(parent).map_err(Error::io(parent, "create"))?;
            std::fs::rename(self.scratch.join(name), &target)
                .map_err(Error::io(&target, "rename to"))?;
        }
        if cfg!(unix) {
            let folder = File::open(&self.folder).map_err(Error::io(&self.folder, "open"))?;
            folder.sync_all().map_err(Error::io(&self.folder, "sync"))?;
        }
        Ok(files)
    }

    fn remove_stale(&self, is_ours: impl Fn(&str) -> bool) -> Result<(), Error> {
        let mut below = vec![String::new()];
        let mut folders = Vec::new();
        while let Some(prefix) = below.pop() {
            let folder = self.folder.join(&prefix);
            let entries = std::fs::read_dir(&folder).map_err(Error::io(&folder, "read"))?;
            for entry in entries {
                let entry = entry.map_err(Error::io(&folder, "read"))?;
                let file_name = entry.file_name().to_string_lossy().into_owned();
                let name = format!("{prefix}{file_name}");
                let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
                if is_folder && !file_name.starts_with(TEMP_PREFIX) {
                    if is_ours(&format!("{name}/")) {
                        folders.push(entry.path());
                    }
                    below.push(format!("{name}/"));
                } else if is_ours(&name) && !self.names.contains(&name) {
                    std::fs::remove_file(entry.path())
                        .map_err(Error::io(&entry.path(), "remove"))?;
                }
            }
        }
        // The deepest first; a folder in which something is left refuses, and stays.
        for folder in folders.iter().rev() {
            std::fs::remove_dir(folder).unwrap_or_default();
        }
        Ok(())
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        // Nobody to tell; what cannot be removed now, the next run of the stage removes.
        remove_folder(&self.scratch).unwrap_or_default();
    }
}

fn remove_folder(folder: &Path) -> Result<(), Error> {
    match std::fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Error::io(folder, "remove")(error))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn files_appear_together_and_replace_earlier_ones() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["dtm-1.tif", "dtm-2.tif", "notes.txt"] {
            std::fs::write(folder.path().join(name), "old").unwrap();
        }
        std::fs::create_dir(folder.path().join(".partial-export")).unwrap();
        std::fs::write(folder.path().join(".partial-export/left"), "over").unwrap();
        let mut output = OutputFolder::open(folder.path(), "export").unwrap();
        std::fs::write(output.file("dtm.tif"), "new").unwrap();
        std::fs::write(output.scratch().join("scratch"), "x").unwrap();
        assert_eq!(names(folder.path()).len(), 4);
        let files = output.publish(|name| name.starts_with("dtm")).unwrap();
        assert_eq!(names(folder.path()), ["dtm.tif", "notes.txt"]);
        assert_eq!((files[0].name.as_str(), files[0].bytes), ("dtm.tif", 3));
        assert_eq!(files, [OutputFile::describe(folder.path(), "dtm.tif").unwrap()]);
    }

    #[test]
    fn folders_come_and_go_with_their_files() {
        let folder = tempfile::tempdir().unwrap();
        let publish = |tree: &str| {
            let mut output = OutputFolder::open(folder.path(), "tables").unwrap();
            let path = output.file(&format!("trees/{tree}/qsm.csv"));
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, tree).unwrap();
            output.publish(|name| name.starts_with("trees/")).unwrap()
        };
        assert_eq!(publish("1")[0].name, "trees/1/qsm.csv");
        std::fs::create_dir_all(folder.path().join("mine/own")).unwrap();
        std::fs::write(folder.path().join("mine/own/notes.txt"), "x").unwrap();
        publish("2");
        assert_eq!(names(&folder.path().join("trees")), ["2"]);
        assert_eq!(std::fs::read(folder.path().join("trees/2/qsm.csv")).unwrap(), b"2");
        assert_eq!(names(folder.path()), ["mine", "trees"]);
    }

    #[test]
    fn an_abandoned_folder_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let mut output = OutputFolder::open(folder.path(), "export").unwrap();
        std::fs::write(output.file("a"), "new").unwrap();
        drop(output);
        assert!(names(folder.path()).is_empty());
    }
}

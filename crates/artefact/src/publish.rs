//! Files that appear whole or not at all.

use crate::Error;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// What temporary files in a store are called: left-overs of a killed process are recognised by it.
pub const TEMP_PREFIX: &str = ".partial-";

/// A file being written beside its final place. Dropped without [`Staged::publish`], it is removed.
#[derive(Debug)]
pub struct Staged {
    temp: NamedTempFile,
    target: PathBuf,
}

impl Staged {
    /// Begins a file that will appear at `target`; the folder is made if need be.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(target: &Path) -> Result<Self, Error> {
        let folder = parent(target);
        std::fs::create_dir_all(folder).map_err(Error::io(folder, "create"))?;
        let temp = tempfile::Builder::new()
            .prefix(TEMP_PREFIX)
            .permissions_if_unix()
            .tempfile_in(folder)
            .map_err(Error::io(folder, "write in"))?;
        Ok(Self { temp, target: target.to_path_buf() })
    }

    /// The open temporary file.
    pub fn file(&mut self) -> &mut File {
        self.temp.as_file_mut()
    }

    /// Where the file is for now.
    #[must_use]
    pub fn temp_path(&self) -> &Path {
        self.temp.path()
    }

    /// Where the file will appear.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Makes the file durable and lets it appear: fsync, rename, fsync of the folder.
    ///
    /// # Errors
    /// [`Error::Io`]; the target is then as it was.
    pub fn publish(self) -> Result<PathBuf, Error> {
        let Self { temp, target } = self;
        temp.as_file().sync_all().map_err(Error::io(temp.path(), "sync"))?;
        temp.persist(&target).map_err(|error| Error::io(&target, "rename to")(error.error))?;
        sync_folder(parent(&target))?;
        Ok(target)
    }
}

/// Writes bytes to a file that appears whole or not at all.
///
/// # Errors
/// [`Error::Io`].
pub fn write_atomic(target: &Path, bytes: &[u8]) -> Result<(), Error> {
    let mut staged = Staged::new(target)?;
    staged.file().write_all(bytes).map_err(Error::io(target, "write"))?;
    staged.publish().map(drop)
}

/// Makes the names in a folder durable. Folders cannot be opened for that on every system.
fn sync_folder(folder: &Path) -> Result<(), Error> {
    if cfg!(unix) {
        let open = File::open(folder).map_err(Error::io(folder, "open"))?;
        open.sync_all().map_err(Error::io(folder, "sync"))?;
    }
    Ok(())
}

fn parent(target: &Path) -> &Path {
    target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Temporary files are private by default; artefacts are as readable as any file.
trait PermissionsIfUnix {
    fn permissions_if_unix(&mut self) -> &mut Self;
}

impl PermissionsIfUnix for tempfile::Builder<'_, '_> {
    fn permissions_if_unix(&mut self) -> &mut Self {
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            self.permissions(std::fs::Permissions::from_mode(0o644));
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dropped_files_leave_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("sub/a.tmbr");
        let mut staged = Staged::new(&target).unwrap();
        staged.file().write_all(b"half").unwrap();
        drop(staged);
        assert_eq!(std::fs::read_dir(folder.path().join("sub")).unwrap().count(), 0);
        write_atomic(&target, b"whole").unwrap();
        assert_eq!(std::fs::read(&target).unwrap(), b"whole");
    }
}

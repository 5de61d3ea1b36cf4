//! One lock per unit: two processes on one store never make the same artefact twice.

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// The right to work on a unit. Dropping it, or the death of the process, gives it back.
#[derive(Debug)]
pub struct UnitLock {
    path: PathBuf,
    file: Option<File>,
}

impl UnitLock {
    /// Waits until nobody else holds the lock and takes it.
    ///
    /// # Errors
    /// The system's.
    pub fn acquire(path: &Path) -> io::Result<Self> {
        loop {
            let file = OpenOptions::new().create(true).truncate(false).write(true).open(path)?;
            match file.lock() {
                Ok(()) => {}
                // Without locks two processes may make the same artefact twice, with the same bytes.
                Err(error) if error.kind() == io::ErrorKind::Unsupported => {
                    tracing::warn!("{}: this file system has no locks", path.display());
                    return Ok(Self { path: path.to_owned(), file: Some(file) });
                }
                Err(error) => return Err(error),
            }
            // The holder before may have removed the name while this process waited on the old file.
            if same_file(&file, path) {
                return Ok(Self { path: path.to_owned(), file: Some(file) });
            }
        }
    }
}

impl Drop for UnitLock {
    fn drop(&mut self) {
        if cfg!(unix)
            && let Err(error) = std::fs::remove_file(&self.path)
        {
            tracing::debug!("{}: {error}", self.path.display());
        }
        drop(self.file.take());
    }
}

#[cfg(unix)]
fn same_file(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let (Ok(open), Ok(named)) = (file.metadata(), std::fs::metadata(path)) else { return false };
    (open.dev(), open.ino()) == (named.dev(), named.ino())
}

#[cfg(not(unix))]
fn same_file(_: &File, _: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn one_at_a_time_and_nothing_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("u.lock");
        let inside = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..50 {
                        let lock = UnitLock::acquire(&path).unwrap();
                        assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0);
                        inside.fetch_sub(1, Ordering::SeqCst);
                        drop(lock);
                    }
                });
            }
        });
        assert!(!path.exists());
    }
}

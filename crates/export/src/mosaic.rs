//! A raster larger than memory: patches on disk, read back by window.

use crate::{Error, Window};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Edge of the cells of the index over patches, in raster cells.
const BUCKET: i64 = 512;

/// Patches of one raster in an unnamed scratch file, which vanishes with the process.
///
/// Patches may overlap: the highest value counts, NaN is nothing. So the sequence in which patches
/// come, and how the plane is cut into them, do not matter.
#[derive(Debug)]
pub struct Mosaic {
    file: File,
    folder: PathBuf,
    patches: Vec<(Window, u64)>,
    buckets: BTreeMap<(i64, i64), Vec<u32>>,
    end: u64,
}

impl Mosaic {
    /// An empty mosaic with its scratch file in a folder.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(folder: &Path) -> Result<Self, Error> {
        let file = tempfile::tempfile_in(folder).map_err(Error::io(folder, "write in"))?;
        Ok(Self {
            file,
            folder: folder.to_path_buf(),
            patches: Vec::new(),
            buckets: BTreeMap::new(),
            end: 0,
        })
    }

    /// Adds a patch: values row by row from the south, NaN where there is none.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn push(&mut self, window: Window, values: &[f32]) -> Result<(), Error> {
        if window.is_empty() {
            return Ok(());
        }
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.file.seek(SeekFrom::Start(self.end)).map_err(Error::io(&self.folder, "seek in"))?;
        self.file.write_all(&bytes).map_err(Error::io(&self.folder, "write in"))?;
        for bucket in buckets(&window) {
            self.buckets.entry(bucket).or_default().push(self.patches.len() as u32);
        }
        self.patches.push((window, self.end));
        self.end += bytes.len() as u64;
        Ok(())
    }

    /// The values of a window, row by row from the south; NaN where no patch has any.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn read(&mut self, window: Window) -> Result<Vec<f32>, Error> {
        let mut values = vec![f32::NAN; window.len()];
        let mut touched: Vec<u32> = buckets(&window)
            .filter_map(|bucket| self.buckets.get(&bucket))
            .flatten()
            .copied()
            .collect();
        touched.sort_unstable();
        touched.dedup();
        for patch in touched {
            self.merge(patch as usize, window, &mut values)?;
        }
        Ok(values)
    }

    fn merge(&mut self, patch: usize, window: Window, values: &mut [f32]) -> Result<(), Error> {
        let (source, offset) = self.patches[patch];
        let Some(common) = source.intersection(&window) else { return Ok(()) };
        let mut bytes = vec![0; common.columns as usize * 4];
        for row in common.row0..common.end_row() {
            let place = offset + source.index(common.column0, row) as u64 * 4;
            self.file.seek(SeekFrom::Start(place)).map_err(Error::io(&self.folder, "seek in"))?;
            self.file.read_exact(&mut bytes).map_err(Error::io(&self.folder, "read in"))?;
            let first = window.index(common.column0, row);
            let (chunks, _) = bytes.as_chunks::<4>();
            for (value, chunk) in values[first..].iter_mut().zip(chunks) {
                // `max` takes the number when the other is NaN.
                *value = value.max(f32::from_le_bytes(*chunk));
            }
        }
        Ok(())
    }
}

/// The index cells that a window touches.
fn buckets(window: &Window) -> impl Iterator<Item = (i64, i64)> + use<> {
    let span = |first: i64, end: i64| first.div_euclid(BUCKET)..=(end - 1).div_euclid(BUCKET);
    let rows = span(window.row0, window.end_row());
    span(window.column0, window.end_column())
        .flat_map(move |column| rows.clone().map(move |row| (column, row)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn as_one_raster_in_memory(
            patches in prop::collection::vec((-700i64..700, -700i64..700, 1u32..90, 1u32..90), 0..8),
            (column0, row0) in (-800i64..700, -800i64..700),
        ) {
            let folder = tempfile::tempdir().unwrap();
            let mut mosaic = Mosaic::new(folder.path()).unwrap();
            let window = Window { column0, row0, columns: 200, rows: 150 };
            let mut expected = vec![f32::NAN; window.len()];
            for (number, (column0, row0, columns, rows)) in patches.into_iter().enumerate() {
                let patch = Window { column0, row0, columns, rows };
                mosaic.push(patch, &vec![number as f32; patch.len()]).unwrap();
                for row in row0..patch.end_row() {
                    for column in column0..patch.end_column() {
                        if window.contains(column, row) {
                            expected[window.index(column, row)] = number as f32;
                        }
                    }
                }
            }
            let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&mosaic.read(window).unwrap()), bits(&expected));
        }
    }
}

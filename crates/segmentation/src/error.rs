//! The crate's one error enum.

/// What can be wrong with the input of a segmentation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A crown reaches further than the halo, so that a neighbouring tile could miss it.
    #[error("tree {tree}: crown radius {radius_m} m exceeds reach_m = {reach_m} m; raise it")]
    Reach {
        /// Id of the tree.
        tree: u64,
        /// Its crown radius, m.
        radius_m: f64,
        /// The reach in the parameters, m.
        reach_m: f64,
    },
    /// The triangulation refused the points.
    #[error("triangulation of the canopy: {reason}")]
    Triangulation {
        /// What the library says.
        reason: String,
    },
    /// The points could not be laid on a grid.
    #[error(transparent)]
    Grid(#[from] timberline_pointcloud::Error),
    /// Slices that belong together have different lengths.
    #[error("column `{column}` has {found} values for {expected} points")]
    Length {
        /// Name of the column.
        column: &'static str,
        /// Number of points.
        expected: usize,
        /// Number of values found.
        found: usize,
    },
}

impl Error {
    /// [`Error::Length`] for the first of some columns that has not a value for every point.
    pub(crate) fn check_lengths(
        expected: usize,
        columns: &[(&'static str, usize)],
    ) -> Result<(), Self> {
        match columns.iter().find(|(_, found)| *found != expected) {
            Some(&(column, found)) => Err(Self::Length { column, expected, found }),
            None => Ok(()),
        }
    }
}

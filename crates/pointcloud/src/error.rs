//! The crate's one error enum.

/// What can be wrong with columns and grids.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A column has another length than the positions.
    #[error("column `{column}` has {found} values for {expected} points")]
    ColumnLength {
        /// Name of the column.
        column: String,
        /// Number of points.
        expected: usize,
        /// Number of values found.
        found: usize,
    },
    /// Two clouds give different types to one extra column.
    #[error("extra column `{column}` is {left} in one cloud and {right} in the other")]
    ColumnType {
        /// Name of the column.
        column: String,
        /// Type in the cloud appended to.
        left: &'static str,
        /// Type in the appended cloud.
        right: &'static str,
    },
    /// A cell or tile size that is not a positive number.
    #[error("cell size {0} m is not a positive finite number")]
    CellSize(f64),
    /// A coordinate that is not finite or outside the range the lattice can hold.
    #[error("coordinate {value} m of axis {axis} is not finite or beyond {limit} m")]
    Coordinate {
        /// `x`, `y` or `z`.
        axis: char,
        /// The value given.
        value: f64,
        /// Largest magnitude supported.
        limit: f64,
    },
}

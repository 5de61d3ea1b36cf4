//! What can go wrong.

/// Why treetops could not be found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A column given along with the points has another length.
    #[error("`{column}` has {found} values for {points} points")]
    Length {
        /// Which column.
        column: &'static str,
        /// Number of points.
        points: usize,
        /// Number of values.
        found: usize,
    },
    /// A parameter is out of range, or two contradict each other.
    #[error("treetops: {}", .0.join("; "))]
    Params(Vec<String>),
    /// The points could not be laid on a grid.
    #[error(transparent)]
    Grid(timberline_pointcloud::Error),
    /// More points than an index of 32 bits can name.
    #[error("{0} points in one cloud; at most {max} can be indexed", max = u32::MAX)]
    TooManyPoints(usize),
}

//! The crate's one error enum.

/// Why points could not be consolidated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A coordinate is no finite number, or too far away.
    #[error(
        "point {index} has {axis} = {value} m; coordinates must be finite and within {most_m} m: \
         leave the point out, or use a nearer frame"
    )]
    Position {
        /// Index of the point.
        index: usize,
        /// Which coordinate.
        axis: char,
        /// Its value, m.
        value: f64,
        /// Largest magnitude, m.
        most_m: f64,
    },
    /// A support radius that no neighbourhood can have.
    #[error("support radius {found_m} m; allowed are {} to {} m", .allowed_m[0], .allowed_m[1])]
    Radius {
        /// The radius, m.
        found_m: f64,
        /// Smallest and largest, m.
        allowed_m: [f64; 2],
    },
    /// A column given along with the points has another length.
    #[error("`{column}` has {found} values for {expected} points")]
    Length {
        /// Which column.
        column: &'static str,
        /// Number of points.
        expected: usize,
        /// Number of values.
        found: usize,
    },
    /// A sample is none of the points.
    #[error("sample {index} of a cloud of {points} points")]
    Index {
        /// The sample's index.
        index: u32,
        /// Number of points.
        points: usize,
    },
    /// More points than an index of 32 bits can name.
    #[error("{0} points in one cloud; at most {max} can be indexed", max = u32::MAX - 1)]
    TooManyPoints(usize),
    /// A parameter is out of range, or two contradict each other.
    #[error("consolidation: {}", .0.join("; "))]
    Params(Vec<String>),
    /// The neighbours could not be sought.
    #[error(transparent)]
    Neighbours(#[from] timberline_pointcloud::nearest::BuildError),
}

/// Refuses coordinates that are not finite or beyond `most_m`.
pub(crate) fn check_positions(points: &[[f64; 3]], most_m: f64) -> Result<(), Error> {
    for (index, point) in points.iter().enumerate() {
        for (axis, &value) in ['x', 'y', 'z'].into_iter().zip(point) {
            if !value.is_finite() || value.abs() > most_m {
                return Err(Error::Position { index, axis, value, most_m });
            }
        }
    }
    Ok(())
}

//! The crate's one error enum.

/// Why a scene cannot be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter outside its range.
    #[error("`{name}` is {value}; expected {expected}")]
    Parameter {
        /// Name of the parameter, with its unit.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The range in words.
        expected: &'static str,
    },
    /// A scene that covers nothing.
    #[error("the area from {min:?} to {max:?} m holds nothing")]
    EmptyArea {
        /// Smallest world x and y.
        min: [f64; 2],
        /// Largest world x and y.
        max: [f64; 2],
    },
    /// A stand boundary that is no polygon.
    #[error("the boundary of stand `{stand}` has {corners} corners; a polygon has at least 3")]
    Boundary {
        /// Name of the stand.
        stand: String,
        /// Corners given.
        corners: usize,
    },
    /// A stand from whose species none can be drawn.
    #[error("cohort {cohort} of stand `{stand}` has no species with a positive share")]
    NoSpecies {
        /// Name of the stand.
        stand: String,
        /// Index of the cohort.
        cohort: usize,
    },
}

/// Checks that a parameter is finite and within closed bounds.
pub(crate) fn check(
    name: &'static str,
    value: f64,
    range: std::ops::RangeInclusive<f64>,
    expected: &'static str,
) -> Result<(), Error> {
    if value.is_finite() && range.contains(&value) {
        Ok(())
    } else {
        Err(Error::Parameter { name, value, expected })
    }
}

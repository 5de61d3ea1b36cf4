//! The crate's one error enum.

/// What can be wrong with the input of a skeleton.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No point has a position.
    #[error("no skeleton of {given} points, of which {not_finite} have a coordinate that is no finite number: at least 2 different positions are needed")]
    NoPoints {
        /// Points given.
        given: usize,
        /// Points whose position is not finite.
        not_finite: usize,
    },
    /// All points lie at one position.
    #[error("all {given} points lie at ({}, {}, {}): at least 2 different positions are needed", .at[0], .at[1], .at[2])]
    OnePosition {
        /// Points given.
        given: usize,
        /// Where they lie, m.
        at: [f64; 3],
    },
    /// More points than indices of 32 bits can tell apart.
    #[error("{0} points: one tree may have {max} at most, thin the cloud first", max = crate::cloud::MOST_POINTS)]
    TooMany(usize),
    /// Likelihoods that are not one for each point.
    #[error("{wood} likelihoods of wood for {points} points")]
    WoodCount {
        /// Number of points.
        points: usize,
        /// Number of likelihoods.
        wood: usize,
    },
    /// A base that is no position.
    #[error("the base of the tree is at ({}, {}, {}): all must be finite numbers", .0[0], .0[1], .0[2])]
    Base([f64; 3]),
    /// A parameter outside its range.
    #[error("{0}")]
    Parameter(String),
}

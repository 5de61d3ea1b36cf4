//! The crate's one error enum.

/// What can be wrong with the input of a crown fit. A crown that merely cannot be fitted is no
/// error: it is a [`crate::starsac::Rejection`] or a fallback of [`crate::surface::Fit`].
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A coordinate that is not finite.
    #[error("cell {index} of the crown's surface has the {axis} coordinate {value}")]
    NotFinite {
        /// Index of the cell.
        index: usize,
        /// `x`, `y` or `z`.
        axis: char,
        /// The value given.
        value: f64,
    },
    /// No cell at all: nothing carries weight.
    #[error("the crown's surface has no cells")]
    NoCells,
    /// A bound on the paraboloid's semiaxes that no paraboloid can meet.
    #[error(
        "semiaxis bounds {smallest} m to {largest} m: both must be positive, the first the smaller"
    )]
    AxisBounds {
        /// Smallest semiaxis allowed, m.
        smallest: f64,
        /// Largest semiaxis allowed, m.
        largest: f64,
    },
    /// A prior box that is inside out or not a number.
    #[error("half width {0} m of the position prior is negative or not a number")]
    PriorWidth(f64),
    /// A cell size that is not a positive number.
    #[error("cell size {0} m is not a positive finite number")]
    CellSize(f64),
    /// The cone solver refused or left a problem that is always feasible.
    #[error("the cone solver stopped with {status} after {iterations} iterations")]
    Solver {
        /// The solver's own word.
        status: String,
        /// Iterations done.
        iterations: u32,
    },
    /// A crown reaches further than the halo that was asked for, so a neighbour could miss it.
    #[error(
        "tree {tree}: crown radius {radius_m} m exceeds the reach of {reach_m} m: raise `reach_m`"
    )]
    Reach {
        /// Id of the tree.
        tree: u64,
        /// Its crown radius.
        radius_m: f64,
        /// The reach in the parameters.
        reach_m: f64,
    },
}

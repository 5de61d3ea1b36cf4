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
    /// Weights that are not one for each cell.
    #[error("{weights} weights for {cells} cells of the crown's surface")]
    WeightCount {
        /// Number of cells.
        cells: usize,
        /// Number of weights.
        weights: usize,
    },
    /// A weight that is negative or not a number.
    #[error("cell {index} of the crown's surface has the weight {value}: weights are 0 or more")]
    Weight {
        /// Index of the cell.
        index: usize,
        /// The value given.
        value: f64,
    },
    /// An imbalance of the axes outside its range.
    #[error("omega {0} is not between 0 (equal axes) and 1 (free axes)")]
    Omega(f64),
    /// Bounds on the paraboloid's semiaxes that no paraboloid can meet.
    #[error(
        "semiaxis bounds {smallest} m to {largest} m: both must be positive, the first the smaller"
    )]
    AxisBounds {
        /// Smallest semiaxis allowed, m.
        smallest: f64,
        /// Largest semiaxis allowed, m.
        largest: f64,
    },
    /// A bound after equation 15 of Polewski et al. that makes mu infinite or not positive.
    #[error(
        "largest axis {largest} m with omega {omega}: the paper's bound needs a positive axis and omega below 1 (use exact axis bounds for omega 1)"
    )]
    PaperBound {
        /// b_max, m.
        largest: f64,
        /// Largest imbalance of the axes.
        omega: f64,
    },
    /// A prior box that is inside out or not a number.
    #[error(
        "position prior at ({}, {}) with half width {half_width} m: all must be numbers, the last 0 or more",
        .centre[0], .centre[1]
    )]
    Prior {
        /// Middle of the box, m.
        centre: [f64; 2],
        /// Half its edge, m.
        half_width: f64,
    },
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
    /// Positions could not be laid on a grid.
    #[error(transparent)]
    Grid(#[from] timberline_pointcloud::Error),
}

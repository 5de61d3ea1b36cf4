//! The crate's one error enum.

/// What can go wrong in classification and terrain modelling.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Columns of different lengths.
    #[error("{what} has {found} values for {expected} points")]
    Length {
        /// The column.
        what: &'static str,
        /// Number of points.
        expected: usize,
        /// Number of values found.
        found: usize,
    },
    /// The kernel matrix could not be factored, even with a trace of smoothing.
    #[error(
        "multiquadric system of {nodes} nodes with offset {offset_m} m is singular to working \
         precision; use a smaller offset or some smoothing"
    )]
    Singular {
        /// Number of nodes.
        nodes: usize,
        /// Kernel offset, metres.
        offset_m: f64,
    },
    /// The eigenvalue iteration did not converge.
    #[error("eigenvalues of a matrix of size {size} did not converge")]
    Eigen {
        /// Rows of the matrix.
        size: usize,
    },
    /// No nodes to interpolate.
    #[error("a surface needs at least one ground point")]
    NoNodes,
    /// A parameter out of its range.
    #[error("{0}")]
    Parameter(String),
    /// A triangulation refused its vertices.
    #[error("the ground vertices cannot be triangulated: {reason}")]
    Triangulation {
        /// What is wrong with them.
        reason: String,
    },
    /// A grid or kd-tree refused its input.
    #[error(transparent)]
    Grid(#[from] timberline_pointcloud::Error),
    /// The kd-tree over the nodes could not be built.
    #[error(transparent)]
    Nearest(#[from] timberline_pointcloud::nearest::BuildError),
}

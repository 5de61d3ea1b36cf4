//! What can go wrong.

/// Why a tree could not be modelled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parameter is out of range, or two contradict each other.
    #[error("cylinders: {}", .0.join("; "))]
    Params(Vec<String>),
    /// The likelihoods of wood do not belong to the points.
    #[error("`wood` has {found} values for {points} points")]
    Length {
        /// Number of points.
        points: usize,
        /// Number of values.
        found: usize,
    },
    /// More points than an index of 32 bits can name.
    #[error("{0} points in one tree; at most {max} can be indexed: thin them", max = u32::MAX)]
    TooManyPoints(usize),
    /// A skeleton without a segment.
    #[error(
        "the skeleton has {nodes} nodes and no segment of any length: the tree has too few points to model"
    )]
    NoSegment {
        /// Number of nodes.
        nodes: usize,
    },
    /// A node that is not finite, or a radius below 0.
    #[error("node {node} of the skeleton has {field} {value}, must be finite{}", if *.field == "radius_m" { " and at least 0" } else { "" })]
    Node {
        /// Which node.
        node: usize,
        /// Which field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// A node whose parent does not come before it, or a second root.
    #[error(
        "node {node} of the skeleton has parent {parent:?}, must be one of the nodes before it"
    )]
    Parent {
        /// Which node.
        node: usize,
        /// Its parent.
        parent: Option<u32>,
    },
    /// No neighbour search over the points.
    #[error(transparent)]
    Nearest(#[from] timberline_pointcloud::nearest::BuildError),
}

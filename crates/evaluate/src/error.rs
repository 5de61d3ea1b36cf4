//! What can go wrong.

/// Why an assessment could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Two trees of one list share an id, so that ties could not be decided.
    #[error("the {list} trees name id {id} twice")]
    DuplicateId {
        /// `reference` or `detected`.
        list: &'static str,
        /// The id.
        id: u64,
    },
    /// A position is not finite.
    #[error("the {list} tree {id} stands at ({}, {})", at_m[0], at_m[1])]
    Position {
        /// `reference` or `detected`.
        list: &'static str,
        /// The tree.
        id: u64,
        /// Its position.
        at_m: [f64; 2],
    },
    /// A distance or share is not a number in its range.
    #[error("`{name}` is {value}; {allowed}")]
    Parameter {
        /// Which parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// Two columns that belong together differ in length.
    #[error("{reference} reference labels for {found} found labels")]
    Length {
        /// Number of reference values.
        reference: usize,
        /// Number of values to be assessed.
        found: usize,
    },
    /// The neighbour search could not be built.
    #[error(transparent)]
    Search(#[from] timberline_pointcloud::nearest::BuildError),
}

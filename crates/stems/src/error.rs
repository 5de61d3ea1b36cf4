//! What can go wrong.

/// Why trees could not be found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There are too few points for a tree.
    #[error("{found} {what}: a tree takes at least {needed}; check the filters of `tiles`")]
    TooFewPoints {
        /// What is counted: points or voxels.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many it takes.
        needed: usize,
    },
    /// All points lie in a plane or on a line.
    #[error(
        "all {voxels} voxels with points lie within {thickness_m:.3} m of a plane: this is no tree \
         (a wall, a single slice?)"
    )]
    Flat {
        /// Number of voxels with points.
        voxels: usize,
        /// Standard deviation across the plane, m.
        thickness_m: f64,
    },
    /// No tree was found.
    #[error(
        "no stem found between {low_m} and {high_m} m above ground: check that heights are right \
         (stage `dtm`), or raise `search_to_m` or `noise_m`"
    )]
    NoStem {
        /// Where the search began, m.
        low_m: f64,
        /// Where it ended, m.
        high_m: f64,
    },
    /// More voxels than an index of 32 bits can name.
    #[error("{0} voxels; at most {max} can be indexed: raise `voxel_m`", max = i32::MAX)]
    TooManyVoxels(usize),
    /// The neighbour search refused the points.
    #[error(transparent)]
    Neighbours(#[from] timberline_pointcloud::nearest::BuildError),
    /// The points could not be laid on a grid.
    #[error(transparent)]
    Grid(#[from] timberline_pointcloud::Error),
}

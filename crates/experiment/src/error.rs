//! What can go wrong.

/// Why an experiment could not be made.
#[derive(Debug, thiserror::Error)]
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
    /// A dataset whose stands hold too few trees that can be seen.
    #[error(
        "dataset {dataset}: {found} of {wanted} trees in {plots} plots; its stands are too thin"
    )]
    TooFewTrees {
        /// Name of the dataset.
        dataset: String,
        /// Trees wanted.
        wanted: usize,
        /// Trees found.
        found: usize,
        /// Plots grown.
        plots: u64,
    },
    /// A cluster that no method can be run on.
    #[error("cluster {id}: {reason}")]
    Cluster {
        /// Number of the cluster.
        id: u64,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A name that nothing goes by.
    #[error("no {what} is called `{name}`; known are {known}")]
    Unknown {
        /// What was named.
        what: &'static str,
        /// The name given.
        name: String,
        /// The names there are.
        known: String,
    },
    /// Columns of a plot that differ in length.
    #[error("column `{column}` of a plot has {found} values for {points} points")]
    Length {
        /// Name of the column.
        column: &'static str,
        /// Points of the plot.
        points: usize,
        /// Values of the column.
        found: usize,
    },
    /// A virtual forest could not be grown.
    #[error(transparent)]
    Synth(#[from] timberline_synth::Error),
    /// Treetops could not be sought.
    #[error(transparent)]
    Treetops(#[from] timberline_treetops::Error),
    /// A segmenter failed.
    #[error(transparent)]
    Segmentation(#[from] timberline_segmentation::Error),
    /// Trees could not be compared.
    #[error(transparent)]
    Evaluate(#[from] timberline_evaluate::Error),
    /// Points could not be laid on a grid.
    #[error(transparent)]
    Grid(#[from] timberline_pointcloud::Error),
    /// A fit failed.
    #[error(transparent)]
    Crowns(#[from] timberline_crowns::Error),
    /// Points could not be consolidated.
    #[error(transparent)]
    Consolidation(#[from] timberline_wlop::Error),
    /// The neighbour search could not be built.
    #[error(transparent)]
    Search(#[from] timberline_pointcloud::nearest::BuildError),
}

//! What the paper reports.

/// Figures of one of the paper's datasets (its Table 1 and section 6). Median errors in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paper {
    /// Name of the dataset.
    pub dataset: &'static str,
    /// Species.
    pub species: &'static str,
    /// Trees, where it says.
    pub trees: Option<u32>,
    /// Mean height, m.
    pub height_m: f64,
    /// Mean radius of the smallest circle around a segment, m.
    pub enclosing_radius_m: f64,
    /// Points per square metre inside crowns.
    pub density_per_m2: f64,
    /// Centroid of the convex hull.
    pub hull_m: &'static str,
    /// Highest point.
    pub highest_m: &'static str,
    /// Least squares: one figure, which stands beside both kinds of axes here.
    pub l2_m: &'static str,
    /// L1 without a prior.
    pub l1_m: &'static str,
    /// L1 with a prior of half width 0.1 m.
    pub l1_prior_m: &'static str,
}

/// The two datasets of Polewski et al.
pub const PAPER: [Paper; 2] = [
    Paper {
        dataset: "I",
        species: "Norway spruce",
        trees: Some(110),
        height_m: 17.0,
        enclosing_radius_m: 3.1,
        density_per_m2: 28.6,
        hull_m: "0.55",
        highest_m: "–",
        l2_m: "0.29",
        l1_m: "0.22 to 0.25",
        l1_prior_m: "–",
    },
    Paper {
        dataset: "II",
        species: "Douglas fir",
        trees: None,
        height_m: 24.0,
        enclosing_radius_m: 4.56,
        density_per_m2: 14.6,
        hull_m: "1.24",
        highest_m: "0.26",
        l2_m: "0.52",
        l1_m: "0.39",
        l1_prior_m: "0.214",
    },
];

impl Paper {
    /// The figures of a dataset, if it is one of the paper's.
    #[must_use]
    pub fn of(dataset: &str) -> Option<&'static Self> {
        PAPER.iter().find(|paper| paper.dataset == dataset)
    }
}

/// How the generated data differ from the paper's, for every report.
pub const DIFFERENCES: &[&str] = &[
    "The paper's clouds and reference positions are not public: trees, terrain, scanner and segments here \
     are virtual. Crowns are envelopes between cone and paraboloid filled with whorls, clumps and holes; \
     stems are straight.",
    "Rates were set so that the data, not the results of the fits, agree with the paper: height, radius and \
     density with its Table 1, and the errors of the two baselines that fit nothing (hull centroid, highest \
     point) roughly with its section 6. How much of the error of a highest point is lean, a new leader or the \
     sensor's noise is not known and was chosen.",
    "The reference is the foot of the stem, without the error of a field survey.",
    "Segments come from the true tree of every return. In dataset II a share lacks a side, swallows a part of \
     a lower neighbour, and takes points of neighbours and of small trees near it. The paper's segments are \
     those of a real segmentation; the rates of its errors are not given.",
    "Crowns with a bare flank stand for the irregular outlines of real ones; the points of the flank are taken \
     out after the scan.",
    "Only trees of the upper canopy are located; how the paper chose its trees is known for the number only.",
];

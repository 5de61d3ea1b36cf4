//! Generated datasets in the manner of the paper's: what they are made of.
//!
//! Polewski et al. tested on two: I, Norway spruce with clean segments, and II, Douglas fir with the
//! errors of an automatic segmentation. Neither is public. The generated ones are near what the
//! paper's Table 1 says (number of trees, height, radius of the smallest circle around a segment,
//! density of points) and are virtual otherwise: crowns are envelopes filled with foliage, stems are
//! straight, and errors of segments come from the rates below. How the rates were set is told in
//! [`super::paper::DIFFERENCES`].

use super::cluster::Cluster;
use super::plot::plot;
use crate::Error;
use rayon::prelude::*;
use serde::Serialize;
use timberline_synth::{Cohort, Layout, Share, Species};

/// How trees differ from upright and even ones. The reference is the foot of the stem; above it
/// every method would find an even crown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Growth {
    /// Deviation of the lean of stems, degrees (half-normal, cut at three deviations).
    pub lean_deg: f64,
    /// Share of trees whose leader broke and was replaced by a side branch.
    pub broken_share: f64,
    /// How far the new leader stands beside the old one, m: smallest and largest.
    pub broken_offset_m: [f64; 2],
    /// Deviation of the crown's widest section from the stem, in crown radii, each axis (normal,
    /// cut at two deviations), beside what the neighbours push.
    pub asymmetry: f64,
    /// Share of crowns with a bare flank, shaded to death.
    pub bare_share: f64,
    /// Width of the bare sector, degrees: smallest and largest.
    pub bare_angle_deg: [f64; 2],
    /// Distance from the top beyond which the sector is bare, in crown radii: smallest and largest.
    pub bare_beyond: [f64; 2],
}

/// What an automatic segmentation does wrong.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SegmentErrors {
    /// Share of segments that lack a side of their crown (over-segmentation).
    pub cut_share: f64,
    /// Distance from the top to the cut, in crown radii: smallest and largest.
    pub cut_at: [f64; 2],
    /// Share of segments that swallow a part of a lower neighbour (under-segmentation).
    pub merged_share: f64,
    /// How much of the neighbour's width is swallowed: smallest and largest.
    pub merged_part: [f64; 2],
    /// How far around its own points a segment takes points of neighbours, m.
    pub leak_reach_m: f64,
    /// Share of the neighbours' points within that reach which it takes, on average over the
    /// segments (uniform from 0 to twice this).
    pub leak_share: f64,
    /// Share of the points of small trees within that reach which it takes.
    pub understorey_share: f64,
}

impl SegmentErrors {
    /// Every point in the right segment.
    #[must_use]
    pub fn none() -> Self {
        Self {
            cut_share: 0.0,
            cut_at: [0.0; 2],
            merged_share: 0.0,
            merged_part: [0.0; 2],
            leak_reach_m: 0.0,
            leak_share: 0.0,
            understorey_share: 0.0,
        }
    }
}

/// A dataset's definition.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DatasetParams {
    /// Name in tables and figures.
    pub name: String,
    /// The trees to be located.
    pub cohort: Cohort,
    /// Small trees below them; none where the ground is bare.
    pub understorey: Option<Cohort>,
    /// Height relative to the regression of the species.
    pub site: f64,
    /// Crown width relative to the regression of the species.
    pub crown_scale: f64,
    /// How far crowns may reach into one another, as a share of the sum of their radii.
    pub crown_overlap: f64,
    /// Laser pulses per square metre.
    pub pulses_per_m2: f64,
    /// Deviation of the position of a pulse in the plane, m.
    pub horizontal_noise_m: f64,
    /// Stems, tops and flanks.
    pub growth: Growth,
    /// Errors of the segments.
    pub errors: SegmentErrors,
}

impl DatasetParams {
    /// Dataset I: Norway spruce, clean segments.
    #[must_use]
    pub fn spruce() -> Self {
        Self {
            name: "I".to_owned(),
            cohort: cohort(Species::NorwaySpruce, 350.0, [3.4, 12.4, 8.0], 0.62),
            understorey: None,
            site: 1.0,
            crown_scale: 1.45,
            crown_overlap: 0.2,
            pulses_per_m2: 22.0,
            horizontal_noise_m: 0.06,
            growth: Growth {
                lean_deg: 0.8,
                broken_share: 0.0,
                broken_offset_m: [0.0; 2],
                asymmetry: 0.06,
                bare_share: 0.85,
                bare_angle_deg: [90.0, 180.0],
                bare_beyond: [0.4, 0.7],
            },
            errors: SegmentErrors::none(),
        }
    }

    /// Dataset II: Douglas fir, segments with errors.
    #[must_use]
    pub fn douglas_fir() -> Self {
        Self {
            name: "II".to_owned(),
            cohort: cohort(Species::DouglasFir, 230.0, [3.4, 17.2, 12.0], 0.55),
            understorey: Some(cohort(Species::WesternHemlock, 250.0, [1.8, 5.0, 3.0], 0.7)),
            site: 1.0,
            crown_scale: 1.16,
            crown_overlap: 0.3,
            pulses_per_m2: 12.6,
            horizontal_noise_m: 0.11,
            growth: Growth {
                lean_deg: 0.3,
                broken_share: 0.15,
                broken_offset_m: [0.2, 0.7],
                asymmetry: 0.06,
                bare_share: 0.9,
                bare_angle_deg: [90.0, 180.0],
                bare_beyond: [0.35, 0.65],
            },
            errors: SegmentErrors {
                cut_share: 0.45,
                cut_at: [0.1, 0.6],
                merged_share: 0.4,
                merged_part: [0.3, 1.0],
                leak_reach_m: 1.2,
                leak_share: 0.25,
                understorey_share: 0.5,
            },
        }
    }
}

fn cohort(species: Species, stems_per_ha: f64, dbh: [f64; 3], crown_ratio: f64) -> Cohort {
    Cohort {
        stems_per_ha,
        mix: vec![Share { species, weight: 1.0 }],
        dbh_shape: dbh[0],
        dbh_scale_cm: dbh[1],
        dbh_min_cm: dbh[2],
        crown_ratio,
        layout: Layout::Free,
    }
}

/// Plots grown at a time, whatever the number of threads.
const BATCH: u64 = 4;
/// Plots after which a dataset is given up: thousands of trees for any sound parameters.
const MOST_PLOTS: u64 = 4000;

/// Generates the clusters of so many trees: plots are grown one after the other until there are
/// enough, and the last plot's surplus is left out.
///
/// # Errors
/// [`Error::Synth`] for parameters that no stand can be grown from, [`Error::TooFewTrees`].
pub fn generate(params: &DatasetParams, trees: usize, seed: u64) -> Result<Vec<Cluster>, Error> {
    let mut clusters: Vec<Cluster> = Vec::with_capacity(trees);
    let mut first = 0;
    while clusters.len() < trees {
        if first >= MOST_PLOTS {
            return Err(Error::TooFewTrees {
                dataset: params.name.clone(),
                wanted: trees,
                found: clusters.len(),
                plots: first,
            });
        }
        let batch: Vec<u64> = (first..first + BATCH).collect();
        let grown: Result<Vec<_>, Error> =
            batch.par_iter().map(|&index| plot(params, seed, index)).collect();
        clusters.extend(grown?.into_iter().flatten());
        first += BATCH;
    }
    clusters.truncate(trees);
    clusters.iter_mut().zip(1..).for_each(|(cluster, id)| cluster.id = id);
    Ok(clusters)
}

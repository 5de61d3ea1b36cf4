//! The segmenters compared.

use super::chain::view;
use super::plot::Plot;
use crate::Error;
use std::fmt;
use timberline_segmentation::{Claim, Marker, SegmentationParams, Segmenter, View, label};

/// A tree found, with its position in the world and the height of its top above ground, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundTree {
    /// Its id, that of its points' claims.
    pub id: u64,
    /// Top of the crown.
    pub top_m: [f64; 2],
    /// Height above ground, m.
    pub height_m: f64,
}

/// What a segmenter made of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Segmented {
    /// The trees, sorted by id.
    pub trees: Vec<FoundTree>,
    /// The tree of every point.
    pub claims: Vec<Claim>,
}

/// A way to segment.
#[derive(Clone, Copy)]
pub struct Method {
    /// Name in tables and arguments.
    pub name: &'static str,
    /// What it does, in a few words.
    pub about: &'static str,
    segment: fn(&View<'_>) -> Result<Vec<Claim>, Error>,
    /// Whether it finds trees itself instead of taking those of the detection.
    pub own_trees: bool,
}

impl fmt::Debug for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Method").field("name", &self.name).finish_non_exhaustive()
    }
}

/// All ways to segment, in the sequence of the tables.
#[must_use]
pub fn methods() -> Vec<Method> {
    vec![Method {
        name: "starsac",
        about: "surface and volume of the crown models (Tittmann et al. 2011)",
        segment: |view| run(&Crowns, view),
        own_trees: false,
    }]
}

/// The way of a name.
///
/// # Errors
/// [`Error::Unknown`].
pub fn method(name: &str) -> Result<Method, Error> {
    let all = methods();
    let known = || all.iter().map(|method| method.name).collect::<Vec<_>>().join(", ");
    all.iter().find(|method| method.name == name).copied().ok_or_else(|| Error::Unknown {
        what: "segmenter",
        name: name.to_owned(),
        known: known(),
    })
}

impl Method {
    /// Segments a plot whose trees were detected.
    ///
    /// # Errors
    /// What the segmenter refuses.
    pub fn run(&self, plot: &Plot, markers: &[Marker]) -> Result<Segmented, Error> {
        let claims = (self.segment)(&view(plot, markers))?;
        let trees = if self.own_trees { own_trees(plot, &claims) } else { given(plot, markers) };
        Ok(Segmented { trees, claims })
    }
}

fn run(segmenter: &dyn Segmenter, view: &View<'_>) -> Result<Vec<Claim>, Error> {
    Ok(segmenter.segment(view)?)
}

fn given(plot: &Plot, markers: &[Marker]) -> Vec<FoundTree> {
    let tree = |marker: &Marker| {
        let [x, y, _] = plot.cloud.frame.world_from_local(marker.crown.apex);
        FoundTree { id: marker.crown.id, top_m: [x, y], height_m: marker.height_m }
    };
    markers.iter().map(tree).collect()
}

/// A tree for every id, its top the highest of its points (the first in canonical order of equals).
fn own_trees(plot: &Plot, claims: &[Claim]) -> Vec<FoundTree> {
    let mut tops: std::collections::BTreeMap<u64, usize> = std::collections::BTreeMap::new();
    for (i, claim) in claims.iter().enumerate().filter(|(_, claim)| claim.id != 0) {
        let top = tops.entry(claim.id).or_insert(i);
        if plot.height_m[i] > plot.height_m[*top] {
            *top = i;
        }
    }
    let tree = |(id, top): (u64, usize)| {
        let [x, y, _] = plot.cloud.world(top);
        FoundTree { id, top_m: [x, y], height_m: f64::from(plot.height_m[top]) }
    };
    tops.into_iter().map(tree).collect()
}

/// The crown models themselves as segments.
struct Crowns;

impl Segmenter for Crowns {
    fn reach_m(&self) -> f64 {
        SegmentationParams::default().reach_m
    }

    fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, timberline_segmentation::Error> {
        let standing = view.markers.iter().filter(|marker| marker.crown.radius_m > 0.0);
        let crowns: Vec<_> = standing.map(|marker| marker.crown).collect();
        label([view.x, view.y, view.z], view.height_m, &crowns, &SegmentationParams::default())
    }
}

//! The segmenters compared.

use super::chain::view;
use super::plot::Plot;
use crate::Error;
use timberline_segmentation::{
    Claim, LiParams, Marker, SegmentMethod, SegmentationParams, Segments, View, methods::li,
    methods::ncut, segment_in_blocks, segmenter,
};

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
#[derive(Debug, Clone, Copy)]
pub struct Method {
    /// Name in tables and arguments.
    pub name: &'static str,
    /// What it does, in a few words.
    pub about: &'static str,
    how: How,
}

#[derive(Debug, Clone, Copy)]
enum How {
    /// Points for the trees of the detection, as the stage `segmentation` does it.
    Given(SegmentMethod),
    /// Trees of its own, on the whole plot at once.
    Own(Find),
}

type Find = fn(&View<'_>) -> Result<Segments, timberline_segmentation::Error>;

/// What a segmenter of the stage does.
const fn about(method: SegmentMethod) -> &'static str {
    match method {
        SegmentMethod::Starsac => "surface and volume of the crown models (Tittmann et al. 2011)",
        SegmentMethod::Watershed => {
            "marker-controlled watershed on a pit-free canopy height model (Meyer 1994)"
        }
        SegmentMethod::Dalponte => {
            "region growing on a pit-free canopy height model (Dalponte and Coomes 2016)"
        }
        SegmentMethod::Silva => {
            "Voronoi cells on a pit-free canopy height model (Silva et al. 2016)"
        }
        SegmentMethod::Li => {
            "growing from the top down by spacing in the plane (Li et al. 2012), all trees at once"
        }
        SegmentMethod::Ncut => {
            "normalized cut of a graph of voxels (Reitberger et al. 2009), one part for every tree"
        }
    }
}

/// Those that find trees themselves.
const OWN: [(Find, &str, &str); 2] = [
    (
        |view| li::trees(view.x, view.y, view.height_m, &LiParams::default()),
        "li-own",
        "Li et al. 2012 with the paper's parameters, which finds its trees itself",
    ),
    (
        |view| ncut::trees(view, 3.0, 2.0, &SegmentationParams::default()),
        "ncut-own",
        "normalized cut that ends at a fixed threshold, which finds its trees itself",
    ),
];

/// All ways to segment, in the sequence of the tables.
#[must_use]
pub fn methods() -> Vec<Method> {
    let given = SegmentMethod::ALL.map(|method| Method {
        name: method.name(),
        about: about(method),
        how: How::Given(method),
    });
    let own = OWN.map(|(find, name, about)| Method { name, about, how: How::Own(find) });
    given.into_iter().chain(own).collect()
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
    /// Whether it finds trees itself, instead of taking those of the detection.
    #[must_use]
    pub fn has_own_trees(&self) -> bool {
        match self.how {
            How::Given(_) => false,
            How::Own(_) => true,
        }
    }

    /// Segments a plot whose trees were detected.
    ///
    /// # Errors
    /// What the segmenter refuses.
    pub fn run(&self, plot: &Plot, markers: &[Marker]) -> Result<Segmented, Error> {
        match self.how {
            How::Given(method) => {
                let claims = segmented_as_given(&view(plot, markers), method)?;
                Ok(Segmented { trees: given(plot, markers), claims })
            }
            How::Own(find) => Ok(own_trees(plot, &find(&view(plot, markers))?)),
        }
    }
}

fn segmented_as_given(view: &View<'_>, method: SegmentMethod) -> Result<Vec<Claim>, Error> {
    let params = SegmentationParams { method, ..SegmentationParams::default() };
    let segmenter = segmenter(&params);
    Ok(segment_in_blocks(&*segmenter, view, &vec![true; view.len()], params.block_m)?)
}

fn given(plot: &Plot, markers: &[Marker]) -> Vec<FoundTree> {
    let tree = |marker: &Marker| {
        let [x, y, _] = plot.cloud.frame.world_from_local(marker.crown.apex);
        FoundTree { id: marker.crown.id, top_m: [x, y], height_m: marker.height_m }
    };
    markers.iter().map(tree).collect()
}

/// Trees and claims of a segmenter that found the trees: ids count from 1, and whether a point is on
/// the surface is not said.
fn own_trees(plot: &Plot, found: &Segments) -> Segmented {
    let tree = |(label, &top): (u64, &u32)| {
        let [x, y, _] = plot.cloud.world(top as usize);
        FoundTree { id: label, top_m: [x, y], height_m: f64::from(plot.height_m[top as usize]) }
    };
    let claim = |&label: &u32| match label {
        Segments::NONE => Claim::default(),
        label => Claim { id: u64::from(label) + 1, score: 0.5 },
    };
    Segmented {
        trees: (1..).zip(&found.tops).map(tree).collect(),
        claims: found.tree.iter().map(claim).collect(),
    }
}

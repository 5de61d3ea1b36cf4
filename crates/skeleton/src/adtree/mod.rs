//! The steps and constants of AdTree (Du, Lindenbergh, Ledoux, Stoter and Nan 2019), from its paper
//! and from what its program was seen to do. Nothing here is meant to be better.
//!
//! 1. Points are thinned; the first radius is half the extent of the lowest ones ([`centre`]).
//! 2. Points of trunk and main branches move to the middle of their neighbours ([`centre`]).
//! 3. Delaunay edges weighted by squared length; shortest paths from the lowest point, or the
//!    minimum spanning tree ([`span`]).
//! 4. Small subtrees are left out; radii follow from the length of what is left ([`tree`]).
//! 5. Parallel siblings are merged, vertices on straight lines removed ([`simplify`]).
//! 6. The trunk's radius is that of a cylinder fitted to its points ([`trunk`]).
//! 7. Branches are smoothed as Hermite curves ([`hermite`]).
//!
//! Where neither source gives a detail, the module says what was chosen.

mod centre;
mod hermite;
mod simplify;
mod span;
mod tree;
mod trunk;

use crate::cloud::Cloud;
use crate::model::{Outcome, Report};
use crate::{SkeletonParams, base};

/// The skeleton of a prepared cloud by AdTree's steps. The tree begins at the lowest point.
pub(crate) fn skeleton(cloud: &Cloud, params: &SkeletonParams, given: usize) -> Outcome {
    let points = centre::thin(&cloud.points);
    let first_radius = base::first_radius_m(&points, &base::lowest(&points)).max(1e-3);
    let root = base::root(&points, None, |_| true);
    let centred = centre::centre(&points, root, first_radius);
    let spanned = span::span(&points, &centred, root, params);
    let mut tree = tree::Tree::new(&centred, &spanned.parent, &spanned.order);
    tree.leave_out_small();
    tree.set_radii(first_radius);
    simplify::simplify(&mut tree);
    let radius = trunk::radius_m(&tree, &points).unwrap_or(first_radius);
    tree.set_radii(radius);
    let mut skeleton = hermite::skeleton(&tree);
    for node in &mut skeleton.nodes {
        node.position_m = cloud.to_given(node.position_m);
    }
    let finite = given - cloud.not_finite;
    let report = Report {
        points: given as u64,
        not_finite: cloud.not_finite as u64,
        duplicates: (finite - cloud.points.len()) as u64,
        cut_off: 0,
        pieces_cut_off: 0,
        spacing_m: spanned.spacing_m,
        graph: spanned.graph,
    };
    Outcome { skeleton, report }
}

//! What a segmenter is given and what it gives back.

use crate::{Claim, Crown, Error};
use timberline_pointcloud::Frame;

/// A tree whose points are sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Marker {
    /// Its crown model; its id is that of the tree. The radius is 0 where no model stands.
    pub crown: Crown,
    /// Height of the apex above ground, m.
    pub height_m: f64,
    /// How sure it is that this is a tree, 0 to 1.
    pub score: f32,
}

/// The points of a piece of forest with its surroundings, and the trees in it.
///
/// Points are in canonical order, trees sorted by id. Everything laid out in the plane must be laid
/// out on a lattice that is fixed in the world, which `frame` tells.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// Where the coordinates count from.
    pub frame: Frame,
    /// Easting, m.
    pub x: &'a [f64],
    /// Northing, m.
    pub y: &'a [f64],
    /// Elevation, m.
    pub z: &'a [f64],
    /// Height above ground, m; NaN where unknown: such a point has no tree.
    pub height_m: &'a [f32],
    /// The trees.
    pub markers: &'a [Marker],
}

/// Gives points their trees.
///
/// The trees are given, and every id returned is one of theirs: detection decides what is a tree,
/// segmentation how far it reaches. What a segmenter says about a point may depend only on points
/// and trees within [`Segmenter::reach_m`] of it, or it is run in
/// blocks that are fixed in the world.
pub trait Segmenter: Sync {
    /// How far from a point its tree may depend on other points and trees, in the plane, m; for a
    /// segmenter that is run in blocks, how much surroundings a block needs.
    fn reach_m(&self) -> f64;

    /// The tree of every point, with a score from 0 to 1: 0 for no tree (id 0); above 1/2 where the
    /// point is on the surface of its tree's crown, which alone the crown is fitted to.
    ///
    /// # Errors
    /// When the view is inconsistent. That a tree has no points is no error.
    fn segment(&self, view: &View<'_>) -> Result<Vec<Claim>, Error>;
}
